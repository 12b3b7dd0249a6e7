//! The estimators at one point, without film or intersector: their means at any position.

use crate::bsdf::DiffuseOrPhong;
use crate::estimator::ShadingPoint;
use crate::estimator::density::{Average, ConeOnly, DiskOrCone, LobeInCap, Mix, Projected};
use crate::estimator::per_light::{self, Directions};
use crate::estimator::per_point::{self, Lobe, Sphere};
use crate::lane::{Bits, F32x8, Lane, Mask, Mask8, U32x8};
use crate::light::SphereLight;
use crate::math::Vec3;
use crate::sampling::hash::pcg4d;
use crate::sampling::{Pair, TechniqueSample};
use crate::scene::EstimatorKind;
use crate::shape::BoundingSphere;
use crate::study::estimate::Estimate;

/// A point at 0 with the normal z, of albedo 1.
#[derive(Clone, Copy, Debug)]
pub struct Spot {
    /// The exponent; 1 is diffuse.
    pub alpha: f32,
    /// Unit direction to the camera.
    pub wo: [f32; 3],
}

/// The estimate at a test point: mean, and invalid samples.
#[derive(Clone, Copy, Debug)]
pub struct Lit {
    /// Mean radiance.
    pub mean: Estimate,
    /// Samples that were NaN, infinite or below 0.
    pub unsound: usize,
    /// Share of samples without contribution.
    pub rejected: f64,
    /// Fourth moment over the squared variance: 3 for a normal distribution.
    pub kurtosis: f64,
}

impl Spot {
    /// Diffuse, seen from 45 degrees.
    pub const DIFFUSE: Self = Self {
        alpha: 1.0,
        wo: [0.6, 0.0, 0.8],
    };

    fn point(self) -> ShadingPoint<F32x8, DiffuseOrPhong<F32x8>> {
        let n = Vec3::splat([0.0, 0.0, 1.0]);
        ShadingPoint {
            p: Vec3::zero(),
            ng: n,
            bsdf: DiffuseOrPhong::new(n, Vec3::splat(self.wo), Vec3::splat([1.0; 3]), F32x8::splat(self.alpha)),
        }
    }

    /// The largest sample of `brdf`.
    pub fn largest(self, lights: &[SphereLight], packets: u32) -> f64 {
        let point = self.point();
        let samples = (0..packets).map(|packet| first_met::<Lobe>(&point, lights, packet));
        let lanes = samples.flat_map(|value| (0..8).map(move |lane| f64::from(value.lane(lane))));
        lanes.fold(0.0, f64::max)
    }

    /// Estimates all lights with eight times `packets` samples. A light occludes those behind it.
    pub fn lit(self, lights: &[SphereLight], estimator: EstimatorKind, packets: u32) -> Lit {
        let point = self.point();
        let (mut sums, mut unsound, mut nothing) = ([0.0_f64; 4], 0, 0);
        for packet in 0..packets {
            let value = match estimator {
                EstimatorKind::Light => per_lights(ConeOnly, &point, lights, packet),
                EstimatorKind::Mis => per_lights(Average, &point, lights, packet),
                EstimatorKind::Mis2Balance => per_lights(Mix::Balance, &point, lights, packet),
                EstimatorKind::Mis2Power => per_lights(Mix::Power, &point, lights, packet),
                EstimatorKind::Projected if self.alpha > 1.0 => per_lights(ConeOnly, &point, lights, packet),
                EstimatorKind::Projected => per_lights(Projected, &point, lights, packet),
                EstimatorKind::Product if self.alpha > 1.0 => per_lights(LobeInCap, &point, lights, packet),
                EstimatorKind::Product => per_lights(DiskOrCone, &point, lights, packet),
                EstimatorKind::Uniform => first_met::<Sphere>(&point, lights, packet),
                EstimatorKind::Brdf => first_met::<Lobe>(&point, lights, packet),
            };
            for lane in 0..8 {
                let x = f64::from(value.lane(lane));
                unsound += usize::from(!(x.is_finite() && x >= 0.0));
                nothing += usize::from(x == 0.0);
                sums = [
                    sums[0] + x,
                    sums[1] + x * x,
                    sums[2] + x * x * x,
                    sums[3] + x * x * x * x,
                ];
            }
        }
        let n = f64::from(packets) * 8.0;
        let [mean, m2, m3, m4] = sums.map(|sum| sum / n);
        let variance = (m2 - mean * mean).max(0.0);
        let fourth = m4 - 4.0 * mean * m3 + 6.0 * mean * mean * m2 - 3.0 * mean.powi(4);
        Lit {
            mean: Estimate {
                mean,
                variance: variance / n,
                dof: n - 1.0,
            },
            unsound,
            rejected: nothing as f64 / n,
            kurtosis: fourth / (variance * variance),
        }
    }
}

