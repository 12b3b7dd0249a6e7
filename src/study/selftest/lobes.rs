//! Cases 10 to 14: Phong's lobe and grazing directions.

use std::f64::consts::PI;

use super::bench::{self, SIGMAS};
use super::cones::chi_square;
use super::row::{Check, Checks, Effort};
use super::test_point::{self, Spot};
use crate::bsdf::phong;
use crate::embree::{LaneWork, TraceLane, in_sixteen};
use crate::lane::{F32x8, Lane, has_avx512};
use crate::light::SphereLight;
use crate::math::elementary::powcos;
use crate::math::{Frame, Vec3};
use crate::sampling::hash::mix;
use crate::sampling::warp;
use crate::scene::{EstimatorKind, Material};
use crate::study::distributions::z_quantile;
use crate::study::family::Family;

fn unit(i: u32, n: u32) -> f32 {
    ((f64::from(i) + 0.5) / f64::from(n)) as f32
}

/// A light of radiance 1 from all directions.
fn furnace() -> [SphereLight; 1] {
    [test_point::light([0.0; 3], 10.0, 0)]
}

/// Case 10.
pub fn grazing(effort: Effort) -> Checks {
    let (mut highest, mut beyond, mut unsound) = (0.0_f64, f64::NEG_INFINITY, 0);
    for sine in [0.0, 1e-7, 1e-5, 1e-3, 0.1] {
        let wo = [(1.0_f32 - sine * sine).sqrt(), 0.0, sine];
        for alpha in [1.0, 1.5, 30.0, 1e4, 1e6] {
            let test_point = Spot { alpha, wo };
            for kind in [EstimatorKind::Brdf, EstimatorKind::Mis, EstimatorKind::Light] {
                // Sampling all directions as the light's cone does not find a narrow lobe.
                if kind == EstimatorKind::Light && alpha > 30.0 {
                    continue;
                }
                let lit = test_point.lit(&furnace(), kind, effort.of(1 << 12));
                unsound += lit.unsound;
                highest = highest.max(lit.mean.mean - SIGMAS * lit.mean.error());
                if kind == EstimatorKind::Brdf {
                    beyond = beyond.max(test_point.largest(&furnace(), effort.of(1 << 12)));
                }
            }
        }
    }
    Ok(vec![
        Check::new("f cos / pdf of `brdf`, n.wo = 0..0.1: largest", beyond, 1.0 + 1e-6),
        Check::new(
            "white furnace there: mean minus 5.5 standard errors",
            highest,
            1.0 + 1e-6,
        ),
        Check::none("samples that are NaN, infinite or negative", unsound),
    ])
}

