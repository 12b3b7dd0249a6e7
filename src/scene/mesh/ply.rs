//! PLY, ASCII and binary, read by `ply-rs-bw`.

use std::io::ErrorKind;

use glam::{DVec2, DVec3};
use ply_rs_bw::parser::{ParseError, Parser, Reader};
use ply_rs_bw::ply::{BeginList, ElementDef, Encoding, Header, PropertyAccess, PropertyAccessResult};
use ply_rs_bw::ply::{PropertyType, ScalarType};

use super::{Problem, RawMesh, fan};

/// What programs call texture coordinates.
const UVS: [[&str; 2]; 3] = [["s", "t"], ["u", "v"], ["texture_u", "texture_v"]];

const DAMAGED: &str = "the file is damaged or cut short: save or fetch it again";

/// Elements that are read at a time: the parser's own take six times the memory of what is kept of them.
const PORTION: usize = 1 << 14;

/// Reads the `vertex` and `face` elements of a PLY file, with texture coordinates only where it is `textured`; other elements and properties are skipped.
pub fn read(bytes: &[u8], textured: bool) -> Result<RawMesh, Problem> {
    let mut reader = Reader::new(bytes);
    let parser = Parser::<Element>::new();
    let header = parser
        .read_header(&mut reader)
        .map_err(|error| header_problem(&error))?;
    check(&header, bytes.len() as u64)?;

    let mut raw = RawMesh::default();
    for element in header.elements.values() {
        let has = |keys: &[&str]| keys.iter().all(|key| element.properties.contains_key(*key));
        raw.normals = match element.name.as_str() {
            "vertex" => has(&["nx", "ny", "nz"]).then(Vec::new),
            _ => raw.normals,
        };
        raw.uvs = match element.name.as_str() {
            "vertex" if textured => UVS.iter().any(|pair| has(pair)).then(Vec::new),
            _ => raw.uvs,
        };
        let mut portion = element.clone();
        for first in (0..element.count).step_by(PORTION) {
            portion.count = PORTION.min(element.count - first);
            let items = parser.read_payload_for_element(&mut reader, &portion, &header);
            let items = items.map_err(|error| payload_problem(&error, element, &header))?;
            keep(&mut raw, &items, &element.name, first)?;
        }
    }
    Ok(raw)
}

/// Adds the elements `first..` of a file.
fn keep(raw: &mut RawMesh, items: &[Element], name: &str, first: usize) -> Result<(), Problem> {
    match name {
        "vertex" => {
            raw.vertices.extend(items.iter().map(|item| item.position));
            if let Some(normals) = &mut raw.normals {
                normals.extend(items.iter().map(|item| item.normal));
            }
            if let Some(uvs) = &mut raw.uvs {
                uvs.extend(items.iter().map(|item| item.uv));
            }
        }
        "face" => {
            for (index, item) in items.iter().enumerate() {
                if item.corners.len() < 3 {
                    let face = first + index;
                    let what = format!("has a face with {} corners: face {face}", item.corners.len());
                    return Err(Problem::new(what, "a face needs at least 3 corners"));
                }
                // A negative index becomes one that no file can hold; the check of all indices reports it.
                let corners = item
                    .corners
                    .iter()
                    .map(|&corner| u32::try_from(corner).unwrap_or(u32::MAX));
                raw.triangles.extend(fan(&corners.collect::<Vec<_>>()));
            }
        }
        _ => {}
    }
    Ok(())
}

/// Whether the header describes a mesh, and one that `length` bytes can hold: nothing is allocated on its word alone.
fn check(header: &Header, length: u64) -> Result<(), Problem> {
    let mesh = "a mesh file has vertices with x, y, z and faces with vertex_indices";
    let element = |name: &str| {
        header
            .elements
            .get(name)
            .ok_or_else(|| Problem::new(format!("has no `{name}` element in its header"), mesh))
    };
    let vertex = element("vertex")?;
    for key in ["x", "y", "z"] {
        let property = vertex.properties.get(key).map(|property| &property.data_type);
        if !matches!(property, Some(PropertyType::Scalar(_))) {
            return Err(Problem::new(format!("has vertices without the number `{key}`"), mesh));
        }
    }
    let lists = ["vertex_indices", "vertex_index"];
    let is_list = |key: &&str| {
        let property = element("face").ok().and_then(|face| face.properties.get(*key));
        property.is_some_and(|property| matches!(property.data_type, PropertyType::List(..)))
    };
    if element("face")?.count > 0 && !lists.iter().any(is_list) {
        return Err(Problem::new("has faces without the list `vertex_indices`", mesh));
    }

    for element in header.elements.values() {
        let least = element
            .properties
            .values()
            .map(|p| least_bytes(&p.data_type, header.encoding))
            .sum::<u64>()
            .max(1);
        let needed = (element.count as u64).checked_mul(least);
        // The last line of a text may lack its newline.
        if needed.is_none_or(|needed| needed > length + 1) {
            return Err(cut_short(element));
        }
    }
    Ok(())
}

