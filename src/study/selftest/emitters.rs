//! Cases 5 to 8, 18 to 20, 35 and 38: positions of emitters.

use std::f64::consts::PI;

use super::bench::{self, ACCELS, SIGMAS, SelftestError};
use super::row::{Check, Checks, Effort};
use super::test_point::{self, Spot};
use super::truth;
use crate::light::SphereLight;
use crate::pipeline::Settings;
use crate::scene::{EstimatorKind, Scene};
use crate::study::estimate::Estimate;

/// Relative error allowed for single precision.
const ROUNDING: f64 = 2e-6;

/// The largest deviation, in standard errors, between the estimators at a diffuse test point and `irradiance` over pi, and the
/// number of samples that are NaN, infinite or negative.
fn against(irradiance: f64, lights: &[SphereLight], kinds: &[EstimatorKind], packets: u32) -> (f64, usize) {
    kinds.iter().fold((0.0, 0), |(worst, unsound), &kind| {
        let lit = Spot::DIFFUSE.lit(lights, kind, packets);
        (
            f64::max(worst, lit.mean.sigmas(Estimate::exact(irradiance / PI), ROUNDING)),
            unsound + lit.unsound,
        )
    })
}

/// The same for whole renders of [`bench::test_point`] under lights, by both intersectors.
///
/// # Errors
/// Where the scene cannot be rendered.
pub fn rendered(irradiance: f64, scene: &Scene, kinds: &[EstimatorKind], passes: u32) -> Result<f64, SelftestError> {
    let mut worst = 0.0_f64;
    for &estimator in kinds {
        for accel in ACCELS {
            let settings = Settings {
                accel: Some(accel),
                ..bench::settings(32, 32, estimator)
            };
            let mean = bench::mean_of_pixels(&bench::picture(scene, settings, passes)?);
            worst = worst.max(mean.sigmas(Estimate::exact(0.5 * irradiance / PI), ROUNDING));
        }
    }
    Ok(worst)
}

/// Case 5.
pub fn inside(effort: Effort) -> Checks {
    let (mut worst, mut unsound) = (0.0_f64, 0);
    for center in [[0.0, 0.0, 0.0], [0.1, 0.0, 0.7], [0.0, 0.0, -0.9], [0.9, 0.0, 0.0]] {
        let lights = [test_point::light(center, 1.0, 0)];
        let (sigmas, bad) = against(PI, &lights, &EstimatorKind::ALL, effort.of(1 << 15));
        (worst, unsound) = (worst.max(sigmas), unsound + bad);
    }
    let rendered = rendered(
        PI,
        &bench::lit(&[bench::light([0.3, 0.2, 0.1], 10.0, 1.0)])?,
        &EstimatorKind::ALL,
        effort.of(128),
    )?;
    Ok(vec![
        Check::new(
            "E at four places inside of a light against pi L: standard errors",
            worst,
            SIGMAS,
        ),
        Check::new("camera and scene inside, rendered: standard errors", rendered, SIGMAS),
        Check::none("samples that are NaN, infinite or negative", unsound),
    ])
}

/// Case 6.
pub fn on_the_surface(effort: Effort) -> Checks {
    let (mut worst, mut unsound) = (0.0_f64, 0);
    for ulps in -4..=4 {
        // The light is above the test point and touches it, to within some ulp.
        let height = 1.0 + f64::from(ulps) * f64::from(f32::EPSILON) / if ulps < 0 { 2.0 } else { 1.0 };
        let (sigmas, bad) = against(
            PI,
            &[test_point::light([0.0, 0.0, height], 1.0, 0)],
            &EstimatorKind::ALL,
            effort.of(1 << 15),
        );
        (worst, unsound) = (worst.max(sigmas), unsound + bad);
        // And the light beside the test point, half of it below the horizon.
        let beside = truth::clipped_sphere((1.0 / height).min(1.0 - 1e-16), PI / 2.0);
        let (sigmas, bad) = against(
            if height < 1.0 { PI } else { beside },
            &[test_point::light([height, 0.0, 0.0], 1.0, 0)],
            if height == 1.0 { &[] } else { &EstimatorKind::ALL },
            effort.of(1 << 15),
        );
        (worst, unsound) = (worst.max(sigmas), unsound + bad);
    }
    Ok(vec![
        Check::new(
            "E from 4 ulp outside to 4 ulp inside against the closed form: standard errors",
            worst,
            SIGMAS,
        ),
        Check::none("samples that are NaN, infinite or negative", unsound),
    ])
}

