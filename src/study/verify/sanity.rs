//! What can be wrong with a scene that is well formed.

use glam::DVec3;

use super::row::{Row, Verdict};
use crate::scene::{Bsdf, Scene, Sphere, Surface};

/// Names at most so many culprits in a sentence.
const NAMED: usize = 3;

/// Below this exponent Phong's model rounds to the diffuse one in single precision.
const LEAST_EXPONENT: f64 = 1.000_000_1;

/// Every check of the scene alone.
pub fn check(scene: &Scene) -> Vec<Row> {
    let mut rows = vec![
        energy(scene),
        exponents(scene),
        lights(scene),
        overlaps(scene),
        inside_out(scene),
    ];
    rows.extend(unused(scene));
    let row = |note: &String| Row::pass("scene", "reading").judged(Verdict::Note, note.clone());
    rows.extend(scene.notes.iter().map(row));
    rows
}

/// Emitters as the oracle numbers them: spheres, then meshes; with a name and the radiance.
pub fn emitters(scene: &Scene) -> Vec<(String, DVec3)> {
    let spheres = scene
        .spheres
        .iter()
        .enumerate()
        .map(|(i, s)| (sphere_name(i), s.surface));
    let meshes = scene.meshes.iter().enumerate().map(|(i, m)| (mesh_name(i), m.surface));
    let emission = |(name, surface)| match surface {
        Surface::Emission(le) => Some((name, le)),
        Surface::Material(_) => None,
    };
    spheres.chain(meshes).filter_map(emission).collect()
}

/// Lights that the oracle saw no reflection of.
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

/// "a, b, c and 4 more".
pub fn list(names: &[String]) -> String {
    let shown = names.iter().take(NAMED).cloned().collect::<Vec<_>>().join(", ");
    match names.len().saturating_sub(NAMED) {
        0 => shown,
        more => format!("{shown} and {more} more"),
    }
}

/// As the file counts them, from 1.
fn sphere_name(index: usize) -> String {
    format!("sphere {}", index + 1)
}

fn mesh_name(index: usize) -> String {
    format!("mesh {}", index + 1)
}

fn plural(count: usize, noun: &str) -> String {
    format!("{count} {noun}{}", if count == 1 { "" } else { "s" })
}

fn used(scene: &Scene) -> Vec<bool> {
    let mut used = vec![false; scene.materials.len()];
    let surfaces = scene
        .spheres
        .iter()
        .map(|s| s.surface)
        .chain(scene.meshes.iter().map(|m| m.surface));
    for surface in surfaces {
        if let Surface::Material(index) = surface {
            used[index] = true;
        }
    }
    used
}

fn energy(scene: &Scene) -> Row {
    let rho = |bsdf: &Bsdf| match *bsdf {
        Bsdf::Diffuse { rho } | Bsdf::Phong { rho, .. } => rho.max_element(),
    };
    let most = scene
        .materials
        .iter()
        .map(|material| rho(&material.bsdf))
        .fold(0.0, f64::max);
    let gains = scene
        .materials
        .iter()
        .zip(used(scene))
        .filter(|(material, _)| rho(&material.bsdf) > 1.0);
    let names: Vec<String> = gains
        .clone()
        .map(|(material, _)| format!("\"{}\" ({})", material.name, rho(&material.bsdf)))
        .collect();
    let row = Row::pass("energy", plural(scene.materials.len(), "material"))
        .figures(format!("reflectance up to {most:.4}"), "1")
        .number("largest_reflectance", most);
    let verdict = match (names.is_empty(), gains.clone().any(|(_, used)| used)) {
        (true, _) => return row,
        (false, true) => Verdict::Fail,
        (false, false) => Verdict::Warn,
    };
    row.judged(
        verdict,
        format!(
            "material {} reflects more light than it gets: keep it at or below 1",
            list(&names)
        ),
    )
}

fn exponents(scene: &Scene) -> Row {
    let flat = scene.materials.iter().filter(|material| match material.bsdf {
        Bsdf::Phong { alpha, .. } => alpha < LEAST_EXPONENT,
        Bsdf::Diffuse { .. } => false,
    });
    let names: Vec<String> = flat.map(|material| format!("\"{}\"", material.name)).collect();
    let row = Row::pass("exponents", plural(scene.materials.len(), "material"))
        .figures(format!("{} next to 1", names.len()), "0");
    if names.is_empty() {
        return row;
    }
    let what = format!(
        "material {}: single precision cannot tell its exponent from 1; write 1.001 or more",
        list(&names)
    );
    row.judged(Verdict::Warn, what)
}

