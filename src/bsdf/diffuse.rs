//! Lambert's model: `f = rho / pi`, sampled in proportion to the cosine.

use std::f32::consts::FRAC_1_PI;

use super::Lobe;
use crate::lane::Lane;
use crate::sampling::warp;

/// `t = 1 - cos(theta)` about the normal, from `u` in [0, 1).
#[inline(always)]
pub fn sample<L: Lane>(u: L) -> L {
    warp::cosine(u)
}

/// Shape and density at a direction with `cos_theta > 0`: they are the same.
#[inline(always)]
pub fn eval<L: Lane>(cos_theta: L) -> Lobe<L> {
    let pdf = cos_theta * L::splat(FRAC_1_PI);
    Lobe { shape: pdf, pdf }
}