/// Case 7.
pub fn below_the_horizon(effort: Effort) -> Checks {
    let (mut worst, mut rejected) = (0.0_f64, 0.0_f64);
    for step in 0..19 {
        let tilt = f64::from(step) * PI / 18.0;
        let lights = [test_point::light([tilt.sin(), 0.0, tilt.cos()], 0.3, 0)];
        let truth = truth::clipped_sphere(f64::from(0.3_f32), tilt);
        for kind in EstimatorKind::ALL {
            let lit = Spot::DIFFUSE.lit(&lights, kind, effort.of(1 << 15));
            worst = worst.max(if truth == 0.0 && lit.mean.mean == 0.0 {
                0.0
            } else {
                lit.mean.sigmas(Estimate::exact(truth / PI), ROUNDING)
            });
            if kind == EstimatorKind::Light && truth > 0.0 {
                rejected = rejected.max(lit.rejected);
            }
        }
    }
    Ok(vec![
        Check::new(
            "E at 19 tilts, all estimators, against the clipped sphere: standard errors",
            worst,
            SIGMAS,
        ),
        Check::new(
            "largest share of `light` below the horizon while the light is above it",
            rejected,
            1.0,
        ),
    ])
}

/// Case 8.
pub fn on_the_ground(effort: Effort) -> Checks {
    let mut worst = 0.0_f64;
    for step in 0..13 {
        let ring = 10.0_f64.powf(-2.0 + f64::from(step) / 3.0);
        let lights = [test_point::light([ring, 0.0, 1.0], 1.0, 0)];
        let truth = PI * (1.0 / (ring * ring + 1.0)).powf(1.5);
        let kinds: &[EstimatorKind] = if ring > 10.0 {
            &[EstimatorKind::Light, EstimatorKind::Mis]
        } else {
            &EstimatorKind::ALL
        };
        worst = worst.max(against(truth, &lights, kinds, effort.of(1 << 15)).0);
    }
    let rendered = rendered(
        PI * 2.0_f64.powf(-1.5),
        &bench::lit(&[bench::light([1.0, 1.0, 0.0], 1.0, 1.0)])?,
        &EstimatorKind::ALL,
        effort.of(128),
    )?;
    Ok(vec![
        Check::new(
            "E on 13 rings around a light that rests on the ground: standard errors",
            worst,
            SIGMAS,
        ),
        Check::new("one ring rendered: standard errors", rendered, SIGMAS),
    ])
}

/// Case 18.
pub fn overlapping(effort: Effort) -> Checks {
    let (a, b) = ([0.3, 0.1, 1.2], [-0.2, 0.2, 1.5]);
    let lights = [
        SphereLight {
            le: [2.0; 3],
            ..test_point::light(a, 0.5, 0)
        },
        SphereLight {
            le: [1.0; 3],
            ..test_point::light(b, 0.6, 1)
        },
    ];
    let radiance = |w: [f64; 3]| match (truth::distance(w, a, 0.5), truth::distance(w, b, 0.6)) {
        (Some(to_a), Some(to_b)) => {
            if to_a < to_b {
                2.0
            } else {
                1.0
            }
        }
        (Some(_), None) => 2.0,
        (None, Some(_)) => 1.0,
        (None, None) => 0.0,
    };
    let truth = truth::irradiance(1500, radiance);
    let (worst, _) = against(truth, &lights, &EstimatorKind::ALL, effort.of(1 << 14));
    let place = |[x, y, z]: [f64; 3]| [x, z, y];
    let scene = bench::lit(&[bench::light(place(a), 0.5, 2.0), bench::light(place(b), 0.6, 1.0)])?;
    let rendered = rendered(truth, &scene, &EstimatorKind::ALL, effort.of(128))?;
    Ok(vec![
        Check::new(
            "two overlapping lights against cubature: standard errors",
            worst,
            SIGMAS,
        ),
        Check::new(
            "the same rendered by both accelerators: standard errors",
            rendered,
            SIGMAS,
        ),
    ])
}

/// Case 19.
pub fn coincident(effort: Effort) -> Checks {
    let one = bench::light([0.0, 4.0, 0.0], 1.0, 1.0);
    let near = bench::light([0.0, 4.0 + 1e-9, 0.0], 1.0, 1.0);
    let exact = rendered(
        PI / 16.0,
        &bench::lit(&[one, one, one])?,
        &EstimatorKind::ALL,
        effort.of(128),
    )?;
    let rounded = rendered(
        PI / 16.0,
        &bench::lit(&[one, near])?,
        &EstimatorKind::ALL,
        effort.of(128),
    )?;
    let lights = [
        one,
        bench::light([2.0, 3.0, 1.0], 0.5, 3.0),
        bench::light([-1.0, 2.0, 2.0], 0.2, 30.0),
        bench::light([2.0, 3.0, 1.0], 0.6, 2.0),
    ];
    let orders = [[0, 1, 2, 3], [3, 2, 1, 0], [2, 0, 3, 1]];
    let mut different = 0;
    for estimator in EstimatorKind::ALL {
        for accel in ACCELS {
            let settings = Settings {
                accel: Some(accel),
                ..bench::settings(16, 16, estimator)
            };
            let mut pictures = Vec::new();
            for order in orders {
                let scene = bench::lit(&order.map(|i| lights[i]))?;
                pictures.push(bench::picture(&scene, settings, effort.of(32))?);
            }
            different += pictures[1..]
                .iter()
                .map(|p| bench::differences(&pictures[0], p))
                .sum::<usize>();
        }
    }
    Ok(vec![
        Check::new("three lights in one place against one: standard errors", exact, SIGMAS),
        Check::new("two lights 1e-9 apart against one: standard errors", rounded, SIGMAS),
        Check::none(
            "pixels whose bits follow the order of four lights in the file",
            different,
        ),
    ])
}

