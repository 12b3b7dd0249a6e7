//! Case 44: cases 5, 9 and 18 to 21 again, for emitting meshes.

use std::f64::consts::PI;
use std::sync::Arc;

use super::bench::{self, SIGMAS, SelftestError};
use super::emitters::rendered;
use super::places::BOX;
use super::row::{Check, Checks, Effort};
use crate::scene::{EstimatorKind, InvalidScene, Mesh, Scene, Surface};

/// The test point under emitting meshes.
fn under(meshes: &[Mesh]) -> Result<Scene, InvalidScene> {
    let mut scene = bench::test_point();
    scene.meshes.extend(meshes.iter().cloned().map(Arc::new));
    scene.build()
}

/// A square of sides `2 half` directly above the test point.
fn plate(half: f64, height: f64, radiance: f64) -> Mesh {
    let corners = [[-half, -half], [half, -half], [half, half], [-half, half]];
    Mesh::quadrilateral(corners.map(|[x, z]| [x, height, z]), Surface::emission([radiance; 3]))
}

/// Its irradiance at the test point, over pi and its radiance: four times the form factor of a quarter (Howell 2001,
/// configuration B-4).
fn form_factor(half: f64, height: f64) -> f64 {
    let x = half / height;
    let root = x.hypot(1.0);
    4.0 / PI * (x / root) * (x / root).atan()
}

/// A cube of sides `2 half`.
fn cube(center: [f64; 3], half: f64, radiance: f64) -> Mesh {
    let corner =
        |i: usize| -> [f64; 3] { std::array::from_fn(|k| center[k] + if i >> k & 1 == 1 { half } else { -half }) };
    let triangles = BOX.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]);
    Mesh::new(
        (0..8).map(corner),
        triangles.collect(),
        Surface::emission([radiance; 3]),
    )
}

/// The largest deviation, in standard errors, under plates whose size is ten to ten million times their distance.
///
/// # Errors
/// Where a scene cannot be rendered.
pub fn large(effort: Effort) -> Result<f64, SelftestError> {
    let mut worst = 0.0_f64;
    for half in [40.0, 400.0, 4e3, 4e5, 4e7] {
        let irradiance = PI * form_factor(half, 4.0);
        // Other estimators miss the plate so rarely that it takes too many samples to measure how rarely.
        let kinds = [EstimatorKind::Light, EstimatorKind::Mis];
        let scene = under(&[plate(half, 4.0, 1.0)])?;
        worst = worst.max(rendered(irradiance, &scene, &kinds, effort.of(128))?);
    }
    Ok(worst)
}

/// Case 44.
pub fn emitting_meshes(effort: Effort) -> Checks {
    let passes = effort.of(64);
    let (mut inside, mut small) = (0.0_f64, 0.0_f64);
    for half in [10.0, 1e3, 1e7] {
        let scene = under(&[cube([0.3, 0.2, 0.1], half, 1.0)])?;
        inside = inside.max(rendered(PI, &scene, &EstimatorKind::ALL, passes)?);
    }
    for half in [1e-3, 1e-6, 1e-9, 1e-12_f64] {
        let scene = under(&[plate(half, 4.0, 1.0 / (half * half))])?;
        let kinds = [EstimatorKind::Light, EstimatorKind::Mis];
        small = small.max(rendered(4.0 / 16.0, &scene, &kinds, passes)?);
    }
    let one = plate(1.0, 4.0, 1.0);
    let mut coincident = 0.0_f64;
    let faces_twice = Mesh {
        triangles: vec![[0, 1, 2], [0, 2, 3], [0, 1, 2], [0, 2, 3], [2, 0, 3]],
        ..one.clone()
    };
    for meshes in [
        vec![one.clone(), one.clone(), one.clone()],
        vec![one, plate(1.0, 4.0 + 1e-9, 1.0)],
        vec![faces_twice],
    ] {
        let irradiance = PI * form_factor(1.0, 4.0);
        coincident = coincident.max(rendered(irradiance, &under(&meshes)?, &EstimatorKind::ALL, passes)?);
    }
    let place = [0.0, 4.0, 0.0];
    let (outer, below) = (cube(place, 1.0, 1.0), PI * form_factor(1.0, 3.0));
    let mut nested = 0.0_f64;
    let beside = |light, mesh: Mesh| {
        let mut scene = bench::test_point();
        scene.sphere(light);
        scene.mesh(mesh);
        scene.build()
    };
    for (scene, irradiance) in [
        (under(&[cube(place, 0.5, 100.0), outer.clone()])?, below),
        (beside(bench::light(place, 0.9, 100.0), outer)?, below),
        (
            beside(bench::light(place, 2.0, 1.0), cube(place, 1.0, 100.0))?,
            PI * 4.0 / 16.0,
        ),
    ] {
        nested = nested.max(rendered(irradiance, &scene, &EstimatorKind::ALL, passes)?);
    }
    Ok(vec![
        Check::new(
            "plates 10 to 10^7 times as large as they are far away: standard errors",
            large(effort)?,
            SIGMAS,
        ),
        Check::new(
            "camera and scene inside of cubes of 10 to 10^7: standard errors",
            inside,
            SIGMAS,
        ),
        Check::new(
            "plates of 1e-3 to 1e-12, less than an ulp, `light` and `mis`: standard errors",
            small,
            SIGMAS,
        ),
        Check::new(
            "plates in one place, 1e-9 apart, faces twice, against one: standard errors",
            coincident,
            SIGMAS,
        ),
        Check::new(
            "cube in a cube, sphere in a cube, cube in a sphere: standard errors",
            nested,
            SIGMAS,
        ),
    ])
}
