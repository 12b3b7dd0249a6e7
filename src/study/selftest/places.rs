//! Rows 21 to 24: where a scene is and how large must not matter, and no surface shadows itself.

use glam::DVec3;

use super::bench::{self, ACCELS, Trouble};
use super::row::{Check, Checks, Effort};
use crate::pipeline::Settings;
use crate::scene::{EstimatorKind, Scene};

/// A body of albedo 1 in a light of radiance 1 all around: every sample of `brdf` is exactly 1, unless the body shadows itself.
const FURNACE: &str = "[materials.white]\ndiffuse = [1, 1, 1]\n[[spheres]]\ncenter = [0, 0, 0]\nradius = 1e5\n\
                       emission = [1, 1, 1]\n";

const BODIES: [&str; 4] = ["plane", "sphere", "mesh", "far floor"];

/// Twelve scales, powers of ten.
const SCALES: [i32; 12] = [-6, -5, -4, -3, -2, -1, 0, 1, 2, 3, 4, 5];

/// Twelve offsets of scene and camera together, in sizes of the body.
const OFFSETS: [f64; 12] = [0.0, 0.1, 1.0, 3.0, 10.0, 100.0, 1e3, 1e4, 1e5, 2e5, 1e6, 1e7];

/// Twelve distances of the camera, in sizes of the body.
const DISTANCES: [f64; 12] = [1.5, 2.0, 4.0, 10.0, 30.0, 100.0, 300.0, 1e3, 3e3, 1e4, 2e4, 5e4];

/// A body of size 1 at 0, seen from some distance.
fn body(name: &str, distance: f64) -> Result<Scene, Trouble> {
    let toward = DVec3::new(0.48, 0.64, 0.6).normalize();
    let fov = (2.2 / distance).atan().to_degrees();
    let view = bench::camera((toward * distance).to_array(), [0.0; 3], fov);
    let shape = match name {
        "sphere" => bench::ball([0.0; 3], 1.0, "white"),
        "mesh" => round_mesh(3),
        // Its triangles reach a thousand times as far as the distance at which it is seen.
        "far floor" => {
            let (u, v) = (
                toward.any_orthonormal_vector(),
                toward.cross(toward.any_orthonormal_vector()),
            );
            let lean = (toward + 0.3 * u).normalize();
            let (a, b) = (lean.cross(v).normalize(), lean.cross(lean.cross(v)).normalize());
            square(a * 1e3, b * 1e3)
        }
        _ => square(DVec3::X, DVec3::new(0.0, 0.6, -0.8)),
    };
    bench::scene(&(view + FURNACE + &shape))
}

fn mesh(vertices: &[DVec3], faces: &[[usize; 3]]) -> String {
    let vertices: Vec<[f64; 3]> = vertices.iter().map(|v| v.to_array()).collect();
    format!("[[meshes]]\nmaterial = \"white\"\nvertices = {vertices:?}\nfaces = {faces:?}\n")
}

fn square(a: DVec3, b: DVec3) -> String {
    mesh(&[-a - b, a - b, a + b, b - a], &[[0, 1, 2], [0, 2, 3]])
}

/// An octahedron, every triangle divided into four so many times, its corners on the unit sphere: convex and closed.
fn round_mesh(times: u32) -> String {
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
    let faces: Vec<[usize; 3]> = (0..triangles.len()).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    mesh(&vertices, &faces)
}

/// Samples that are not exactly 1, of all samples.
fn acne(scene: &Scene, effort: Effort) -> Result<usize, Trouble> {
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

/// Row 24.
pub fn self_intersection(effort: Effort) -> Checks {
    let mut checks = Vec::new();
    for name in BODIES {
        let (mut places, mut distances) = (0, 0);
        let scene = body(name, 4.0)?;
        for scale in SCALES.map(|power| 10.0_f64.powi(power)) {
            for offset in OFFSETS {
                let moved = bench::moved(&scene, scale, DVec3::new(1.0, 0.7, -0.3) * (offset * scale));
                places += acne(&moved, effort)?;
            }
        }
        for distance in DISTANCES {
            distances += acne(&body(name, distance)?, effort)?;
        }
        checks.push(Check::none(
            format!("{name}, 12 scales x 12 offsets: pixels with acne"),
            places,
        ));
        checks.push(Check::none(
            format!("{name}, 12 distances up to 5e4: pixels with acne"),
            distances,
        ));
    }
    Ok(checks)
}
