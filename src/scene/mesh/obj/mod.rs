//! Wavefront OBJ. The crate `tobj` gives corners without normals or texture coordinates those of their neighbours, and supports
//! no continued lines; so the few statements of meshes are parsed here.

#[cfg(test)]
mod tests;

use std::collections::HashMap;
use std::io::BufRead;

use glam::{DVec2, DVec3};

use super::corners::{Corners, NONE, SMOOTHING, Set};
use super::lines::{Lines, number, numbers, words};
use super::polygons::Polygons;
use super::{NO_NORMAL, NO_UV, Problem, RawMesh, Wanted};

const MEND: &str = "the file is damaged or cut short: save the mesh again";
const NO_FACES: &str = "save the mesh with its faces: lines such as `f 1 2 3`";

/// Reads all faces of an OBJ file, with the wanted attributes; objects, groups and materials are ignored.
pub fn read<R: BufRead>(source: R, wanted: Wanted) -> Result<RawMesh, Problem> {
    let mut lines = Lines::new(source)?;
    let mut mesh = Obj {
        wanted,
        group: NONE,
        ..Default::default()
    };
    while let Some((line, text)) = lines.next_continued()? {
        mesh.statement(line, text)?;
    }
    mesh.finish()
}

/// Indices of a position, texture coordinates and a normal, from 0.
type Corner = [u32; 3];

const KINDS: [&str; 3] = ["vertex", "texture coordinate", "normal"];

#[derive(Default)]
struct Obj {
    wanted: Wanted,
    positions: Vec<DVec3>,
    uvs: Vec<DVec2>,
    normals: Vec<DVec3>,
    /// Number of elements of each kind, stored or not.
    counts: [u64; 3],
    triangles: Vec<[u32; 3]>,
    /// Present once a corner has more than a position.
    corners: Option<Corners>,
    polygons: Polygons,
    /// The smoothing group, numbered like a normal of [`Set`]; none for `s 0` and `s off`.
    group: u32,
    groups: HashMap<Vec<u8>, u32>,
    /// Faces that refer to later elements of the file, with their lines and groups.
    waiting: Vec<(usize, u32, Vec<Corner>)>,
    short: usize,
    curves: usize,
    /// Corners with index 0 for a texture coordinate or normal.
    zeros: usize,
    /// The corners of the current face, a reused buffer.
    face: Vec<Corner>,
}

impl Obj {
    fn statement(&mut self, line: usize, text: &[u8]) -> Result<(), Problem> {
        let broken = |what: &str| Problem::new(format!("has {what} that cannot be read in line {line}"), MEND);
        let mut words = words(text).take_while(|word| word[0] != b'#');
        match words.next() {
            Some(b"v") => {
                self.counts[0] += 1;
                let position = position(&mut words).ok_or_else(|| broken("a vertex"))?;
                self.positions.push(position);
            }
            Some(b"vt") => {
                self.counts[1] += 1;
                let [u] = numbers(&mut words).ok_or_else(|| broken("a texture coordinate"))?;
                // The second coordinate is optional.
                let v = words.next().map_or(Some(0.0), number);
                let v = v.ok_or_else(|| broken("a texture coordinate"))?;
                if self.wanted.uvs {
                    self.uvs.push(DVec2::new(u, v));
                }
            }
            Some(b"vn") => {
                self.counts[2] += 1;
                let normal = numbers(&mut words).ok_or_else(|| broken("a normal"))?;
                if self.wanted.normals {
                    self.normals.push(DVec3::from_array(normal));
                }
            }
            // `fo` is the old name of `f`.
            Some(b"f" | b"fo") => {
                let mut face = std::mem::take(&mut self.face);
                face.clear();
                for word in words {
                    let corner = self.corner(word, line)?;
                    face.push(corner);
                }
                let mut indices = face.iter().flatten().zip(self.counts.iter().cycle());
                if indices.all(|(&index, &count)| index == NONE || u64::from(index) < count) {
                    self.face(&face, self.group, line)?;
                } else {
                    self.waiting.push((line, self.group, face.clone()));
                }
                self.face = face;
            }
            Some(b"s") => self.group = self.smoothing(words.next().unwrap_or(b"off")),
            Some(b"surf" | b"curv" | b"curv2") => self.curves += 1,
            _ => {}
        }
        Ok(())
    }

    /// Parses a corner `position/uv/normal`, of which the last two are optional; negative indices count back from the last.
    fn corner(&mut self, word: &[u8], line: usize) -> Result<Corner, Problem> {
        let broken = || Problem::new(format!("has a face that cannot be read in line {line}"), MEND);
        let mut corner = [NONE; 3];
        for (kind, part) in word.split(|&byte| byte == b'/').enumerate() {
            if kind > 0 && part.is_empty() {
                continue;
            }
            let place = corner.get_mut(kind).ok_or_else(broken)?;
            let index: i64 = number(part).ok_or_else(broken)?;
            let counted = match index {
                1.. => Some(index - 1),
                0 if kind > 0 => {
                    self.zeros += 1;
                    continue;
                }
                0 => None,
                _ => self.counts[kind]
                    .checked_add_signed(index)
                    .and_then(|index| i64::try_from(index).ok()),
            };
            let counted = counted
                .and_then(|index| u32::try_from(index).ok())
                .filter(|&index| index < SMOOTHING);
            *place = counted.ok_or_else(|| missing(kind, index, self.counts[kind], line))?;
        }
        Ok(corner)
    }

