//! Maps what a builder rejects to its place in a scene file.

use super::error::Fault;
use super::invalid::{InvalidScene, Subject};
use super::table::Table;
use super::{materials, shapes, view};

/// The error for a scene read from the file with this root: the builder's message, with the value as written.
pub(super) fn fault(error: &InvalidScene, root: &Table<'_>) -> Fault {
    // The tables were read before, so they exist.
    in_table_of(error, root).unwrap_or_else(|fault| fault)
}

fn in_table_of(error: &InvalidScene, root: &Table<'_>) -> Result<Fault, Fault> {
    let whole = || Fault::new(error.to_string(), error.remedy()).at(0..0, "in this file");
    if let Subject::Mesh(index) = error.subject() {
        // Boxes follow the meshes.
        let meshes = root
            .get("meshes")
            .map(|value| value.tables("mesh", shapes::MESH_KEYS))
            .transpose()?;
        let before = meshes.map_or(0, |meshes| meshes.len());
        if index >= before {
            let boxes = root.get("boxes").ok_or_else(whole)?.tables("box", shapes::BOX_KEYS)?;
            return Ok(in_table(error, boxes.get(index - before).ok_or_else(whole)?));
        }
    }
    let (key, thing, keys) = match error.subject() {
        Subject::Camera => ("camera", "camera", view::CAMERA_KEYS),
        Subject::Film => ("film", "film", view::FILM_KEYS),
        Subject::Render => ("render", "render", view::RENDER_KEYS),
        Subject::Material(_) => ("materials", "material", materials::KEYS),
        Subject::Sphere(_) => ("spheres", "sphere", shapes::SPHERE_KEYS),
        Subject::Mesh(_) => ("meshes", "mesh", shapes::MESH_KEYS),
        Subject::Light(_) => ("lights", "light", super::lights::KEYS),
        Subject::Environment => ("environment", "environment", super::environment::KEYS),
    };
    let value = root.get(key).ok_or_else(whole)?;
    match error.subject() {
        Subject::Material(index) => {
            let (_, table) = value
                .named_tables(thing, keys)?
                .into_iter()
                .nth(index)
                .ok_or_else(whole)?;
            Ok(in_table(error, &table))
        }
        Subject::Sphere(index) | Subject::Light(index) => {
            let table = value.tables(thing, keys)?.into_iter().nth(index).ok_or_else(whole)?;
            Ok(in_table(error, &table))
        }
        Subject::Mesh(index) => {
            let table = value.tables(thing, keys)?.into_iter().nth(index).ok_or_else(whole)?;
            Ok(in_mesh(error, &table))
        }
        _ => Ok(in_table(error, &value.table(format!("[{key}]"), thing, keys)?)),
    }
}

fn in_table(error: &InvalidScene, table: &Table<'_>) -> Fault {
    let Some(property) = error.property() else {
        let name = match error.subject() {
            // "film of 65536 x 65536 pixels", "[[spheres]] 3 has"
            Subject::Film => table.thing,
            _ => &table.title,
        };
        return table.fault(format!("{name} {}", error.problem()), error.remedy());
    };
    let written = table.get(property.key).or_else(|| {
        // The direction of a spot light may come from its target.
        let target = table.get("target").filter(|_| property.key == "direction");
        if target.is_some() {
            return target;
        }
        // The alternative spelling of a model.
        let of_model = ["diffuse", "phong", "exponent"].contains(&property.key);
        table.get("brdf_params").filter(|_| of_model)
    });
    match written {
        Some(value) => value.fault_in(property.component, error.problem(), error.remedy()),
        // The value is derived from others.
        None => {
            let got = error.value().unwrap_or_default();
            let what = format!("{} {} {}, got {got}", table.thing, property.key, error.problem());
            table.fault(what, error.remedy())
        }
    }
}

/// The problem of a mesh may be in its file or in its transform.
fn in_mesh(error: &InvalidScene, table: &Table<'_>) -> Fault {
    let what = |problem: &str| format!("{} {problem}", error.name());
    let source = table.get("faces").or_else(|| table.get("file"));
    let (span, label) = source.map_or_else(
        || (table.span.clone(), "this table".to_owned()),
        |source| source.place(),
    );
    let Some(property) = error.property() else {
        return Fault::new(what(error.problem()), error.remedy()).at(span, label);
    };
    match (property.key, property.index) {
        // Numbers written in the scene are checked when they are read.
        ("vertices", Some(index)) => {
            let what = what(&format!("has vertex {index} beyond 3.4e38 once it is transformed"));
            Fault::new(what, "make the scale or the translation smaller").at(span, label)
        }
        (_, Some(_)) => Fault::new(error.to_string(), error.remedy()).at(span, label),
        (_, None) => in_table(error, table),
    }
}
