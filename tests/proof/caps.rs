//! Caps of a light above the horizon: areas and directions against the same region in `f64`.

use std::f64::consts::PI;

use glam::DVec3;
use octolux::bsdf::DiffuseOrPhong;
use octolux::estimator::density::{DiskOrCone, Projected};
use octolux::estimator::{ShadingPoint, per_light};
use octolux::lane::{Bits, F32x8, Lane, Mask, Word};
use octolux::light::{Cap, SphereLight, disk};
use octolux::sampling::{PassBlock, TechniqueSample};
use octolux::scene::SamplerKind;

use super::Family;
use super::places::{RHO, point, wide};
use super::stats::chi_square;

/// A diffuse point at the origin, and a light of this sine whose axis is `height` sines over the horizon: -1 and below is set, 1 and
/// above is wholly risen.
fn place<L: Lane>(sine: f64, height: f64) -> (ShadingPoint<L, DiffuseOrPhong<L>>, SphereLight) {
    let point = point::<L>(1.0, 0.5);
    let n = wide(point.bsdf.n.lane(0)).normalize();
    let aside = n.cross(DVec3::new(0.2, 0.9, 0.1)).normalize();
    let angle = (height * sine).clamp(-1.0, 1.0).asin();
    let center = 3.0 * (n * angle.sin() + aside * angle.cos());
    let light = SphereLight {
        center: center.to_array().map(|x| x as f32),
        radius: (3.0 * sine) as f32,
        le: [2.0, 3.0, 5.0],
        sphere: 0,
        origin_power: None,
    };
    (point, light)
}

/// The cap that a light is above a surface, in `f64` of the numbers that the renderer has.
struct Region {
    n: DVec3,
    /// Along the shadow of the axis, and along the horizon.
    shadow: DVec3,
    across: DVec3,
    sine: f64,
    cosine: f64,
    high: f64,
    level: f64,
}

impl Region {
    fn of(point: &ShadingPoint<f32, DiffuseOrPhong<f32>>, light: &SphereLight) -> Self {
        let (n, center) = (wide(point.bsdf.n.lane(0)).normalize(), wide(light.center));
        let axis = center.normalize();
        let sine = f64::from(light.radius) / center.length();
        let high = n.dot(axis);
        let shadow = (axis - n * high).normalize();
        Self {
            n,
            shadow,
            across: n.cross(shadow),
            sine,
            cosine: (1.0 - sine * sine).max(0.0).sqrt(),
            high,
            level: (1.0 - high * high).sqrt(),
        }
    }

    /// Projected solid angle, by Lambert's integral around the rim: an arc of the rim and one of the horizon.
    fn projected(&self) -> f64 {
        let Self {
            sine: s,
            cosine: c,
            high,
            level,
            ..
        } = *self;
        let rise = c * high;
        if rise >= s * level && high >= 0.0 {
            return PI * s * s * high;
        }
        if rise <= -s * level {
            return 0.0;
        }
        let rim = (-rise / (s * level)).acos();
        let horizon = (s * rim.sin()).atan2(c / level);
        horizon - c * s * level * rim.sin() + s * s * high * rim
    }

    /// The ends of the strip of the region at `y`, along the shadow of the axis.
    fn strip(&self, y: f64) -> (f64, f64) {
        let Self {
            sine: s,
            cosine: c,
            high,
            level,
            ..
        } = *self;
        let k = (1.0 - (y / s).powi(2)).max(0.0).sqrt();
        let circle = (1.0 - y * y).sqrt();
        if c * high + s * level * k <= 0.0 {
            return (circle, circle);
        }
        let far = if c * high - s * level * k > 0.0 {
            c * level + s * high * k
        } else {
            circle
        };
        (c * level - s * high * k, far)
    }
}

/// Sines of half-angles, from the smallest that the project promises to nearly half the sky.
const SINES: [f64; 14] = [
    1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 0.01, 0.05, 0.2, 0.5, 0.8, 0.9, 0.99, 0.9999, 0.999_999,
];
/// Heights of the axis: set, below the horizon, on it, above it, wholly risen.
const HEIGHTS: [f64; 15] = [
    -1.2, -0.99, -0.9, -0.6, -0.3, -0.05, -1e-3, 0.0, 1e-3, 0.05, 0.3, 0.6, 0.9, 0.999, 1.5,
];

