//! Cases 21 to 24: invariance under scale and translation, and self-intersection.

use std::sync::Arc;

use glam::DVec3;

use super::bench::{self, ACCELS, SelftestError};
use super::row::{Check, Checks, Effort};
use crate::pipeline::Settings;
use crate::scene::{EstimatorKind, InvalidScene, Material, MaterialId, Mesh, Scene, Sphere};

const BODIES: [&str; 4] = ["plane", "sphere", "mesh", "far floor"];

/// Twelve scales, powers of ten.
const SCALES: [i32; 12] = [-6, -5, -4, -3, -2, -1, 0, 1, 2, 3, 4, 5];

/// Twelve offsets of scene and camera together, in units of the body's size.
const OFFSETS: [f64; 12] = [0.0, 0.1, 1.0, 3.0, 10.0, 100.0, 1e3, 1e4, 1e5, 2e5, 1e6, 1e7];

/// Twelve distances of the camera, in units of the body's size.
const DISTANCES: [f64; 12] = [1.5, 2.0, 2.5, 3.0, 4.0, 6.0, 10.0, 15.0, 20.0, 30.0, 50.0, 100.0];

/// Larger distances: rounding of the distance equals the thickness of the body at its silhouette, where a back face can be hit
/// first.
const FAR: [f64; 4] = [300.0, 1e3, 1e4, 5e4];

/// A material with albedo 1.
const WHITE: MaterialId = MaterialId::new(0);

/// A body of size 1 and albedo 1 at 0, seen from some distance, under radiance 1 from all directions: every sample of `brdf` is
/// exactly 1, unless the body shadows itself.
fn body(name: &str, distance: f64) -> Result<Scene, InvalidScene> {
    let toward = DVec3::new(0.48, 0.64, 0.6).normalize();
    let fov = (2.2 / distance).atan().to_degrees();
    let mut scene = bench::view(toward * distance, [0.0; 3], fov);
    scene.material(Material::diffuse("white", [1.0; 3]));
    scene.sphere(bench::light([0.0; 3], 1e5, 1.0));
    match name {
        "sphere" => _ = scene.sphere(Sphere::new([0.0; 3], 1.0, WHITE)),
        "mesh" => _ = scene.mesh(round_mesh(3)),
        // Its triangles extend a thousand times the viewing distance.
        "far floor" => {
            let (u, v) = (
                toward.any_orthonormal_vector(),
                toward.cross(toward.any_orthonormal_vector()),
            );
            let lean = (toward + 0.3 * u).normalize();
            let (a, b) = (lean.cross(v).normalize(), lean.cross(lean.cross(v)).normalize());
            scene.mesh(square(a * 1e3, b * 1e3));
        }
        _ => _ = scene.mesh(square(DVec3::X, DVec3::new(0.0, 0.6, -0.8))),
    }
    scene.build()
}

fn square(a: DVec3, b: DVec3) -> Mesh {
    Mesh::quadrilateral([-a - b, a - b, a + b, b - a], WHITE)
}

/// An octahedron with every triangle subdivided into four `times` times and its vertices on the unit sphere: convex and closed.
fn round_mesh(times: u32) -> Mesh {
    let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
    let mut triangles = Vec::new();
    for sign in [x, -x] {
        for [a, b] in [[y, z], [z, -y], [-y, -z], [-z, y]] {
            triangles.push([sign, a, b]);
        }
    }
    for _ in 0..times {
        triangles = triangles
            .iter()
            .flat_map(|&[a, b, c]| {
                let [ab, bc, ca] = [a + b, b + c, c + a].map(DVec3::normalize);
                [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            })
            .collect();
    }
    let vertices = triangles.concat();
    let faces = (0..triangles.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]);
    Mesh::new(vertices, faces.collect(), WHITE)
}

/// Number of pixels that are not exactly 1, over both intersectors.
fn acne(scene: &Scene, effort: Effort) -> Result<usize, SelftestError> {
    let mut lost = 0;
    for accel in ACCELS {
        let settings = Settings {
            accel: Some(accel),
            ..bench::settings(48, effort.of(48), EstimatorKind::Brdf)
        };
        let picture = bench::picture(scene, settings, 4)?;
        lost += picture.pixels.iter().filter(|p| p[1] != 1.0).count();
    }
    Ok(lost)
}

