//! Lists of lights against all lights.

use std::fmt::Write;
use std::path::Path;

use octolux::pipeline::Settings;
use octolux::scene::{Bsdf, EstimatorKind, Light, Mesh, SamplerKind, Scene, Surface};
use octolux::settings::LightsAsked;

use super::Family;
use super::runs::{Runs, names, rendered, settings};

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

/// The same, all polished: points walk down the tree of lights by themselves.
pub fn polished(spheres: u32, triangles: u32) -> Scene {
    let (rho, alpha) = (glam::DVec3::new(0.5, 0.4, 0.3), 30.0);
    of_one(spheres, triangles, Bsdf::Phong { rho, alpha })
}

/// The same, all diffuse: no point walks.
pub fn dull(spheres: u32, triangles: u32) -> Scene {
    let rho = glam::DVec3::splat(0.5);
    of_one(spheres, triangles, Bsdf::Diffuse { rho })
}

fn of_one(spheres: u32, triangles: u32, bsdf: Bsdf) -> Scene {
    let mut scene = scene(spheres, triangles).to_builder();
    scene.materials.iter_mut().for_each(|material| material.bsdf = bsdf);
    scene.build().expect("a scene")
}

/// The same under `bodies` tetrahedra that emit, of one mesh, and a dimmer one around all. Of some a face is turned or missing, so they have
/// no inner side. Lights are selected by the side that should be seen.
pub fn closed(bodies: u32) -> Scene {
    let unit = |i: u32| f64::from(octolux::sampling::hash::mix(i + 91) >> 8) / f64::from(1 << 24);
    let ends = [[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]].map(glam::DVec3::from);
    let faces = [[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]];
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for i in 0..bodies {
        let place = |k: u32| unit(8 * i + k);
        let middle = glam::DVec3::new(8.0 * place(0) - 4.0, 1.0 + 2.5 * place(1), 8.0 * place(2) - 5.5);
        let first = vertices.len() as u32;
        vertices.extend(ends.map(|end| middle + (0.05 + 0.15 * place(3)) * end));
        let mut faces = faces.map(|face| face.map(|k| first + k));
        match i % 4 {
            1 => faces.iter_mut().for_each(|face| face.swap(0, 1)),
            2 => faces[2].swap(0, 1),
            _ => {}
        }
        triangles.extend(&faces[usize::from(i % 4 == 3)..]);
    }
    let mut scene = scene(0, 0).to_builder();
    let emission = |le: f64| Surface::Emission(le * glam::DVec3::new(1.0, 1.0, 1.5));
    scene.mesh(Mesh::new(vertices, triangles, emission(10.0)));
    scene.mesh(Mesh::new(ends.map(|end| 60.0 * end), faces.to_vec(), emission(0.1)));
    scene.build().expect("a scene")
}

/// The same under `lamps` points and spots as well, above the balls, a quarter of them behind the wall; and a light from one direction,
/// which is in no list.
pub fn under_lamps(scene: &Scene, lamps: u32) -> Scene {
    let unit = |i: u32| f64::from(octolux::sampling::hash::mix(i + 90_001) >> 8) / f64::from(1 << 24);
    let mut scene = scene.to_builder();
    for i in 0..lamps {
        let u = |k: u32| unit(8 * i + k);
        if i == lamps / 2 {
            scene.lights.push(Light::directional([0.3, -1.0, -0.2], [0.02; 3], 0.0));
        }
        let z = if i % 4 == 0 { 3.1 * u(2) - 5.5 } else { 4.1 * u(2) - 1.6 };
        let position = glam::DVec3::new(8.0 * u(0) - 4.0, 1.9 + 1.2 * u(1), z);
        let power = 60.0 * 10.0_f64.powf(2.0 * u(3) - 2.0) / f64::from(lamps);
        let intensity = glam::DVec3::new(power, power * u(4), 0.5 * power);
        let target = position + glam::DVec3::new(u(5) - 0.5, -1.0, u(6) - 0.5);
        scene.lights.push(match i % 3 {
            0 => Light::spot(position, target, intensity, [30.0 * u(7), 45.0]),
            _ => Light::point(position, intensity),
        });
    }
    scene.build().expect("a scene")
}

/// Lists of a few lights, or walks of half as many, have the mean of all lights, in every estimator that draws a direction for lights, in
/// each part of the film.
pub fn agree(family: Family, scene: &Scene, length: u8, seeds: u32, passes: u32) {
    // `product` has the bits of `mis2-power`, by a test of its own.
    let others = |estimator: &EstimatorKind| estimator.per_light() && *estimator != EstimatorKind::Product;
    let others: Vec<_> = EstimatorKind::ALL.into_iter().filter(others).collect();
    agree_by(family, scene, &others, length, seeds, passes);
}

