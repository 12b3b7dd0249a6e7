//! From two uniform numbers to a direction: each warp beside its density, all as `t = 1 - cos` about an axis.
//!
//! An azimuth comes from the second number by [`crate::math::elementary::sin_cos_turn`]; a warp here gives `t` alone.
//! `t` is kept instead of the cosine because lobes and cones get as narrow as 1e-7, where a cosine is 1.

use std::f32::consts::{FRAC_1_PI, PI};

use crate::lane::Lane;
use crate::math::elementary::{expm1, ln};

/// Uniform over the sphere: `t` in [0, 2].
#[inline(always)]
pub fn sphere<L: Lane>(u: L) -> L {
    u + u
}

/// Density of [`sphere`] per steradian.
pub const SPHERE_PDF: f32 = 0.25 * FRAC_1_PI;

/// Uniform in the cone with `omc = 1 - cos(theta_max)`: `t` in [0, omc].
#[inline(always)]
pub fn cone<L: Lane>(u: L, omc: L) -> L {
    mutate!(u, ConeTowardsTheAxis => u * u) * omc
}

/// Density of [`cone`] per steradian, inside the cone.
#[inline(always)]
pub fn cone_pdf<L: Lane>(omc: L) -> L {
    L::one() / cone_solid_angle(omc)
}

/// Solid angle of the cone, in steradians.
#[inline(always)]
pub fn cone_solid_angle<L: Lane>(omc: L) -> L {
    L::splat(2.0 * PI) * omc
}

/// Proportional to the cosine over the hemisphere: `t = 1 - sqrt(1 - u)`, written without cancellation.
#[inline(always)]
pub fn cosine<L: Lane>(u: L) -> L {
    u / (L::one() + (L::one() - u).sqrt())
}

/// Density of [`cosine`] per steradian; 0 below the horizon.
#[inline(always)]
pub fn cosine_pdf<L: Lane>(cosine: L) -> L {
    cosine.max(L::zero()) * L::splat(FRAC_1_PI)
}

/// Proportional to `cos^alpha` over the hemisphere: `cos = (1 - u)^(1 / (alpha + 1))` (the hand-out, section 5), so
/// `t = -expm1(ln(1 - u) / (alpha + 1))`, which has all its digits at every exponent. `1 - u` is exact and not 0.
#[inline(always)]
pub fn power<L: Lane>(u: L, alpha: L) -> L {
    -expm1(ln(L::one() - u) / (alpha + L::one()))
}

/// Density of [`power`] per steradian, given `cos^alpha` (0 below the horizon).
#[inline(always)]
pub fn power_pdf<L: Lane>(cos_to_the_alpha: L, alpha: L) -> L {
    let normalisation = (alpha + mutate!(L::one(), WrongNormalisation => L::splat(2.0))) * L::splat(0.5 * FRAC_1_PI);
    normalisation * cos_to_the_alpha
}
