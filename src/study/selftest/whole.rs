//! Three checks of whole pictures.

use std::f64::consts::PI;

use super::bench::{self, SIGMAS};
use super::row::{Check, Checks, Effort};
use crate::bsdf::{Brdf, DiffuseOrPhong};
use crate::math::Vec3;
use crate::scene::EstimatorKind;
use crate::study::distributions::{t_as_normal, z_quantile};
use crate::study::estimate::Estimate;
use crate::study::family::Family;

/// White furnace: a white body under radiance 1 has radiance 1.
pub fn furnace(effort: Effort) -> Checks {
    let (mut worst, mut gain) = (0.0_f64, 0.0_f64);
    for (text, conserves) in [
        (include_str!("../../../scenes/tests/furnace-diffuse.toml"), true),
        (include_str!("../../../scenes/tests/furnace-phong.toml"), false),
    ] {
        let scene = bench::scene(text)?;
        for estimator in EstimatorKind::ALL {
            let picture = bench::picture(&scene, bench::settings(32, 32, estimator), effort.of(64))?;
            let mean = bench::mean_of_pixels(&picture);
            if conserves {
                worst = worst.max(mean.sigmas(Estimate::exact(1.0), 1e-6));
            }
            gain = gain.max(mean.mean - SIGMAS * mean.error());
        }
    }
    Ok(vec![
        Check::new("diffuse: mean against 1: standard errors", worst, SIGMAS),
        Check::new("diffuse and Phong: mean minus 5.5 standard errors", gain, 1.0 + 1e-6),
    ])
}

/// Reciprocity: exchanging the light and view directions leaves a BRDF unchanged.
pub fn reciprocity(effort: Effort) -> Checks {
    let mut worst = 0.0_f64;
    let n = Vec3::<f32>::splat([0.0, 0.0, 1.0]);
    for i in 0..effort.of(20_000) {
        let direction = |k: u32| {
            let u = (f64::from(i * 2 + k) * 0.754_877_666 + 0.3).fract();
            let v = (f64::from(i * 2 + k) * 0.569_840_291 + 0.7).fract();
            let (z, (s, c)) = (0.05 + 0.95 * u, (2.0 * PI * v).sin_cos());
            let r = (1.0 - z * z).sqrt();
            Vec3::<f32>::splat([r * c, r * s, z].map(|x| x as f32))
        };
        let (a, b) = (direction(0), direction(1));
        for alpha in [1.0_f32, 2.0, 20.0] {
            let f = |wo: Vec3<f32>, wi: Vec3<f32>| {
                let cosine = n.dot(wi);
                DiffuseOrPhong::new(n, wo, Vec3::splat([1.0; 3]), alpha)
                    .eval(wi, cosine)
                    .shape
                    / cosine
            };
            let (forth, back) = (f64::from(f(a, b)), f64::from(f(b, a)));
            // Far from the lobe a relative error is meaningless: it is alpha times that of the cosine.
            let peak = (f64::from(alpha) + 1.0) / (2.0 * PI);
            worst = worst.max((forth - back).abs() / (forth.abs() + 1e-3 * peak));
        }
    }
    Ok(vec![Check::new(
        "f(wo, wi) against f(wi, wo), exponents 1, 2, 20: largest relative difference",
        worst,
        2e-5,
    )])
}

/// All estimators agree, tile by tile.
pub fn estimators_agree(effort: Effort) -> Checks {
    let scene = bench::scene(include_str!("../../../scenes/large-lights.toml"))?;
    let (tiles, side) = (4, 12);
    let mut means = Vec::new();
    for estimator in EstimatorKind::ALL {
        let mut of_seeds = Vec::new();
        for seed in 0..effort.of(32).max(8) {
            let settings = crate::pipeline::Settings {
                seed,
                ..bench::settings(tiles * side, tiles * side, estimator)
            };
            let picture = bench::picture(&scene, settings, 4)?;
            let tile = |t: u32| {
                let pixels = (0..side * side)
                    .map(|k| (t / tiles * side + k / side) * tiles * side + t % tiles * side + k % side);
                pixels.map(|i| f64::from(picture.pixels[i as usize][1])).sum::<f64>()
            };
            of_seeds.push((0..tiles * tiles).map(tile).collect::<Vec<_>>());
        }
        means.push(
            (0..(tiles * tiles) as usize)
                .map(|t| Estimate::of(&of_seeds.iter().map(|s| s[t]).collect::<Vec<f64>>()))
                .collect::<Vec<_>>(),
        );
    }
    let mut family = Family::new(1e-6);
    for (i, a) in means.iter().enumerate() {
        for b in &means[i + 1..] {
            for (x, y) in a.iter().zip(b) {
                // With few seeds the standard error is itself uncertain: use Student's t.
                family.add(t_as_normal(x.sigmas(*y, 1e-5), x.minus(*y).dof));
            }
        }
    }
    let (each, deviates) = family.close();
    Ok(vec![Check::new(
        "16 tiles, all pairs of estimators: difference as a normal deviate",
        deviates.into_iter().fold(0.0, f64::max),
        z_quantile(each),
    )])
}