/// On an unoccluded diffuse surface every sample is the whole answer, the same for all numbers.
///
/// It is so to 1e-5 of itself and 5e-7 of what the light would bring from overhead: where a light of sine `s` sets, the rounding of
/// one direction, 6e-8, is `6e-8 / s` of its radius. Close to the light the rounding of its distance moves the rim by `6e-8 / cos` of
/// the half-angle, here and for cones. Returns of each sine the largest error in parts of the answer, where a thousandth of the light
/// is in sight at least, and in parts of the light overhead.
pub fn every_sample_is_the_answer() -> Vec<[f64; 3]> {
    let mut table = Vec::new();
    let numbers = PassBlock::new(SamplerKind::Independent, 5, 0, 1, 3);
    for sine in SINES {
        let mut worst = [sine, 0.0, 0.0];
        for height in HEIGHTS.into_iter().chain([0.3 / sine, 0.95 / sine]) {
            let (point, light) = place::<f32>(sine, height);
            let region = Region::of(&point, &light);
            let truth = region.projected();
            let overhead = PI * region.sine * region.sine;
            let cap = Cap::above(point.bsdf.n, &light.cone(point.p));
            let error = (f64::from(cap.projected()) - truth).abs();
            let what = format!("sine {sine:e}, {height} sines high");
            assert!(
                error <= 1e-5 * truth + (5e-7 + 5e-8 / region.cosine) * overhead,
                "{what}: {:e} instead of {truth:e}, off by {:e} of it and {:e} of the light overhead",
                cap.projected(),
                error / truth,
                error / overhead
            );
            if truth > 1e-3 * overhead {
                worst[1] = worst[1].max(error / truth);
            }
            worst[2] = worst[2].max(error / overhead);
            // Of `projected`, and of `product` where the light is wholly risen.
            let whole = disk::clears(point.bsdf.n, &light.seen_from(point.p));
            let samples = |pixel: u32| {
                let technique_sample = TechniqueSample {
                    by_brdf_lanes: false,
                    pair: numbers.pair(Word(pixel), Word(0), 2),
                };
                if pixel % 2 == 1 && whole {
                    per_light::sample(DiskOrCone, &point, &light, technique_sample, true)
                } else {
                    per_light::sample(Projected, &point, &light, technique_sample, true)
                }
            };
            let (mut seen, mut none) = ([None; 2], 0);
            for pixel in 0..1024 {
                let Some(found) = samples(pixel) else {
                    none += 1;
                    continue;
                };
                let bits = found.ld.lane(0).map(f32::to_bits);
                let seen = seen[pixel as usize % 2].get_or_insert(bits);
                assert_eq!(*seen, bits, "{what}: samples differ");
                let wi = wide(found.wi.lane(0));
                let from_axis = (wi.normalize() - wide(light.center).normalize()).length();
                // The chord to a direction of the cone, and what a stored direction is off.
                let chord = (2.0 * (1.0 - region.cosine)).sqrt().min(2.0);
                assert!(
                    from_axis <= chord * (1.0 + 1e-5) + 3e-7,
                    "{what}: {from_axis:e} from the axis"
                );
                assert!((wi.length() - 1.0).abs() < 5e-7, "{what}: not of unit length");
                let most = 3.0 * (1.0 + region.sine) + 1e-5;
                assert!(
                    (0.0..most).contains(&f64::from(found.distance)),
                    "{what}: at {}",
                    found.distance
                );
            }
            // `projected` is the cap's solid angle; `product` has a value of its own for a light that is wholly risen, as exact as the cap's.
            let off = (5e-7 + 5e-8 / region.cosine) * overhead;
            let of_cap = (f64::from(cap.projected()), 1e-6, 0.0);
            let solid_angles = [of_cap, if whole { (truth, 1e-5, off) } else { of_cap }];
            for (bits, (solid_angle, relative, off)) in seen.into_iter().zip(solid_angles) {
                let Some(bits) = bits else { continue };
                let (value, scale) = (
                    f64::from(f32::from_bits(bits[0])),
                    f64::from(light.le[0]) * f64::from(RHO[0]) / PI,
                );
                assert!(
                    (value - scale * solid_angle).abs() <= scale * (relative * solid_angle + off),
                    "{what}: {value:e} for {:e}",
                    scale * solid_angle
                );
            }
            // At the horizon a stored direction may be below it; elsewhere none is lost.
            let lost = if height < 1.0 && sine < 1e-2 { 1024 } else { 0 };
            assert!(
                none <= lost || truth == 0.0,
                "{what}: {none} samples of 1024 brought nothing"
            );
            assert!(truth > 0.0 || none == 1024 || sine < 1e-2, "{what}: light from below");
        }
        table.push(worst);
    }
    table
}

