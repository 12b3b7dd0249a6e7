//! Triangle meshes: what an inline table or a file says, and the steps from there to a [`Mesh`].

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

pub(super) use inline::inline;
pub(super) use source::read;
pub(super) use transform::{rotations, transform};

/// What a file or a table says: nothing is known of it but that the lengths of `vertices`, `normals` and `uvs` agree.
#[derive(Debug, Default)]
pub(super) struct RawMesh {
    vertices: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    /// [`NO_NORMAL`] where a vertex has none.
    normals: Option<Vec<DVec3>>,
    /// [`NO_UV`] where a vertex has none.
    uvs: Option<Vec<DVec2>>,
    /// What was left out or guessed: sentences without a subject.
    notes: Vec<String>,
}

/// In the place of a normal: the vertex gets one from the triangles around it.
const NO_NORMAL: DVec3 = DVec3::ZERO;

/// In the place of texture coordinates.
const NO_UV: DVec2 = DVec2::INFINITY;

/// What of a file is needed beside positions and faces.
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
    /// By normals at the vertices: the file's, else area-weighted ones.
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

/// What is wrong with the contents of a mesh file; `what` follows the file's name.
type Problem = Fault;

/// Moves a mesh into place, drops triangles without area and gives it normals. The sentences say what was left out.
pub(super) fn finish(
    mut raw: RawMesh,
    placement: DMat4,
    shading: Normals,
    surface: Surface,
    title: &str,
) -> Result<(Mesh, Vec<String>), Fault> {
    transform::apply(&mut raw, placement);
    if let Some(index) = raw.vertices.iter().position(|&v| !clean::in_range(v)) {
        let what = format!("{title} has vertex {index} beyond 3.4e38 once it is transformed");
        return Err(Fault::new(what, "make the scale or the translation smaller"));
    }

    let all = raw.triangles.len();
    clean::drop_flat(&mut raw);
    let kept = raw.triangles.len();
    if kept == 0 {
        let what = match all {
            0 => format!("{title} has no faces"),
            _ => format!("{title} has no triangle with an area, got {all} without"),
        };
        return Err(Fault::new(
            what,
            "a mesh needs a triangle whose corners are not on one line",
        ));
    }
    let mut notes: Vec<_> = raw.notes.drain(..).map(|note| format!("{title}: {note}")).collect();
    if kept < all {
        let left_out = all - kept;
        let (noun, verb) = if left_out == 1 {
            ("triangle", "is")
        } else {
            ("triangles", "are")
        };
        notes.push(format!(
            "{title}: {left_out} {noun} of {all} without area {verb} left out"
        ));
    }
    bare_triangles(&mut raw, title)?;

    let normals = (shading == Normals::Smooth).then(|| normals::smooth(&mut raw));
    Ok((
        Mesh {
            vertices: raw.vertices,
            triangles: raw.triangles,
            normals,
            uvs: raw.uvs,
            surface,
        },
        notes,
    ))
}

/// Refuses triangles without texture coordinates in a mesh that has some: they are read only where there is a texture.
fn bare_triangles(raw: &mut RawMesh, title: &str) -> Result<(), Fault> {
    let Some(uvs) = &mut raw.uvs else { return Ok(()) };
    let bare = |triangle: &&[u32; 3]| triangle.iter().any(|&corner| uvs[corner as usize] == NO_UV);
    let count = raw.triangles.iter().filter(bare).count();
    if count == 0 {
        // Vertices that no triangle uses.
        uvs.iter_mut()
            .filter(|uv| **uv == NO_UV)
            .for_each(|uv| *uv = DVec2::ZERO);
        return Ok(());
    }
    let all = raw.triangles.len();
    let what = format!(
        "{title} has a material with a texture, and {count} of its {all} triangles have no texture coordinates"
    );
    Err(Fault::new(
        what,
        "give all faces texture coordinates, or save those without them as a mesh of their own",
    ))
}

/// The triangles of a strip: each corner makes one with the two before it, and every second one is wound the other way
/// round. Repeated corners join strips; their triangles are nothing.
fn strip(corners: &[u32]) -> impl Iterator<Item = [u32; 3]> + '_ {
    let triangles = corners.windows(3).enumerate().map(|(i, t)| match i % 2 {
        0 => [t[0], t[1], t[2]],
        _ => [t[1], t[0], t[2]],
    });
    triangles.filter(|[a, b, c]| a != b && b != c && c != a)
}

/// A sentence about faces without an inside.
fn short_faces(count: usize) -> Option<String> {
    let (noun, verb) = if count == 1 { ("face", "is") } else { ("faces", "are") };
    (count > 0).then(|| format!("{count} {noun} of fewer than 3 corners {verb} left out"))
}
