//! `light` and `mis`: a direction for every light, of its cone; or for `mis` with half a chance one of the BRDF, which all
//! lights share. It costs as much as that of a cone and mostly meets no light at all: drawn for each light anew it took a third
//! of the time of shading, and gained nothing, since a direction seldom meets two lights.

use std::f32::consts::FRAC_1_PI;

use super::ShadingPoint;
use super::density::{Average, ConeOnly, ConeOrCap, Density, Listed, LobeInCap, Mix, Projected};
use crate::bsdf::{Ball, Brdf, Bsdf, Diffuse, Phong, Tint};
use crate::lane::{Lane, Mask};
use crate::light::{Cap, Cone, Ring, Rings, SphereLight, View};
use crate::math::elementary::sin_cos_turn;
use crate::math::{Frame, Vec3};
use crate::sampling::{Pair, TechniqueSample, warp};

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

/// A [`Contribution`] before it has a colour.
#[derive(Clone, Copy, Debug)]
pub struct Weighed<L: Lane, T = L> {
    /// Lanes with anything to ask for; elsewhere the weight is exactly 0.
    pub active: L::Mask,
    /// Direction to the light; unit.
    pub wi: Vec3<L>,
    /// Distance to the light.
    pub distance: L,
    /// `f_cos / pdf` without the colours of the light and of the material.
    pub weight: T,
}

impl<L: Lane, T: Tint<L>> Weighed<L, T> {
    /// `le * f_cos / pdf` for points of this reflectance. Selected at the end: what overflows in an idle lane must not reach the sum of
    /// its point as infinity times 0.
    #[inline(always)]
    pub fn ld(&self, light: &SphereLight, rho: Vec3<L>) -> Vec3<L> {
        let le = Vec3::splat(light.le);
        self.weight.colour(le.times(rho), le).or_zero(self.active)
    }
}

/// A direction in the cone of a light.
#[derive(Clone, Copy, Debug)]
pub struct Drawn<L: Lane> {
    cone: Cone<L>,
    /// `1 - cos` about the axis of the cone.
    t: L,
    wi: Vec3<L>,
}

/// One sample of the density: a direction of the BRDF where the coin shows heads and both kinds count, else of the light. What a
/// render does in two steps, since its packets mostly follow one technique, and lights share the direction of the BRDF.
#[inline(always)]
pub fn sample<L: Lane, D: Directions<L, B>, B: Brdf<L>>(
    density: D,
    point: &ShadingPoint<L, B>,
    light: &SphereLight,
    TechniqueSample { by_brdf_lanes, pair }: TechniqueSample<L::Bits>,
    active: L::Mask,
) -> Option<Contribution<L>> {
    let by_brdf_lanes = density.mix().by_brdf::<L>(by_brdf_lanes);
    let view = light.seen_from(point.p);
    let tails = active & !by_brdf_lanes & may_contribute(point, &view);
    let tails = density.toward_light(point, &view, pair, tails);
    let by_brdf_lanes = active & by_brdf_lanes & light.may_meet(point.p, along_lobe(point, pair));
    let by_brdf_lanes = by_brdf(density, point, light, along_lobe(point, pair), by_brdf_lanes);
    let found = either(tails, by_brdf_lanes)?;
    Some(Contribution {
        active: found.active,
        wi: found.wi,
        distance: found.distance,
        ld: found.ld(light, point.bsdf.rho()),
    })
}

/// How the directions of a light are drawn at points of a model. A density that suits some models is implemented for no others.
pub trait Directions<L: Lane, B: Brdf<L>>: Density {
    /// Draws and weighs a direction of the light for each active point; `None` where no lane gets light by it.
    fn toward_light(
        self,
        point: &ShadingPoint<L, B>,
        view: &View<L>,
        numbers: Pair<L::Bits>,
        active: L::Mask,
    ) -> Option<Weighed<L, B::Tint>>;
}

