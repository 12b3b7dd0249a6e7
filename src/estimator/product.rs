//! `product`: directions to a sphere in proportion to the reflected light. On Phong surfaces the lobe inside the light, on diffuse ones the
//! cosine, but for a light that the horizon cuts.

use super::ShadingPoint;
use super::density::Density;
use super::per_light::{Weighed, by_light, draw, either, seen_sphere};
use crate::bsdf::{Brdf, Phong};
use crate::lane::{Lane, Mask};
use crate::light::{Cone, Ring, Rings, View, disk};
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
    Weighed {
        active,
        wi: Vec3::zero(),
        distance: L::zero(),
        weight: disk::share(point.bsdf.normal(), view).or_zero(active),
    }
}

/// Samples a light at diffuse points: cosine-weighted by its disk, or in the cone where a horizon cuts it. There the cosine has a map
/// too (`projected`), but it takes three times as long and saves a fifth of the error on a scene of a large low light.
#[inline(always)]
pub fn by_disk_or_cone<L: Lane, D: Density, B: Brdf<L, Tint = L>>(
    density: D,
    point: &ShadingPoint<L, B>,
    view: &View<L>,
    numbers: Pair<L::Bits>,
    active: L::Mask,
) -> Option<Weighed<L>> {
    let whole = active & clears(point, view);
    let rest = active & !whole;
    let disk = if whole.any() {
        by_disk(point, view, numbers, whole)
    } else {
        None
    };
    let cone = if rest.any() {
        by_light(density, point, &draw(view, numbers), rest)
    } else {
        None
    };
    either(disk, cone)
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
    point.bsdf.beside_tail(&seen_sphere(view))
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
