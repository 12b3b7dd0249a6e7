//! `light` and `mis`: a direction for every light, of its cone; or for `mis` with half a chance one of the BRDF, which all
//! lights share. It costs as much as that of a cone and mostly meets no light at all: drawn for each light anew it took a third
//! of the time of shading, and gained nothing, since a direction seldom meets two lights.

use super::ShadingPoint;
use crate::bsdf::Lobe;
use crate::lane::{Lane, Mask};
use crate::light::{Cone, SphereLight, View};
use crate::math::elementary::sin_cos_turn;
use crate::math::{Frame, Vec3};
use crate::sampling::{Pair, Toss, warp};

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

/// One sample of the density: a direction of the BRDF where the coin shows heads and `D` is an average, else of the cone. What a
/// render does in two steps, since its packets mostly follow one technique, and lights share the direction of the BRDF.
#[inline(always)]
pub fn sample<L: Lane, D: Density>(
    point: &ShadingPoint<L>,
    light: &SphereLight,
    Toss { heads, pair }: Toss<L::Bits>,
    active: L::Mask,
) -> Option<Contribution<L>> {
    let heads = if D::MIXED { heads } else { L::Mask::splat(false) };
    let view = light.seen_from(point.p);
    let tails = active & !heads & may_contribute(point, &view);
    let tails = by_cone::<L, D>(point, light, &view, pair, tails);
    let heads = active & heads & light.may_meet(point.p, along_lobe(point, pair));
    let heads = by_brdf::<L, D>(point, light, along_lobe(point, pair), heads);
    match (tails, heads) {
        (Some(a), Some(b)) => Some(Contribution {
            active: a.active | b.active,
            wi: Vec3::select(b.active, b.wi, a.wi),
            distance: L::select(b.active, b.distance, a.distance),
            ld: a.ld + b.ld,
        }),
        (a, b) => a.or(b),
    }
}

/// Draws one direction in the cone of `light`, as it is viewed from each active point, and weighs it; `None` where no lane gets
/// light by it. Ask [`may_contribute`] first: it is cheaper.
#[inline(always)]
pub fn by_cone<L: Lane, D: Density>(
    point: &ShadingPoint<L>,
    light: &SphereLight,
    view: &View<L>,
    numbers: Pair<L::Bits>,
    active: L::Mask,
) -> Option<Contribution<L>> {
    let cone = view.cone();
    let (u, v) = numbers.unit::<L>();
    let t = warp::cone(u, cone.omc);
    let (sin_phi, cos_phi) = sin_cos_turn(v);
    let wi = Frame::about(cone.axis).direction(t, sin_phi, cos_phi);
    let (cos_theta, above) = point.above(wi);
    weigh::<L, D>(point, light, &cone, t, wi, cos_theta, active & above)
}

/// Draws the direction of the BRDF that all lights of a point share; 0 where it does not leave the surface.
#[inline(always)]
pub fn along_lobe<L: Lane>(point: &ShadingPoint<L>, numbers: Pair<L::Bits>) -> Vec3<L> {
    let bsdf = &point.bsdf;
    let (u, v) = numbers.unit::<L>();
    let (sin_phi, cos_phi) = sin_cos_turn(v);
    let wi = Frame::about(bsdf.axis()).direction(bsdf.sample(u), sin_phi, cos_phi);
    let (_, above) = point.above(wi);
    Vec3::select(above, wi, Vec3::zero())
}

/// Weighs a direction that [`along_lobe`] has drawn, for `light`; `None` where no lane gets light by it.
#[inline(always)]
pub fn by_brdf<L: Lane, D: Density>(
    point: &ShadingPoint<L>,
    light: &SphereLight,
    wi: Vec3<L>,
    active: L::Mask,
) -> Option<Contribution<L>> {
    let cone = light.seen_from(point.p).cone();
    let t = cone.t(wi);
    let (cos_theta, above) = point.above(wi);
    let met = above & mutate!(cone.contains(t), FlippedMask => !cone.contains(t));
    weigh::<L, D>(point, light, &cone, t, wi, cos_theta, active & met)
}

/// `le f_cos / pdf` of directions at `t` from the axis of a cone that they are in.
#[inline(always)]
fn weigh<L: Lane, D: Density>(
    point: &ShadingPoint<L>,
    light: &SphereLight,
    cone: &Cone<L>,
    t: L,
    wi: Vec3<L>,
    cos_theta: L,
    active: L::Mask,
) -> Option<Contribution<L>> {
    if active.none() {
        return None;
    }
    let lobe = point.bsdf.eval(wi, cos_theta);
    let active = active & lobe.shape.gt(L::zero());
    if active.none() {
        return None;
    }
    let omega = warp::cone_solid_angle(mutate!(cone.omc, DoubledDensity => cone.omc * L::splat(0.5)));
    // Selected at the end: what overflows in an idle lane must not reach the sum of its point as infinity times 0.
    let ld = Vec3::splat(light.le).times(point.bsdf.rho) * D::weight(omega, lobe);
    let ld = Vec3::select(active, ld, Vec3::zero());
    Some(Contribution {
        active,
        wi,
        distance: cone.distance(t),
        ld,
    })
}

/// Lanes where a direction of the cone can have a value that is not exactly 0: the light rises above the horizon and
/// comes close enough to a Phong lobe for `f32` to hold it. All is multiplied by the distance: no division is needed.
///
/// The chord from the axis to a direction of the cone is `2 sin(theta / 2) <= sqrt(2) sin(theta)` for a cone of up to a
/// right angle.
#[inline(always)]
pub fn may_contribute<L: Lane>(point: &ShadingPoint<L>, view: &View<L>) -> L::Mask {
    let bsdf = &point.bsdf;
    let radius = mutate!(view.radius, RimForgotten => L::zero());
    let highest = bsdf.n.dot(view.to_center) + radius;
    let rises = highest.gt(view.distance * L::splat(-1e-6));
    if bsdf.phong.none() {
        return rises;
    }
    let reach = bsdf.reach.mul_add(view.distance, view.radius * L::splat(1.415));
    let apart = bsdf.wr.mul_add(view.distance, -view.to_center);
    let near = apart.length_squared().le(reach * reach) | view.inside();
    rises & (!bsdf.phong | near)
}