/// `Density: models => how`, for points `point` and what else [`Directions::toward_light`] is given.
macro_rules! directions {
    ($($density:ty: $([$model:ident])? $(<$any:ident>)? => |$own:ident, $point:ident, $view:ident, $pair:ident, $active:ident| $by:expr;)*) => {$(
        impl<L: Lane $(, $any: Brdf<L>)?> Directions<L, $($model<L>)? $($any)?> for $density {
            #[inline(always)]
            fn toward_light(
                self,
                $point: &ShadingPoint<L, $($model<L>)? $($any)?>,
                $view: &View<L>,
                $pair: Pair<L::Bits>,
                $active: L::Mask,
            ) -> Option<Weighed<L, <$($model<L>)? $($any)? as Brdf<L>>::Tint>> {
                let $own = self;
                $by
            }
        }
    )*};
}

directions! {
    ConeOnly: <B> => |own, point, view, pair, active| by_light(own, point, &draw(view, pair), active);
    Average: <B> => |own, point, view, pair, active| by_light(own, point, &draw(view, pair), active);
    Listed: <B> => |own, point, view, pair, active| by_light(own, point, &draw(view, pair), active);
    Mix: <B> => |own, point, view, pair, active| by_light(own, point, &draw(view, pair), active);
    Projected: [Diffuse] => |_own, point, view, pair, active| by_cap(point, view, pair, active);
    Projected: [Bsdf] => |_own, point, view, pair, active| by_cap(point, view, pair, active);
    ConeOrCap: [Diffuse] => |own, point, view, pair, active| by_cone_or_cap(own, point, view, pair, active);
    ConeOrCap: [Bsdf] => |own, point, view, pair, active| by_cone_or_cap(own, point, view, pair, active);
    LobeInCap: [Phong] => |_own, point, view, pair, active| by_lobe(point, view, pair, active);
    LobeInCap: [Bsdf] => |_own, point, view, pair, active| by_lobe(&point.with(point.bsdf.as_phong()), view, pair, active);
}

/// Samples of lanes that are in one of two at most.
#[inline(always)]
fn either<L: Lane, T: Tint<L>>(a: Option<Weighed<L, T>>, b: Option<Weighed<L, T>>) -> Option<Weighed<L, T>> {
    match (a, b) {
        (Some(a), Some(b)) => Some(Weighed {
            active: a.active | b.active,
            wi: Vec3::select(b.active, b.wi, a.wi),
            distance: L::select(b.active, b.distance, a.distance),
            weight: a.weight.plus(b.weight),
        }),
        (a, b) => a.or(b),
    }
}

/// Draws one direction in the cone of a light, uniformly.
#[inline(always)]
pub fn draw<L: Lane>(view: &View<L>, numbers: Pair<L::Bits>) -> Drawn<L> {
    let cone = view.cone();
    let (u, v) = numbers.unit::<L>();
    let t = warp::cone(u, cone.one_minus_cos_max);
    let (sin_phi, cos_phi) = sin_cos_turn(v);
    let wi = Frame::about(cone.axis).direction(t, sin_phi, cos_phi);
    Drawn { cone, t, wi }
}

/// Weighs a direction that [`draw`] has drawn; `None` where no lane gets light by it. Ask [`may_contribute`] before drawing: it is
/// cheaper.
#[inline(always)]
pub fn by_light<L: Lane, D: Density, B: Brdf<L>>(
    density: D,
    point: &ShadingPoint<L, B>,
    drawn: &Drawn<L>,
    active: L::Mask,
) -> Option<Weighed<L, B::Tint>> {
    let (cos_theta, above) = point.above(drawn.wi);
    let technique = (active & above, L::Mask::splat(false));
    weigh(density, point, drawn, cos_theta, technique)
}

