//! `[[light_clouds]]`: many emitting spheres in a file, which takes 28 bytes per light instead of 65 of text.

use std::io::{self, BufReader, ErrorKind, Read};

use glam::DVec3;
use npyz::{DType, NpyFile, Order, TypeChar};

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

const ROWS: &str =
    "each row is a light: x, y, z, radius, red, green and blue, the last three its radiance, as float32 or float64";

/// The lights of a file, in file order.
pub(super) fn spheres(table: &Table<'_>, files: &Files) -> Result<Vec<Sphere>, Fault> {
    let value = table.need("file", "file = \"lamps.ply\"")?;
    let name = value.string()?;
    let (span, label) = value.place();
    let read = || {
        let lower = name.to_lowercase();
        let array = lower.ends_with(".npy");
        if !array && !lower.ends_with(".ply") {
            let what = format!("light cloud \"{name}\" has an ending that Octolux does not read");
            return Err(Fault::new(what, "save the cloud as .ply (text or binary) or as .npy"));
        }
        let of_file = |fault: Fault| Fault::new(format!("light cloud \"{name}\" {}", fault.what), fault.help);
        let points = files.stream("light cloud", name, |source, length| {
            let source = BufReader::with_capacity(1 << 16, source);
            if array {
                rows(source, length)
            } else {
                mesh::points(source, length, NUMBERS, HELP)
            }
        })?;
        let points = points.map_err(of_file)?;
        let element = if array { "row" } else { "vertex" };
        points
            .iter()
            .enumerate()
            .map(|(i, point)| sphere((element, i), point).map_err(of_file))
            .collect()
    };
    read().map_err(|fault| fault.at(span, label))
}

/// The rows of a NumPy array of `length` bytes.
fn rows(source: impl Read, length: u64) -> Result<Vec<[f64; 7]>, Fault> {
    let array = NpyFile::new(source).map_err(|error| {
        let said = error.to_string();
        let what = format!("is not an NPY array: {}", said.lines().next().unwrap_or_default());
        Fault::new(what, "save it with numpy.save")
    })?;
    let &[count, 7] = array.shape() else {
        let what = format!("has the shape {:?}, a light cloud has (lights, 7)", array.shape());
        return Err(Fault::new(what, ROWS));
    };
    if array.order() != Order::C {
        return Err(Fault::new(
            "is in Fortran order",
            "save it with numpy.ascontiguousarray",
        ));
    }
    let bytes = match array.dtype() {
        DType::Plain(item) if item.type_char() == TypeChar::Float => item.size_field(),
        _ => 0,
    };
    if bytes != 4 && bytes != 8 {
        let what = format!("holds {}, a light cloud holds f4 or f8", array.dtype().descr());
        return Err(Fault::new(what, ROWS));
    }
    let cut_short = || {
        let what = format!("is cut short: its header promises {count} lights, the file ends before");
        Fault::new(what, "the file is damaged or cut short: save or fetch it again")
    };
    // Checked before anything is allocated.
    if u128::from(count) * 7 * u128::from(bytes) > length.into() {
        return Err(cut_short());
    }
    let unreadable = |error: io::Error| match error.kind() {
        ErrorKind::UnexpectedEof => cut_short(),
        _ => Fault::new(format!("cannot be read: {error}"), "save or fetch it again"),
    };
    let values: Vec<f64> = if bytes == 4 {
        let single = array.into_vec::<f32>().map_err(unreadable)?;
        single.into_iter().map(f64::from).collect()
    } else {
        array.into_vec::<f64>().map_err(unreadable)?
    };
    Ok(values.as_chunks::<7>().0.to_vec())
}

fn sphere((element, number): (&str, usize), point: &[f64; 7]) -> Result<Sphere, Fault> {
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
            let what = format!("has a {element} {number} whose {name} {}, got {x:?}", rule.problem(x));
            return Err(Fault::new(what, rule.remedy(x)));
        }
    }
    let [x, y, z, radius, red, green, blue] = *point;
    Ok(Sphere {
        center: DVec3::new(x, y, z),
        radius,
        surface: Surface::Emission(DVec3::new(red, green, blue)),
    })
}
