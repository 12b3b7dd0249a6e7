//! Weights: every sample of every strategy is worth `f_cos / pdf`, written out again in `f64`, and none that
//! counts is left out.

use std::f64::consts::{PI, TAU};

use glam::DVec3;
use octolux::bsdf::{Brdf, DiffuseOrPhong};
use octolux::estimator::density::{Average, ConeOnly, Mix};
use octolux::estimator::{ShadingPoint, per_light, per_point};
use octolux::lane::Word;
use octolux::math::Frame;
use octolux::math::elementary::sin_cos_turn;
use octolux::sampling::{PassBlock, warp};
use octolux::scene::SamplerKind;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::places::{LIGHTS, RHO, light, point, wide};

/// The lobe in `f64`, and the relative error that its `f32` form states: 5e-7 times `|alpha ln cos|` for the power, the
/// same again for the chord, and the length of stored vectors where the cosine is taken instead of the chord.
fn lobe_and_error(point: &ShadingPoint<f32, DiffuseOrPhong<f32>>, wi: DVec3) -> (f64, f64) {
    let (axis, alpha) = (wide(point.bsdf.axis().lane(0)).normalize(), f64::from(point.bsdf.alpha));
    let t = (wi.normalize() - axis).length_squared() / 2.0;
    if t >= 1.0 {
        return (0.0, 0.0);
    }
    let exponent = alpha * (-t).ln_1p();
    // A stored unit vector is off by 1e-7 across its length as well, which moves the angle of the lobe.
    let across = alpha * (2.0 * t).sqrt() * 1.2e-7;
    let error = 2e-6 + 1e-6 * exponent.abs() + across + if t >= 0.29 { 3e-7 * alpha / (1.0 - t) } else { 0.0 };
    ((alpha + 1.0) / TAU * exponent.exp(), error)
}

fn compare(x: f32, truth: f64, error: f64, what: &str) {
    // Below 1e-37 a lobe has been cut off.
    assert!(
        (f64::from(x) - truth).abs() <= error * truth + 1e-37,
        "{what}: {x:e} instead of {truth:e}, relative error {:e}, allowed {error:e}",
        f64::from(x) / truth - 1.0
    );
}

/// What a direction counts over its integrand, where `p` is the density of the light's own and `q` that of the BRDF's directions.
pub fn weight_over_f(mix: Mix, p: f64, q: f64, by_brdf: bool) -> f64 {
    match mix {
        Mix::Light => 1.0 / p,
        Mix::Average => 2.0 / (p + q),
        Mix::Balance => 1.0 / (p + q),
        Mix::Power => (if by_brdf { q } else { p }) / (p * p + q * q),
        Mix::Lobe => 1.0 / q,
    }
}

/// 4096 samples of each light: `le rho shape / pdf`, written out again in `f64`.
pub fn samples_of_lights() {
    fn check<D: per_light::Directions<f32, DiffuseOrPhong<f32>>>(density: D) {
        for (i, (sine, alpha, off, dip)) in LIGHTS.into_iter().enumerate() {
            let point = point::<f32>(alpha, 0.5);
            let light = light(&point, sine, off, dip);
            let numbers = PassBlock::new(SamplerKind::Sobol, 5, 0, 1, LIGHTS.len() as u32);
            let ratio = f64::from(light.radius) / wide(light.center).length();
            let one_minus_cos_max = if ratio < 1.0 {
                ratio * ratio / (1.0 + (1.0 - ratio * ratio).sqrt())
            } else {
                2.0
            };
            // Where the light fills the sky, the cosine of its rim is a difference of nearly equal numbers.
            let rim = if ratio < 1.0 { 3e-7 / (1.0 - ratio) } else { 0.0 };
            let mut samples = 0;
            for pixel in 0..4096 {
                let technique_sample = numbers.technique_sample(numbers.key(Word(pixel)), Word(0), i as u32, pixel);
                let Some(found) = per_light::sample(density, &point, &light, technique_sample, true) else {
                    continue;
                };
                let wi = wide(found.wi.lane(0));
                let cos_theta = wi.dot(wide(point.bsdf.n.lane(0)));
                let (lobe, error) = lobe_and_error(&point, wi);
                let cone = 1.0 / (TAU * one_minus_cos_max);
                let (shape, lobe) = if alpha == 1.0 {
                    (cos_theta / PI, cos_theta / PI)
                } else {
                    (lobe * cos_theta, lobe)
                };
                let weight = shape * weight_over_f(density.mix(), cone, lobe, technique_sample.by_brdf_lanes);
                let error = error + rim + 2e-7 / cos_theta;
                for (channel, ld) in found.ld.lane(0).into_iter().enumerate() {
                    let truth = f64::from(light.le[channel]) * f64::from(RHO[channel]) * weight;
                    compare(
                        ld,
                        truth,
                        error,
                        &format!("sin {sine}, alpha {alpha}, {:?}", density.mix()),
                    );
                }
                samples += 1;
            }
            assert!(
                samples > 400,
                "sin {sine}, alpha {alpha}: only {samples} samples to check"
            );
        }
    }
    check(Average);
    check(ConeOnly);
    check(Mix::Balance);
    check(Mix::Power);
}

