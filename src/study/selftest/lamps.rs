//! Case 46: delta lights and suns.

use std::f64::consts::PI;

use glam::DVec3;

use super::bench::{self, PLATE, SIGMAS, SelftestError};
use super::row::{Check, Checks, Effort};
use super::truth;
use crate::scene::{EstimatorKind, Light, Mesh, Scene};

/// Case 46.
pub fn no_shapes(effort: Effort) -> Checks {
    Ok(vec![
        Check::new(
            "point light 1 to 1e6 away, all estimators: worst relative error of I cos / d²",
            distances()?,
            5e-6,
        ),
        Check::new(
            "point light 1e-6 above a plate, seen from 4e-6: relative error",
            one(&plate(1e-6, &[point(1e-6)])?, EstimatorKind::Mis, 0.5 / PI * 0.8)?,
            5e-6,
        ),
        Check::new(
            "spot of 10 to 40 degrees, 0 to 45 degrees off: worst error of the falloff, over the intensity",
            falloff([10.0, 40.0], &[0.0, 9.0, 15.0, 25.0, 39.0, 45.0])?,
            2e-6,
        ),
        // The 32 points see the test point under angles that differ by 0.0015 degrees; the spot light's edge spans 0.4 degrees.
        Check::new(
            "spot of 0.1 to 0.5 degrees: worst error of the falloff, over the intensity",
            falloff([0.1, 0.5], &[0.0, 0.2, 0.3, 0.4, 0.6])?,
            5e-4,
        ),
        Check::none("point light in a surface above: pixels it blocks", in_a_surface()?),
        Check::new(
            "sun of 0.3 to 60 degrees, up and at the horizon, by estimators that sample it: standard errors off",
            suns(effort)?,
            SIGMAS,
        ),
        Check::new(
            "sun of 1e-4 degrees and of 1e-7 radians against one direction: worst relative difference",
            vanishing()?,
            1e-5,
        ),
    ])
}

/// The plate of [`bench::test_point`] under lights, with the camera and everything else scaled by `scale`.
fn plate(scale: f64, lights: &[Light]) -> Result<Scene, SelftestError> {
    let mut scene = bench::moved(&bench::test_point().build()?, scale, DVec3::ZERO)?.to_builder();
    scene.lights.extend_from_slice(lights);
    Ok(scene.build()?)
}

/// A point light at distance `d`, with a cosine of 0.8 and the irradiance 0.8.
fn point(d: f64) -> Light {
    Light::point([0.6 * d, 0.8 * d, 0.0], [d * d; 3])
}

/// Relative error of the mean. There is no noise.
fn one(scene: &Scene, estimator: EstimatorKind, answer: f64) -> Result<f64, SelftestError> {
    let picture = bench::picture(scene, bench::settings(4, 4, estimator), 2)?;
    Ok((bench::mean_of_pixels(&picture).mean / answer - 1.0).abs())
}

fn distances() -> Result<f64, SelftestError> {
    let mut worst = 0.0_f64;
    for estimator in EstimatorKind::ALL {
        for d in [1.0, 10.0, 1e3, 1e6] {
            worst = worst.max(one(&plate(1.0, &[point(d)])?, estimator, 0.5 / PI * 0.8)?);
        }
    }
    Ok(worst)
}

/// The largest error over spot lights at height 2 above the plate, with the axis tilted by these angles in degrees.
fn falloff([inner, outer]: [f64; 2], angles: &[f64]) -> Result<f64, SelftestError> {
    let cosine = |degrees: f64| degrees.to_radians().cos();
    let mut worst = 0.0_f64;
    for &angle in angles {
        let direction = DVec3::new(angle.to_radians().sin(), -cosine(angle), 0.0);
        let spot = Light::Spot {
            position: DVec3::new(0.0, 2.0, 0.0),
            direction,
            intensity: DVec3::splat(8.0 * PI),
            inner_angle: inner,
            outer_angle: outer,
        };
        let x = ((cosine(angle) - cosine(outer)) / (cosine(inner) - cosine(outer))).clamp(0.0, 1.0);
        let settings = bench::settings(4, 4, EstimatorKind::Light);
        let found = bench::mean_of_pixels(&bench::picture(&plate(1.0, &[spot])?, settings, 2)?).mean;
        worst = worst.max((found - x * x * (3.0 - 2.0 * x)).abs());
    }
    Ok(worst)
}

