//! `light` and `mis`: a direction in the cone of every light. `mis` instead uses a BRDF sample with probability one half, which all
//! lights share. A BRDF sample costs as much as a cone sample and mostly hits no light. Sampling it per light took a third of the
//! shading time and gained nothing, because a direction seldom hits two lights.

use std::f32::consts::FRAC_1_PI;

use super::density::{Average, ConeOnly, Density, DiskOrCone, Listed, LobeInCap, Mix, Projected};
use super::{ShadingPoint, product};
use crate::bsdf::{Brdf, Diffuse, DiffuseOrPhong, Phong, SeenSphere, Tint};
use crate::lane::{Lane, Mask};
use crate::light::{Cap, Cone, SphereLight, View};
use crate::math::elementary::sin_cos_turn;
use crate::math::{Frame, Vec3};
use crate::sampling::{Pair, TechniqueSample, warp};

/// An unoccluded contribution of a light, and the shadow ray that decides its visibility.
#[derive(Clone, Copy, Debug)]
pub struct Contribution<L: Lane> {
    /// Lanes that need a shadow ray; in the others the contribution is exactly 0.
    pub active: L::Mask,
    /// Unit direction to the light.
    pub wi: Vec3<L>,
    /// Distance to the light.
    pub distance: L,
    /// `le * f_cos / pdf`; counts if nothing occludes the light.
    pub ld: Vec3<L>,
}

/// A [`Contribution`] before colors are applied.
#[derive(Clone, Copy, Debug)]
pub struct Weighed<L: Lane, T = L> {
    /// Lanes that need a shadow ray; in the others the weight is exactly 0.
    pub active: L::Mask,
    /// Unit direction to the light.
    pub wi: Vec3<L>,
    /// Distance to the light.
    pub distance: L,
    /// `f_cos / pdf` without the colors of the light and of the material.
    pub weight: T,
}

impl<L: Lane, T: Tint<L>> Weighed<L, T> {
    /// `le * f_cos / pdf` for points with this reflectance. Idle lanes are masked last: an overflow there must not reach the sum as
    /// infinity times 0.
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
    /// `1 - cos` of the angle from the axis of the cone.
    t: L,
    wi: Vec3<L>,
}

/// One sample of the density: BRDF sampling in lanes that chose it if the density mixes both, else light sampling. A render splits
/// this in two steps, because its packets mostly use one technique and lights share the BRDF sample.
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

/// Samples a light at points of a model. A density is implemented only for the models it supports.
pub trait Directions<L: Lane, B: Brdf<L>>: Density {
    /// Samples a direction to the light for each active point and weights it; `None` if no lane receives light.
    fn toward_light(
        self,
        point: &ShadingPoint<L, B>,
        view: &View<L>,
        numbers: Pair<L::Bits>,
        active: L::Mask,
    ) -> Option<Weighed<L, B::Tint>>;
}

/// `Density: models => expression`, in terms of `point` and the other arguments of [`Directions::toward_light`].
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
    Projected: [DiffuseOrPhong] => |_own, point, view, pair, active| by_cap(point, view, pair, active);
    DiskOrCone: [Diffuse] => |own, point, view, pair, active| product::by_disk_or_cone(own, point, view, pair, active);
    DiskOrCone: [DiffuseOrPhong] => |own, point, view, pair, active| product::by_disk_or_cone(own, point, view, pair, active);
    LobeInCap: [Phong] => |_own, point, view, pair, active| product::by_lobe(point, view, pair, active);
    LobeInCap: [DiffuseOrPhong] => |_own, point, view, pair, active| product::by_lobe(&point.with(point.bsdf.as_phong()), view, pair, active);
}

/// Merges samples whose active lanes are disjoint.
#[inline(always)]
pub(super) fn either<L: Lane, T: Tint<L>>(a: Option<Weighed<L, T>>, b: Option<Weighed<L, T>>) -> Option<Weighed<L, T>> {
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

/// Samples a direction uniformly in the cone of a light.
#[inline(always)]
pub fn draw<L: Lane>(view: &View<L>, numbers: Pair<L::Bits>) -> Drawn<L> {
    let cone = view.cone();
    let (u, v) = numbers.unit::<L>();
    let t = warp::cone(u, cone.one_minus_cos_max);
    let (sin_phi, cos_phi) = sin_cos_turn(v);
    let wi = Frame::about(cone.axis).direction(t, sin_phi, cos_phi);
    Drawn { cone, t, wi }
}

/// Weights a direction from [`draw`]; `None` if no lane receives light. Test [`may_contribute`] before sampling, which is cheaper.
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

/// Samples the part of the light above the horizon, cosine-weighted. For diffuse points only: `f_cos / pdf` then reduces to the
/// projected solid angle of the light over pi, the same for every direction.
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
    // The cosine is positive by construction; that of the rounded direction may not be, if a light is at the horizon.
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

/// Samples the BRDF direction that all lights of a point share; 0 if it does not leave the surface.
#[inline(always)]
pub fn along_lobe<L: Lane, B: Brdf<L>>(point: &ShadingPoint<L, B>, numbers: Pair<L::Bits>) -> Vec3<L> {
    let (u, v) = numbers.unit::<L>();
    let wi = point.bsdf.draw(u, v);
    let (_, above) = point.above(wi);
    wi.or_zero(above)
}

/// Weights a direction from [`along_lobe`] for `light`; `None` if no lane receives light.
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

/// `f_cos / pdf` without the reflectance; active lanes, and those of them with BRDF samples.
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

/// Lanes where a direction in the cone can contribute.
#[inline(always)]
pub fn may_contribute<L: Lane, B: Brdf<L>>(point: &ShadingPoint<L, B>, view: &View<L>) -> L::Mask {
    point.bsdf.may_reflect(&seen_sphere(view))
}

#[inline(always)]
pub(super) fn seen_sphere<L: Lane>(view: &View<L>) -> SeenSphere<L> {
    SeenSphere {
        to_center: view.to_center,
        distance: view.distance,
        radius: view.radius,
        inside: view.inside(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lane::{Bits, F32x8};

    /// Every other point faces away from a light whose radiance times the reflectance overflows `f32`.
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
