//! PLY, ASCII and binary. The crate `ply-rs-bw`, used before, does not support `nan` or `.5` in text, Latin-1, or lines that
//! end in `\r`, and allocates memory for each face.

mod header;
mod payload;
mod points;
mod strips;

use std::collections::HashMap;
use std::io::BufRead;
use std::ops::Range;

use glam::{DVec2, DVec3};

use super::corners::{Corners, Set};
use super::lines::Lines;
use super::polygons::Polygons;
use super::{NO_UV, Problem, RawMesh, Wanted};
use header::{Element, Header};
use payload::Payload;
pub use points::points;

/// Names of the corner list of a face or a strip.
const CORNERS: &[&str] = &["vertex_indices", "vertex_index"];

/// Names of texture coordinates of vertices.
const UVS: [[&str; 2]; 3] = [["s", "t"], ["u", "v"], ["texture_u", "texture_v"]];

/// Names of texture coordinates of a face's corners: two numbers each, in one list.
const FACE_UVS: &[&str] = &["texcoord", "texcoords", "uv"];

/// Reads the `vertex`, `face` and `tristrips` elements of a PLY file with the wanted attributes; other elements and properties
/// are skipped. The file has at most `longest` bytes.
pub fn read<R: BufRead>(source: R, longest: u64, wanted: Wanted) -> Result<RawMesh, Problem> {
    let mut lines = Lines::new(source)?;
    let header = Header::read(&mut lines)?;
    header.check(longest)?;
    let mut payload = Payload::new(lines, header.encoding)?;
    let mut mesh = Ply {
        wanted,
        ..Default::default()
    };
    for element in &header.elements {
        match element.name.as_str() {
            "vertex" => mesh.vertices(element, &mut payload)?,
            "face" => mesh.faces(element, &mut payload)?,
            "tristrips" => mesh.strips(element, &mut payload)?,
            _ => mesh.skip(element, &mut payload)?,
        }
    }
    mesh.finish()
}

#[derive(Default)]
struct Ply {
    wanted: Wanted,
    raw: RawMesh,
    /// Distinct texture coordinates of the corners of faces.
    pairs: Vec<DVec2>,
    numbers: HashMap<[u64; 2], u32>,
    corners: Option<Corners>,
    polygons: Polygons,
    /// Polygons before the vertices: the index of their first triangle, and their corners.
    waiting: Vec<(u64, Vec<u32>, Vec<f64>)>,
    short: usize,
    /// The triangle range of each strip.
    strips: Vec<Range<usize>>,
}

impl Ply {
    fn skip<R: BufRead>(&self, element: &Element, payload: &mut Payload<R>) -> Result<(), Problem> {
        if element.properties.is_empty() && matches!(payload, Payload::Binary { .. }) {
            return Ok(());
        }
        for _ in 0..element.count {
            payload.begin(element)?;
            for property in &element.properties {
                payload.property(property, element, None)?;
            }
        }
        Ok(())
    }

    fn vertices<R: BufRead>(&mut self, element: &Element, payload: &mut Payload<R>) -> Result<(), Problem> {
        let has = |keys: &[&str]| {
            let number = |key: &&str| {
                element
                    .property(&[key])
                    .is_some_and(|property| property.length.is_none())
            };
            keys.iter().all(number)
        };
        let with_normals = self.wanted.normals && has(&["nx", "ny", "nz"]);
        let pair = UVS.iter().find(|pair| self.wanted.uvs && has(*pair));
        let keys = ["x", "y", "z", "nx", "ny", "nz"]
            .into_iter()
            .chain(pair.into_iter().flatten().copied());
        let keys: Vec<_> = keys.collect();
        let places: Vec<_> = element
            .properties
            .iter()
            .map(|property| keys.iter().position(|key| *key == property.name))
            .collect();

        let (mut normals, mut uvs) = (Vec::new(), Vec::new());
        let mut values = [0.0; 8];
        for _ in 0..element.count {
            payload.begin(element)?;
            for (property, place) in element.properties.iter().zip(&places) {
                let value = payload.property(property, element, None)?;
                if let Some(place) = *place {
                    values[place] = value;
                }
            }
            let [x, y, z, nx, ny, nz, u, v] = values;
            self.raw.vertices.push(DVec3::new(x, y, z));
            if with_normals {
                normals.push(DVec3::new(nx, ny, nz));
            }
            if pair.is_some() {
                uvs.push(DVec2::new(u, v));
            }
        }
        self.raw.normals = with_normals.then_some(normals);
        self.raw.uvs = pair.is_some().then_some(uvs);
        Ok(())
    }

