//! Wavefront OBJ, read by `tobj`.

use std::collections::HashMap;
use std::io::{BufRead, Read};

use glam::{DVec2, DVec3};
use tobj::{LoadError, LoadOptions};

use super::{Problem, RawMesh};

/// Reads all faces of an OBJ file, with texture coordinates only where it is `textured`; objects, groups and materials make no
/// difference.
pub fn read(bytes: &[u8], textured: bool) -> Result<RawMesh, Problem> {
    let mut lines = Geometry {
        rest: bytes,
        line: &[],
        taken: 0,
        number: 0,
        counts: [0; 3],
    };
    let options = LoadOptions {
        triangulate: true,
        ignore_points: true,
        ignore_lines: true,
        ..Default::default()
    };
    let loaded = tobj::load_obj_buf(&mut lines, &options, |_| Err(LoadError::GenericFailure));
    let (models, _) = loaded.map_err(|error| problem(error, lines.number))?;
    // Without objects and groups there is at most one model.
    let mesh = models
        .into_iter()
        .next()
        .map(|model| model.mesh)
        .filter(|mesh| !mesh.indices.is_empty());
    let Some(mesh) = mesh else {
        return Err(Problem::new(
            "has no faces",
            "save the mesh with its faces: lines such as `f 1 2 3`",
        ));
    };

    let vectors = |numbers: &[f64]| numbers.chunks_exact(3).map(DVec3::from_slice).collect::<Vec<_>>();
    let (positions, normals) = (vectors(&mesh.positions), vectors(&mesh.normals));
    let pairs = |numbers: &[f64]| numbers.chunks_exact(2).map(DVec2::from_slice).collect::<Vec<_>>();
    let uvs = pairs(&mesh.texcoords);
    // Both are optional for each corner: without all of them they are of no use.
    let complete = |indices: &Vec<u32>| (indices.len() == mesh.indices.len()).then(|| indices.clone());
    let (normal_of, uv_of) = (
        complete(&mesh.normal_indices),
        complete(&mesh.texcoord_indices).filter(|_| textured),
    );
    if normal_of.is_none() && uv_of.is_none() {
        let triangles = mesh.indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect();
        return Ok(RawMesh {
            vertices: positions,
            triangles,
            ..Default::default()
        });
    }

    // A corner has a position, a normal and texture coordinates of its own: each set of them becomes a vertex.
    let mut raw = RawMesh {
        normals: normal_of.as_ref().map(|_| Vec::new()),
        uvs: uv_of.as_ref().map(|_| Vec::new()),
        ..Default::default()
    };
    let mut sets = HashMap::new();
    let mut corners = Vec::with_capacity(mesh.indices.len());
    for (corner, &position) in mesh.indices.iter().enumerate() {
        let normal = normal_of.as_ref().map(|indices| indices[corner]);
        let uv = uv_of.as_ref().map(|indices| indices[corner]);
        corners.push(*sets.entry((position, normal, uv)).or_insert_with(|| {
            raw.vertices.push(positions[position as usize]);
            if let (Some(all), Some(normal)) = (&mut raw.normals, normal) {
                all.push(normals[normal as usize]);
            }
            if let (Some(all), Some(uv)) = (&mut raw.uvs, uv) {
                all.push(uvs[uv as usize]);
            }
            raw.vertices.len() as u32 - 1
        }));
    }
    raw.triangles = corners.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect();
    Ok(raw)
}

fn problem(error: LoadError, line: usize) -> Problem {
    let cut = "the file is damaged or cut short: save the mesh again";
    let broken = |what: &str| Problem::new(format!("has {what} in line {line}"), cut);
    match error {
        LoadError::PositionParseError | LoadError::ColorParseError | LoadError::ScalingByZeroError => {
            broken("a vertex that cannot be read")
        }
        LoadError::NormalParseError => broken("a normal that cannot be read"),
        LoadError::TexcoordParseError => broken("a texture coordinate that cannot be read"),
        LoadError::FaceParseError | LoadError::InvalidPolygon => broken("a face that cannot be read"),
        LoadError::ReadError => broken("an index or something else that cannot be read"),
        LoadError::FaceVertexOutOfBounds | LoadError::FaceNormalOutOfBounds | LoadError::FaceTexCoordOutOfBounds => {
            Problem::new(
                "has a face that names a vertex, a normal or a texture coordinate that does not exist",
                cut,
            )
        }
        other => Problem::new(format!("cannot be read: {other}"), cut),
    }
}

/// The lines of a file that speak of geometry, counted; all others are empty.
///
/// `tobj` makes a mesh of its own for each object, group and material, and the vertices that they share fall apart: the
/// seams would show under smooth shading. It also gives its errors without a line: this knows which one was last read.
struct Geometry<'b> {
    rest: &'b [u8],
    line: &'b [u8],
    taken: usize,
    number: usize,
    /// Positions, texture coordinates and normals so far.
    counts: [u64; 3],
}

