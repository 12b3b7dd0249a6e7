//! Triangle meshes: what an inline table or a file says, and the steps from there to a [`Mesh`].

mod clean;
mod gltf;
mod inline;
mod normals;
mod obj;
mod ply;
mod transform;

use std::fs::File;
use std::path::Path;

use glam::{DMat4, DVec3};

use super::error::Fault;
use super::{Mesh, Surface, memory};

pub(super) use inline::inline;
pub(super) use transform::transform;

/// What a file or a table says: nothing is known of it but that the lengths of `vertices` and `normals` agree.
#[derive(Debug, Default)]
pub(super) struct RawMesh {
    vertices: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    normals: Option<Vec<DVec3>>,
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

/// Reading takes at most about this many times the file's length (OBJ: the text, 64-bit numbers and tables of both).
const BYTES_PER_BYTE: u64 = 6;

/// Reads the mesh file `name` in `folder`.
pub(super) fn read(folder: &Path, name: &str) -> Result<RawMesh, Fault> {
    let path = folder.join(name);
    let fault = |what: String, help: &str| Fault::new(format!("mesh file \"{name}\" {what}"), help);

    let ending = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    if !["obj", "ply", "gltf", "glb"].contains(&ending.as_str()) {
        let help = "save the mesh as .obj, .ply, .gltf or .glb";
        return Err(fault("has an ending that Octolux does not read".to_owned(), help));
    }
    // Its kind before it is opened: opening a named pipe would wait for somebody to write into it.
    let length = match std::fs::metadata(&path) {
        Ok(metadata) if metadata.is_file() => metadata.len(),
        Ok(_) => {
            return Err(fault(
                "is not a file".to_owned(),
                "name a file: paths are relative to the scene file",
            ));
        }
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
            return Err(fault("does not exist".to_owned(), &how_to_get(folder, name)));
        }
        Err(error) => {
            return Err(fault(
                format!("cannot be read: {error}"),
                "check that the file may be read",
            ));
        }
    };
    if length == 0 {
        return Err(fault(
            "is empty".to_owned(),
            "save the mesh again, or name another file",
        ));
    }
    if !memory::fits(length.saturating_mul(BYTES_PER_BYTE)) {
        return Err(fault(
            "is too large for the memory that is free".to_owned(),
            "use a mesh with fewer triangles",
        ));
    }

    let file = File::open(&path)
        .map_err(|error| fault(format!("cannot be read: {error}"), "check that the file may be read"))?;
    let raw = match ending.as_str() {
        "obj" => obj::read(file),
        "ply" => ply::read(file, length),
        _ => gltf::read(file, path.parent().unwrap_or(folder)),
    };
    let raw = raw.and_then(|raw| clean::check(&raw).map(|()| raw));
    raw.map_err(|problem| Fault::new(format!("mesh file \"{name}\" {}", problem.what), problem.help))
}

/// Where a missing file may come from: a script `fetch-NAME.sh` beside the scene fetches what has NAME in its name.
fn how_to_get(folder: &Path, name: &str) -> String {
    // The folder of `dragon.toml` is the empty path, which cannot be listed.
    let here = if folder.as_os_str().is_empty() {
        Path::new(".")
    } else {
        folder
    };
    let scripts = std::fs::read_dir(here).into_iter().flatten().flatten();
    let script = scripts
        .map(|entry| entry.file_name().to_string_lossy().into_owned())
        .find(|script| {
            let subject = script.strip_prefix("fetch-").and_then(|rest| rest.strip_suffix(".sh"));
            subject.is_some_and(|subject| name.contains(subject))
        });
    match script {
        Some(script) => format!("run {}, which fetches it", folder.join(script).display()),
        None => "check the name: paths are relative to the scene file".to_owned(),
    }
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
