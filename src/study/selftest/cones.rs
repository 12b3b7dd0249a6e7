//! Cases 1 to 4 and 9: cones of spheres, from smaller than an ulp to half of all directions.

use std::f64::consts::PI;

use super::bench::{self, SIGMAS};
use super::row::{Check, Checks, Effort};
use super::truth;
use crate::lane::Word;
use crate::light::SphereLight;
use crate::math::elementary::sin_cos_turn;
use crate::math::{Frame, Vec3};
use crate::sampling::hash::pcg4d;
use crate::sampling::{Pair, warp};
use crate::scene::EstimatorKind;
use crate::study::distributions::{chi_square_as_normal, z_quantile};
use crate::study::estimate::Estimate;

fn sphere(center: [f32; 3], radius: f32) -> SphereLight {
    SphereLight {
        center,
        radius,
        le: [1.0; 3],
        sphere: 0,
        origin_power: None,
    }
}

/// The exact sine of the sphere: its inputs are exact, so this is accurate to 1e-16.
fn sine(light: &SphereLight) -> f64 {
    let d2: f64 = light.center.iter().map(|&x| f64::from(x).powi(2)).sum();
    f64::from(light.radius) / d2.sqrt()
}

/// The density at 0 relative to the true one.
fn ratio(light: &SphereLight) -> f64 {
    let pdf = light.cone(Vec3::<f32>::zero()).pdf();
    f64::from(pdf) * 2.0 * PI * truth::cone(sine(light)).0
}

fn uniform(i: u32, stream: u32) -> (f32, f32) {
    let [a, b, ..] = pcg4d([Word(i), Word(stream), Word(3), Word(0x5bd1_e995)]);
    Pair(a, b).unit()
}

/// Case 1.
pub fn tiny_sphere(effort: Effort) -> Checks {
    let steps = |from: f64, to: f64| (0..2000).map(move |i| from * (to / from).powf(f64::from(i) / 1999.0));
    let worst = |center: [f32; 3], sines: &mut dyn Iterator<Item = f64>| {
        let d = center.iter().map(|&x| f64::from(x).powi(2)).sum::<f64>().sqrt();
        sines
            .map(|s| (ratio(&sphere(center, (s * d) as f32)) - 1.0).abs())
            .fold(0.0, f64::max)
    };
    let mut checks = vec![
        Check::new(
            "density, s = 1e-15..0.9999 along an axis: largest relative error",
            worst([0.0, 0.0, 2.0], &mut steps(1e-15, 0.9999)),
            5e-7,
        ),
        // Off the axes the distance is rounded, and thus 1 - s^2, so the bound of 5e-7 only holds up to s = 0.7.
        Check::new(
            "density, s = 1e-15..0.7 aslant: largest relative error",
            worst([0.3, -1.7, 0.9], &mut steps(1e-15, 0.7)),
            5e-7,
        ),
    ];
    let mut worst = 0.0_f64;
    for power in 1..=7 {
        let s = 10.0_f64.powi(-power);
        // The light is placed where its direction makes 60 degrees with the normal.
        let (center, cosine) = ([4.0 * 0.75_f64.sqrt(), 2.0, 0.0], 0.5);
        let scene = bench::lit(&[bench::light(center, 4.0 * s, 1.0 / (s * s))])?;
        for estimator in [EstimatorKind::Light, EstimatorKind::Mis] {
            let picture = bench::picture(&scene, bench::settings(32, 32, estimator), effort.of(128))?;
            worst = worst.max(bench::mean_of_pixels(&picture).sigmas(Estimate::exact(0.5 * cosine), 2e-6));
        }
    }
    checks.push(Check::new(
        "E against pi L s^2 cos, s = 0.1..1e-7: standard errors",
        worst,
        SIGMAS,
    ));
    Ok(checks)
}

/// Case 2.
pub fn narrow_cone(effort: Effort) -> Checks {
    let light = sphere([1.2, -0.7, 2.9], (1e-4 * 3.216_364_408_5) as f32);
    let cone = light.cone(Vec3::<f32>::zero());
    let frame = Frame::about(cone.axis);
    let rim = f64::from(cone.one_minus_cos_max) * (2.0 - f64::from(cone.one_minus_cos_max));
    let n = effort.of(1 << 20);
    let (mut cells, mut length) = ([0.0_f64; 64], 0.0_f64);
    let axes = [frame.tangent, frame.bitangent].map(|v| v.lane(0).map(f64::from));
    for i in 0..n {
        let (u, v) = uniform(i, 1);
        let (s, c) = sin_cos_turn(v);
        let w = frame
            .direction(warp::cone(u, cone.one_minus_cos_max), s, c)
            .lane(0)
            .map(f64::from);
        let dot = |a: [f64; 3]| a[0] * w[0] + a[1] * w[1] + a[2] * w[2];
        length = length.max((dot(w) - 1.0).abs());
        // Tangents relative to the rim, which is at 1: uniform in the disc.
        let (x, y) = (dot(axes[0]) / rim.sqrt(), dot(axes[1]) / rim.sqrt());
        let ring = ((x * x + y * y) * 8.0).clamp(0.0, 7.0) as usize;
        let sector = ((y.atan2(x) / (2.0 * PI) + 0.5) * 8.0).clamp(0.0, 7.0) as usize;
        cells[ring * 8 + sector] += 1.0;
    }
    Ok(vec![
        Check::new(
            "8 x 8 cells of the disc at s = 1e-4: chi-square as a normal deviate, p = 0.01",
            chi_square(&cells, f64::from(n) / 64.0),
            z_quantile(0.02),
        ),
        Check::new("|w.w - 1| in units of 2^-23", length / f64::from(f32::EPSILON), 4.0),
    ])
}