    fn smoothing(&mut self, word: &[u8]) -> u32 {
        if number::<f64>(word) == Some(0.0) || word == b"off" {
            return NONE;
        }
        let next = SMOOTHING + self.groups.len() as u32;
        *self.groups.entry(word.to_owned()).or_insert(next)
    }

    /// Adds a face whose elements have all been read.
    fn face(&mut self, face: &[Corner], group: u32, line: usize) -> Result<(), Problem> {
        if face.len() < 3 {
            self.short += 1;
            return Ok(());
        }
        for corners in self
            .polygons
            .triangles(face.iter().map(|corner| self.positions[corner[0] as usize]), line)
        {
            let mut triangle = [0; 3];
            for (place, corner) in triangle.iter_mut().zip(corners) {
                let [position, uv, normal] = face[corner as usize];
                let set = Set {
                    normal: match (self.wanted.normals, normal) {
                        (false, _) => NONE,
                        (true, NONE) => group,
                        (true, normal) => normal,
                    },
                    uv: if self.wanted.uvs { uv } else { NONE },
                };
                if self.corners.is_none() && set != Set::EMPTY {
                    self.corners = Some(Corners::after(&self.triangles));
                }
                *place = match &mut self.corners {
                    Some(corners) => corners.vertex(position, set, self.positions.len())?,
                    None => position,
                };
            }
            self.triangles.push(triangle);
        }
        Ok(())
    }

    fn finish(mut self) -> Result<RawMesh, Problem> {
        for (line, group, face) in std::mem::take(&mut self.waiting) {
            for corner in &face {
                for (kind, (&index, &count)) in corner.iter().zip(&self.counts).enumerate() {
                    if index != NONE && u64::from(index) >= count {
                        return Err(missing(kind, i64::from(index) + 1, count, line));
                    }
                }
            }
            self.face(&face, group, line)?;
        }
        if self.triangles.is_empty() {
            return Err(match (self.short, self.curves) {
                (0, 0) => Problem::new("has no faces", NO_FACES),
                (0, _) => Problem::new(
                    "has curves and free-form surfaces, and no faces",
                    "save the surfaces as polygons",
                ),
                _ => Problem::new("has no face with 3 corners or more", NO_FACES),
            });
        }
        let mut notes = Vec::new();
        if self.curves > 0 {
            notes.push(format!(
                "{} curves and free-form surfaces are left out: only faces are read",
                self.curves
            ));
        }
        if self.zeros > 0 {
            let what = "normals or texture coordinates with the number 0, which nothing has, count as missing";
            notes.push(format!("{} {what}", self.zeros));
        }
        notes.extend(super::short_faces(self.short));
        notes.extend(self.polygons.note("line"));

        let mut raw = RawMesh {
            vertices: self.positions,
            triangles: self.triangles,
            notes,
            ..Default::default()
        };
        if let Some(corners) = self.corners {
            let mut corners = corners.finish(raw.vertices.len(), &mut raw.triangles);
            if !self.groups.is_empty() {
                // If there are smoothing groups, faces outside all groups are flat.
                corners.part(&mut raw.triangles, |set| set.normal == NONE)?;
            }
            corners.extend(&mut raw.vertices);
            if !self.normals.is_empty() {
                raw.normals = Some(corners.gather(&self.normals, NO_NORMAL, |set| set.normal));
                self.normals = Vec::new();
            }
            if !self.uvs.is_empty() {
                raw.uvs = Some(corners.gather(&self.uvs, NO_UV, |set| set.uv));
            }
        }
        Ok(raw)
    }
}

/// Three coordinates. A fourth number is a divisor; six or seven numbers are coordinates and a colour.
fn position<'w>(words: &mut impl Iterator<Item = &'w [u8]>) -> Option<DVec3> {
    let position = DVec3::from_array(numbers(words)?);
    let more: Vec<_> = words.take(5).collect();
    match more[..] {
        [] | [_, _, _] | [_, _, _, _] => Some(position),
        [w] => number(w).filter(|&w: &f64| w != 0.0).map(|w| position / w),
        _ => None,
    }
}

fn missing(kind: usize, index: i64, count: u64, line: usize) -> Problem {
    let kind = KINDS[kind];
    match (index, count) {
        (0, _) => Problem::new(
            format!("has a face that names {kind} 0 in line {line}"),
            "an OBJ file counts from 1: save the mesh again",
        ),
        (_, 0) if kind == KINDS[1] => Problem::new(
            format!("has a face that names texture coordinate {index} of 0 in line {line}"),
            "a normal stands behind two strokes: 1//1, not 1/1",
        ),
        _ => Problem::new(
            format!("has a face that names {kind} {index} of {count} in line {line}"),
            MEND,
        ),
    }
}