/// 4096 samples of each exponent, `f_cos / pdf` written out again; none goes below the horizon.
pub fn samples_of_points() {
    for alpha in [1.0, 1.5, 10.0, 1e3, 1e5, 1e6] {
        let point = point::<f32>(alpha, 0.8);
        let numbers = PassBlock::new(SamplerKind::Sobol, 6, 0, 1, 2);
        let mut samples = [0, 0];
        for pixel in 0..4096 {
            let pair = |i| numbers.pair(numbers.key(Word(pixel)), Word(0), i);
            let by_lobe = per_point::sample::<f32, per_point::Lobe>(&point, pair(0), true);
            let by_sphere = per_point::sample::<f32, per_point::Sphere>(&point, pair(1), true);
            for (i, found) in [by_lobe, by_sphere].into_iter().enumerate() {
                let Some(found) = found else { continue };
                let wi = wide(found.wi.lane(0));
                let cos_theta = wi.dot(wide(point.bsdf.n.lane(0)));
                let (lobe, error) = lobe_and_error(&point, wi);
                let (shape, lobe) = if alpha == 1.0 {
                    (cos_theta / PI, cos_theta / PI)
                } else {
                    (lobe * cos_theta, lobe)
                };
                let weight = if i == 0 { shape / lobe } else { shape * 4.0 * PI };
                let error = 2e-7 / cos_theta + if i == 0 { 1e-6 } else { error };
                for (rho, value) in RHO.into_iter().zip(found.throughput.lane(0)) {
                    compare(
                        value,
                        f64::from(rho) * weight,
                        error,
                        &format!("alpha {alpha}, strategy {i}"),
                    );
                }
                // The shortcut that cancels the density is the quotient of what the model says.
                let eval = point.bsdf.eval(found.wi, point.bsdf.n.dot(found.wi));
                if i == 0 && eval.pdf > 1e-30 {
                    let quotient = f64::from(eval.shape) / f64::from(eval.pdf);
                    compare(
                        point.bsdf.weight(found.wi, cos_theta as f32),
                        quotient,
                        1e-6 + 2e-7 / cos_theta,
                        "weight",
                    );
                }
                samples[i] += 1;
            }
        }
        // A lobe of 1e6 seen through the whole sphere underflows nearly everywhere.
        assert!(
            samples[0] > 2000 && (samples[1] > 0 || alpha > 1e5),
            "alpha {alpha}: {samples:?} samples to check"
        );
    }
}

/// Before a direction is drawn, lanes are dropped whose light is below the horizon or beyond the lobe. 400 000 places
/// with lights at the horizon, at the lobe's edge and around the point: wherever a direction of the cone counts, the
/// sample is there, and it is the direction of the cone.
pub fn nothing_is_dropped() {
    let mut rng = Pcg64::seed_from_u64(12);
    let numbers = PassBlock::new(SamplerKind::Independent, 4, 0, 1, 1);
    let (mut counted, mut dropped) = (0, 0);
    for pixel in 0..400_000 {
        let alpha = [1.0, 1.5, 30.0, 1e3, 1e5, 1e6][rng.random_range(0..6)];
        let point = point::<f32>(alpha, 1.5 * rng.random::<f64>());
        let sine = 10.0_f64.powf(-4.0 * rng.random::<f64>()) * 1.05;
        // Where the horizon or the lobe's last digit is, give or take two light radii.
        let edge = if alpha == 1.0 {
            PI / 2.0
        } else {
            (180.0 / alpha).sqrt().min(1.6)
        };
        let light = light(&point, sine, 4.0 * rng.random::<f64>() - 2.0, edge);
        let technique_sample = numbers.technique_sample(Word(pixel), Word(0), 0, pixel);
        let cone = light.cone(point.p);
        let ((u, v), frame) = (technique_sample.pair.unit::<f32>(), Frame::about(cone.axis));
        let (sin_phi, cos_phi) = sin_cos_turn(v);
        let wi = frame.direction(warp::cone(u, cone.one_minus_cos_max), sin_phi, cos_phi);
        let (cos_theta, above) = point.above(wi);
        let counts = above && point.bsdf.eval(wi, cos_theta).shape > 0.0;
        let found = per_light::sample(ConeOnly, &point, &light, technique_sample, true);
        match found {
            Some(found) => assert_eq!(found.wi.lane(0), wi.lane(0)),
            None => assert!(
                !counts,
                "alpha {alpha}, sin {sine}: a direction that counts was dropped"
            ),
        }
        counted += u32::from(counts);
        dropped += u32::from(!counts);
    }
    assert!(
        counted > 50_000 && dropped > 50_000,
        "{counted} count, {dropped} do not: the edge is not in sight"
    );
}
