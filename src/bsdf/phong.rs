//! The normalised Phong lobe of the hand-out: `f = rho (alpha + 1) / (2 pi) max(0, dot(wr, wi))^alpha`.

use super::Lobe;
use crate::lane::Lane;
use crate::math::Vec3;
use crate::math::elementary::powcos;
use crate::sampling::warp;

/// `t = 1 - cos` about the mirror direction, from `u` in [0, 1).
#[inline(always)]
pub fn sample<L: Lane>(u: L, alpha: L) -> L {
    warp::power(u, alpha)
}

/// Shape and density at `wi`. The lobe is 0 behind the mirror direction and where it underflows.
#[inline(always)]
pub fn eval<L: Lane>(wr: Vec3<L>, wi: Vec3<L>, cos_theta: L, alpha: L) -> Lobe<L> {
    // The chord has the digits that the scalar product of two stored unit vectors has not.
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
