//! `[[light_clouds]]`: many emitting spheres in a file, which takes 28 bytes per light instead of 65 of text.

use std::io::BufReader;

use glam::DVec3;

use super::error::Fault;
use super::files::Files;
use super::mesh;
use super::rule::{FINITE, NOT_NEGATIVE, POSITIVE, Rule};
use super::table::Table;
use super::{Sphere, Surface};

pub(super) const KEYS: &[&str] = &["file"];

/// The numbers of a light, named like the vertex properties of the file.
const NUMBERS: [&str; 7] = ["x", "y", "z", "radius", "red", "green", "blue"];

const HELP: &str =
    "each vertex is a light with the numbers x, y, z, radius, red, green and blue, the last three its radiance";

/// The lights of a file, in file order.
pub(super) fn spheres(table: &Table<'_>, files: &Files) -> Result<Vec<Sphere>, Fault> {
    let value = table.need("file", "file = \"lamps.ply\"")?;
    let name = value.string()?;
    let (span, label) = value.place();
    let read = || {
        if !name.to_lowercase().ends_with(".ply") {
            let what = format!("light cloud \"{name}\" has an ending that Octolux does not read");
            return Err(Fault::new(what, "save the cloud as .ply, in text or binary"));
        }
        let of_file = |fault: Fault| Fault::new(format!("light cloud \"{name}\" {}", fault.what), fault.help);
        let points = files.stream("light cloud", name, |source, length| {
            mesh::points(BufReader::with_capacity(1 << 16, source), length, NUMBERS, HELP)
        })?;
        let points = points.map_err(of_file)?;
        points
            .iter()
            .enumerate()
            .map(|(i, point)| sphere(i, point).map_err(of_file))
            .collect()
    };
    read().map_err(|fault| fault.at(span, label))
}

fn sphere(number: usize, point: &[f64; 7]) -> Result<Sphere, Fault> {
    const RULES: [&Rule; 7] = [
        &FINITE,
        &FINITE,
        &FINITE,
        &POSITIVE,
        &NOT_NEGATIVE,
        &NOT_NEGATIVE,
        &NOT_NEGATIVE,
    ];
    for ((name, rule), &x) in NUMBERS.iter().zip(RULES).zip(point) {
        if !rule.holds(x) {
            let what = format!("has a vertex {number} whose {name} {}, got {x:?}", rule.problem(x));
            return Err(Fault::new(what, rule.help));
        }
    }
    let [x, y, z, radius, red, green, blue] = *point;
    Ok(Sphere {
        center: DVec3::new(x, y, z),
        radius,
        surface: Surface::Emission(DVec3::new(red, green, blue)),
    })
}
