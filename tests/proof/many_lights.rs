//! Lists of lights against all lights.

use std::fmt::Write;
use std::path::Path;

use octolux::pipeline::Settings;
use octolux::scene::{EstimatorKind, SamplerKind, Scene};
use octolux::settings::LightsAsked;

use super::Family;
use super::runs::{Runs, names, settings};

/// A floor, a wall with a hole in it, a dull ball, a polished ball and a blend, under `spheres` small lights on both sides of the wall and
/// a mesh of `triangles` triangles that emits.
pub fn scene(spheres: u32, triangles: u32) -> Scene {
    let unit = |i: u32| f64::from(octolux::sampling::hash::mix(i + 17) >> 8) / f64::from(1 << 24);
    let mut text = String::from(
        r#"
[camera]
origin = [0.0, 2.0, 7.0]
target = [0.0, 0.5, 0.0]
up = [0.0, 1.0, 0.0]
fov_x = 50.0
[film]
width = 40
height = 24
[materials.grey]
diffuse = [0.5, 0.4, 0.3]
[materials.polished]
phong = [0.3, 0.6, 0.5]
exponent = 60.0
[materials.coat]
diffuse = [0.3, 0.2, 0.2]
phong = [0.3, 0.3, 0.3]
exponent = 20.0
[[meshes]]
material = "grey"
vertices = [[-9, 0, 9], [9, 0, 9], [9, 0, -9], [-9, 0, -9], [-9, 0, -2], [-0.1, 0, -2], [-0.1, 5, -2], [-9, 5, -2], [0.2, 0, -2], [9, 0, -2], [9, 5, -2], [0.2, 5, -2]]
faces = [[0, 1, 2, 3], [4, 5, 6, 7], [8, 9, 10, 11]]
[[spheres]]
center = [-1.2, 0.8, 0.0]
radius = 0.8
material = "polished"
[[spheres]]
center = [1.2, 0.8, 0.0]
radius = 0.8
material = "grey"
[[spheres]]
center = [0.0, 0.5, 1.2]
radius = 0.5
material = "coat"
"#,
    );
    for i in 0..spheres {
        let [x, y, z] = [
            8.0 * unit(8 * i) - 4.0,
            0.5 + 2.5 * unit(8 * i + 1),
            8.0 * unit(8 * i + 2) - 5.5,
        ];
        let (radius, power) = (0.03 + 0.1 * unit(8 * i + 3), 10.0_f64.powf(2.0 * unit(8 * i + 4) - 2.0));
        let le = 30.0 * power / (f64::from(spheres) * radius * radius);
        let colour = [le, le * unit(8 * i + 5), 0.5 * le]
            .map(|x| format!("{x:.4}"))
            .join(", ");
        let _ = writeln!(
            text,
            "[[spheres]]\ncenter = [{x:.4}, {y:.4}, {z:.4}]\nradius = {radius:.4}\nemission = [{colour}]"
        );
    }
    if triangles > 0 {
        // A strip that winds upward on the right.
        let (mut vertices, mut faces) = (String::new(), String::new());
        for i in 0..triangles + 2 {
            let (turn, up) = (f64::from(i / 2) * 0.7, 1.0 + 1.8 * f64::from(i) / f64::from(triangles));
            let (x, z) = (3.2 + 0.5 * turn.cos(), 0.5 * turn.sin());
            let _ = write!(vertices, "[{x:.4}, {:.4}, {z:.4}], ", up + 0.3 * f64::from(i % 2));
        }
        for i in 0..triangles {
            let _ = write!(faces, "[{i}, {}, {}], ", i + 1, i + 2);
        }
        let _ = writeln!(
            text,
            "[[meshes]]\nemission = [2.0, 2.0, 3.0]\nvertices = [{vertices}]\nfaces = [{faces}]"
        );
    }
    Scene::parse(&text, Path::new("many-lights.toml")).unwrap_or_else(|error| panic!("{error}"))
}

/// Lists of a few lights have the mean of all lights, in every estimator that draws a direction for lights, in each part of the film.
pub fn agree(mut family: Family, (spheres, triangles): (u32, u32), length: u8, seeds: u32, passes: u32) {
    let scene = scene(spheres, triangles);
    for estimator in EstimatorKind::ALL.into_iter().filter(|estimator| estimator.per_light()) {
        for sampler in SamplerKind::ALL {
            let base = Settings {
                sampler,
                ..settings(40, 24, estimator)
            };
            let asked = |lights: LightsAsked, first: u32, passes: u32| {
                Runs::new(&scene, Settings { lights, ..base }, passes, first, seeds).estimates(4, 2)
            };
            let lists = asked(LightsAsked::List(length), 1, passes);
            let all = asked(LightsAsked::All, 10_001, (passes / 2).max(1));
            for ((x, y), name) in lists.iter().zip(&all).zip(names(4, 2)) {
                let what = format!(
                    "{} {} {length} of {spheres} + {triangles} {name}",
                    estimator.name(),
                    sampler.name()
                );
                family.add(x.p(*y, 1e-5), format!("{what}: {}", x.against(*y)));
            }
        }
    }
    family.judge();
}