/// The same by these estimators.
pub fn agree_by(mut family: Family, scene: &Scene, by: &[EstimatorKind], length: u8, seeds: u32, passes: u32) {
    for &estimator in by {
        for sampler in SamplerKind::ALL {
            let base = Settings {
                sampler,
                ..settings(40, 24, estimator)
            };
            let asked = |lights: LightsAsked, first: u32, passes: u32| {
                Runs::new(scene, Settings { lights, ..base }, passes, first, seeds).estimates(4, 2)
            };
            let lists = asked(LightsAsked::List(length), 1, passes);
            let all = asked(LightsAsked::All, 10_001, (passes / 2).max(1));
            for ((x, y), name) in lists.iter().zip(&all).zip(names(4, 2)) {
                let what = format!("{} {} lists of {length} {name}", estimator.name(), sampler.name());
                family.add(x.p(*y, 1e-5), format!("{what}: {}", x.against(*y)));
            }
        }
    }
    family.judge();
}

/// The noise of lists of one light is that of the lists. So the two colors of a tile, the groups of a color, and passes, would show that
/// they share lists: the noise of colors is not correlated, that of groups is not alike, and the variance of 16 passes is far below
/// that of one.
///
/// Colors are compared in pass 16, counted from 0, the first with one list for all pixels of a color: before, the lists of the groups are
/// stratified, and the mean of a tile has little of their noise. Of 60 seeds of 15 tiles the correlation of independent noise has a standard deviation of about `1 / sqrt(15 59) = 0.034`, some
/// times that for its long tails; it is 1 with one list. Diagonal neighbors inside a square of 4 x 4 pixels never are of one group:
/// their correlation is far from that of points with one list as well. The ratio of a pixel's variances is about 1 if all passes share a list and about 16
/// if they share none (the mean of a tile has less to gain, since in one pass it has many lists already). The seeds are fixed, so the bounds hold always or never.
pub fn apart() {
    const SEEDS: usize = 60;
    let scene = scene(200, 0);
    let base = Settings {
        lights: LightsAsked::List(1),
        ..settings(80, 48, EstimatorKind::Light)
    };
    let render = |seed: usize, passes: u32| {
        let seed = seed as u32 + 1;
        rendered(&scene, Settings { seed, ..base }, passes).picture()
    };
    let tiles = |seed: usize| -> Vec<[f64; 2]> {
        let [before, after] = [16, 17].map(|passes| render(seed, passes).pixels);
        let sum = |pixel: [f32; 3]| f64::from(pixel.iter().sum::<f32>());
        let mut sums = vec![[0.0; 2]; 15];
        for y in 0..48 {
            for x in 0..80 {
                let at = 80 * y + x;
                sums[y / 16 * 5 + x / 16][(x ^ y) & 1] += 17.0 * sum(after[at]) - 16.0 * sum(before[at]);
            }
        }
        sums
    };
    let noise = || -> Vec<[f64; 2]> {
        let all: Vec<Vec<[f64; 2]>> = (0..SEEDS).map(tiles).collect();
        let mut noise = Vec::new();
        for tile in 0..15 {
            let mean = |colour: usize| all.iter().map(|sums| sums[tile][colour]).sum::<f64>() / SEEDS as f64;
            let means = [mean(0), mean(1)];
            let both = means[0] + means[1];
            noise.extend(all.iter().map(|sums| [0, 1].map(|k| (sums[tile][k] - means[k]) / both)));
        }
        noise
    };
    let one = noise();
    let product = |i: usize, j: usize, of: &[[f64; 2]]| of.iter().map(|pair| pair[i] * pair[j]).sum::<f64>();
    let correlation = product(0, 1, &one) / (product(0, 0, &one) * product(1, 1, &one)).sqrt();
    assert!(
        correlation.abs() < 0.25,
        "the colors of a tile share lists: correlation {correlation}"
    );
    let pairs = |passes: u32| -> Vec<[f64; 2]> {
        let square = |seed: usize| -> Vec<[f64; 2]> {
            let picture = render(seed, passes);
            let pixel = |x: usize, y: usize| f64::from(picture.pixels[80 * y + x].iter().sum::<f32>());
            let corners = (0..240).map(|i| (i % 20 * 4, i / 20 * 4));
            corners
                .map(|(x, y)| [pixel(x + 1, y + 1), pixel(x + 2, y + 2)])
                .collect()
        };
        let all: Vec<Vec<[f64; 2]>> = (0..SEEDS).map(square).collect();
        let mut pairs = Vec::new();
        for at in 0..240 {
            let mean = [0, 1].map(|k| all.iter().map(|seed| seed[at][k]).sum::<f64>() / SEEDS as f64);
            let scale = mean[0] + mean[1];
            if scale > 0.0 {
                // Rare picks of lights that no probe saw do not decide.
                let noise = |seed: &Vec<[f64; 2]>| [0, 1].map(|k| ((seed[at][k] - mean[k]) / scale).min(1.0));
                pairs.extend(all.iter().map(noise));
            }
        }
        pairs
    };
    let pairs_of_one = pairs(1);
    let alike = product(0, 1, &pairs_of_one) / (product(0, 0, &pairs_of_one) * product(1, 1, &pairs_of_one)).sqrt();
    assert!(alike < 0.25, "groups of a color share lists: correlation {alike}");
    let ratio = product(0, 0, &pairs_of_one) / product(0, 0, &pairs(16));
    assert!(
        ratio > 4.0,
        "passes share lists: 16 have 1/{ratio} of the variance of one"
    );
}
