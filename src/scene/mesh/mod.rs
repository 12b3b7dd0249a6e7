//! Triangle meshes: what an inline table or a file says, and the steps from there to a [`Mesh`].

mod clean;
mod gltf;
mod inline;
mod normals;
mod obj;
mod ply;
mod transform;

use std::path::Path;

use glam::{DMat4, DVec2, DVec3};

use super::error::Fault;
use super::files::Files;
use super::{Mesh, Surface};

pub(super) use inline::inline;
pub(super) use transform::{rotations, transform};

/// What a file or a table says: nothing is known of it but that the lengths of `vertices`, `normals` and `uvs` agree.
#[derive(Debug, Default)]
pub(super) struct RawMesh {
    vertices: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    normals: Option<Vec<DVec3>>,
    uvs: Option<Vec<DVec2>>,
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

/// Reads the mesh file `name`, with its texture coordinates where they are wanted: in an OBJ file they split vertices.
pub(super) fn read(files: &Files, name: &str, textured: bool) -> Result<RawMesh, Fault> {
    let ending = Path::new(name).extension().unwrap_or_default();
    let ending = ending.to_string_lossy().to_lowercase();
    if !["obj", "ply", "gltf", "glb"].contains(&ending.as_str()) {
        let what = format!("mesh file \"{name}\" has an ending that Octolux does not read");
        return Err(Fault::new(what, "save the mesh as .obj, .ply, .gltf or .glb"));
    }
    let bytes = files.bytes("mesh file", name)?;
    let raw = match ending.as_str() {
        "obj" => obj::read(&bytes, textured),
        "ply" => ply::read(&bytes, textured),
        _ => gltf::read(&bytes, textured, &|buffer| files.bytes("buffer", &beside(name, buffer))),
    };
    let raw = raw.and_then(|raw| clean::check(&raw).map(|()| raw));
    raw.map_err(|problem| Fault::new(format!("mesh file \"{name}\" {}", problem.what), problem.help))
}

/// The file `other` in the folder of the file `name`.
fn beside(name: &str, other: &str) -> String {
    Path::new(name).with_file_name(other).to_string_lossy().into_owned()
}

/// What is wrong with the contents of a mesh file; `what` follows the file's name.
type Problem = Fault;

/// Moves a mesh into place, drops triangles without area and gives it normals. The sentence says what was left out.
pub(super) fn finish(
    mut raw: RawMesh,
    placement: DMat4,
    shading: Normals,
    surface: Surface,
    title: &str,
) -> Result<(Mesh, Option<String>), Fault> {
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
    let note = (kept < all).then(|| {
        let left_out = all - kept;
        let (noun, verb) = if left_out == 1 {
            ("triangle", "is")
        } else {
            ("triangles", "are")
        };
        format!("{title}: {left_out} {noun} of {all} without area {verb} left out")
    });

    let normals = (shading == Normals::Smooth).then(|| normals::smooth(&mut raw));
    Ok((
        Mesh {
            vertices: raw.vertices,
            triangles: raw.triangles,
            normals,
            uvs: raw.uvs,
            surface,
        },
        note,
    ))
}

/// The triangles of a polygon: a fan from its first corner, so that four corners are split along 0-2.
fn fan<T: Copy>(corners: &[T]) -> impl Iterator<Item = [T; 3]> + '_ {
    let pairs = corners.get(1..).unwrap_or_default().windows(2);
    pairs.map(|pair| [corners[0], pair[0], pair[1]])
}
