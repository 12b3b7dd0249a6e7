//! `[[spheres]]`, `[[meshes]]` and `[[boxes]]` with their surfaces.

use super::error::Fault;
use super::files::Files;
use super::materials::Materials;
use super::mesh::{self, Normals, Wanted};
use super::nearest::nearest;
use super::rule::{FINITE, POSITIVE};
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
    "shadow_terminator",
    "transform",
    "emission",
    "material",
];

pub(super) const BOX_KEYS: &[&str] = &[
    "center", "size", "rotate_x", "rotate_y", "rotate_z", "rotate", "emission", "material",
];

/// A box, rotated about its centre.
pub(super) fn cuboid(table: &Table<'_>, materials: &Materials<'_>) -> Result<Mesh, Fault> {
    let center = table
        .need("center", "center = [0.0, 0.5, 0.0]")?
        .ruled_triple(&FINITE)?;
    let size = table.need("size", "size = [1.0, 1.0, 1.0]")?.ruled_triple(&POSITIVE)?;
    let mut mesh = Mesh::cuboid(center, size, mesh::rotations(table)?, surface(table, materials)?);
    mesh.name.clone_from(&table.title);
    Ok(mesh)
}

pub(super) fn sphere(table: &Table<'_>, materials: &Materials<'_>) -> Result<Sphere, Fault> {
    Ok(Sphere {
        center: table.need("center", "center = [0.0, 0.0, 0.0]")?.triple()?,
        radius: table.need("radius", "radius = 1.0")?.number()?,
        surface: surface(table, materials)?,
    })
}

/// A mesh named as in messages, and notes about omissions. `files` are those of the scene.
pub(super) fn mesh(table: &Table<'_>, materials: &Materials<'_>, files: &Files) -> Result<(Mesh, Vec<String>), Fault> {
    // Cheap checks first: a wrong name should be reported before a big file is read.
    let surface = surface(table, materials)?;
    let transform = mesh::transform(table.get("transform"))?;
    let normals = match table.get("normals") {
        None => Normals::Flat,
        Some(value) => value.choice(&Normals::ALL, Normals::name)?,
    };
    let smooth_terminator = match table.get("shadow_terminator") {
        None => false,
        Some(value) if normals == Normals::Flat => {
            let help = "add normals = \"smooth\", or leave it out: a flat mesh is lit as it is";
            return Err(value.fault("belongs to smooth normals", help));
        }
        Some(value) => value.choice(&[false, true], |smooth| if smooth { "smooth" } else { "facets" })?,
    };
    let wanted = Wanted {
        uvs: materials.textured(surface),
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
            let raw = mesh::inline(&source, &faces, table.get("uvs"))?;
            (raw, faces, table.title.clone())
        }
    };
    let (span, label) = place.place();
    let (mesh, notes) = mesh::finish(raw, transform, normals, surface, title).map_err(|fault| fault.at(span, label))?;
    let mesh = Mesh {
        smooth_terminator,
        ..mesh
    };
    Ok((mesh, notes))
}

/// The surface of a shape: exactly one of `material` and `emission`.
fn surface(table: &Table<'_>, materials: &Materials<'_>) -> Result<Surface, Fault> {
    let help = "write material = \"name\" for what reflects, or emission = [r, g, b] for what gives light";
    let value = table.one_of("material", "emission", help)?;
    if value.key == "emission" {
        return value.triple().map(Surface::Emission);
    }
    let name = value.string()?;
    materials
        .find(name)
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
