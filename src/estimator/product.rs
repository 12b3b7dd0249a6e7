//! `product`: directions to a sphere in proportion to the reflected light. On Phong surfaces the lobe inside the light, on diffuse ones the
//! cosine.

use std::f32::consts::FRAC_1_PI;

use super::ShadingPoint;
use super::per_light::{Weighed, ball, either, in_cap};
use crate::bsdf::{Brdf, Phong};
use crate::lane::{Lane, Mask};
use crate::light::{Cap, Cone, Ring, Rings, View, disk};
use crate::math::Vec3;
use crate::sampling::Pair;

/// Lanes where a light is wholly above the horizons of both normals.
#[inline(always)]
pub fn clears<L: Lane, B: Brdf<L>>(point: &ShadingPoint<L, B>, view: &View<L>) -> L::Mask {
    disk::clears(point.bsdf.normal(), view) & disk::clears(point.ng, view)
}

/// What a light brings to diffuse points where it [`clears`] the horizon, whatever its direction. It takes no random number: where
/// nothing can block the light, no direction is needed.
#[inline(always)]
pub fn unoccluded<L: Lane, B: Brdf<L>>(point: &ShadingPoint<L, B>, view: &View<L>, active: L::Mask) -> Weighed<L> {
    undirected(active, disk::share(point.bsdf.normal(), view))
}

#[inline(always)]
fn undirected<L: Lane>(active: L::Mask, weight: L) -> Weighed<L> {
    Weighed {
        active,
        wi: Vec3::zero(),
        distance: L::zero(),
        weight: weight.or_zero(active),
    }
}

/// Samples a light at diffuse points, cosine-weighted: by the cap where a horizon cuts it, else by its disk, which costs less. No
/// direction is sampled if nothing can block the light (`open`), but where the horizon of the geometric normal may.
#[inline(always)]
pub fn by_disk_or_cap<L: Lane, B: Brdf<L, Tint = L>>(
    point: &ShadingPoint<L, B>,
    view: &View<L>,
    numbers: Pair<L::Bits>,
    active: L::Mask,
    open: bool,
) -> Option<Weighed<L>> {
    let whole = active & clears(point, view);
    let rest = active & !whole;
    let disk = if whole.none() {
        None
    } else if open {
        Some(unoccluded(point, view, whole))
    } else {
        by_disk(point, view, numbers, whole)
    };
    let cap = if rest.any() {
        by_cap(point, view, numbers, rest, open)
    } else {
        None
    };
    either(disk, cap)
}

#[inline(always)]
fn by_cap<L: Lane, B: Brdf<L>>(
    point: &ShadingPoint<L, B>,
    view: &View<L>,
    numbers: Pair<L::Bits>,
    active: L::Mask,
    open: bool,
) -> Option<Weighed<L>> {
    let (n, cone) = (point.bsdf.normal(), view.cone());
    let cap = Cap::above(n, &cone);
    let bent = (point.ng - n).length_squared().gt(L::zero());
    if open && (active & bent).none() {
        let active = active & cap.projected().gt(L::zero());
        return Some(undirected(active, cap.projected() * L::splat(FRAC_1_PI)));
    }
    in_cap(point, &cone, &cap, numbers, active)
}

#[inline(always)]
fn by_disk<L: Lane, B: Brdf<L>>(
    point: &ShadingPoint<L, B>,
    view: &View<L>,
    numbers: Pair<L::Bits>,
    active: L::Mask,
) -> Option<Weighed<L>> {
    let cone = view.cone();
    let (u, v) = numbers.unit::<L>();
    let drawn = disk::draw(point.bsdf.normal(), &cone, u, v);
    let active = active & drawn.cos_theta.gt(L::zero());
    if active.none() {
        return None;
    }
    Some(Weighed {
        active,
        wi: drawn.wi,
        distance: cone.distance(drawn.t),
        weight: drawn.share.or_zero(active),
    })
}

/// Lanes where a light is not wholly in the tail of the lobe. In the tail one sample in [`RARE`](crate::sampling::sampler::RARE) is taken, for as much more weight
/// (Russian roulette): two thirds of a lobe's reach are tail, and brought 1e-13 of its peak at most for as much work.
#[inline(always)]
pub fn beside_tail<L: Lane>(point: &ShadingPoint<L, Phong<L>>, view: &View<L>) -> L::Mask {
    point.bsdf.beside_tail(&ball(view))
}

/// Samples the part of each point's lobe inside the light, in proportion to the lobe. A render does this in three steps over many
/// packets, which then overlap.
#[inline(always)]
pub fn by_lobe<L: Lane>(
    point: &ShadingPoint<L, Phong<L>>,
    view: &View<L>,
    numbers: Pair<L::Bits>,
    active: L::Mask,
) -> Option<Weighed<L>> {
    let cone = view.cone();
    let beside_tail = beside_tail(point, view);
    let rings = Rings::of(point.bsdf.wr, point.bsdf.alpha, &cone).weighed_in_tail(beside_tail);
    let active = active & rings.mass.gt(L::zero()) & (beside_tail | numbers.rare());
    if active.none() {
        return None;
    }
    let (u, v) = numbers.unit::<L>();
    let ring = rings.draw(point.bsdf.alpha, u);
    on_ring(point, &cone, &ring, rings.weight(&ring), v, active)
}

/// The direction at `v` on the arc of a ring inside the light; `weight` is [`Rings::weight`]. `None` if no lane receives light.
#[inline(always)]
pub fn on_ring<L: Lane>(
    point: &ShadingPoint<L, Phong<L>>,
    cone: &Cone<L>,
    ring: &Ring<L>,
    weight: L,
    v: L,
    active: L::Mask,
) -> Option<Weighed<L>> {
    let wi = ring.direction(point.bsdf.wr, cone.axis, v);
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