const ROWS: usize = 16;
const COLUMNS: usize = 12;

/// Adds a test for each place: `draws` directions in cells of equal projected solid angle, strips of the region cut across.
pub fn directions<L: Lane>(family: &mut Family, seed: u32, draws: u32) {
    let places = [
        (0.05, 1.5),
        (0.05, 0.4),
        (0.05, -0.4),
        (0.5, 1.9),
        (0.5, 0.7),
        (0.5, 0.02),
        (0.5, -0.02),
        (0.5, -0.8),
        (0.95, 1.03),
        (0.95, 0.5),
        (0.95, -0.3),
        (0.9999, 0.9),
        (0.9999, -0.7),
    ];
    for (i, (sine, height)) in (0..).zip(places) {
        let (point, light) = place::<L>(sine, height);
        let (one, _) = place::<f32>(sine, height);
        let region = Region::of(&one, &light);
        // Area of the region below each of many strips.
        let strips = 1 << 14;
        let y = |strip: usize| region.sine * (2.0 * strip as f64 / strips as f64 - 1.0);
        let mut below = vec![0.0; strips + 1];
        for strip in 0..strips {
            let (near, far) = region.strip((y(strip) + y(strip + 1)) / 2.0);
            below[strip + 1] = below[strip] + (far - near).max(0.0);
        }
        let (cone, n) = (light.cone(point.p), point.bsdf.n);
        let cap = Cap::above(n, &cone);
        let numbers = PassBlock::new(SamplerKind::Independent, seed, 0, 1, 40);
        let whole = disk::clears(n, &light.seen_from(point.p)).all();
        assert_eq!(
            whole,
            height > 1.0,
            "sine {sine}, {height} sines high: wholly risen or not"
        );
        for by_disk in [false, true].into_iter().take(1 + usize::from(whole)) {
            let mut counts = vec![0.0; ROWS * COLUMNS];
            for first in (0..draws).step_by(L::N) {
                let pixel = L::Bits::from_fn(|lane| first + lane as u32);
                let (u, v) = numbers.pair(pixel, L::Bits::splat(0), i).unit::<L>();
                let (wi, cos_theta) = if by_disk {
                    let drawn = disk::draw(n, &cone, u, v);
                    (drawn.wi, drawn.cos_theta)
                } else {
                    let drawn = cap.draw(u, v);
                    (drawn.wi, drawn.cos_theta)
                };
                for lane in L::Mask::splat(true).lanes() {
                    let wi = wide(wi.lane(lane));
                    let height = f64::from(cos_theta.lane(lane));
                    assert!(
                        (wi.dot(region.n) - height).abs() < 1e-6,
                        "sine {sine}, {height} high: the height is another"
                    );
                    let (x, y) = (wi.dot(region.shadow), wi.dot(region.across));
                    let (near, far) = region.strip(y.clamp(-region.sine, region.sine));
                    let at = ((y / region.sine + 1.0) / 2.0 * strips as f64).clamp(0.0, strips as f64 - 1e-9);
                    let (strip, part) = (at as usize, at.fract());
                    let share = (below[strip] + part * (below[strip + 1] - below[strip])) / below[strips];
                    let along = if far > near { (x - near) / (far - near) } else { 0.5 };
                    let row = ((share * ROWS as f64) as usize).min(ROWS - 1);
                    let column = ((along.clamp(0.0, 1.0) * COLUMNS as f64) as usize).min(COLUMNS - 1);
                    counts[row * COLUMNS + column] += 1.0;
                }
            }
            let expected = vec![f64::from(draws) / (ROWS * COLUMNS) as f64; ROWS * COLUMNS];
            let test = chi_square(&counts, &expected);
            family.add(
                test.p,
                format!(
                    "sine {sine}, {height} sines high, by its disk: {by_disk}, {} lanes: {test:?}",
                    L::N
                ),
            );
        }
    }
}

/// What a mutant's process runs.
pub fn both() {
    every_sample_is_the_answer();
    let mut family = Family::rarely("caps", 1e-6);
    directions::<F32x8>(&mut family, 71, 1 << 15);
    family.judge();
}