/// The fewest bytes that a property can take: a list may be empty, a number in a text is a digit and a space.
fn least_bytes(property: &PropertyType, encoding: Encoding) -> u64 {
    let (PropertyType::Scalar(scalar) | PropertyType::List(scalar, _)) = property;
    if encoding == Encoding::Ascii {
        return 2;
    }
    match scalar {
        ScalarType::Char | ScalarType::UChar => 1,
        ScalarType::Short | ScalarType::UShort => 2,
        ScalarType::Int | ScalarType::UInt | ScalarType::Float => 4,
        ScalarType::Double => 8,
    }
}

fn cut_short(element: &ElementDef) -> Problem {
    let ElementDef { name, count, .. } = element;
    Problem::new(
        format!("is cut short: its header promises {count} `{name}` elements, the file ends before"),
        DAMAGED,
    )
}

fn header_problem(error: &ParseError) -> Problem {
    match (error.kind(), error.line()) {
        (ErrorKind::UnexpectedEof, _) => Problem::new("is cut short: its header has no end", DAMAGED),
        (_, Some(line)) if line > 1 => Problem::new(format!("has a header that cannot be read, line {line}"), DAMAGED),
        _ => Problem::new(
            "is not a PLY file: it does not begin with the line `ply`",
            "name a mesh that is saved as PLY",
        ),
    }
}

fn payload_problem(error: &ParseError, element: &ElementDef, header: &Header) -> Problem {
    let name = &element.name;
    match (error.kind(), error.line()) {
        (ErrorKind::UnexpectedEof, _) => cut_short(element),
        // Binary files have no lines to speak of.
        (_, Some(line)) if header.encoding == Encoding::Ascii => Problem::new(
            format!("has a `{name}` element that cannot be read in line {line}"),
            DAMAGED,
        ),
        _ => Problem::new(format!("has a `{name}` element that cannot be read"), DAMAGED),
    }
}

/// What is kept of an element, whichever it is.
struct Element {
    position: DVec3,
    normal: DVec3,
    uv: DVec2,
    corners: Vec<i64>,
}

impl Element {
    fn set(&mut self, key: &str, value: f64) -> PropertyAccessResult {
        let place = match key {
            "x" => &mut self.position.x,
            "y" => &mut self.position.y,
            "z" => &mut self.position.z,
            "nx" => &mut self.normal.x,
            "ny" => &mut self.normal.y,
            "nz" => &mut self.normal.z,
            "s" | "u" | "texture_u" => &mut self.uv.x,
            "t" | "v" | "texture_v" => &mut self.uv.y,
            _ => return PropertyAccessResult::Ignored,
        };
        *place = value;
        PropertyAccessResult::Set
    }

    fn set_list<T: Into<i64>>(&mut self, key: &str, values: Vec<T>) -> PropertyAccessResult {
        if !matches!(key, "vertex_indices" | "vertex_index") {
            return PropertyAccessResult::Ignored;
        }
        self.corners = values.into_iter().map(Into::into).collect();
        PropertyAccessResult::Set
    }
}

/// The reader calls the method of the type that the header declares; these all do the same.
macro_rules! setters {
    (numbers: $($number:ident($type:ty)),*; lists: $($list:ident($item:ty)),*; no: $($no:ident($float:ty)),*) => {
        $(fn $number(&mut self, key: &str, value: $type) -> PropertyAccessResult {
            self.set(key, value.into())
        })*
        $(fn $list(&mut self, key: &str, values: Vec<$item>) -> PropertyAccessResult {
            self.set_list(key, values)
        })*
        $(fn $no(&mut self, key: &str, _length: usize) -> BeginList<'_, $float> {
            // Indices are whole numbers. Other lists of fractions are none of our business.
            match key {
                "vertex_indices" | "vertex_index" => BeginList::UnsupportedType,
                _ => BeginList::UseSetter,
            }
        })*
    };
}

impl PropertyAccess for Element {
    fn new() -> Self {
        Self {
            position: DVec3::ZERO,
            normal: DVec3::ZERO,
            uv: DVec2::ZERO,
            corners: Vec::new(),
        }
    }