/// Draws a direction of the part of the light above the horizon in proportion to its cosine. The points must be diffuse: what is
/// left of `f_cos / pdf` is the light's projected solid angle over pi, the same for every direction.
#[inline(always)]
pub fn by_cap<L: Lane, B: Brdf<L>>(
    point: &ShadingPoint<L, B>,
    view: &View<L>,
    numbers: Pair<L::Bits>,
    active: L::Mask,
) -> Option<Weighed<L>> {
    let cone = view.cone();
    let (u, v) = numbers.unit::<L>();
    let cap = Cap::above(point.bsdf.normal(), &cone);
    let drawn = cap.draw(u, v);
    // The cosine itself is above 0 by its form; that of the direction is not, where a light is at the horizon.
    let lit = cap.projected().gt(L::zero()) & drawn.cos_theta.gt(L::zero());
    let active = active & lit & point.ng.dot(drawn.wi).gt(L::zero());
    if active.none() {
        return None;
    }
    let t = L::select(cone.inside, cone.t(drawn.wi), drawn.t);
    Some(Weighed {
        active,
        wi: drawn.wi,
        distance: cone.distance(t),
        weight: (cap.projected() * L::splat(FRAC_1_PI)).or_zero(active),
    })
}

/// Sine of half the angle of a light, squared, from which it counts as large: its cosines then differ, and near it the time that the
/// cap takes is small beside the noise that it saves. Half an angle of 26 degrees.
const LARGE: f32 = 0.19;

/// Lanes where a diffuse point draws by the cosine, not in the cone: the light is large, or its rim is below the horizon, where a part
/// of the cone is lost.
#[inline(always)]
pub fn suits_cap<L: Lane, B: Brdf<L>>(point: &ShadingPoint<L, B>, view: &View<L>) -> L::Mask {
    let large = (view.radius * view.radius).gt(view.distance * view.distance * L::splat(LARGE));
    large | point.bsdf.normal().dot(view.to_center).lt(view.radius)
}

/// Draws a direction of a light for diffuse points, by [`by_cap`] where [`suits_cap`] says so, else in the cone.
#[inline(always)]
pub fn by_cone_or_cap<L: Lane, D: Density, B: Brdf<L, Tint = L>>(
    density: D,
    point: &ShadingPoint<L, B>,
    view: &View<L>,
    numbers: Pair<L::Bits>,
    active: L::Mask,
) -> Option<Weighed<L>> {
    let by_cosine = active & suits_cap(point, view);
    let rest = active & !by_cosine;
    let cap = if by_cosine.any() {
        by_cap(point, view, numbers, by_cosine)
    } else {
        None
    };
    let cone = if rest.any() {
        by_light(density, point, &draw(view, numbers), rest)
    } else {
        None
    };
    either(cone, cap)
}

/// Draws a direction of the part of each point's lobe that lies inside the light, in proportion to the lobe. What a render does in three steps over many packets, which then overlap.
#[inline(always)]
pub fn by_lobe<L: Lane>(
    point: &ShadingPoint<L, Phong<L>>,
    view: &View<L>,
    numbers: Pair<L::Bits>,
    active: L::Mask,
) -> Option<Weighed<L>> {
    let cone = view.cone();
    let rings = Rings::of(point.bsdf.wr, point.bsdf.alpha, &cone);
    let active = active & rings.mass.gt(L::zero());
    if active.none() {
        return None;
    }
    let (u, v) = numbers.unit::<L>();
    let ring = rings.draw(point.bsdf.alpha, u);
    on_ring(point, &cone, &ring, rings.weight(&ring), v, active)
}

/// The direction at `v` of the arc of a ring that lies inside the light; `weight` is [`Rings::weight`]. `None` where no lane gets
/// light by it.
#[inline(always)]
pub fn on_ring<L: Lane>(
    point: &ShadingPoint<L, Phong<L>>,
    cone: &Cone<L>,
    ring: &Ring<L>,
    weight: L,
    v: L,
    active: L::Mask,
) -> Option<Weighed<L>> {
    let wi = ring.direction(&Frame::about(point.bsdf.wr), cone.axis, v);
    let (cos_theta, above) = point.above(wi);
    let weight = weight * cos_theta;
    let active = active & above & weight.gt(L::zero());
    if active.none() {
        return None;
    }
    Some(Weighed {
        active,
        wi,
        distance: cone.distance(cone.t(wi)),
        weight: weight.or_zero(active),
    })
}