fn in_a_surface() -> Result<usize, SelftestError> {
    let mut blocked = 0;
    for height in [0.5, 1.0, 2.0, 7.3] {
        let mut scene = bench::test_point();
        // Smaller than its height, so that the camera looks at the plate below it.
        let lean = |x: f64, z: f64| [x, 1.0 + 0.3 * x - 0.2 * z, z].map(|k| height * k);
        let corners = [lean(-0.5, 0.5), lean(0.5, 0.5), lean(0.5, -0.5), lean(-0.5, -0.5)];
        scene.mesh(Mesh::quadrilateral(corners, PLATE));
        scene.light(Light::point(lean(0.2, 0.1), [1.0; 3]));
        let scene = scene.build()?;
        for accel in bench::ACCELS {
            let settings = crate::pipeline::Settings {
                accel: Some(accel),
                ..bench::settings(16, 16, EstimatorKind::Light)
            };
            let picture = bench::picture(&scene, settings, 4)?;
            let most = picture.pixels.iter().map(|p| p[1]).fold(0.0, f32::max);
            blocked += picture.pixels.iter().filter(|p| p[1] <= 0.99 * most).count();
        }
    }
    Ok(blocked)
}

/// A sun is equivalent to a sphere of the same angle at infinite distance: the closed form is the same.
fn suns(effort: Effort) -> Result<f64, SelftestError> {
    let mut worst = 0.0_f64;
    for radius in [0.3_f64, 5.0, 60.0] {
        let sine = radius.to_radians().sin();
        for tilt in [
            0.0,
            0.7,
            PI / 2.0 - 0.4 * radius.to_radians(),
            PI / 2.0 + 0.4 * radius.to_radians(),
        ] {
            let sun = Light::directional([-tilt.sin(), -tilt.cos(), 0.0], [PI * sine * sine; 3], radius);
            let scene = plate(1.0, &[sun])?;
            let answer = 0.5 / PI * truth::clipped_sphere(sine, tilt);
            for estimator in EstimatorKind::ALL {
                // `uniform` and `brdf` hit a sun of 5 degrees at the horizon once in 10 000 directions.
                let sampled = !matches!(estimator, EstimatorKind::Uniform | EstimatorKind::Brdf);
                if !sampled && radius < 60.0 {
                    continue;
                }
                let picture = bench::picture(&scene, bench::settings(32, 32, estimator), effort.of(64))?;
                let found = bench::mean_of_pixels(&picture);
                // Mixtures find the narrowest sun along the BRDF too, once in 36 000 directions: all samples may miss this part of the light.
                let mixes = !matches!(estimator, EstimatorKind::Light | EstimatorKind::Projected);
                let missed = if mixes && radius < 5.0 { sine * sine } else { 0.0 };
                // Allow 1.5e-6 for rounding of the offset and of radiances.
                let off = (found.mean - answer).abs() - (1.5e-6 + missed) * answer;
                worst = worst.max(off.max(0.0) / found.variance.sqrt().max(1e-9 * answer));
            }
        }
    }
    Ok(worst)
}

fn vanishing() -> Result<f64, SelftestError> {
    let mut worst = 0.0_f64;
    for radius in [1e-4, 1e-7_f64.to_degrees()] {
        let sun = Light::directional([-0.6, -0.8, 0.0], [1.0; 3], radius);
        worst = worst.max(one(&plate(1.0, &[sun])?, EstimatorKind::Light, 0.5 / PI * 0.8)?);
    }
    Ok(worst)
}