/// Number of pixels with self-shadowing, for a body scaled by powers of ten and moved by multiples of its size.
///
/// # Errors
/// Where the scene cannot be rendered.
pub fn moved_about(name: &str, scales: &[i32], offsets: &[f64], effort: Effort) -> Result<usize, SelftestError> {
    let (scene, mut lost) = (body(name, 4.0)?, 0);
    for scale in scales.iter().map(|&power| 10.0_f64.powi(power)) {
        for offset in offsets {
            let moved = bench::moved(&scene, scale, DVec3::new(1.0, 0.7, -0.3) * (offset * scale))?;
            lost += acne(&moved, effort)?;
        }
    }
    Ok(lost)
}

/// Case 24.
pub fn self_intersection(effort: Effort) -> Checks {
    let mut checks = Vec::new();
    for name in BODIES {
        let places = moved_about(name, &SCALES, &OFFSETS, effort)?;
        let (mut distances, mut far) = (0, 0);
        for distance in DISTANCES {
            distances += acne(&body(name, distance)?, effort)?;
        }
        for distance in FAR {
            far += acne(&body(name, distance)?, effort)?;
        }
        checks.push(Check::none(
            format!("{name}, 12 scales x 12 offsets: pixels with acne"),
            places,
        ));
        checks.push(Check::none(
            format!("{name}, 12 distances up to 100 sizes: pixels with acne"),
            distances,
        ));
        let all = FAR.len() * ACCELS.len() * 48 * effort.of(48) as usize;
        checks.push(Check::new(
            format!("{name}, 300 to 50000 sizes away: share of pixels, all on the outline"),
            far as f64 / all as f64,
            0.01,
        ));
    }
    Ok(checks)
}

/// Case 22.
pub fn far_away(_: Effort) -> Checks {
    let mut different = 0;
    for text in SCENES {
        let scene = exact(&bench::scene(text)?)?;
        for offset in [2e5_f64, 1e6, 3e7].map(|x| (x as i64 as f64) * DVec3::new(1.0, -2.0, 0.5)) {
            different += compared(&scene, &bench::moved(&scene, 1.0, offset)?)?;
        }
    }
    let room = closed_box(4.0)?;
    let mut leaks = 0;
    for offset in [0.0, 2e5, 1e6, 3e7] {
        leaks += lit_pixels(&bench::moved(&room, 1.0, DVec3::splat(offset))?)?;
    }
    Ok(vec![
        Check::none(
            "pixels whose bits change when two scenes move by 2e5, 1e6 and 3e7",
            different,
        ),
        Check::none("pixels lit inside of a closed box before a light, moved as far", leaks),
    ])
}

/// Case 23.
pub fn scaled(_: Effort) -> Checks {
    let mut checks = Vec::new();
    for powers in [[-20, -19], [-7, -1], [1, 8], [19, 20], [-30, 30]] {
        let mut different = 0;
        for text in SCENES {
            let scene = bench::scene(text)?;
            for power in powers {
                let moved = bench::moved(&scene, 2.0_f64.powi(power), DVec3::ZERO)?;
                different += compared(&scene, &moved)?;
            }
        }
        let [a, b] = powers;
        checks.push(Check::none(
            format!("two scenes 2^{a} and 2^{b} times as large: pixels whose bits change"),
            different,
        ));
    }
    Ok(checks)
}