/// Draws the direction of the BRDF that all lights of a point share; 0 where it does not leave the surface.
#[inline(always)]
pub fn along_lobe<L: Lane, B: Brdf<L>>(point: &ShadingPoint<L, B>, numbers: Pair<L::Bits>) -> Vec3<L> {
    let (u, v) = numbers.unit::<L>();
    let wi = point.bsdf.draw(u, v);
    let (_, above) = point.above(wi);
    wi.or_zero(above)
}

/// Weighs a direction that [`along_lobe`] has drawn, for `light`; `None` where no lane gets light by it.
#[inline(always)]
pub fn by_brdf<L: Lane, D: Density, B: Brdf<L>>(
    density: D,
    point: &ShadingPoint<L, B>,
    light: &SphereLight,
    wi: Vec3<L>,
    active: L::Mask,
) -> Option<Weighed<L, B::Tint>> {
    let cone = light.seen_from(point.p).cone();
    let t = cone.t(wi);
    let (cos_theta, above) = point.above(wi);
    let met = above & mutate!(cone.contains(t), FlippedMask => !cone.contains(t));
    let technique = (active & met, L::Mask::splat(true));
    weigh(density, point, &Drawn { cone, t, wi }, cos_theta, technique)
}

/// `f_cos / pdf` of directions without the reflectance; lanes that count, and those of them that follow their BRDF.
#[inline(always)]
fn weigh<L: Lane, D: Density, B: Brdf<L>>(
    density: D,
    point: &ShadingPoint<L, B>,
    Drawn { cone, t, wi }: &Drawn<L>,
    cos_theta: L,
    (active, by_brdf): (L::Mask, L::Mask),
) -> Option<Weighed<L, B::Tint>> {
    if active.none() {
        return None;
    }
    let lobe = point.bsdf.eval(*wi, cos_theta);
    let active = active & lobe.shape.lit();
    if active.none() {
        return None;
    }
    let omega = warp::cone_solid_angle(
        mutate!(cone.one_minus_cos_max, DoubledDensity => cone.one_minus_cos_max * L::splat(0.5)),
    );
    Some(Weighed {
        active,
        wi: *wi,
        distance: cone.distance(*t),
        weight: density.mix().weight(density.asked(omega), lobe, by_brdf).kept(active),
    })
}

/// Lanes where a direction of the cone can have a value that is not exactly 0.
#[inline(always)]
pub fn may_contribute<L: Lane, B: Brdf<L>>(point: &ShadingPoint<L, B>, view: &View<L>) -> L::Mask {
    point.bsdf.may_reflect(&Ball {
        to_center: view.to_center,
        distance: view.distance,
        radius: view.radius,
        inside: view.inside(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lane::{Bits, F32x8};

    /// Every other point looks away from a light whose radiance times their reflectance is more than `f32` holds.
    #[test]
    fn what_overflows_in_an_idle_lane_stays_out_of_it() {
        let light = SphereLight {
            center: [0.0, 2.0, 0.0],
            radius: 0.5,
            le: [3e38; 3],
            sphere: 0,
            origin_power: None,
        };
        let up = F32x8::from_fn(|lane| if lane % 2 == 0 { 1.0 } else { -1.0 });
        let n = Vec3::new(F32x8::zero(), up, F32x8::zero());
        let point = ShadingPoint {
            p: Vec3::zero(),
            ng: n,
            bsdf: Diffuse {
                n,
                rho: Vec3::splat([4.0; 3]),
            },
        };
        let numbers = Pair(
            <F32x8 as Lane>::Bits::splat(1 << 31),
            <F32x8 as Lane>::Bits::splat(1 << 30),
        );
        let drawn = draw(&light.seen_from(point.p), numbers);
        let all = <F32x8 as Lane>::Mask::splat(true);
        let found = by_light(crate::estimator::density::ConeOnly, &point, &drawn, all).unwrap();
        let ld = found.ld(&light, point.bsdf.rho);
        assert_eq!(found.active.to_bitmask(), 0b0101_0101);
        for lane in 0..8 {
            let expected = if lane % 2 == 0 { [f32::INFINITY; 3] } else { [0.0; 3] };
            assert_eq!(ld.lane(lane), expected, "lane {lane}");
        }
    }
}