    setters! {
        numbers: set_char(i8), set_uchar(u8), set_short(i16), set_ushort(u16), set_int(i32), set_uint(u32),
            set_float(f32), set_double(f64);
        lists: set_list_char(i8), set_list_uchar(u8), set_list_short(i16), set_list_ushort(u16), set_list_int(i32),
            set_list_uint(u32);
        no: begin_list_float(f32), begin_list_double(f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEADER: &str = "element vertex 4\nproperty float x\nproperty double y\nproperty short z\nproperty uchar red\n\
        element face 2\nproperty list uchar int vertex_indices\nproperty float quality\nend_header\n";

    fn expected(raw: &RawMesh) {
        let [a, b, c, d] = [[0., 0., 0.], [1.5, 0., 0.], [1.5, 2.25, -3.], [0., 2.25, -3.]].map(DVec3::from_array);
        assert_eq!(raw.vertices, [a, b, c, d]);
        assert_eq!(raw.triangles, [[0, 1, 2], [0, 2, 3], [2, 1, 0]]);
        assert!(raw.normals.is_none());
    }

    #[test]
    fn ascii() {
        let text = format!(
            "ply\nformat ascii 1.0\ncomment by hand\n{HEADER}0 0 0 1\n1.5 0 0 1\n1.5 2.25 -3 1\n0 2.25 -3 1\n\
             4 0 1 2 3 0.5\n3 2 1 0 0.5"
        );
        expected(&read(text.as_bytes(), false).unwrap());
    }

    #[test]
    fn binary_of_both_orders() {
        for little in [true, false] {
            let mut bytes = Vec::new();
            let order = if little { "little" } else { "big" };
            bytes.extend(format!("ply\nformat binary_{order}_endian 1.0\n{HEADER}").bytes());
            let mut put = |big: &[u8]| match little {
                true => bytes.extend(big.iter().rev()),
                false => bytes.extend(big),
            };
            for (x, y, z) in [
                (0.0_f32, 0.0_f64, 0_i16),
                (1.5, 0.0, 0),
                (1.5, 2.25, -3),
                (0.0, 2.25, -3),
            ] {
                put(&x.to_be_bytes());
                put(&y.to_be_bytes());
                put(&z.to_be_bytes());
                put(&[200]);
            }
            for corners in [&[0_i32, 1, 2, 3][..], &[2, 1, 0]] {
                put(&[corners.len() as u8]);
                corners.iter().for_each(|corner| put(&corner.to_be_bytes()));
                put(&0.5_f32.to_be_bytes());
            }
            expected(&read(&bytes, false).unwrap());
            // Any cut is an error, never a smaller mesh.
            for end in 0..bytes.len() {
                assert!(read(&bytes[..end], false).is_err(), "cut at {end}");
            }
        }
    }

    #[test]
    fn portions_of_a_long_file_follow_each_other() {
        let count = PORTION + 3;
        let mut text = format!(
            "ply\nformat ascii 1.0\nelement vertex {count}\nproperty float x\nproperty float y\nproperty float z\n\
             element face {count}\nproperty list uchar uint vertex_index\nend_header\n"
        );
        (0..count).for_each(|i| text += &format!("{i} 0 1\n"));
        (0..count).for_each(|i| text += &format!("3 0 1 {i}\n"));
        let raw = read(text.as_bytes(), false).unwrap();
        let numbers = 0..count as u32;
        assert!(raw.vertices.iter().map(|v| v.x as u32).eq(numbers.clone()));
        assert!(raw.triangles.iter().map(|t| t[2]).eq(numbers));

        // Faces and lines are counted through.
        let last = text.trim_end().rfind('\n').unwrap() + 1;
        let error = |end: &str| {
            read(format!("{}{end}\n", &text[..last]).as_bytes(), false)
                .unwrap_err()
                .what
        };
        assert_eq!(error("2 0 1"), format!("has a face with 2 corners: face {}", count - 1));
        let line = 9 + 2 * count;
        assert_eq!(
            error("3 0 1 x"),
            format!("has a `face` element that cannot be read in line {line}")
        );
    }

    #[test]
    fn normals_of_the_file() {
        let text = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
            property float nx\nproperty float ny\nproperty float nz\nelement face 1\n\
            property list uchar uint vertex_index\nend_header\n0 0 0 0 0 1\n1 0 0 0 1 0\n0 1 0 1 0 0\n3 0 1 2\n";
        assert_eq!(
            read(text.as_bytes(), false).unwrap().normals.unwrap(),
            [DVec3::Z, DVec3::Y, DVec3::X]
        );
    }

    #[test]
    fn a_header_that_promises_too_much_costs_nothing() {
        for encoding in ["ascii", "binary_little_endian"] {
            for vertices in ["4000000000", "18446744073709551615"] {
                let text = format!(
                    "ply\nformat {encoding} 1.0\nelement vertex {vertices}\nproperty float x\nproperty float y\n\
                     property float z\nelement face 1\nproperty list uint uint vertex_indices\nend_header\n"
                );
                assert!(
                    read(text.as_bytes(), false)
                        .unwrap_err()
                        .what
                        .starts_with("is cut short")
                );
            }
            // An element without properties takes no bytes: its count is not believed either.
            let text = format!(
                "ply\nformat {encoding} 1.0\nelement thing 4000000000\nelement vertex 0\nproperty float x\n\
                 property float y\nproperty float z\nelement face 0\nend_header\n"
            );
            assert!(read(text.as_bytes(), false).is_err());
        }
    }
}