/// Case 21.
pub fn touching(_: Effort) -> Checks {
    // A shell around the light, at a distance from it of 8 ulp of the light's distance.
    let gap = |distance: f64, ulps: f64| ulps * f64::from(f32::EPSILON) * distance;
    let (mut shell, mut wall) = (0, 0);
    for radius in [0.1, 0.5, 1.0] {
        let around = Sphere::new([0.0, 4.0, 0.0], radius + gap(4.0, 8.0), bench::PLATE);
        shell += lit_pixels(&bench::lit(&[bench::light([0.0, 4.0, 0.0], radius, 1.0), around])?)?;
    }
    // A wall that stands on the floor, with its lower edge on it and 8 ulp below; the light is behind it.
    for foot in [0.0, -8.0] {
        let y = gap(4.0, foot);
        let mut scene = bench::view([-3.0, 3.0, 0.0], [-0.01, 0.0, 0.0], 0.6);
        scene.material(Material::diffuse("white", [1.0; 3]));
        scene.mesh(square(DVec3::X * 5.0, DVec3::Z * 5.0));
        let corners = [[0.02, y, -5.0], [0.02, y, 5.0], [0.02, 9.0, 5.0], [0.02, 9.0, -5.0]];
        scene.mesh(Mesh::quadrilateral(corners, WHITE));
        scene.sphere(bench::light([3.0, 3.0, 0.0], 0.5, 1.0));
        wall += lit_pixels(&scene.build()?)?;
    }
    let mut inside = 0;
    for distance in [2.0, 10.0, 1000.0] {
        inside += lit_pixels(&closed_box(distance)?)?;
    }
    Ok(vec![
        Check::none("pixels that see a light through a shell 8 ulp around it", shell),
        Check::none(
            "pixels lit at the foot of a wall before a light, on the floor and 8 ulp below it",
            wall,
        ),
        Check::none("pixels lit inside of a closed box", inside),
    ])
}

/// Scenes without external files.
const SCENES: [&str; 2] = [
    include_str!("../../../scenes/veach-mis.toml"),
    include_str!("../../../scenes/large-lights.toml"),
];

/// The scene with all positions rounded to multiples of 2^-20, so moving it by 1e7 is exact.
fn exact(scene: &Scene) -> Result<Scene, InvalidScene> {
    let mut scene = scene.to_builder();
    let round = |place: &mut DVec3| *place = (*place * 1_048_576.0).round() / 1_048_576.0;
    scene.spheres.iter_mut().for_each(|sphere| round(&mut sphere.center));
    for mesh in &mut scene.meshes {
        Arc::make_mut(mesh).vertices.iter_mut().for_each(round);
    }
    round(&mut scene.camera.origin);
    round(&mut scene.camera.target);
    scene.build()
}

/// Pixels that differ in any bit, over estimators and intersectors.
fn compared(a: &Scene, b: &Scene) -> Result<usize, SelftestError> {
    let mut different = 0;
    for estimator in EstimatorKind::ALL {
        for accel in ACCELS {
            let settings = Settings {
                accel: Some(accel),
                ..bench::settings(48, 32, estimator)
            };
            different += bench::differences(&bench::picture(a, settings, 2)?, &bench::picture(b, settings, 2)?);
        }
    }
    Ok(different)
}

/// Pixels that are not black.
fn lit_pixels(scene: &Scene) -> Result<usize, SelftestError> {
    let mut lit = 0;
    for estimator in EstimatorKind::ALL {
        for accel in ACCELS {
            let settings = Settings {
                accel: Some(accel),
                ..bench::settings(64, 64, estimator)
            };
            lit += bench::picture(scene, settings, 16)?
                .pixels
                .iter()
                .filter(|p| **p != [0.0; 3])
                .count();
        }
    }
    Ok(lit)
}

/// The camera in a closed box of thin walls with shared edges, and a light outside at `distance` half sizes of the box.
fn closed_box(distance: f64) -> Result<Scene, InvalidScene> {
    let corner = |i: usize| DVec3::new([-1.0, 1.0][i & 1], [-1.0, 1.0][i >> 1 & 1], [-1.0, 1.0][i >> 2 & 1]);
    let mut scene = bench::view([-0.9, 0.3, -0.8], [0.5, -0.4, 0.3], 120.0);
    scene.material(Material::diffuse("white", [1.0; 3]));
    let triangles = BOX.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]);
    scene.mesh(Mesh::new((0..8).map(corner), triangles.collect(), WHITE));
    scene.sphere(bench::light(
        [distance * 0.8, distance * 0.5, distance * 0.4],
        0.3 * distance - 0.3,
        1.0,
    ));
    scene.build()
}

/// The faces of a box whose corner number `i` is at the upper end of axis `k` where bit `k` of `i` is set.
pub const BOX: [[u32; 4]; 6] = [
    [0, 1, 3, 2],
    [4, 5, 7, 6],
    [0, 1, 5, 4],
    [2, 3, 7, 6],
    [0, 2, 6, 4],
    [1, 3, 7, 5],
];