/// Whether the indices of a face have no more than ten digits, and those that count backwards do not leave the file, which has
/// so many positions, texture coordinates and normals so far. `tobj` 4.0.5 multiplies indices unchecked, so that huge ones come
/// round to vertices that exist.
fn indices_fit(line: &[u8], counts: [u64; 3]) -> bool {
    // As `tobj` takes lines apart, which knows more spaces than those of ASCII.
    let Ok(line) = str::from_utf8(line) else {
        return false;
    };
    let fits = |(kind, index): (usize, &str)| match (index.strip_prefix('-'), counts.get(kind)) {
        (_, None) => false,
        (Some(back), Some(&count)) => back.parse().is_ok_and(|back: u64| back <= count),
        (None, _) => index.len() <= 10,
    };
    line.split_whitespace()
        .skip(1)
        .all(|corner| corner.split('/').enumerate().all(fits))
}

impl BufRead for Geometry<'_> {
    fn fill_buf(&mut self) -> std::io::Result<&[u8]> {
        while self.taken == self.line.len() && !self.rest.is_empty() {
            let end = self
                .rest
                .iter()
                .position(|&byte| byte == b'\n')
                .map_or(self.rest.len(), |at| at + 1);
            let (line, rest) = self.rest.split_at(end);
            self.rest = rest;
            self.number += 1;
            let word = line.trim_ascii_start().split(u8::is_ascii_whitespace).next();
            let words: [&[u8]; 4] = [b"v", b"vt", b"vn", b"f"];
            let kind = words.iter().position(|&known| word == Some(known));
            let wanted = kind.is_some();
            if let Some(count) = kind.and_then(|kind| self.counts.get_mut(kind)) {
                *count += 1;
            } else if wanted && !indices_fit(line, self.counts) {
                return Err(std::io::ErrorKind::InvalidData.into());
            }
            (self.line, self.taken) = (if wanted { line } else { &[] }, 0);
        }
        Ok(&self.line[self.taken..])
    }

    fn consume(&mut self, amount: usize) {
        self.taken += amount;
    }
}

impl Read for Geometry<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let count = self.fill_buf()?.read(buffer)?;
        self.consume(count);
        Ok(count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CUBE: &str = "# a cube\no cube\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n\
        g ends\nf 4 3 2 1\nf -4 -3 -2 -1\ng sides\nusemtl any\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

    #[test]
    fn quads_negative_indices_and_groups() {
        let raw = read(CUBE.as_bytes(), false).unwrap();
        assert_eq!(raw.vertices.len(), 8, "groups share their vertices");
        assert_eq!(raw.triangles.len(), 12);
        assert!(raw.normals.is_none());
        // The second quad is split along its first and third corner.
        let points = |i: usize| raw.triangles[i].map(|corner| raw.vertices[corner as usize].to_array());
        assert_eq!(points(2), [[0., 0., 1.], [1., 0., 1.], [1., 1., 1.]]);
        assert_eq!(points(3), [[0., 0., 1.], [1., 1., 1.], [0., 1., 1.]]);
    }

    #[test]
    fn a_pair_of_position_and_normal_is_a_vertex() {
        let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvn 0 0 1\nvn 1 0 0\nf 1//1 2//1 3//1\nf 1//2 3//2 4//2\n";
        let raw = read(text.as_bytes(), false).unwrap();
        assert_eq!(raw.vertices.len(), 6);
        assert_eq!(raw.normals.unwrap()[3], DVec3::X);
    }

    #[test]
    fn a_corner_has_texture_coordinates_of_its_own() {
        let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nvt 0 0\nvt 1 0\nvt 0 0.5\nf 1/1 2/2 3/3\nf 2/1 4/2 3/3\n";
        let raw = read(text.as_bytes(), true).unwrap();
        let uvs = raw.uvs.unwrap();
        assert_eq!(
            (raw.vertices.len(), uvs.len()),
            (5, 5),
            "vertex 2 has two pairs, vertex 3 one"
        );
        assert_eq!(uvs[2], DVec2::new(0.0, 0.5));
        assert!(raw.normals.is_none());
    }

    #[test]
    fn errors_name_the_line() {
        let error = |text: &str| read(text.as_bytes(), false).unwrap_err().what;
        assert_eq!(
            error("v 0 0 0\nv 1 zero 0\n"),
            "has a vertex that cannot be read in line 2"
        );
        assert_eq!(
            error("v 0 0 0\n\n# f\nf 1 2 x\n"),
            "has a face that cannot be read in line 4"
        );
        assert_eq!(error("nothing here\n"), "has no faces");
        // Three times this index, counted from 0, comes round to 4: the second vertex and a half.
        assert_eq!(
            error("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 12297829382473034413\n"),
            "has an index or something else that cannot be read in line 4"
        );
        assert!(error("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 -4\n").ends_with("in line 4"));
        // Each kind of index has a count of its own, whatever stands between two of them.
        let square = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\n";
        for face in [
            "1/1 2/-2 3/1",
            "1//1 2//-2 3//1",
            "1/1 2/1\u{b}-4/1",
            "1/1/1/1 2 3",
            "1 2 --1",
        ] {
            assert!(error(&format!("{square}f {face}\n")).ends_with("in line 6"), "{face}");
        }
        assert!(read(format!("{square}f -3/-1/-1 2/1/1 -1/-1/-1\n").as_bytes(), true).is_ok());
        assert!(error("v 0 0 0\nv 1 0 0\nf 1 2 9\n").contains("does not exist"));
    }
}