fn lights(scene: &Scene) -> Row {
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
            Verdict::Fail,
            "nothing emits light, so the picture is black: give a shape an emission above 0",
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

/// Emitting spheres with their numbers.
fn glowing(scene: &Scene) -> impl Iterator<Item = (usize, &Sphere)> {
    let emits = |sphere: &Sphere| matches!(sphere.surface, Surface::Emission(le) if le.max_element() > 0.0);
    scene
        .spheres
        .iter()
        .enumerate()
        .filter(move |(_, sphere)| emits(sphere))
}

fn overlaps(scene: &Scene) -> Row {
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

/// An emitter around what it should light, or a wall around an emitter. A dome around everything is allowed.
fn inside_out(scene: &Scene) -> Row {
    let camera = scene.camera.origin;
    let holds = |sphere: &Sphere, point: DVec3| sphere.center.distance(point) < sphere.radius;
    let around = |outer: &Sphere, inner: &Sphere| {
        outer.center.distance(inner.center) + inner.radius <= outer.radius && outer.radius > inner.radius
    };
    let reflects = |surface: &Surface| matches!(surface, Surface::Material(_));
    let (mut wrong, mut domes) = (Vec::new(), Vec::new());
    for (i, sphere) in glowing(scene) {
        let mut held = Vec::new();
        let mut outside = 0;
        for (j, other) in scene.spheres.iter().enumerate().filter(|(j, _)| *j != i) {
            if around(sphere, other) {
                held.push(sphere_name(j));
            } else {
                outside += usize::from(reflects(&other.surface));
            }
            if reflects(&other.surface) && around(other, sphere) && !holds(other, camera) {
                wrong.push(format!("{} is closed in by {}", sphere_name(i), sphere_name(j)));
            }
        }
        for (j, mesh) in scene.meshes.iter().enumerate() {
            if mesh.vertices.iter().all(|&vertex| holds(sphere, vertex)) {
                held.push(mesh_name(j));
            } else {
                outside += usize::from(reflects(&mesh.surface));
            }
        }
        match (holds(sphere, camera), held.is_empty(), outside) {
            (true, _, 0) => domes.push(sphere_name(i)),
            (true, _, _) => wrong.push(format!("the camera is inside {}", sphere_name(i))),
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
            Verdict::Fail,
            format!("an emitter is inside out: {}; check centre and radius", list(&wrong)),
        );
    }
    if domes.is_empty() {
        return row;
    }
    row.judged(
        Verdict::Note,
        format!("{} is a dome: camera and scene are inside", list(&domes)),
    )
}

fn unused(scene: &Scene) -> Option<Row> {
    let names: Vec<String> = scene
        .materials
        .iter()
        .zip(used(scene))
        .filter(|(_, used)| !used)
        .map(|(material, _)| format!("\"{}\"", material.name))
        .collect();
    let row = Row::pass("materials", plural(scene.materials.len(), "material"));
    (!names.is_empty()).then(|| {
        row.figures(format!("{} unused", names.len()), "")
            .judged(Verdict::Note, format!("no shape uses material {}", list(&names)))
    })
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use super::*;
    use crate::scene::{Camera, FilmSize, Fov, Material, RenderTable};

    const GLOW: Surface = Surface::Emission(DVec3::ONE);

    fn sphere(x: f64, radius: f64, surface: Surface) -> Sphere {
        let center = DVec3::new(x, 0.0, 0.0);
        Sphere {
            center,
            radius,
            surface,
        }
    }

    /// The camera is at z = 10.
    fn scene(spheres: Vec<Sphere>) -> Scene {
        Scene {
            name: "test".into(),
            path: PathBuf::from("test.toml"),
            camera: Camera {
                origin: DVec3::Z * 10.0,
                target: DVec3::ZERO,
                up: DVec3::Y,
                fov: Fov::X(40.0),
            },
            film: FilmSize { width: 4, height: 4 },
            render: RenderTable::default(),
            materials: vec![
                Material {
                    name: "grey".into(),
                    bsdf: Bsdf::Diffuse { rho: DVec3::splat(0.5) },
                },
                Material {
                    name: "hot".into(),
                    bsdf: Bsdf::Phong {
                        rho: DVec3::new(0.1, 1.1, 0.1),
                        alpha: 1.000_000_01,
                    },
                },
            ],
            spheres,
            meshes: Vec::new(),
            notes: vec!["a note".into()],
        }
    }

    #[track_caller]
    fn expect(spheres: Vec<Sphere>, check_name: &str, verdict: Verdict, words: &str) {
        let rows = check(&scene(spheres));
        let row = rows.iter().find(|row| row.check == check_name).unwrap();
        assert!(row.verdict == verdict && row.sentence.contains(words), "{row:?}");
    }

    #[test]
    fn each_fault_is_found_and_named() {
        use Verdict::{Fail, Note, Pass, Warn};
        let (grey, hot) = (Surface::Material(0), Surface::Material(1));
        let sound = || vec![sphere(0.0, 1.0, grey), sphere(5.0, 1.0, GLOW)];
        let with = |more: Sphere| [sound(), vec![more]].concat();
        expect(sound(), "inside out", Pass, "");
        expect(sound(), "energy", Warn, "\"hot\" (1.1)");
        expect(sound(), "materials", Note, "\"hot\"");
        expect(sound(), "scene", Note, "a note");
        expect(sound(), "exponents", Warn, "\"hot\"");
        expect(with(sphere(-5.0, 1.0, hot)), "energy", Fail, "\"hot\" (1.1)");
        expect(sound()[..1].to_vec(), "lights", Fail, "black");
        expect(
            with(sphere(-5.0, 1.0, Surface::Emission(DVec3::ZERO))),
            "lights",
            Warn,
            "sphere 3",
        );
        expect(with(sphere(6.5, 1.0, GLOW)), "lights overlap", Warn, "sphere 2 and 3");
        expect(
            with(sphere(5.0, 0.2, GLOW)),
            "inside out",
            Fail,
            "sphere 2 has sphere 3 inside",
        );
        expect(
            with(sphere(5.0, 0.2, grey)),
            "inside out",
            Fail,
            "sphere 2 has sphere 3 inside",
        );
        expect(
            with(sphere(5.0, 2.0, grey)),
            "inside out",
            Fail,
            "sphere 2 is closed in by sphere 3",
        );
        expect(with(sphere(0.0, 12.0, grey)), "inside out", Pass, "");
        let half_around = [with(sphere(10.0, 14.5, GLOW)), vec![sphere(60.0, 1.0, grey)]].concat();
        expect(half_around, "inside out", Fail, "the camera is inside sphere 3");
        expect(with(sphere(0.0, 50.0, GLOW)), "inside out", Note, "dome");
    }
}
