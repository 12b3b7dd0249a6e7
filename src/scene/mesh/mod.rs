//! Triangle meshes: from an inline table or a file to a [`Mesh`].

mod clean;
mod corners;
mod gltf;
mod inline;
mod lines;
mod normals;
mod obj;
mod off;
mod ply;
mod polygons;
mod source;
mod stl;
mod transform;

use glam::{DMat4, DVec2, DVec3};

use super::error::Fault;
use super::{Mesh, Surface};

pub(super) use clean::has_area;
pub(super) use gltf::name as buffer_name;
pub(super) use inline::inline;
pub(super) use ply::points;
pub(super) use source::read;
pub(super) use transform::{rotations, transform};

/// Unchecked data of a file or a table; only the lengths of `vertices`, `normals` and `uvs` agree.
#[derive(Debug, Default)]
pub(super) struct RawMesh {
    vertices: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    /// [`NO_NORMAL`] where a vertex has none.
    normals: Option<Vec<DVec3>>,
    /// [`NO_UV`] where a vertex has none.
    uvs: Option<Vec<DVec2>>,
    /// Notes about omissions and guesses: sentences without a subject.
    notes: Vec<String>,
}

/// Marks a missing normal: the vertex gets one from the triangles around it.
const NO_NORMAL: DVec3 = DVec3::ZERO;

/// Marks missing texture coordinates.
const NO_UV: DVec2 = DVec2::INFINITY;

/// What to read from a file besides positions and faces.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Wanted {
    pub uvs: bool,
    pub normals: bool,
}

/// How a mesh is shaded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Normals {
    /// By the normal of each triangle.
    Flat,
    /// By normals at the vertices: from the file, or area-weighted averages.
    Smooth,
}

impl Normals {
    pub const ALL: [Self; 2] = [Self::Flat, Self::Smooth];

    pub const fn name(self) -> &'static str {
        match self {
            Self::Flat => "flat",
            Self::Smooth => "smooth",
        }
    }
}

/// A problem with the contents of a mesh file; `what` follows the file's name.
type Problem = Fault;

/// Transforms a mesh and computes normals. Also returns notes about omissions and guesses.
pub(super) fn finish(
    mut raw: RawMesh,
    placement: DMat4,
    shading: Normals,
    surface: Surface,
    name: String,
) -> Result<(Mesh, Vec<String>), Fault> {
    transform::apply(&mut raw, placement);
    let notes = raw.notes.drain(..).map(|note| format!("{name}: {note}")).collect();
    bare_triangles(&mut raw, &name)?;
    if shading == Normals::Flat {
        raw.normals = None;
    }
    let mesh = raw.into_mesh(name, surface);
    let mesh = if shading == Normals::Smooth {
        mesh.smooth()
    } else {
        mesh
    };
    Ok((mesh, notes))
}

impl RawMesh {
    fn into_mesh(self, name: String, surface: Surface) -> Mesh {
        Mesh {
            name,
            vertices: self.vertices,
            triangles: self.triangles,
            normals: self.normals,
            smooth_terminator: false,
            uvs: self.uvs,
            surface,
        }
    }
}

impl Mesh {
    /// The mesh with smooth shading: unit normals at its vertices, its own if it has them, otherwise area-weighted averages
    /// over the surrounding triangles. Triangles are wound to agree with the normals of their corners. A mesh that a builder
    /// would reject is returned unchanged.
    #[must_use]
    pub fn smooth(self) -> Self {
        let count = self.vertices.len();
        let there = |corner: &u32| (*corner as usize) < count;
        let fits = |normals: &Vec<DVec3>| normals.len() == count && normals.iter().all(|n| n.is_finite());
        if !self.triangles.iter().flatten().all(there) || !self.normals.as_ref().is_none_or(fits) {
            return self;
        }
        let mut raw = RawMesh {
            vertices: self.vertices,
            triangles: self.triangles,
            normals: self.normals,
            uvs: self.uvs,
            notes: Vec::new(),
        };
        let normals = normals::smooth(&mut raw);
        Self {
            normals: Some(normals),
            smooth_terminator: self.smooth_terminator,
            ..raw.into_mesh(self.name, self.surface)
        }
    }
}

/// Rejects triangles without texture coordinates in a mesh that has some: coordinates are only read for textures.
fn bare_triangles(raw: &mut RawMesh, title: &str) -> Result<(), Fault> {
    let Some(uvs) = raw.uvs.as_mut().filter(|uvs| uvs.len() == raw.vertices.len()) else {
        return Ok(());
    };
    // Triangles without area are removed later.
    let area = |triangle: &&[u32; 3]| has_area(triangle.map(|corner| raw.vertices[corner as usize]));
    let bare = |triangle: &&[u32; 3]| triangle.iter().any(|&corner| uvs[corner as usize] == NO_UV);
    let count = raw.triangles.iter().filter(area).filter(bare).count();
    if count == 0 {
        // Vertices that no triangle uses.
        uvs.iter_mut()
            .filter(|uv| **uv == NO_UV)
            .for_each(|uv| *uv = DVec2::ZERO);
        return Ok(());
    }
    let all = raw.triangles.iter().filter(area).count();
    let what = format!(
        "{title} has a material with a texture, and {count} of its {all} triangles have no texture coordinates"
    );
    Err(Fault::new(
        what,
        "give all faces texture coordinates, or save those without them as a mesh of their own",
    ))
}

/// The triangles of a strip: each corner forms one with the two before it, with alternating winding. Repeated corners join
/// strips; their degenerate triangles are dropped.
fn strip(corners: &[u32]) -> impl Iterator<Item = [u32; 3]> + '_ {
    let triangles = corners.windows(3).enumerate().map(|(i, t)| match i % 2 {
        0 => [t[0], t[1], t[2]],
        _ => [t[1], t[0], t[2]],
    });
    triangles.filter(|[a, b, c]| a != b && b != c && c != a)
}

/// A sentence about faces with fewer than three corners.
fn short_faces(count: usize) -> Option<String> {
    let (noun, verb) = if count == 1 { ("face", "is") } else { ("faces", "are") };
    (count > 0).then(|| format!("{count} {noun} of fewer than 3 corners {verb} left out"))
}
