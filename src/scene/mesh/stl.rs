//! STL, binary and ASCII. The crate `stl_io` needs to seek, which compressed files cannot, treats every file that begins with
//! `solid` as ASCII, and only reads the first solid. Facet normals are redundant and ignored.

use std::collections::HashMap;
use std::io::{BufRead, ErrorKind, Read};

use glam::DVec3;

use super::lines::{DAMAGED, Lines, numbers, unreadable, words};
use super::polygons::Polygons;
use super::{Problem, RawMesh};

/// A binary file begins with 80 arbitrary bytes and the number of its triangles.
const HEADER: usize = 84;

/// Reads all triangles. Corners at the same point become one vertex, so that smooth normals can be averaged.
pub fn read<R: BufRead>(mut source: R) -> Result<RawMesh, Problem> {
    let mut start = Vec::new();
    source
        .by_ref()
        .take(HEADER as u64)
        .read_to_end(&mut start)
        .map_err(unreadable)?;
    let mut mesh = Stl::default();
    // Text has no zero bytes, except in UTF-16. Binary headers may begin with `solid`; the count after them contains a zero
    // byte, or is the maximum.
    let marked = start.starts_with(&[0xff, 0xfe]) || start.starts_with(&[0xfe, 0xff]);
    let binary = start.contains(&0) || start.ends_with(&[0xff; 4]);
    if start.len() == HEADER && binary && !marked {
        let count = [start[80], start[81], start[82], start[83]];
        mesh.binary(source, u32::from_le_bytes(count))?;
    } else {
        mesh.ascii(Lines::new(start.chain(source))?)?;
    }
    mesh.raw.notes.extend(mesh.polygons.note("line"));
    Ok(mesh.raw)
}

#[derive(Default)]
struct Stl {
    raw: RawMesh,
    /// The vertex at each point, by the bits of its coordinates.
    found: HashMap<[u32; 3], u32>,
    polygons: Polygons,
}

impl Stl {
    fn vertex(&mut self, point: [f32; 3]) -> Result<u32, Problem> {
        let next = u32::try_from(self.raw.vertices.len())
            .map_err(|_| Problem::new("has more vertices than 32 bits can count", "use a smaller mesh"))?;
        // The addition turns -0 into 0.
        let vertex = *self.found.entry(point.map(|x| (x + 0.0).to_bits())).or_insert(next);
        if vertex == next {
            self.raw.vertices.push(DVec3::from_array(point.map(f64::from)));
        }
        Ok(vertex)
    }

    fn binary<R: BufRead>(&mut self, mut source: R, count: u32) -> Result<(), Problem> {
        // Streaming writers leave one of these in the header.
        let unknown = count == 0 || count == u32::MAX;
        let mut facet = [0; 50];
        let mut read = 0_u32;
        while unknown || read < count {
            if source.fill_buf().map_err(unreadable)?.is_empty() && unknown {
                break;
            }
            source.read_exact(&mut facet).map_err(|error| match error.kind() {
                ErrorKind::UnexpectedEof if unknown => {
                    Problem::new("is cut short: its last triangle is not whole", DAMAGED)
                }
                ErrorKind::UnexpectedEof => Problem::new(
                    format!("is cut short: its header promises {count} triangles, the file ends after {read}"),
                    DAMAGED,
                ),
                _ => unreadable(error),
            })?;
            let mut triangle = [0; 3];
            for (place, point) in triangle.iter_mut().zip(facet[12..48].chunks_exact(12)) {
                let x = |i: usize| f32::from_le_bytes([point[i], point[i + 1], point[i + 2], point[i + 3]]);
                *place = self.vertex([x(0), x(4), x(8)])?;
            }
            self.raw.triangles.push(triangle);
            read += 1;
        }
        if read == 0 {
            return Err(Problem::new("has no triangles", "save the mesh again"));
        }
        if !unknown && !source.fill_buf().map_err(unreadable)?.is_empty() {
            self.raw.notes.push(format!(
                "bytes behind the {count} triangles that the header promises are left out"
            ));
        }
        Ok(())
    }