/// Pearson's statistic of cells with equal expectation, as a normal deviate.
pub fn chi_square(cells: &[f64], expected: f64) -> f64 {
    let statistic: f64 = cells.iter().map(|x| (x - expected).powi(2) / expected).sum();
    chi_square_as_normal(statistic, cells.len() - 1)
}

/// Case 3.
pub fn no_switch(_: Effort) -> Checks {
    let steps = 100_000;
    let at = |i: i32| {
        ratio(&sphere(
            [0.0, 0.0, 1.0],
            10.0_f64.powf(-6.0 + 5.9 * f64::from(i) / f64::from(steps)) as f32,
        ))
    };
    let largest = (0..steps).map(|i| (at(i + 1) - at(i)).abs()).fold(0.0, f64::max);
    Ok(vec![Check::new(
        "10^5 steps of s = 1e-6..0.8: largest step of the density beyond its slope",
        largest,
        1e-6,
    )])
}

/// Case 4.
pub fn point_on_the_sphere(effort: Effort) -> Checks {
    let mut worst = 0.0_f64;
    for power in 0..14 {
        let s = 0.7 * 10.0_f64.powf(-0.5 * f64::from(power));
        let light = sphere([0.0, 0.0, 1.0], s as f32);
        let cone = light.cone(Vec3::<f32>::zero());
        let (one_minus_cos_max, d, r) = (truth::cone(sine(&light)).0, 1.0_f64, f64::from(light.radius));
        for i in 0..effort.of(4096) {
            let t = warp::cone(uniform(i, 2).0, cone.one_minus_cos_max);
            // The `f64` value for the same share of the cone.
            let below = f64::from(t) / f64::from(cone.one_minus_cos_max) * one_minus_cos_max;
            let chord = ((one_minus_cos_max - below) * (2.0 - one_minus_cos_max - below))
                .max(0.0)
                .sqrt();
            let exact = (d - r) * (d + r) / (d * (1.0 - below + chord));
            worst = worst.max((f64::from(cone.distance(t)) / exact - 1.0).abs());
        }
    }
    // Shadow rays skip the sampled light itself, so every drawn sample must count. The light is straight above, so all samples
    // are equal.
    let mut lost = 0;
    for s in [0.3, 1e-2, 1e-4, 1e-6] {
        let scene = bench::lit(&[bench::light([0.0, 4.0, 0.0], 4.0 * s, 1.0 / (s * s))])?;
        let passes = effort.of(2560);
        let picture = bench::picture(&scene, bench::settings(32, 32, EstimatorKind::Light), passes)?;
        let least = 0.5 * (1.0 - s * s).sqrt() * (1.0 - 0.5 / f64::from(passes)).min(1.0 - 1e-5);
        // A pixel that lacks one sample is darker than all others by that share; for small lights the noise of the cosine is
        // less.
        lost += if s < 0.1 {
            picture.pixels.iter().filter(|p| f64::from(p[1]) < least).count()
        } else {
            0
        };
    }
    Ok(vec![
        Check::new(
            "distance to the sphere, s = 2e-7..0.7: largest error in units of 2^-23",
            worst / f64::from(f32::EPSILON),
            8.0,
        ),
        Check::none("pixels that lost one of 10^7 samples to the light's own sphere", lost),
    ])
}

/// Case 9.
pub fn half_of_all(_: Effort) -> Checks {
    let (mut worst, mut unsound) = (0.0_f64, 0);
    for k in 0..4096_u16 {
        let light = sphere([0.0, 0.0, 1.0], 1.0 - f32::from(k) * f32::EPSILON / 2.0);
        let cone = light.cone(Vec3::<f32>::zero());
        unsound += usize::from(!(cone.pdf().is_finite() && cone.pdf() > 0.0 && cone.distance(0.0).is_finite()));
        if k > 0 {
            worst = worst.max((ratio(&light) - 1.0).abs());
        }
    }
    let last = sphere([0.0, 0.0, 1.0], 1.0 - f32::EPSILON / 2.0)
        .cone(Vec3::<f32>::zero())
        .pdf();
    Ok(vec![
        Check::none(
            "densities at s = 1-2^-12..1 that are not finite and positive, distances that are not finite",
            unsound,
        ),
        Check::new("density against f64 there: largest relative error", worst, 5e-7),
        Check::new(
            "2 pi density - 1 at s = 1-2^-24; exactly sqrt(2^-23)",
            (2.0 * PI * f64::from(last) - 1.0).abs(),
            3.46e-4,
        ),
    ])
}
