//! The normalized Phong lobe of the course assignment (README): `f = rho (alpha + 1) / (2 pi) max(0, dot(wr, wi))^alpha`.

use super::{Brdf, Lobe, SeenSphere, mirrored, rises};
use crate::lane::Lane;
use crate::math::elementary::{powcos, sin_cos_turn};
use crate::math::{Frame, Vec3};
use crate::sampling::warp;

/// Phong's model at the points of a packet.
#[derive(Clone, Copy, Debug)]
pub struct Phong<L: Lane> {
    /// Unit shading normal.
    pub n: Vec3<L>,
    /// Unit mirror direction of `wo` about `n`.
    pub wr: Vec3<L>,
    /// Specular reflectance.
    pub rho: Vec3<L>,
    /// The exponent, above 1.
    pub alpha: L,
    /// Beyond this chord from `wr`, the lobe is exactly 0 in `f32`; see [`reach`].
    pub reach: L,
}

/// Samples `t = 1 - cos` about the mirror direction from `u` in [0, 1).
#[inline(always)]
pub fn sample<L: Lane>(u: L, alpha: L) -> L {
    warp::power(u, alpha)
}

/// Value and density at `wi`. The lobe is 0 more than 90 degrees from the mirror direction and where it underflows.
#[inline(always)]
pub fn eval<L: Lane>(wr: Vec3<L>, wi: Vec3<L>, cos_theta: L, alpha: L) -> Lobe<L> {
    // The chord is accurate where the dot product of two rounded unit vectors is not.
    let t = (wr - wi).length_squared() * L::splat(0.5);
    let pdf = warp::power_pdf(powcos(wr.dot(wi), t, alpha), alpha);
    Lobe {
        shape: mutate!(pdf * cos_theta, MissingCosine => pdf),
        pdf,
    }
}

/// The chord from `wr` beyond which [`eval`] gives exactly 0: the lobe is `exp(alpha ln(1 - t))`, `ln(1 - t) <= -t`,
/// `t = chord^2 / 2`, and [`exp`](crate::math::elementary::exp) is 0 below −87.34; 90 leaves room for rounding.
#[inline(always)]
pub fn reach<L: Lane>(alpha: L) -> L {
    (L::splat(mutate!(180.0, ReachTooShort => 120.0)) / alpha).sqrt()
}

impl<L: Lane> Phong<L> {
    /// The model at points seen from the unit direction `wo`; `reach` is that of `alpha`.
    #[inline(always)]
    pub fn new(n: Vec3<L>, wo: Vec3<L>, rho: Vec3<L>, alpha: L, reach: L) -> Self {
        Self {
            n,
            wr: mirrored(n, wo),
            rho,
            alpha,
            reach,
        }
    }

    /// Lanes where a sphere is close enough to the lobe that the lobe does not underflow.
    ///
    /// The chord from the axis to a direction of the sphere's cone is `2 sin(theta / 2) <= sqrt(2) sin(theta)`, for a cone up to a
    /// right angle.
    #[inline(always)]
    pub(super) fn near(&self, sphere: &SeenSphere<L>) -> L::Mask {
        self.within(self.reach, sphere)
    }

    /// Lanes where a sphere is not wholly in the lobe's tail, where it is below `e^-30` (1e-13) of its peak.
    #[inline(always)]
    pub fn beside_tail(&self, sphere: &SeenSphere<L>) -> L::Mask {
        // The root of 30 / 90: a third of the exponent in `reach`.
        self.within(self.reach * L::splat(0.577_350_3), sphere)
    }

    #[inline(always)]
    fn within(&self, chord: L, sphere: &SeenSphere<L>) -> L::Mask {
        let reach = chord.mul_add(sphere.distance, sphere.radius * L::splat(1.415));
        let apart = self.wr.mul_add(sphere.distance, -sphere.to_center);
        apart.length_squared().le(reach * reach) | sphere.inside
    }
}

impl<L: Lane> Brdf<L> for Phong<L> {
    type Tint = L;

    #[inline(always)]
    fn normal(&self) -> Vec3<L> {
        self.n
    }

    #[inline(always)]
    fn rho(&self) -> Vec3<L> {
        self.rho
    }

    #[inline(always)]
    fn draw(&self, u: L, v: L) -> Vec3<L> {
        let (sin_phi, cos_phi) = sin_cos_turn(v);
        Frame::about(self.wr).direction(sample(u, self.alpha), sin_phi, cos_phi)
    }

    #[inline(always)]
    fn eval(&self, wi: Vec3<L>, cos_theta: L) -> Lobe<L> {
        eval(self.wr, wi, cos_theta, self.alpha)
    }

    /// The remainder after density and value cancel (the assignment, section 5).
    #[inline(always)]
    fn weight(&self, _: Vec3<L>, cos_theta: L) -> L {
        cos_theta
    }

    #[inline(always)]
    fn may_reflect(&self, sphere: &SeenSphere<L>) -> L::Mask {
        rises(self.n, sphere) & self.near(sphere)
    }
}
