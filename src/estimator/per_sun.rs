//! `light` and `mis` under a disk in the sky: a direction of its cone, or of the BRDF.

use super::ShadingPoint;
use super::density::Density;
use super::per_light::Contribution;
use crate::bsdf::{Ball, Brdf, Tint};
use crate::lane::{Lane, Mask};
use crate::light::Sun;
use crate::math::Vec3;
use crate::sampling::TechniqueSample;

/// Lanes where any direction of the disk can have a value that is not 0: it is in a ball about its middle as large as its chord.
#[inline(always)]
pub fn may_contribute<L: Lane, B: Brdf<L>>(point: &ShadingPoint<L, B>, sun: &Sun) -> L::Mask {
    point.bsdf.may_reflect(&Ball {
        to_center: Vec3::splat(sun.axis),
        distance: L::one(),
        radius: L::splat(sun.chord),
        inside: L::Mask::splat(false),
    })
}

/// Draws one direction at each active point and weighs it, as for spheres ([`super::per_light::sample`]); `None` where no lane gets light
/// by it.
#[inline(always)]
pub fn sample<L: Lane, D: Density, B: Brdf<L>>(
    density: D,
    point: &ShadingPoint<L, B>,
    sun: &Sun,
    technique_sample: TechniqueSample<L::Bits>,
    active: L::Mask,
) -> Option<Contribution<L>> {
    let bsdf = &point.bsdf;
    let by_brdf = active & density.mix().by_brdf::<L>(technique_sample.by_brdf_lanes);
    let mut wi = sun.draw(technique_sample.pair);
    let mut active = active;
    if by_brdf.any() {
        let (u, v) = technique_sample.pair.unit::<L>();
        wi = Vec3::select(by_brdf, bsdf.draw(u, v), wi);
        active = active & (!by_brdf | sun.contains(wi));
    }
    let (cos_theta, above) = point.above(wi);
    let active = active & above;
    if active.none() {
        return None;
    }
    let lobe = bsdf.eval(wi, cos_theta);
    let active = active & lobe.shape.lit();
    if active.none() {
        return None;
    }
    let le = Vec3::splat(sun.le);
    let weight = density.mix().weight(sun.solid_angle(), lobe, by_brdf);
    Some(Contribution {
        active,
        wi,
        distance: L::splat(f32::INFINITY),
        ld: weight.kept(active).colour(le.times(bsdf.rho()), le),
    })
}
