//! `light` and `mis`: a direction for every light.

use super::ShadingPoint;
use crate::lane::{Lane, Mask};
use crate::light::SphereLight;
use crate::math::elementary::sin_cos_turn;
use crate::math::{Frame, Vec3};
use crate::sampling::{Pair, warp};

/// Which density directions are drawn from.
pub trait Density {
    /// Whether the BRDF has half of it.
    const MIXED: bool;
}

/// `1 / Ω`: uniform in the cone of the light.
pub struct ConeOnly;

/// `(p_light + p_brdf) / 2`: the balance heuristic of two strategies in one sample (the hand-out, section 6).
pub struct Average;

impl Density for ConeOnly {
    const MIXED: bool = false;
}
impl Density for Average {
    const MIXED: bool = true;
}

/// One unoccluded contribution of a light, and what has to be asked before it counts.
#[derive(Clone, Copy, Debug)]
pub struct Contribution<L: Lane> {
    /// Lanes with anything to ask for; elsewhere the contribution is exactly 0.
    pub active: L::Mask,
    /// Direction to the light; unit.
    pub wi: Vec3<L>,
    /// Distance to the light.
    pub distance: L,
    /// `le * f_cos / pdf`, to be counted where nothing else stands before the light.
    pub ld: Vec3<L>,
}

/// Draws one direction for `light` at each active point and weighs it; `None` where no lane gets light by it.
#[inline(always)]
pub fn sample<L: Lane, D: Density>(
    point: &ShadingPoint<L>,
    light: &SphereLight,
    numbers: Pair<L::Bits>,
    active: L::Mask,
) -> Option<Contribution<L>> {
    let cone = light.cone(point.p);
    let bsdf = &point.bsdf;

    // Both techniques are "a direction at 1 - cos = t about an axis": the lanes differ by selections only.
    let (by_brdf, numbers) = if D::MIXED {
        numbers.coin()
    } else {
        (L::Mask::splat(false), numbers)
    };
    let (u, v) = numbers.unit::<L>();
    let (mut t, mut axis) = (warp::cone(u, cone.omc), cone.axis);
    if D::MIXED {
        t = L::select(by_brdf, bsdf.sample(u), t);
        axis = Vec3::select(by_brdf, bsdf.axis(), axis);
    }
    let (sin_phi, cos_phi) = sin_cos_turn(v);
    let wi = Frame::about(axis).direction(t, sin_phi, cos_phi);

    let (cos_theta, above) = point.above(wi);
    let mut active = active & above;
    if D::MIXED {
        t = L::select(by_brdf, cone.t(wi), t);
        active = active & (!by_brdf | cone.contains(t));
    }
    if active.none() {
        return None;
    }

    let lobe = bsdf.eval(wi, cos_theta);
    let pdf = if D::MIXED {
        (cone.pdf() + lobe.pdf) * L::splat(0.5)
    } else {
        cone.pdf()
    };
    let active = active & lobe.shape.gt(L::zero());
    if active.none() {
        return None;
    }
    let weight = lobe.shape.div_or_zero(pdf, active);
    let ld = Vec3::splat(light.le).times(bsdf.rho) * weight;
    Some(Contribution {
        active,
        wi,
        distance: cone.distance(t),
        ld,
    })
}
