//! Cases 15 to 17 and 30: extreme random numbers, MIS weights, rejected contributions, frames.

use super::bench;
use super::row::{Check, Checks, Effort};
use super::test_point;
use crate::bsdf::DiffuseOrPhong;
use crate::estimator::ShadingPoint;
use crate::estimator::density::{Average, ConeOnly, DiskOrCone, LobeInCap, Mix, Projected};
use crate::estimator::per_light;
use crate::estimator::per_point::{self, Lobe, Sphere};
use crate::lane::Word;
use crate::light::SphereLight;
use crate::math::{Frame, Vec3};
use crate::sampling::{Pair, TechniqueSample};
use crate::scene::EstimatorKind;

/// The first, second, middle and last numbers of a dimension.
const CORNERS: [u32; 4] = [0, 0x100, 0x8000_0000, u32::MAX];

fn sound(value: Vec3<f32>) -> bool {
    value.lane(0).iter().all(|x| x.is_finite() && *x >= 0.0)
}

/// Counts samples of all estimators at extreme random numbers that are NaN, infinite, negative or without positive density.
fn unsound_corners(point: &ShadingPoint<f32, DiffuseOrPhong<f32>>, light: &SphereLight) -> usize {
    let diffuse = !point.bsdf.phong;
    let mut count = 0;
    for a in CORNERS {
        for b in CORNERS {
            let pair = Pair(Word(a), Word(b));
            for by_brdf_lanes in [false, true] {
                let technique_sample = TechniqueSample { by_brdf_lanes, pair };
                let found = [
                    per_light::sample(ConeOnly, point, light, technique_sample, true),
                    per_light::sample(Average, point, light, technique_sample, true),
                    per_light::sample(Mix::Balance, point, light, technique_sample, true),
                    per_light::sample(Mix::Power, point, light, technique_sample, true),
                    diffuse
                        .then(|| per_light::sample(Projected, point, light, technique_sample, true))
                        .flatten(),
                    if diffuse {
                        per_light::sample(DiskOrCone, point, light, technique_sample, true)
                    } else {
                        per_light::sample(LobeInCap, point, light, technique_sample, true)
                    },
                ];
                count += found
                    .iter()
                    .flatten()
                    .filter(|c| !(sound(c.ld) && c.distance >= 0.0))
                    .count();
            }
            let found = [
                per_point::sample::<f32, Sphere>(point, pair, true),
                per_point::sample::<f32, Lobe>(point, pair, true),
            ];
            count += found.iter().flatten().filter(|p| !sound(p.throughput)).count();
            let (u, v) = pair.unit::<f32>();
            let tops = [point.bsdf.sample(u), crate::sampling::warp::sphere(u), v];
            count += tops.iter().filter(|x| !(0.0..=2.0).contains(*x)).count();
        }
    }
    let pdf = light.cone(point.p).pdf();
    count + usize::from(pdf.is_nan() || pdf <= 0.0)
}

/// Case 15.
pub fn corners(_: Effort) -> Checks {
    let n = Vec3::splat([0.0, 0.0, 1.0]);
    let mut count = 0;
    for wo in [[0.0, 0.0, 1.0_f32], [0.6, 0.0, 0.8], [1.0, 0.0, 1e-7], [1.0, 0.0, 0.0]] {
        for alpha in [1.0, 1.0_f32.next_up(), 50.0, 1e6, 1e30] {
            let point = ShadingPoint {
                p: Vec3::<f32>::zero(),
                ng: n,
                bsdf: DiffuseOrPhong::new(n, Vec3::splat(wo), Vec3::splat([1.0; 3]), alpha),
            };
            for (center, radius) in [
                ([0.0, 0.0, 1.0], 1e-15),
                ([0.6, 0.0, 0.8], 1e-3),
                ([-0.6, 0.0, 0.8], 0.9),
                ([0.0, 0.0, 1.0], 1.0 - 6e-8),
                ([0.0, 0.0, 1.0], 1.0),
                ([0.0, 0.0, 0.0], 1.0),
                ([1.0, 0.0, 0.0], 0.5),
                ([0.0, 0.0, -1.0], 0.5),
            ] {
                count += unsound_corners(&point, &test_point::light(center, radius, 0));
            }
        }
    }
    let (last, _): (f32, f32) = Pair(Word(u32::MAX), Word(0)).unit();
    Ok(vec![
        Check::none(
            "corners of the numbers of 160 places whose samples are NaN, infinite, negative or without density",
            count,
        ),
        Check::new(
            "the largest number of all, less 1 - 2^-24",
            f64::from(last) - (1.0 - 0.5_f64.powi(24)),
            0.0,
        ),
    ])
}

