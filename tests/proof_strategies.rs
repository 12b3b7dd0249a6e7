//! Strategies: the directions of `Bsdf::sample`, of the cone of a light and of the mixture of `mis`, frames and coins
//! included, are distributed as the densities say, and every sample weighs `f_cos / pdf`.
//!
//! Directions are binned in `f64` in 24 x 16 equally likely cells about the axis (lobes) or in equal cells of the
//! light's cone (lights), with a further cell for the draws that bring nothing; the counts are held against the
//! quadrature of the renderer's own `f32` density. 131 072 draws; see `proof_warps.rs` for what that finds.

mod proof;

use std::f64::consts::{PI, TAU};

use glam::DVec3;
use octolux::bsdf::Bsdf;
use octolux::estimator::{ShadingPoint, per_light, per_point};
use octolux::lane::{Bits, F32x8, Lane, Mask};
use octolux::light::SphereLight;
use octolux::math::elementary::sin_cos_turn;
use octolux::math::{Frame, Vec3};
use octolux::sampling::PassBlock;
use octolux::scene::SamplerKind;
use proof::Family;
use proof::stats::{chi_square, integrate, integrate_row};

const ROWS: usize = 24;
const COLUMNS: usize = 16;
const DRAWS: u32 = 1 << 17;
const RHO: [f32; 3] = [0.9, 0.5, 0.25];

fn wide(v: [f32; 3]) -> DVec3 {
    DVec3::from_array(v.map(f64::from))
}

fn narrow<L: Lane>(v: DVec3) -> Vec3<L> {
    Vec3::splat(v.to_array().map(|x| x as f32))
}

/// A shading point at the origin under a normal off every axis, seen under an angle of `tilt`. Diffuse where alpha is 1.
fn point<L: Lane>(alpha: f64, tilt: f64) -> ShadingPoint<L> {
    let n = DVec3::new(0.3, -0.5, 0.8).normalize();
    let wo = n * tilt.cos() + n.cross(DVec3::Y).normalize() * tilt.sin();
    let (n, wo) = (narrow(n), narrow(wo));
    ShadingPoint {
        p: Vec3::zero(),
        ng: n,
        bsdf: Bsdf::new(n, wo, Vec3::splat(RHO), L::splat(alpha as f32)),
    }
}

/// Directions about an axis in `f64`: `1 - cos`, and the azimuth in turns.
struct Polar {
    axis: DVec3,
    tangents: [DVec3; 2],
}

impl Polar {
    fn about(axis: [f32; 3]) -> Self {
        let axis = wide(axis).normalize();
        let (a, b) = axis.any_orthonormal_pair();
        Self { axis, tangents: [a, b] }
    }

    fn of(&self, wi: DVec3) -> (f64, f64) {
        let azimuth = wi.dot(self.tangents[1]).atan2(wi.dot(self.tangents[0]));
        (
            (wi.normalize() - self.axis).length_squared() / 2.0,
            (azimuth / TAU).rem_euclid(1.0),
        )
    }

    fn direction(&self, t: f64, turn: f64) -> DVec3 {
        let (sine, (s, c)) = ((t * (2.0 - t)).max(0.0).sqrt(), (turn * TAU).sin_cos());
        self.axis * (1.0 - t) + (self.tangents[0] * c + self.tangents[1] * s) * sine
    }
}

/// The cell of a direction between rows of `edges`.
fn cell(edges: &[f64], (t, turn): (f64, f64)) -> usize {
    edges[1..ROWS].partition_point(|edge| t >= *edge) * COLUMNS + ((turn * COLUMNS as f64) as usize).min(COLUMNS - 1)
}

/// What the cells expect of `DRAWS` draws with a density per steradian.
fn expectations(
    polar: &Polar,
    quantile: &dyn Fn(f64) -> f64,
    pieces: usize,
    density: impl Fn(DVec3) -> f64,
) -> Vec<f64> {
    let share = |cell: usize| {
        let (row, column) = (cell / COLUMNS, (cell % COLUMNS) as f64);
        integrate_row(row, ROWS, pieces, quantile, &|t| {
            integrate(
                column / COLUMNS as f64,
                (column + 1.0) / COLUMNS as f64,
                pieces,
                |turn| TAU * density(polar.direction(t, turn)),
            )
        })
    };
    (0..ROWS * COLUMNS).map(|i| f64::from(DRAWS) * share(i)).collect()
}