/// Case 11.
pub fn value(effort: Effort) -> Checks {
    let wr = [0.36_f32, 0.48, 0.8];
    let frame = Frame::about(Vec3::<f32>::splat(wr));
    let (mut worst, mut deep) = (0.0_f64, 0.0_f64);
    let n = effort.of(20_000);
    for power in 0..=24 {
        let alpha = if power == 0 {
            1.0_f32.next_up()
        } else {
            10.0_f64.powf(f64::from(power) / 4.0) as f32
        };
        for i in 0..n {
            // alpha ln cos runs from 0 to -60.
            let t = (-(-60.0 * f64::from(unit(i, n)) / f64::from(alpha)).exp_m1()) as f32;
            if t >= 0.999_999 {
                continue;
            }
            let wi = frame.direction(t, 0.6, 0.8);
            let found =
                f64::from(phong::eval(Vec3::splat(wr), wi, 1.0, alpha).pdf) * 2.0 * PI / (f64::from(alpha) + 1.0);
            let (a, b) = (wr.map(f64::from), wi.lane(0).map(f64::from));
            let length = |v: [f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
            let (la, lb) = (length(a), length(b));
            let chord: f64 = (0..3).map(|k| (a[k] / la - b[k] / lb).powi(2)).sum();
            // The cosine has an absolute error of 1e-7, which dominates where cos^n is below 1e-3 of its peak.
            let truth = (f64::from(alpha) * (-chord / 2.0).ln_1p()).exp();
            worst = worst.max((found - truth).abs() / truth.max(1e-3));
            if f64::from(alpha) >= 100.0 {
                deep = deep.max((found / truth - 1.0).abs());
            }
        }
    }
    Ok(vec![
        Check::new(
            "n = 1..10^6: largest error, relative down to 1e-3 of the peak",
            worst,
            1e-4,
        ),
        Check::new(
            "n = 100..10^6, n ln cos in [-60, 0]: largest relative error",
            deep,
            1e-4,
        ),
    ])
}

/// Case 12.
pub fn sampling(effort: Effort) -> Checks {
    let (mut chi, mut sigmas) = (0.0_f64, 0.0_f64);
    let (n, alphas) = (effort.of(1 << 18), [2.0_f32, 10.0, 1e3, 1e5, 1e6]);
    for (stream, alpha) in (0..).zip(alphas) {
        let a = f64::from(alpha);
        let (mut cells, mut sum, mut squares) = ([0.0; 64], 0.0, 0.0);
        for i in 0..n {
            let bits = mix(mix(i) ^ ((stream + 1) * 0x1e37_79b9));
            let t = f64::from(warp::power((bits >> 8) as f32 / 16_777_216.0, alpha));
            // 1 - (1 - t)^(alpha + 1) is uniform; its cells are rings in theta sqrt(alpha).
            let u = -((a + 1.0) * (-t).ln_1p()).exp_m1();
            cells[((u * 64.0) as usize).min(63)] += 1.0;
            (sum, squares) = (sum + t, squares + t * t);
        }
        let (count, truth) = (f64::from(n), 1.0 / (a + 2.0));
        let mean = sum / count;
        let error = ((squares / count - mean * mean) / count).sqrt();
        sigmas = sigmas.max(((mean - truth).abs() - 1e-6 * truth).max(0.0) / error);
        chi = chi.max(chi_square(&cells, count / 64.0));
    }
    let bound = z_quantile(2.0 * Family::of(0.01, alphas).close().0);
    Ok(vec![
        Check::new(
            "64 rings of theta sqrt(n), n = 2..10^6: chi-square as a normal deviate, p = 0.01 for all",
            chi,
            bound,
        ),
        Check::new("mean of 1 - cos against 1 / (n + 2): standard errors", sigmas, SIGMAS),
    ])
}

/// Case 13.
pub fn lowest_exponent(effort: Effort) -> Checks {
    let (wr, wi) = ([0.0, 0.6, 0.8], [0.28, 0.0, 0.96_f32]);
    let cosine: f64 = wr
        .iter()
        .zip(wi)
        .map(|(a, b): (&f32, f32)| f64::from(*a) * f64::from(b))
        .sum();
    let ratio = |alpha: f32| {
        let pdf = phong::eval(Vec3::<f32>::splat(wr), Vec3::splat(wi), 1.0, alpha).pdf;
        f64::from(pdf) * 2.0 * PI / ((f64::from(alpha) + 1.0) * cosine.powf(f64::from(alpha)))
    };
    let mut largest = 0.0_f64;
    for i in 0..4096 {
        // From the first number above 1 upwards: by one ulp, then by growing steps.
        let alpha = |i: u32| f32::from_bits(1.0_f32.to_bits() + i * i / 2 + i + 1).min(2.0);
        largest = largest.max((ratio(alpha(i + 1)) - ratio(alpha(i))).abs());
    }
    let lit = Spot {
        alpha: 1.0_f32.next_up(),
        wo: [0.0, 0.0, 1.0],
    }
    .lit(&furnace(), EstimatorKind::Brdf, effort.of(1 << 13));
    let is_taken = |exponent: &f64| {
        let mut scene = bench::test_point();
        scene.material(Material::phong("x", [1.0; 3], *exponent));
        scene.build().is_ok()
    };
    let beyond = [1.0, 0.0, -1.0, f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e39];
    let taken = beyond.iter().filter(|exponent| is_taken(exponent)).count();
    let refused = [1.000_000_1, 2.0, 1e6]
        .iter()
        .filter(|exponent| !is_taken(exponent))
        .count();
    Ok(vec![
        Check::new(
            "exponents from 1 to 2: largest step beyond the slope, relative",
            largest,
            1e-6,
        ),
        Check::new(
            "white furnace at the first number above 1: mean minus 5.5 standard errors",
            lit.mean.mean - SIGMAS * lit.mean.error(),
            1.0,
        ),
        Check::none("exponents of 1, 0, -1, NaN, inf, 1e39 that a scene takes", taken),
        Check::none("exponents above 1 that a scene refuses", refused),
    ])
}

/// Runs [`lanes_of_power`] with sixteen lanes.
struct Sixteen<'a>(&'a [(f32, f32, f32)], &'a mut usize);

impl LaneWork for Sixteen<'_> {
    #[inline(always)]
    fn run<L: TraceLane>(self) {
        *self.1 += lanes_of_power::<L>(self.0);
    }
}

/// Number of powers whose bits in a lane of `L` differ from those of the scalar lane.
#[inline(always)]
fn lanes_of_power<L: Lane>(cases: &[(f32, f32, f32)]) -> usize {
    let mut different = 0;
    for &(cosine, t, alpha) in cases {
        let wide = powcos(L::splat(cosine), L::splat(t), L::splat(alpha));
        let one = powcos(cosine, t, alpha).to_bits();
        for lane in 0..L::N {
            different += usize::from(wide.lane(lane).to_bits() != one);
        }
    }
    different
}

/// Case 14.
pub fn powers_of_nothing(_: Effort) -> Checks {
    let cosines = [
        0.0,
        -0.0,
        -1e-30,
        -0.5,
        -1.0,
        1e-38,
        1e-45,
        1e-20,
        0.1,
        0.71,
        1.0 - 6e-8,
        1.0,
    ];
    let cases: Vec<(f32, f32, f32)> = cosines
        .iter()
        .flat_map(|&c| [0.0, 1.0, 1.000_000_1, 2.0, 1e3, 1e6, 3e38].map(|alpha| (c, 1.0 - c, alpha)))
        .collect();
    let below = cases
        .iter()
        .filter(|(c, t, a)| *c <= 0.0 && powcos(*c, *t, *a) != 0.0)
        .count();
    let unsound = cases
        .iter()
        .filter(|(c, t, a)| !(0.0..=1.0).contains(&powcos(*c, *t, *a)))
        .count();
    let mut different = lanes_of_power::<F32x8>(&cases);
    if has_avx512() {
        in_sixteen(Sixteen(&cases, &mut different));
    }
    Ok(vec![
        Check::none(
            "powers of a cosine of 0 or below that are not 0 (0^0 is 0 here: no light)",
            below,
        ),
        Check::none("powers outside of [0, 1]", unsound),
        Check::none("lanes whose bits are not those of one lane", different),
    ])
}
