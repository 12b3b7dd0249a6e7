//! `[[spheres]]` and `[[meshes]]`, and what their surfaces do.

use super::error::Fault;
use super::files::Files;
use super::materials::Materials;
use super::mesh::{self, Normals, Wanted};
use super::nearest::nearest;
use super::rule::{FINITE, NOT_NEGATIVE, POSITIVE};
use super::table::Table;
use super::value::Value;
use super::{Mesh, Sphere, Surface};

pub(super) const SPHERE_KEYS: &[&str] = &["center", "radius", "emission", "material"];
pub(super) const MESH_KEYS: &[&str] = &[
    "file",
    "vertices",
    "faces",
    "uvs",
    "normals",
    "transform",
    "emission",
    "material",
];

pub(super) fn sphere(table: &Table<'_>, materials: &Materials<'_>) -> Result<Sphere, Fault> {
    Ok(Sphere {
        center: table.need("center", "center = [0.0, 0.0, 0.0]")?.triple(&FINITE)?,
        radius: table.need("radius", "radius = 1.0")?.number(&POSITIVE)?,
        surface: match surface(table, materials)? {
            Surface::Material(index) if materials.textured(index) => {
                let what = format!(
                    "{} has a material with a texture, and no texture coordinates",
                    table.title
                );
                return Err(table.fault(
                    what,
                    "give the sphere a material without a texture, or make it a mesh with uvs",
                ));
            }
            surface => surface,
        },
    })
}

/// A mesh, and sentences about what was left out of it. Files are those of the scene.
pub(super) fn mesh(table: &Table<'_>, materials: &Materials<'_>, files: &Files) -> Result<(Mesh, Vec<String>), Fault> {
    // What is cheap is checked first: a wrong name should not wait for a big file.
    let surface = surface(table, materials)?;
    let transform = mesh::transform(table.get("transform"))?;
    let normals = match table.get("normals") {
        None => Normals::Flat,
        Some(value) => value.choice(&Normals::ALL, Normals::name)?,
    };

    let textured = matches!(surface, Surface::Material(index) if materials.textured(index));
    let wanted = Wanted {
        uvs: textured,
        normals: normals == Normals::Smooth,
    };
    let source = table.one_of("file", "vertices", "write file = \"bunny.ply\", or vertices and faces")?;
    let (raw, place, title) = match source.key {
        "file" => {
            if let Some(faces) = table.get("faces") {
                return Err(faces.fault(
                    "must not stand beside file",
                    "the file has its own faces: leave these out",
                ));
            }
            if let Some(uvs) = table.get("uvs") {
                return Err(uvs.fault("must not stand beside file", "the file has its own: leave these out"));
            }
            let name = source.string()?;
            let (span, label) = source.place();
            let raw = mesh::read(files, name, wanted).map_err(|fault| fault.at(span, label))?;
            (raw, source, format!("{} ({name})", table.title))
        }
        _ => {
            let faces = table.need("faces", "faces = [[0, 1, 2]]")?;
            (
                mesh::inline(&source, &faces, table.get("uvs"))?,
                faces,
                table.title.clone(),
            )
        }
    };
    let (span, label) = place.place();
    let (mesh, notes) =
        mesh::finish(raw, transform, normals, surface, &title).map_err(|fault| fault.at(span, label))?;
    if mesh.uvs.is_none() && textured {
        return Err(table.fault(
            format!("{title} has a material with a texture, and no texture coordinates"),
            "add uvs = [[0, 0], ...], one for each vertex; of files .obj (vt), .ply (s, t or u, v) and glTF (TEXCOORD_0) bring them",
        ));
    }
    Ok((mesh, notes))
}

/// What the surface of a shape does: exactly one of `material` and `emission`.
fn surface(table: &Table<'_>, materials: &Materials<'_>) -> Result<Surface, Fault> {
    let help = "write material = \"name\" for what reflects, or emission = [r, g, b] for what gives light";
    let value = table.one_of("material", "emission", help)?;
    if value.key == "emission" {
        return value.triple(&NOT_NEGATIVE).map(Surface::Emission);
    }
    let name = value.string()?;
    materials
        .index(name)
        .map(Surface::Material)
        .ok_or_else(|| no_material(&value, name, materials))
}

fn no_material(value: &Value<'_>, name: &str, materials: &Materials<'_>) -> Fault {
    let names = materials.names();
    let listed = names.iter().take(12).copied().collect::<Vec<_>>().join(", ");
    let more = if names.len() > 12 { ", ..." } else { "" };
    let help = match (nearest(name, names.iter().copied()), names.is_empty()) {
        (Some(near), _) => format!("did you mean \"{near}\"? the materials of this scene are {listed}{more}"),
        (None, false) => format!("the materials of this scene are {listed}{more}"),
        (None, true) => format!("this scene has no materials: add [materials.{name}] with diffuse = [0.4, 0.4, 0.4]"),
    };
    value.fault("must name a material of this scene", help)
}