fn lobes<L: Lane>(family: &mut Family) {
    for (i, alpha) in [1.0, 1.5, 2.0, 5.0, 20.0, 300.0, 1e4, 1e5, 1e6_f64]
        .into_iter()
        .enumerate()
    {
        for (j, tilt) in [0.0, 0.6, 1.4].into_iter().enumerate() {
            let bsdf = point::<L>(alpha, tilt).bsdf;
            let polar = Polar::about(bsdf.axis().lane(0));
            let numbers = PassBlock::new(SamplerKind::Independent, (40 + i) as u32, 0, 1, 6);
            let quantile = |s: f64| -((-s).ln_1p() / (alpha + 1.0)).exp_m1();
            let edges: Vec<f64> = (0..=ROWS).map(|i| quantile(i as f64 / ROWS as f64)).collect();
            let mut counts = vec![0.0; ROWS * COLUMNS];
            for first in (0..DRAWS).step_by(L::N) {
                let pixel = L::Bits::from_fn(|lane| first + lane as u32);
                let pair = (2 * j + usize::from(L::N > 1)) as u32;
                let (u, v) = numbers.pair(pixel, L::Bits::splat(0), pair).unit::<L>();
                let (sine, cosine) = sin_cos_turn(v);
                let wi = Frame::about(bsdf.axis()).direction(bsdf.sample(u), sine, cosine);
                (0..L::N).for_each(|lane| counts[cell(&edges, polar.of(wide(wi.lane(lane))))] += 1.0);
            }
            let expected = expectations(&polar, &quantile, 1, |wi| {
                let wi = narrow::<L>(wi);
                f64::from(bsdf.eval(wi, bsdf.n.dot(wi)).pdf.lane(L::N - 1))
            });
            let test = chi_square(&counts, &expected);
            family.add(
                test.p,
                format!("alpha {alpha} seen at {tilt} in {} lanes: {test:?}", L::N),
            );
        }
    }
}

#[test]
fn lobes_are_sampled_with_the_density_that_they_report() {
    let mut family = Family::new("lobes");
    lobes::<f32>(&mut family);
    lobes::<F32x8>(&mut family);
    family.judge();
}

/// A light of `sin(theta_max) = sine` (above 1: from inside), whose direction is `off` from the lobe's axis in units of
/// its own half-angle, and towards the horizon by `dip`.
fn light<L: Lane>(point: &ShadingPoint<L>, sine: f64, off: f64, dip: f64) -> SphereLight {
    let axis = wide(point.bsdf.axis().lane(0)).normalize();
    let aside = axis.any_orthonormal_vector();
    let angle = off * sine.min(1.0).asin() + dip;
    let center = 5.0 * (axis * angle.cos() + aside * angle.sin());
    SphereLight {
        center: center.to_array().map(|x| x as f32),
        radius: (5.0 * sine) as f32,
        le: [2.0, 3.0, 5.0],
        sphere: 0,
    }
}

/// Lights from a sine of 1e-4 (below, single directions are coarser than the cells) to the whole horizon and from
/// inside, and lobes that are wider, as wide and narrower than the light.
const LIGHTS: [(f64, f64, f64, f64); 15] = [
    // sine, alpha, off, dip
    (1e-4, 1.0, 0.0, 0.3),
    (1e-4, 1e6, 0.5, 0.0),
    (1e-3, 1e6, 0.3, 0.0),
    (1e-3, 2e4, 0.3, 0.0),
    (0.01, 1.0, 0.0, 1.5608),
    (0.01, 1e5, 0.2, 0.0),
    (0.1, 1.5, 0.3, 0.0),
    (0.1, 2000.0, 0.8, 0.0),
    (0.5, 1.0, 0.0, 1.3),
    (0.5, 30.0, 0.3, 0.0),
    (0.9, 1.0, 0.0, 0.9),
    (0.9, 8.0, 0.3, 0.3),
    (0.9999, 1.0, 0.0, 1.0),
    (1.2, 1.0, 0.0, 0.5),
    (1.2, 12.0, 0.4, 0.0),
];