    fn faces<R: BufRead>(&mut self, element: &Element, payload: &mut Payload<R>) -> Result<(), Problem> {
        let (mut corners, mut uvs) = (Vec::new(), Vec::new());
        let index = |names: &[&str]| {
            element
                .properties
                .iter()
                .position(|p| p.length.is_some() && names.contains(&&*p.name))
        };
        let corners_at = index(CORNERS);
        let uvs_at = index(FACE_UVS).filter(|_| self.wanted.uvs);
        let mut face = Vec::new();
        for number in 0..element.count {
            payload.begin(element)?;
            uvs.clear();
            for (at, property) in element.properties.iter().enumerate() {
                let list = match Some(at) {
                    at if at == corners_at => Some(&mut corners),
                    at if at == uvs_at => Some(&mut uvs),
                    _ => None,
                };
                payload.property(property, element, list)?;
            }
            face.clear();
            // A negative index becomes an impossible one, which the check of all indices reports.
            face.extend(
                corners
                    .iter()
                    .map(|&corner| if corner < 0.0 { u32::MAX } else { corner as u32 }),
            );
            if face.len() < 3 {
                self.short += 1;
            } else if face.len() > 3 && self.raw.vertices.is_empty() {
                self.waiting.push((number, face.clone(), uvs.clone()));
            } else {
                self.face(number, &face, &uvs)?;
            }
        }
        Ok(())
    }

    /// Adds a face; its texture coordinates only count if there are two numbers for each corner.
    fn face(&mut self, number: u64, face: &[u32], uvs: &[f64]) -> Result<(), Problem> {
        let vertices = &self.raw.vertices;
        // Missing vertices are reported later.
        let point = |&corner: &u32| vertices.get(corner as usize).copied().unwrap_or(DVec3::NAN);
        let bare = uvs.len() != 2 * face.len();
        for triangle in self.polygons.triangles(face.iter().map(point), number as usize) {
            let corners = triangle.map(|corner| face[corner as usize]);
            if bare && self.corners.is_none() {
                self.raw.triangles.push(corners);
                continue;
            }
            if let Some(missing) = corners.iter().find(|&&corner| corner as usize >= vertices.len()) {
                // Positions after the faces are not supported; no known program writes them.
                let what = format!(
                    "has a corner that does not exist: face {number} names vertex {missing} of {}",
                    vertices.len()
                );
                return Err(Problem::new(
                    what,
                    "save the mesh again, with its vertices before its faces",
                ));
            }
            let mut made = [0; 3];
            for (place, (corner, position)) in made.iter_mut().zip(triangle.into_iter().zip(corners)) {
                let mut set = Set::EMPTY;
                if !bare {
                    let pair = DVec2::new(uvs[2 * corner as usize], uvs[2 * corner as usize + 1]);
                    let next = self.pairs.len() as u32;
                    set.uv = *self.numbers.entry(pair.to_array().map(f64::to_bits)).or_insert(next);
                    if set.uv == next {
                        self.pairs.push(pair);
                    }
                }
                let known = &self.raw.triangles;
                let all = self.corners.get_or_insert_with(|| Corners::after(known));
                *place = all.vertex(position, set, vertices.len())?;
            }
            self.raw.triangles.push(made);
        }
        Ok(())
    }

    /// Triangle strips: each corner forms a triangle with the two before it, and -1 starts the next strip.
    fn strips<R: BufRead>(&mut self, element: &Element, payload: &mut Payload<R>) -> Result<(), Problem> {
        let mut corners = Vec::new();
        for _ in 0..element.count {
            payload.begin(element)?;
            for property in &element.properties {
                let wanted = property.length.is_some() && CORNERS.contains(&&*property.name);
                payload.property(property, element, wanted.then_some(&mut corners))?;
            }
            for strip in corners.split(|&corner| corner < 0.0) {
                let strip: Vec<_> = strip.iter().map(|&corner| corner as u32).collect();
                let first = self.raw.triangles.len();
                self.raw.triangles.extend(super::strip(&strip));
                self.strips.push(first..self.raw.triangles.len());
            }
        }
        Ok(())
    }

    fn finish(mut self) -> Result<RawMesh, Problem> {
        for (number, face, uvs) in std::mem::take(&mut self.waiting) {
            self.face(number, &face, &uvs)?;
        }
        let mut raw = self.raw;
        if raw.triangles.is_empty() && self.short > 0 {
            return Err(Problem::new(
                "has no face with 3 corners or more",
                "save the mesh with its faces",
            ));
        }
        let turned = strips::face_outwards(&self.strips, &mut raw.triangles, &raw.vertices);
        if turned > 0 {
            let all = self.strips.len();
            raw.notes.push(format!(
                "{turned} of its {all} strips face into the closed surface: they are turned round"
            ));
        }
        raw.notes.extend(super::short_faces(self.short));
        raw.notes.extend(self.polygons.note("face"));
        if let Some(corners) = self.corners {
            let corners = corners.finish(raw.vertices.len(), &mut raw.triangles);
            let of_faces = corners.gather(&self.pairs, NO_UV, |set| set.uv);
            // Corners without coordinates use those of their vertex, if any.
            let mut uvs = raw.uvs.take().unwrap_or_else(|| vec![NO_UV; raw.vertices.len()]);
            corners.extend(&mut uvs);
            uvs.iter_mut()
                .zip(of_faces)
                .filter(|(_, own)| *own != NO_UV)
                .for_each(|(uv, own)| *uv = own);
            raw.uvs = Some(uvs);
            corners.extend(&mut raw.vertices);
            raw.normals.iter_mut().for_each(|normals| corners.extend(normals));
        }
        Ok(raw)
    }
}

#[cfg(test)]
mod tests;
