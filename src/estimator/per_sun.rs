//! `light` and `mis` under a disk in the sky: a direction of its cone, or of the BRDF.

use super::ShadingPoint;
use super::density::Density;
use super::per_light::Contribution;
use crate::lane::{Lane, Mask};
use crate::light::Sun;
use crate::math::Vec3;
use crate::sampling::Toss;

/// Lanes where any direction of the disk can have a value that is not 0: it rises above the horizon and comes close enough to a Phong
/// lobe for `f32` to hold it.
#[inline(always)]
pub fn may_contribute<L: Lane>(point: &ShadingPoint<L>, sun: &Sun) -> L::Mask {
    let (bsdf, axis) = (&point.bsdf, Vec3::splat(sun.axis));
    // The height of the disk's highest direction is at most the cosine of its middle plus the chord.
    let rises = bsdf.n.dot(axis).gt(L::splat(-1e-6 - sun.chord));
    let reach = bsdf.reach + L::splat(1e-6 + sun.chord);
    let near = (bsdf.wr - axis).length_squared().le(reach * reach);
    rises & (!bsdf.phong | near)
}

/// Draws one direction at each active point and weighs it, as for spheres ([`super::per_light::sample`]); `None` where no lane gets light
/// by it.
#[inline(always)]
pub fn sample<L: Lane, D: Density>(
    density: D,
    point: &ShadingPoint<L>,
    sun: &Sun,
    toss: Toss<L::Bits>,
    active: L::Mask,
) -> Option<Contribution<L>> {
    let bsdf = &point.bsdf;
    let by_brdf = active & density.mix().by_brdf::<L>(toss.heads);
    let mut wi = sun.draw(toss.pair);
    let mut active = active;
    if by_brdf.any() {
        let (u, v) = toss.pair.unit::<L>();
        wi = Vec3::select(by_brdf, bsdf.draw(u, v), wi);
        active = active & (!by_brdf | sun.contains(wi));
    }
    let (cos_theta, above) = point.above(wi);
    let active = active & above;
    if active.none() {
        return None;
    }
    let lobe = bsdf.eval(wi, cos_theta);
    let active = active & lobe.shape.gt(L::zero());
    if active.none() {
        return None;
    }
    let weight = density.mix().weight(sun.solid_angle(), lobe, by_brdf);
    Some(Contribution {
        active,
        wi,
        distance: L::splat(f32::INFINITY),
        ld: Vec3::splat(sun.le).times(bsdf.rho) * weight.or_zero(active),
    })
}
