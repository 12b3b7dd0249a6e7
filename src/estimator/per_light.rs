//! `light` and `mis`: a direction for every light.

use super::ShadingPoint;
use crate::bsdf::Lobe;
use crate::lane::{Lane, Mask};
use crate::light::{Cone, SphereLight};
use crate::math::elementary::sin_cos_turn;
use crate::math::{Frame, Vec3};
use crate::sampling::{Toss, warp};

/// Which density directions are drawn from.
pub trait Density {
    /// Whether the BRDF has half of it.
    const MIXED: bool;
    /// `f_cos / pdf` without the reflectance, where `omega` is one over the light's own density, in steradians.
    fn weight<L: Lane>(omega: L, lobe: Lobe<L>) -> L;
}

/// `1 / Ω`: uniform in the cone of the light.
pub struct ConeOnly;

/// `(p_light + p_brdf) / 2`: the balance heuristic of two strategies in one sample (the hand-out, section 6).
pub struct Average;

impl Density for ConeOnly {
    const MIXED: bool = false;
    #[inline(always)]
    fn weight<L: Lane>(omega: L, lobe: Lobe<L>) -> L {
        omega * lobe.shape
    }
}
impl Density for Average {
    const MIXED: bool = true;
    /// With one division: `2 Ω f_cos / (1 + Ω p_brdf)`.
    #[inline(always)]
    fn weight<L: Lane>(omega: L, lobe: Lobe<L>) -> L {
        mutate!(omega + omega, MixtureWithoutHalf => omega) * lobe.shape / omega.mul_add(lobe.pdf, L::one())
    }
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
///
/// `toss` gives the random numbers, once they are needed, and which technique a lane takes where the density is an average:
/// heads the BRDF, tails the cone.
#[inline(always)]
pub fn sample<L: Lane, D: Density>(
    point: &ShadingPoint<L>,
    light: &SphereLight,
    toss: impl FnOnce() -> Toss<L::Bits>,
    active: L::Mask,
) -> Option<Contribution<L>> {
    let cone = light.cone(point.p);
    let bsdf = &point.bsdf;
    let mut active = active & may_contribute(point, &cone);
    if active.none() {
        return None;
    }

    // Both techniques are "a direction at 1 - cos = t about an axis". Where a packet mixes them, lanes differ by selections.
    let toss = toss();
    let (u, v) = toss.pair.unit::<L>();
    let by_brdf = if D::MIXED {
        mutate!(toss.heads, AlwaysHeads => active) & active
    } else {
        L::Mask::splat(false)
    };
    let (mut t, mut axis) = (warp::cone(u, cone.omc), cone.axis);
    if by_brdf.any() {
        t = L::select(by_brdf, bsdf.sample(u), t);
        axis = Vec3::select(by_brdf, bsdf.axis(), axis);
    }
    let (sin_phi, cos_phi) = sin_cos_turn(v);
    let wi = Frame::about(axis).direction(t, sin_phi, cos_phi);

    let (cos_theta, above) = point.above(wi);
    active = active & above;
    if by_brdf.any() {
        t = L::select(by_brdf, cone.t(wi), t);
        active = active & mutate!(!by_brdf | cone.contains(t), FlippedMask => by_brdf | cone.contains(t));
    }
    if active.none() {
        return None;
    }

    let lobe = bsdf.eval(wi, cos_theta);
    active = active & lobe.shape.gt(L::zero());
    if active.none() {
        return None;
    }
    let omega = warp::cone_solid_angle(mutate!(cone.omc, DoubledDensity => cone.omc * L::splat(0.5)));
    let ld = Vec3::splat(light.le).times(bsdf.rho) * D::weight(omega, lobe).or_zero(active);
    Some(Contribution {
        active,
        wi,
        distance: cone.distance(t),
        ld,
    })
}

/// Lanes where a direction of the cone can have a value that is not exactly 0: the cone rises above the horizon and
/// comes close enough to a Phong lobe for `f32` to hold it. Neither test takes a root or a division.
///
/// With `n·axis < 0`, `n·wi` is largest at the rim, where it is at most `n·axis cos + sin`. The chord from the axis to a
/// direction of the cone is `2 sin(theta / 2) <= sqrt(2) sin(theta)` for a cone of up to a right angle.
#[inline(always)]
fn may_contribute<L: Lane>(point: &ShadingPoint<L>, cone: &Cone<L>) -> L::Mask {
    let bsdf = &point.bsdf;
    let rim = mutate!(cone.sine, RimForgotten => L::zero());
    let highest = bsdf.n.dot(cone.axis).mul_add(L::one() - cone.omc, rim);
    let rises = highest.gt(L::splat(-1e-6)) | cone.inside;
    if bsdf.phong.none() {
        return rises;
    }
    let reach = cone.sine.mul_add(L::splat(1.415), bsdf.reach);
    let near = (bsdf.wr - cone.axis).length_squared().le(reach * reach) | cone.inside;
    rises & (!bsdf.phong | near)
}
