//! Lambert's model: `f = rho / pi`, cosine-weighted sampling.

use std::f32::consts::FRAC_1_PI;

use super::{Brdf, Lobe};
use crate::lane::Lane;
use crate::math::elementary::sin_cos_turn;
use crate::math::{Frame, Vec3};
use crate::sampling::warp;

/// Lambert's model at the points of a packet.
#[derive(Clone, Copy, Debug)]
pub struct Diffuse<L: Lane> {
    /// Unit shading normal.
    pub n: Vec3<L>,
    /// Reflectance.
    pub rho: Vec3<L>,
}

/// Samples `t = 1 - cos(theta)` about the normal from `u` in [0, 1).
#[inline(always)]
pub fn sample<L: Lane>(u: L) -> L {
    warp::cosine(u)
}

/// Value and density at a direction with `cos_theta > 0`; both are equal.
#[inline(always)]
pub fn eval<L: Lane>(cos_theta: L) -> Lobe<L> {
    let pdf = cos_theta * L::splat(FRAC_1_PI);
    Lobe { shape: pdf, pdf }
}

impl<L: Lane> Brdf<L> for Diffuse<L> {
    type Tint = L;
    const EVEN: bool = true;

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
        Frame::about(self.n).direction(sample(u), sin_phi, cos_phi)
    }

    #[inline(always)]
    fn eval(&self, _: Vec3<L>, cos_theta: L) -> Lobe<L> {
        eval(cos_theta)
    }

    /// Value and density cancel.
    #[inline(always)]
    fn weight(&self, _: Vec3<L>, _: L) -> L {
        L::one()
    }
}