/// Case 16: the weights of both techniques as the mixture computes them, `1 / (1 + omega p)` and `omega p / (1 + omega p)`.
pub fn weights(_: Effort) -> Checks {
    let (mut worst, mut unsound) = (0.0_f64, 0);
    for i in -76..=76 {
        for j in -76..=76 {
            let (p1, p2) = (
                10.0_f64.powf(f64::from(i) / 2.0) as f32,
                10.0_f64.powf(f64::from(j) / 2.0) as f32,
            );
            let omega = 1.0 / p1;
            let below = omega.mul_add(p2, 1.0);
            let (w1, w2) = (1.0 / below, if below.is_finite() { omega * p2 / below } else { 1.0 });
            let sum = f64::from(w1) + f64::from(w2);
            worst = worst.max((sum - 1.0).abs() / f64::from(f32::EPSILON));
            unsound += usize::from(!(w1.is_finite() && w2.is_finite()));
        }
    }
    // The estimator's result must be finite for every lobe and cone that a scene can have.
    let n = Vec3::splat([0.0, 0.0, 1.0]);
    for power in 0..=30 {
        for radius in [1e-15, 1e-7, 0.1, 2.0] {
            let point = ShadingPoint {
                p: Vec3::<f32>::zero(),
                ng: n,
                bsdf: DiffuseOrPhong::new(n, n, Vec3::splat([1.0; 3]), 10.0_f64.powi(power).max(1.000_001) as f32),
            };
            unsound += unsound_corners(&point, &test_point::light([0.0, 0.0, 1.0], radius, 0));
        }
    }
    Ok(vec![
        Check::new(
            "weights of two techniques, densities 1e-38..1e38: their sum less 1, in units of 2^-23",
            worst,
            2.0,
        ),
        Check::none(
            "weights or samples, exponents up to 1e30, that are NaN, infinite or negative",
            unsound,
        ),
    ])
}

/// Case 17.
pub fn thrown_away(_: Effort) -> Checks {
    // Radiance times solid angle overflows single precision: every sample is infinite.
    let hot = bench::lit(&[bench::light([0.0, 0.0, 0.0], 10.0, 3e38)])?;
    let (mut strange, mut uncounted, mut all) = (0, 0, 0);
    for estimator in [EstimatorKind::Light, EstimatorKind::Uniform] {
        let renderer = bench::render(&hot, bench::settings(16, 16, estimator), 4)?;
        let counters = renderer.counters();
        strange += renderer
            .picture()
            .pixels
            .iter()
            .flatten()
            .filter(|x| !x.is_finite())
            .count();
        // Contributions become shadow rays; those that were not rejected are on the film.
        let kept = renderer.picture().pixels.iter().filter(|p| p[1] > 0.0).count();
        all += counters.invalid_inf;
        uncounted += usize::from(kept > 0 && counters.invalid_inf == counters.shadow_rays);
        uncounted += usize::from(counters.invalid_inf == 0);
    }
    let mut unsound = 0;
    for text in [
        include_str!("../../../scenes/veach-mis.toml"),
        include_str!("../../../scenes/large-lights.toml"),
    ] {
        let scene = bench::scene(text)?;
        for estimator in EstimatorKind::ALL {
            unsound += bench::invalid(&bench::render(&scene, bench::settings(96, 64, estimator), 4)?);
        }
    }
    Ok(vec![
        Check::none(
            "values of the picture that are no numbers where samples are infinite",
            strange,
        ),
        Check::none("renders whose count of them is not what the film lacks", uncounted),
        Check::new(
            "infinite samples counted, short of the first",
            if all > 0 { 0.0 } else { 1.0 },
            0.0,
        ),
        Check::none("invalid samples on scenes of the repository", unsound),
    ])
}

/// Case 30.
pub fn frames(effort: Effort) -> Checks {
    let mut worst = 0.0_f64;
    let mut look = |axis: [f32; 3]| {
        let frame = Frame::about(Vec3::<f32>::splat(axis));
        let v = [frame.tangent, frame.bitangent, frame.axis].map(|v| v.lane(0).map(f64::from));
        for i in 0..3 {
            for j in 0..3 {
                let dot: f64 = (0..3).map(|k| v[i][k] * v[j][k]).sum();
                worst = worst.max((dot - f64::from(u8::from(i == j))).abs());
            }
        }
    };
    for z in [1.0, -1.0] {
        for x in [0.0, 1e-45, 1e-38, 1e-20, 1e-8, 1e-4_f32] {
            [[x, 0.0, z], [0.0, -x, z], [z, x, 0.0], [z, 0.0, -0.0], [x, z, -x]]
                .into_iter()
                .for_each(&mut look);
        }
    }
    let n = effort.of(1_000_000);
    for i in 0..n {
        let height = (1.0 - 2.0 * (f64::from(i) + 0.5) / f64::from(n)).powf(if i % 2 == 0 { 1.0 } else { 1.0 / 9.0 });
        let height = if height.is_nan() {
            -(-1.0 + 2.0 * (f64::from(i) + 0.5) / f64::from(n)).powf(1.0 / 9.0)
        } else {
            height
        };
        let (s, c) = (f64::from(i) * 2.399_963_229_728_653).sin_cos();
        let r = (1.0 - height * height).max(0.0).sqrt();
        look([r * c, r * s, height].map(|x| x as f32));
    }
    Ok(vec![Check::new(
        "10^6 normals, more of them near the poles, and the poles: off orthonormal",
        worst,
        3e-7,
    )])
}
