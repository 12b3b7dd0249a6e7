//! A light that is wholly above the horizon, sampled uniformly in projected solid angle, i.e. cosine-weighted: the common case of a
//! [`Cap`](super::Cap), at about the cost of a direction in the cone.
//!
//! The rim of the cap bounds a flat disk with the center `cos(theta_max) axis` and the radius `sin(theta_max)`. Moved along the
//! normal `n` onto the unit sphere, this disk is the cap. The move keeps the projection onto the surface, so a uniform point of the
//! disk is a direction with the density `cos / (pi sin^2(theta_max) (n . axis))`.
//!
//! With `below` the height of a point of the disk over the surface and `squared` its squared distance from the sphere within the
//! plane of the disk, the direction's height is `sqrt(below^2 + squared)`, and the way along the normal is
//! `squared / (height + below)`: sums of positive terms only.

use super::{Cone, View};
use crate::lane::Lane;
use crate::math::elementary::sin_cos_turn;
use crate::math::{Frame, Vec3};

/// A direction in the cap.
#[derive(Clone, Copy, Debug)]
pub struct OnDisk<L: Lane> {
    /// The unit direction.
    pub wi: Vec3<L>,
    /// Its cosine with the normal.
    pub cos_theta: L,
    /// `1 - cos` of the angle from the axis of the light's cone.
    pub t: L,
    /// [`share`], the same for all directions up to rounding.
    pub share: L,
}

/// Lanes where the whole light is above the plane with the unit normal `n`; not from inside the light.
#[inline(always)]
pub fn clears<L: Lane>(n: Vec3<L>, view: &View<L>) -> L::Mask {
    n.dot(view.to_center).ge(view.radius) & !view.inside()
}

/// Projected solid angle over pi, where the light [clears] the plane: what it brings to a diffuse surface if nothing is in between.
#[inline(always)]
pub fn share<L: Lane>(n: Vec3<L>, view: &View<L>) -> L {
    let inverse = L::one() / view.distance;
    let sine = view.radius * inverse;
    let high = n.dot(view.to_center) * inverse;
    sine * sine * mutate!(high, OpenLightOverhead => L::one())
}

/// Samples a direction from `u` and `v` in [0, 1), where the light [clears] the plane with the unit normal `n`.
#[inline(always)]
pub fn draw<L: Lane>(n: Vec3<L>, cone: &Cone<L>, u: L, v: L) -> OnDisk<L> {
    let (one, omc) = (L::one(), cone.one_minus_cos_max);
    let squared_sine = omc * (L::splat(2.0) - omc);
    let inner = mutate!(u, DiskDenserInTheMiddle => u * u);
    let radius = (inner * squared_sine).sqrt();
    let (sin_phi, cos_phi) = sin_cos_turn(v);
    let frame = Frame::about(cone.axis);
    let aside = frame.tangent * (radius * cos_phi) + frame.bitangent * (radius * sin_phi);
    let high = n.dot(cone.axis);
    let below = (one - omc).mul_add(high, n.dot(aside));
    let squared = squared_sine * (one - inner);
    let height = below.mul_add(below, squared).sqrt();
    let both = height + below;
    let rise = squared.div_or_zero(both, both.gt(L::zero()));
    OnDisk {
        wi: cone.axis.mul_add(one - omc, n.mul_add(rise, aside)),
        cos_theta: height,
        t: omc - high * rise,
        share: squared_sine * mutate!(high, DiskWithoutItsSlant => L::one()),
    }
}
