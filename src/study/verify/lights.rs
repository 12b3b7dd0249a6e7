//! Checks of the lights of a scene.

use glam::DVec3;

use super::row::{Row, Verdict};
use super::sanity::{list, plural};
use crate::scene::{Scene, Sphere, Surface};

/// Emitters in the oracle's order: spheres, meshes, the environment, then lights without shape; each with a name and its
/// radiance, intensity or irradiance.
pub fn emitters(scene: &Scene) -> Vec<(String, DVec3)> {
    let spheres = scene
        .spheres()
        .iter()
        .enumerate()
        .map(|(i, s)| (sphere_name(i), s.surface));
    let meshes = scene
        .meshes()
        .iter()
        .enumerate()
        .map(|(i, m)| (mesh_name(i), m.surface));
    let emission = |(name, surface)| match surface {
        Surface::Emission(le) => Some((name, le)),
        Surface::Material(_) => None,
    };
    let sky = scene
        .environment()
        .map(|sky| ("the environment".to_owned(), sky.brightest()));
    let lights = scene.lights().iter().enumerate();
    let lights = lights.map(|(i, light)| (format!("light {}", i + 1), light.power()));
    spheres
        .chain(meshes)
        .filter_map(emission)
        .chain(sky)
        .chain(lights)
        .collect()
}

/// Lights without any reflection seen by the oracle.
pub fn reach(scene: &Scene, lights_nothing: &[bool]) -> Row {
    let all = emitters(scene);
    let dark = all
        .iter()
        .zip(lights_nothing)
        .filter(|((_, le), dark)| **dark && le.max_element() > 0.0);
    let names: Vec<String> = dark.map(|((name, _), _)| name.clone()).collect();
    let row = Row::pass("lights reach", plural(all.len(), "emitter"))
        .figures(format!("{} of no effect", names.len()), "0")
        .number("count", names.len() as f64);
    if names.is_empty() {
        return row;
    }
    let what = format!(
        "{}: no light of it was found on anything that the camera sees; is it walled in, far away or behind?",
        list(&names)
    );
    row.judged(Verdict::Warn, what)
}

/// The name of a sphere, counted from 1 as in the file.
pub fn sphere_name(index: usize) -> String {
    format!("sphere {}", index + 1)
}

/// The name of a mesh, counted from 1 as in the file.
pub fn mesh_name(index: usize) -> String {
    format!("mesh {}", index + 1)
}

/// Lights without power, or no lights.
pub fn lights(scene: &Scene) -> Row {
    let all = emitters(scene);
    let dark: Vec<String> = all
        .iter()
        .filter(|(_, le)| le.max_element() == 0.0)
        .map(|(name, _)| name.clone())
        .collect();
    let row = Row::pass("lights", plural(all.len(), "emitter"))
        .figures(format!("{} without power", dark.len()), "0")
        .number("emitters", all.len() as f64)
        .number("without_power", dark.len() as f64);
    if dark.len() == all.len() {
        return row.judged(
            Verdict::Warn,
            "nothing emits light, so the picture is black, and all means are 0: they say that no light comes from nowhere, and \
             nothing else",
        );
    }
    if dark.is_empty() {
        return row;
    }
    row.judged(
        Verdict::Warn,
        format!("{}: an emission of 0 makes a black body, no light", list(&dark)),
    )
}

/// Emitting spheres with their indices.
fn glowing(scene: &Scene) -> impl Iterator<Item = (usize, &Sphere)> {
    let emits = |sphere: &Sphere| matches!(sphere.surface, Surface::Emission(le) if le.max_element() > 0.0);
    scene
        .spheres()
        .iter()
        .enumerate()
        .filter(move |(_, sphere)| emits(sphere))
}

/// Emitting spheres that intersect each other.
pub fn overlaps(scene: &Scene) -> Row {
    let mut spheres: Vec<(usize, &Sphere)> = glowing(scene).collect();
    let left = |sphere: &Sphere| sphere.center.x - sphere.radius;
    spheres.sort_by(|a, b| left(a.1).total_cmp(&left(b.1)));
    let mut pairs = Vec::new();
    for (at, (i, a)) in spheres.iter().enumerate() {
        let near = spheres[at + 1..]
            .iter()
            .take_while(|(_, b)| left(b) < a.center.x + a.radius);
        for (j, b) in near {
            let apart = a.center.distance(b.center);
            if apart < a.radius + b.radius && apart + a.radius.min(b.radius) > a.radius.max(b.radius) {
                pairs.push(format!("{} and {}", sphere_name(*i.min(j)), i.max(j) + 1));
            }
        }
    }
    let row = Row::pass("lights overlap", plural(spheres.len(), "emitting sphere"))
        .figures(plural(pairs.len(), "pair"), "0")
        .number("pairs", pairs.len() as f64);
    if pairs.is_empty() {
        return row;
    }
    row.judged(
        Verdict::Warn,
        format!(
            "{} cut through each other: each shadows a part of the other",
            list(&pairs)
        ),
    )
}

/// An emitter that encloses what it should light, or a wall that encloses an emitter: probably a mistake, but the picture is
/// right, so only a warning. A dome around the camera is only noted.
pub fn inside_out(scene: &Scene) -> Row {
    let camera = scene.camera().origin;
    let holds = |sphere: &Sphere, point: DVec3| sphere.center.distance(point) < sphere.radius;
    let around = |outer: &Sphere, inner: &Sphere| {
        outer.center.distance(inner.center) + inner.radius <= outer.radius && outer.radius > inner.radius
    };
    let reflects = |surface: &Surface| matches!(surface, Surface::Material(_));
    let (mut wrong, mut domes) = (Vec::new(), Vec::new());
    for (i, sphere) in glowing(scene) {
        let mut held = Vec::new();
        let mut outside = 0;
        for (j, other) in scene.spheres().iter().enumerate().filter(|(j, _)| *j != i) {
            if around(sphere, other) {
                held.push(sphere_name(j));
            } else {
                outside += usize::from(reflects(&other.surface));
            }
            if reflects(&other.surface) && around(other, sphere) && !holds(other, camera) {
                wrong.push(format!("{} is closed in by {}", sphere_name(i), sphere_name(j)));
            }
        }
        for (j, mesh) in scene.meshes().iter().enumerate() {
            if mesh.vertices.iter().all(|&vertex| holds(sphere, vertex)) {
                held.push(mesh_name(j));
            } else {
                outside += usize::from(reflects(&mesh.surface));
            }
        }
        match (holds(sphere, camera), held.is_empty(), outside) {
            (true, _, 0) => domes.push(format!("{} is a dome: camera and scene are inside", sphere_name(i))),
            (true, _, outside) => domes.push(format!(
                "the camera is inside {}, which hides {} outside",
                sphere_name(i),
                plural(outside, "shape")
            )),
            (false, false, _) => wrong.push(format!(
                "{} has {} inside, which is not seen",
                sphere_name(i),
                list(&held)
            )),
            (false, true, _) => {}
        }
    }
    let row = Row::pass("inside out", plural(glowing(scene).count(), "emitting sphere"))
        .figures(plural(wrong.len(), "case"), "0")
        .number("cases", wrong.len() as f64)
        .number("domes", domes.len() as f64);
    if !wrong.is_empty() {
        return row.judged(
            Verdict::Warn,
            format!(
                "an emitter is inside out: {}; if it is not meant so, check centre and radius",
                list(&wrong)
            ),
        );
    }
    if domes.is_empty() {
        return row;
    }
    row.judged(Verdict::Note, list(&domes))
}
