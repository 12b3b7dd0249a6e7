//! `[[light_clouds]]`: many emitting spheres, or points, in a file, which takes 28 or 24 bytes per light instead of 65 of text.

use std::io::{self, BufReader, ErrorKind, Read};

use glam::DVec3;
use npyz::{DType, NpyFile, Order, TypeChar};

use super::error::Fault;
use super::files::Files;
use super::mesh;
use super::rule::{FINITE, NOT_NEGATIVE, POSITIVE, Rule};
use super::table::Table;
use super::{Light, SceneBuilder, Sphere, Surface};

pub(super) const KEYS: &[&str] = &["file", "kind"];

/// What the lights of a file are.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Sphere,
    Point,
}

impl Kind {
    const ALL: [Self; 2] = [Self::Sphere, Self::Point];

    fn name(self) -> &'static str {
        match self {
            Self::Sphere => "sphere",
            Self::Point => "point",
        }
    }
}

/// The numbers of a light.
struct Layout<const N: usize> {
    /// Named like the vertex properties of the file.
    names: [&'static str; N],
    rules: [&'static Rule; N],
    /// The shape of an array, and what its rows and the vertices of a file are.
    shape: &'static str,
    row: &'static str,
    vertex: &'static str,
}

const SPHERE: Layout<7> = Layout {
    names: ["x", "y", "z", "radius", "red", "green", "blue"],
    rules: [
        &FINITE,
        &FINITE,
        &FINITE,
        &POSITIVE,
        &NOT_NEGATIVE,
        &NOT_NEGATIVE,
        &NOT_NEGATIVE,
    ],
    shape: "a light cloud has (lights, 7)",
    row: "each row is a light: x, y, z, radius, red, green and blue, the last three its radiance, as float32 or float64",
    vertex: "each vertex is a light with the numbers x, y, z, radius, red, green and blue, the last three its radiance",
};

const POINT: Layout<6> = Layout {
    names: ["x", "y", "z", "red", "green", "blue"],
    rules: [&FINITE, &FINITE, &FINITE, &NOT_NEGATIVE, &NOT_NEGATIVE, &NOT_NEGATIVE],
    shape: "a cloud of points has (lights, 6)",
    row: "each row is a point light: x, y, z, red, green and blue, the last three its intensity, as float32 or float64",
    vertex: "each vertex is a point light with the numbers x, y, z, red, green and blue, the last three its intensity",
};

/// Adds the lights of a file, in file order.
pub(super) fn add(table: &Table<'_>, files: &Files, scene: &mut SceneBuilder) -> Result<(), Fault> {
    let kind = table.get("kind").map(|kind| kind.choice(&Kind::ALL, Kind::name));
    match kind.transpose()?.unwrap_or(Kind::Sphere) {
        Kind::Sphere => {
            for [x, y, z, radius, red, green, blue] in read(table, files, &SPHERE)? {
                scene.sphere(Sphere {
                    center: DVec3::new(x, y, z),
                    radius,
                    surface: Surface::Emission(DVec3::new(red, green, blue)),
                });
            }
        }
        Kind::Point => {
            for [x, y, z, red, green, blue] in read(table, files, &POINT)? {
                scene.light(Light::point([x, y, z], [red, green, blue]));
            }
        }
    }
    Ok(())
}

/// The numbers of each light.
fn read<const N: usize>(table: &Table<'_>, files: &Files, layout: &Layout<N>) -> Result<Vec<[f64; N]>, Fault> {
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
                rows(source, length, layout)
            } else {
                mesh::points(source, length, layout.names, layout.vertex)
            }
        })?;
        let points = points.map_err(of_file)?;
        let element = if array { "row" } else { "vertex" };
        for (i, point) in points.iter().enumerate() {
            layout.check((element, i), point).map_err(of_file)?;
        }
        Ok(points)
    };
    read().map_err(|fault| fault.at(span, label))
}

/// The rows of a NumPy array of `length` bytes.
fn rows<const N: usize>(source: impl Read, length: u64, layout: &Layout<N>) -> Result<Vec<[f64; N]>, Fault> {
    let Layout { shape, row, .. } = *layout;
    let array = NpyFile::new(source).map_err(|error| {
        let said = error.to_string();
        let what = format!("is not an NPY array: {}", said.lines().next().unwrap_or_default());
        Fault::new(what, "save it with numpy.save")
    })?;
    let count = match *array.shape() {
        [count, columns] if columns == N as u64 => count,
        ref other => return Err(Fault::new(format!("has the shape {other:?}, {shape}"), row)),
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
        return Err(Fault::new(what, row));
    }
    let cut_short = || {
        let what = format!("is cut short: its header promises {count} lights, the file ends before");
        Fault::new(what, "the file is damaged or cut short: save or fetch it again")
    };
    // Checked before anything is allocated.
    if u128::from(count) * N as u128 * u128::from(bytes) > length.into() {
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
    Ok(values.as_chunks::<N>().0.to_vec())
}

impl<const N: usize> Layout<N> {
    fn check(&self, (element, number): (&str, usize), point: &[f64; N]) -> Result<(), Fault> {
        for ((name, rule), &x) in self.names.iter().zip(self.rules).zip(point) {
            if !rule.holds(x) {
                let what = format!("has a {element} {number} whose {name} {}, got {x:?}", rule.problem(x));
                return Err(Fault::new(what, rule.help));
            }
        }
        Ok(())
    }
}