    fn ascii<R: BufRead>(&mut self, mut lines: Lines<R>) -> Result<(), Problem> {
        let mut corners = Vec::new();
        let (mut solids, mut open) = (0, false);
        while let Some((number, line)) = lines.next()? {
            let mut rest = words(line);
            let mut word = rest.next().unwrap_or_default().to_ascii_lowercase();
            if word == b"end" {
                // Some programs write `end loop` and `end solid`.
                word.extend(rest.next().unwrap_or_default().to_ascii_lowercase());
            }
            let understood = match &*word {
                b"" => true,
                b"solid" => {
                    solids += 1;
                    open = true;
                    true
                }
                b"vertex" if open => match numbers::<3>(&mut rest) {
                    Some(point) => {
                        corners.push(self.vertex(point.map(|x| x as f32))?);
                        true
                    }
                    None => false,
                },
                b"endloop" if open && corners.len() >= 3 => {
                    let raw = &mut self.raw;
                    let points = corners.iter().map(|&corner| raw.vertices[corner as usize]);
                    for triangle in self.polygons.triangles(points, number) {
                        raw.triangles.push(triangle.map(|corner| corners[corner as usize]));
                    }
                    corners.clear();
                    true
                }
                b"facet" | b"outer" | b"endfacet" => open && corners.is_empty(),
                b"endsolid" => std::mem::take(&mut open) && corners.is_empty(),
                _ => false,
            };
            if !understood && solids == 0 {
                break;
            }
            if !understood {
                let what = format!("has something that STL does not know in line {number}");
                return Err(Problem::new(what, DAMAGED));
            }
        }
        match (solids, open) {
            (0, _) => Err(Problem::new(
                "is not an STL file: it is neither a text that begins with `solid` nor as long as a binary one",
                "name a mesh that is saved as STL",
            )),
            (_, true) => Err(Problem::new("is cut short: its last solid has no `endsolid`", DAMAGED)),
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TETRAHEDRON: [[[f32; 3]; 3]; 4] = [
        [[0., 0., 0.], [0., 1., 0.], [1., 0., 0.]],
        [[0., 0., 0.], [1., 0., 0.], [0., 0., 1.]],
        [[0., 0., 0.], [0., 0., 1.], [0., 1., 0.]],
        [[1., 0., 0.], [0., 1., 0.], [0., 0., 1.]],
    ];

    fn binary(start: &[u8], count: u32) -> Vec<u8> {
        let mut bytes = start.to_vec();
        bytes.resize(80, b' ');
        bytes.extend(count.to_le_bytes());
        for triangle in TETRAHEDRON {
            bytes.extend([0; 12]);
            bytes.extend(triangle.iter().flatten().flat_map(|x| x.to_le_bytes()));
            bytes.extend([7, 0]);
        }
        bytes
    }

    fn ascii(end: &str) -> String {
        let mut text = format!("solid a name{end}");
        for triangle in TETRAHEDRON {
            text += &format!("  facet normal 0 0 0{end}    outer loop{end}");
            triangle
                .iter()
                .for_each(|[x, y, z]| text += &format!("      vertex {x:e} {y} {z}{end}"));
            text += &format!("    endloop{end}  endfacet{end}");
        }
        text + &format!("endsolid a name{end}")
    }

    fn expected(bytes: &[u8]) {
        let raw = read(bytes).unwrap();
        assert_eq!(raw.vertices.len(), 4, "corners at one point are one vertex");
        let corners = raw
            .triangles
            .iter()
            .map(|t| t.map(|i| raw.vertices[i as usize].to_array()));
        assert!(corners.eq(TETRAHEDRON.map(|t| t.map(|p| p.map(f64::from)))));
    }

    #[test]
    fn both_spellings_of_a_tetrahedron() {
        for count in [4, 0, u32::MAX] {
            expected(&binary(b"", count));
            expected(&binary(b"solid exported by a program that did not think of it", count));
        }
        for end in ["\n", "\r\n", "\r"] {
            expected(ascii(end).as_bytes());
            expected(ascii(end).to_uppercase().as_bytes());
            expected(
                format!(
                    "  {}",
                    ascii(end)
                        .replace("endloop", "end loop")
                        .replace("endsolid", "end solid")
                )
                .as_bytes(),
            );
            expected(format!("\u{feff}{end}{}", ascii(end)).as_bytes());
        }
        let two = format!("{}solid\nendsolid\n{}", ascii("\n"), ascii("\n"));
        assert_eq!(read(two.as_bytes()).unwrap().triangles.len(), 8);
    }

    #[test]
    fn any_cut_is_an_error() {
        let (binary, text) = (binary(b"", 4), ascii("\n"));
        for end in 0..binary.len() {
            assert!(read(&binary[..end]).is_err(), "binary cut at {end}");
        }
        for end in 0..text.len() - " a name\n".len() {
            assert!(read(&text.as_bytes()[..end]).is_err(), "text cut at {end}");
        }
        let longer = [&binary[..], b"more"].concat();
        assert_eq!(read(&longer[..]).unwrap().notes.len(), 1);
    }

    #[test]
    fn refusals_are_true() {
        let error = |bytes: &[u8]| read(bytes).unwrap_err().what;
        assert!(error(b"Dear reader,\nthis is a letter and not a mesh.\n").starts_with("is not an STL file"));
        assert_eq!(
            error(ascii("\n").replace("vertex 1e0", "vertex one").as_bytes()),
            "has something that STL does not know in line 6"
        );
        let wide: Vec<u8> = ascii("\n").encode_utf16().flat_map(u16::to_le_bytes).collect();
        assert_eq!(error(&[&[0xff, 0xfe][..], &wide].concat()), "is a text in UTF-16");
    }
}