fn mixtures<L: Lane, D: per_light::Density>(family: &mut Family, seed: u32) {
    for (i, (sine, alpha, off, dip)) in LIGHTS.into_iter().enumerate() {
        let point = point::<L>(alpha, 0.5);
        let light = light(&point, sine, off, dip);
        let cone = light.cone(point.p);
        let (omc, polar) = (f64::from(cone.omc.lane(0)), Polar::about(cone.axis.lane(0)));
        let numbers = PassBlock::new(SamplerKind::Independent, seed, 0, 1, LIGHTS.len() as u32);
        let quantile = |s: f64| s * omc;
        let edges: Vec<f64> = (0..=ROWS).map(|i| quantile(i as f64 / ROWS as f64)).collect();
        let mut counts = vec![0.0; ROWS * COLUMNS];
        let all = L::Mask::splat(true);
        for first in (0..DRAWS).step_by(L::N) {
            let pixel = L::Bits::from_fn(|lane| first + lane as u32);
            let numbers = numbers.pair(pixel, L::Bits::splat(0), i as u32);
            if let Some(found) = per_light::sample::<L, D>(&point, &light, numbers, all) {
                let directions = found.active.lanes().map(|lane| wide(found.wi.lane(lane)));
                directions.for_each(|wi| counts[cell(&edges, polar.of(wi))] += 1.0);
            }
        }
        let mut expected = expectations(&polar, &quantile, 4, |wi| {
            let wi = narrow::<L>(wi);
            let (cos_theta, above) = point.above(wi);
            let lobe = point.bsdf.eval(wi, cos_theta);
            if (above & lobe.shape.gt(L::zero())).none() {
                return 0.0;
            }
            let cone = f64::from(cone.pdf().lane(0));
            if D::MIXED {
                (cone + f64::from(lobe.pdf.lane(0))) / 2.0
            } else {
                cone
            }
        });
        // What brings nothing is a cell too: below the horizon, beside the light.
        counts.push(f64::from(DRAWS) - counts.iter().sum::<f64>());
        expected.push(f64::from(DRAWS) - expected.iter().sum::<f64>());
        let test = chi_square(&counts, &expected);
        let what = format!("sin {sine}, alpha {alpha}, off {off}, dip {dip}, mixed {}", D::MIXED);
        family.add(test.p, format!("{what} in {} lanes: {test:?}", L::N));
    }
}

#[test]
fn lights_and_mixtures_are_sampled_with_the_density_that_weighs_them() {
    let mut family = Family::new("mixtures");
    mixtures::<f32, per_light::Average>(&mut family, 21);
    mixtures::<F32x8, per_light::Average>(&mut family, 22);
    mixtures::<f32, per_light::ConeOnly>(&mut family, 23);
    mixtures::<F32x8, per_light::ConeOnly>(&mut family, 24);
    family.judge();
}

/// The lobe in `f64`, and the relative error that its `f32` form states: 5e-7 times `|alpha ln cos|` for the power, the
/// same again for the chord, and the length of stored vectors where the cosine is taken instead of the chord.
fn lobe_and_error(point: &ShadingPoint<f32>, wi: DVec3) -> (f64, f64) {
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

/// 4096 samples of each light: `le rho shape / pdf`, written out again in `f64`.
#[test]
fn a_sample_of_a_light_weighs_f_cos_over_pdf() {
    fn check<D: per_light::Density>() {
        for (i, (sine, alpha, off, dip)) in LIGHTS.into_iter().enumerate() {
            let point = point::<f32>(alpha, 0.5);
            let light = light(&point, sine, off, dip);
            let numbers = PassBlock::new(SamplerKind::Sobol, 5, 0, 1, LIGHTS.len() as u32);
            let ratio = f64::from(light.radius) / wide(light.center).length();
            let omc = if ratio < 1.0 {
                ratio * ratio / (1.0 + (1.0 - ratio * ratio).sqrt())
            } else {
                2.0
            };
            // Where the light fills the sky, the cosine of its rim is a difference of nearly equal numbers.
            let rim = if ratio < 1.0 { 3e-7 / (1.0 - ratio) } else { 0.0 };
            let mut samples = 0;
            for pixel in 0..4096 {
                let numbers = numbers.pair(octolux::lane::Word(pixel), octolux::lane::Word(0), i as u32);
                let Some(found) = per_light::sample::<f32, D>(&point, &light, numbers, true) else {
                    continue;
                };
                let wi = wide(found.wi.lane(0));
                let cos_theta = wi.dot(wide(point.bsdf.n.lane(0)));
                let (lobe, error) = lobe_and_error(&point, wi);
                let cone = 1.0 / (TAU * omc);
                let (shape, lobe) = if alpha == 1.0 {
                    (cos_theta / PI, cos_theta / PI)
                } else {
                    (lobe * cos_theta, lobe)
                };
                let weight = shape / if D::MIXED { (cone + lobe) / 2.0 } else { cone };
                let error = error + rim + 2e-7 / cos_theta;
                for (channel, ld) in found.ld.lane(0).into_iter().enumerate() {
                    let truth = f64::from(light.le[channel]) * f64::from(RHO[channel]) * weight;
                    compare(
                        ld,
                        truth,
                        error,
                        &format!("sin {sine}, alpha {alpha}, mixed {}", D::MIXED),
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
    check::<per_light::Average>();
    check::<per_light::ConeOnly>();
}

#[test]
fn a_sample_of_the_point_weighs_f_cos_over_pdf() {
    for alpha in [1.0, 1.5, 10.0, 1e3, 1e5, 1e6] {
        let point = point::<f32>(alpha, 0.8);
        let numbers = PassBlock::new(SamplerKind::Sobol, 6, 0, 1, 2);
        let mut samples = [0, 0];
        for pixel in 0..4096 {
            let pair = |i| numbers.pair(octolux::lane::Word(pixel), octolux::lane::Word(0), i);
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
                        point.bsdf.weight(cos_theta as f32),
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