/// Case 20.
pub fn nested(effort: Effort) -> Checks {
    let lights = [
        test_point::light([0.3, 0.0, 3.0], 1.0, 0),
        SphereLight {
            le: [100.0; 3],
            ..test_point::light([0.3, 0.0, 3.0], 0.5, 1)
        },
    ];
    let (d2, cosine) = (9.09, 3.0 / 9.09_f64.sqrt());
    let truth = PI / d2 * cosine;
    let (worst, _) = against(truth, &lights, &EstimatorKind::ALL, effort.of(1 << 15));
    let scene = bench::lit(&[
        bench::light([0.3, 3.0, 0.0], 1.0, 1.0),
        bench::light([0.3, 3.0, 0.0], 0.5, 100.0),
    ])?;
    let rendered = rendered(truth, &scene, &EstimatorKind::ALL, effort.of(128))?;
    let inner = Spot::DIFFUSE.lit(
        &[
            SphereLight {
                le: [0.0; 3],
                ..lights[0]
            },
            lights[1],
        ],
        EstimatorKind::Light,
        effort.of(4096),
    );
    Ok(vec![
        Check::new(
            "a light inside of another against the outer one: standard errors",
            worst,
            SIGMAS,
        ),
        Check::new(
            "the same rendered by both accelerators: standard errors",
            rendered,
            SIGMAS,
        ),
        Check::new("light of the inner one alone", inner.mean.mean, 0.0),
    ])
}

/// Case 35.
pub fn few_lights(effort: Effort) -> Checks {
    let dark = bench::lit(&[])?;
    let zero = bench::light([0.0, 4.0, 0.0], 1.0, 0.0);
    let without_power = bench::lit(&[zero])?;
    let (one, below) = (
        bench::light([1.0, 3.0, 0.0], 1.0, 1.0),
        bench::light([0.0, -9.0, 0.0], 1.0, 0.0),
    );
    let (single, beside) = (bench::lit(&[one])?, bench::lit(&[one, below])?);
    let (mut lit, mut different) = (0, 0);
    for estimator in EstimatorKind::ALL {
        let settings = bench::settings(16, 16, estimator);
        for scene in [&dark, &without_power] {
            let picture = bench::picture(scene, settings, 4)?;
            lit += picture.pixels.iter().filter(|p| **p != [0.0; 3]).count();
        }
        let [a, b] = [&single, &beside].map(|scene| bench::picture(scene, settings, effort.of(16)));
        different += bench::differences(&a?, &b?);
    }
    let unsaid = [&dark, &without_power]
        .iter()
        .filter(|scene| scene.notes().is_empty())
        .count();
    Ok(vec![
        Check::none(
            "pixels that are not black without light or with a light of power 0",
            lit,
        ),
        Check::none("such scenes without a note that says so", unsaid),
        Check::none("pixels whose bits change when a light of power 0 is added", different),
    ])
}

/// Case 38.
pub fn fireflies(effort: Effort) -> Checks {
    let (s, packets) = (0.02_f64, effort.of(1 << 18));
    let lights = [SphereLight {
        le: [2500.0; 3],
        ..test_point::light([0.0, 0.0, 1.0], s, 0)
    }];
    let lit = Spot::DIFFUSE.lit(&lights, EstimatorKind::Brdf, packets);
    let hits = 1.0 - lit.rejected;
    Ok(vec![
        Check::new(
            "`brdf` under a light of s = 0.02: standard errors",
            lit.mean.sigmas(Estimate::exact(1.0), ROUNDING),
            SIGMAS,
        ),
        Check::new(
            "share of samples that find it, against s^2: relative",
            (hits / (s * s) - 1.0).abs(),
            0.2,
        ),
        Check::new(
            "kurtosis against that of a coin of probability s^2: relative",
            (lit.kurtosis * s * s - 1.0).abs(),
            0.2,
        ),
    ])
}
