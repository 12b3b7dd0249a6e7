//! Mistakes in a scene that is syntactically valid.

use super::lights;
use super::row::{Row, Verdict};
use crate::scene::{Bsdf, Scene, Surface};

/// Maximum number of names listed in a sentence.
const NAMED: usize = 3;

/// Below this exponent Phong's model rounds to the diffuse one in single precision.
const LEAST_EXPONENT: f64 = 1.000_000_1;

/// Runs all checks that only need the scene.
pub fn check(scene: &Scene) -> Vec<Row> {
    let mut rows = vec![
        energy(scene),
        exponents(scene),
        lights::lights(scene),
        lights::overlaps(scene),
        lights::inside_out(scene),
    ];
    rows.extend(unused(scene));
    let row = |note: &String| Row::pass("scene", "reading").judged(Verdict::Note, note.clone());
    rows.extend(scene.notes().iter().map(row));
    rows
}

/// "a, b, c and 4 more".
pub fn list(names: &[String]) -> String {
    let shown = names.iter().take(NAMED).cloned().collect::<Vec<_>>().join(", ");
    match names.len().saturating_sub(NAMED) {
        0 => shown,
        more => format!("{shown} and {more} more"),
    }
}

/// "1 light", "2 lights", "2 meshes".
pub fn plural(count: usize, noun: &str) -> String {
    let ending = match noun.ends_with(['s', 'h']) {
        _ if count == 1 => "",
        true => "es",
        false => "s",
    };
    format!("{count} {noun}{ending}")
}

fn used(scene: &Scene) -> Vec<bool> {
    let mut used = vec![false; scene.materials().len()];
    let surfaces = scene
        .spheres()
        .iter()
        .map(|s| s.surface)
        .chain(scene.meshes().iter().map(|m| m.surface));
    for surface in surfaces {
        if let Surface::Material(id) = surface {
            used[id.index()] = true;
        }
    }
    used
}

fn energy(scene: &Scene) -> Row {
    let rho = Bsdf::largest;
    let most = scene
        .materials()
        .iter()
        .map(|material| rho(&material.bsdf))
        .fold(0.0, f64::max);
    let gains = scene
        .materials()
        .iter()
        .zip(used(scene))
        .filter(|(material, _)| rho(&material.bsdf) > 1.0);
    let names: Vec<String> = gains
        .clone()
        .map(|(material, _)| format!("\"{}\" ({})", material.name, rho(&material.bsdf)))
        .collect();
    let row = Row::pass("energy", plural(scene.materials().len(), "material"))
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
    let flat = scene.materials().iter().filter(|material| match material.bsdf {
        Bsdf::Phong { alpha, .. } | Bsdf::Blend { alpha, .. } => alpha < LEAST_EXPONENT,
        Bsdf::Diffuse { .. } | Bsdf::Ggx { .. } | Bsdf::Conductor { .. } => false,
    });
    let names: Vec<String> = flat.map(|material| format!("\"{}\"", material.name)).collect();
    let row = Row::pass("exponents", plural(scene.materials().len(), "material"))
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

fn unused(scene: &Scene) -> Option<Row> {
    let names: Vec<String> = scene
        .materials()
        .iter()
        .zip(used(scene))
        .filter(|(_, used)| !used)
        .map(|(material, _)| format!("\"{}\"", material.name))
        .collect();
    let row = Row::pass("materials", plural(scene.materials().len(), "material"));
    (!names.is_empty()).then(|| {
        row.figures(format!("{} unused", names.len()), "")
            .judged(Verdict::Note, format!("no shape uses material {}", list(&names)))
    })
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::scene::{Camera, FilmSize, Fov, Material, MaterialId, Sphere};

    fn sphere(x: f64, radius: f64, surface: impl Into<Surface>) -> Sphere {
        Sphere::new([x, 0.0, 0.0], radius, surface)
    }

    /// The camera is at z = 10.
    fn scene(spheres: Vec<Sphere>) -> Scene {
        let camera = Camera::new([0.0, 0.0, 10.0], [0.0; 3], Fov::X(40.0));
        let mut scene = Scene::builder(camera, FilmSize { width: 4, height: 4 });
        scene.material(Material::diffuse("grey", [0.5; 3]));
        scene.material(Material::phong("hot", [0.1, 1.1, 0.1], 1.000_000_01));
        scene.spheres = spheres;
        scene.build().unwrap()
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
        let (grey, hot) = (MaterialId::new(0), MaterialId::new(1));
        let glow = Surface::emission([1.0; 3]);
        let sound = || vec![sphere(0.0, 1.0, grey), sphere(5.0, 1.0, glow)];
        let with = |more: Sphere| [sound(), vec![more]].concat();
        expect(sound(), "inside out", Pass, "");
        expect(sound(), "energy", Warn, "\"hot\" (1.1)");
        expect(sound(), "materials", Note, "\"hot\"");
        expect(with(sphere(0.0, 1.0, grey)), "scene", Note, "1 of 3 spheres coincide");
        expect(sound(), "exponents", Warn, "\"hot\"");
        expect(with(sphere(-5.0, 1.0, hot)), "energy", Fail, "\"hot\" (1.1)");
        expect(sound()[..1].to_vec(), "lights", Warn, "black");
        expect(
            with(sphere(-5.0, 1.0, Surface::Emission(DVec3::ZERO))),
            "lights",
            Warn,
            "sphere 3",
        );
        expect(with(sphere(6.5, 1.0, glow)), "lights overlap", Warn, "sphere 2 and 3");
        expect(
            with(sphere(5.0, 0.2, glow)),
            "inside out",
            Warn,
            "sphere 2 has sphere 3 inside",
        );
        expect(
            with(sphere(5.0, 0.2, grey)),
            "inside out",
            Warn,
            "sphere 2 has sphere 3 inside",
        );
        expect(
            with(sphere(5.0, 2.0, grey)),
            "inside out",
            Warn,
            "sphere 2 is closed in by sphere 3",
        );
        expect(with(sphere(0.0, 12.0, grey)), "inside out", Pass, "");
        let half_around = [with(sphere(10.0, 14.5, glow)), vec![sphere(60.0, 1.0, grey)]].concat();
        expect(half_around, "inside out", Note, "the camera is inside sphere 3");
        expect(with(sphere(0.0, 50.0, glow)), "inside out", Note, "dome");
    }
}
