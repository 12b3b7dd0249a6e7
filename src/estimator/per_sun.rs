//! `light` and `mis` for a sun: samples its cone, or the BRDF.

use super::ShadingPoint;
use super::density::Density;
use super::per_light::Contribution;
use crate::bsdf::{Brdf, SeenSphere, Tint};
use crate::lane::{Lane, Mask};
use crate::light::Sun;
use crate::math::Vec3;
use crate::sampling::TechniqueSample;

/// Lanes where a direction to the sun can contribute. The sun is bounded by a sphere around its center with the chord as radius.
#[inline(always)]
pub fn may_contribute<L: Lane, B: Brdf<L>>(point: &ShadingPoint<L, B>, sun: &Sun) -> L::Mask {
    point.bsdf.may_reflect(&SeenSphere {
        to_center: Vec3::splat(sun.axis),
        distance: L::one(),
        radius: L::splat(sun.chord),
        inside: L::Mask::splat(false),
    })
}

/// Samples one direction at each active point and weights it, as for spheres ([`super::per_light::sample`]); `None` if no lane
/// receives light.
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
    let mut wi = Vec3::zero();
    let mut active = active;
    // A packet mostly holds one technique.
    if (active & !by_brdf).any() {
        wi = sun.draw(technique_sample.pair);
    }
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