/// Random numbers for a packet.
fn numbers(packet: u32, pair: u32) -> [U32x8; 4] {
    let lane = U32x8::from_fn(|i| packet * 8 + i as u32);
    pcg4d([lane, U32x8::splat(pair), U32x8::splat(7), U32x8::splat(0x9e37_79b9)])
}

fn per_lights<D: Directions<F32x8, DiffuseOrPhong<F32x8>>>(
    density: D,
    point: &ShadingPoint<F32x8, DiffuseOrPhong<F32x8>>,
    lights: &[SphereLight],
    packet: u32,
) -> F32x8 {
    let mut sum = F32x8::zero();
    for (i, light) in (0..).zip(lights) {
        let [a, b, coin, other] = numbers(packet, i);
        let both = density.mix().both();
        let mut tosses = vec![(coin.top_bit(), Pair(a, b))];
        if both {
            let [c, ..] = numbers(packet, !i);
            tosses = vec![(Mask8::splat(false), Pair(a, b)), (Mask8::splat(true), Pair(other, c))];
        }
        for (by_brdf_lanes, pair) in tosses {
            let technique_sample = TechniqueSample { by_brdf_lanes, pair };
            let Some(found) = per_light::sample(density, point, light, technique_sample, Mask8::splat(true)) else {
                continue;
            };
            let mut visible = found.active;
            for other in lights.iter().filter(|other| other.sphere != light.sphere) {
                let (blocks, _) = ball(other).intersect(point.p, found.wi, F32x8::zero(), found.distance);
                visible = visible & !blocks;
            }
            sum = sum + found.ld.y.or_zero(visible);
        }
    }
    sum
}

fn first_met<D: per_point::Density>(
    point: &ShadingPoint<F32x8, DiffuseOrPhong<F32x8>>,
    lights: &[SphereLight],
    packet: u32,
) -> F32x8 {
    let [a, b, ..] = numbers(packet, 0);
    let Some(found) = per_point::sample::<F32x8, D>(point, Pair(a, b), Mask8::splat(true)) else {
        return F32x8::zero();
    };
    let (mut nearest, mut radiance) = (F32x8::splat(f32::INFINITY), F32x8::zero());
    for light in lights {
        let (meets, t) = ball(light).intersect(point.p, found.wi, F32x8::zero(), nearest);
        let nearer = meets & t.lt(nearest);
        nearest = F32x8::select(nearer, t, nearest);
        radiance = F32x8::select(nearer, F32x8::splat(light.le[1]), radiance);
    }
    (found.throughput.y * radiance).or_zero(found.active)
}

fn ball(light: &SphereLight) -> BoundingSphere {
    BoundingSphere {
        center: light.center,
        radius: light.radius,
    }
}

/// A light of radiance 1, number `sphere`.
pub fn light(center: [f64; 3], radius: f64, sphere: u32) -> SphereLight {
    SphereLight {
        center: center.map(|x| x as f32),
        radius: radius as f32,
        le: [1.0; 3],
        sphere,
        origin_power: None,
    }
}
