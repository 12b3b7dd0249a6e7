//! How surfaces reflect: one model a file, and [`Bsdf`], which holds a model per lane.
//!
//! Both models have one shape: a lobe about an axis with the density `(a + 1) / (2 pi) cos^a`. For the diffuse model the
//! axis is the normal and `a = 1`; for Phong it is the mirror direction and `a = alpha`. Sampling a direction is
//! therefore the same for every lane but for the number `t = 1 - cos` about the axis.

pub mod diffuse;
pub mod phong;

use crate::lane::{Lane, Mask};
use crate::math::elementary::sin_cos_turn;
use crate::math::{Frame, Vec3};

/// The reflection model of each lane at a shading point.
#[derive(Clone, Copy, Debug)]
pub struct Bsdf<L: Lane> {
    /// Shading normal, on the side of `wo`; unit.
    pub n: Vec3<L>,
    /// Mirror direction of `wo` about `n`; unit.
    pub wr: Vec3<L>,
    /// Reflectance: diffuse or specular.
    pub rho: Vec3<L>,
    /// The exponent: 1 means diffuse, above 1 means Phong.
    pub alpha: L,
    /// Lanes with Phong's model.
    pub phong: L::Mask,
    /// Beyond this chord from `wr`, the Phong lobe is exactly 0 in `f32`; see [`phong::reach`].
    pub reach: L,
}

/// What a model says of a direction, without the reflectance: `f_cos = rho * shape`.
#[derive(Clone, Copy, Debug)]
pub struct Lobe<L> {
    /// `f_cos / rho`, per steradian.
    pub shape: L,
    /// Density of sampling the model, per steradian.
    pub pdf: L,
}

impl<L: Lane> Bsdf<L> {
    /// The models at a point seen from the unit direction `wo`.
    #[inline(always)]
    pub fn new(n: Vec3<L>, wo: Vec3<L>, rho: Vec3<L>, alpha: L) -> Self {
        let twice = n.dot(wo) + n.dot(wo);
        Self {
            n,
            wr: n.mul_add(twice, -wo),
            rho,
            alpha,
            phong: alpha.gt(L::one()),
            reach: phong::reach(alpha),
        }
    }

    /// The diffuse model in every lane.
    #[inline(always)]
    pub fn diffuse(n: Vec3<L>, rho: Vec3<L>) -> Self {
        Self {
            n,
            wr: Vec3::zero(),
            rho,
            alpha: L::one(),
            phong: L::Mask::splat(false),
            reach: L::zero(),
        }
    }

    /// The axis of each lane's lobe.
    #[inline(always)]
    pub fn axis(&self) -> Vec3<L> {
        Vec3::select(self.phong, self.wr, self.n)
    }

    /// Draws `t = 1 - cos` about the axis from `u` in [0, 1).
    #[inline(always)]
    pub fn sample(&self, u: L) -> L {
        let diffuse = diffuse::sample(u);
        if self.phong.none() {
            return diffuse;
        }
        L::select(self.phong, phong::sample(u, self.alpha), diffuse)
    }

    /// Draws a unit direction of the lobe from `u` and `v` in [0, 1); it may point below the horizon.
    #[inline(always)]
    pub fn draw(&self, u: L, v: L) -> Vec3<L> {
        let (sin_phi, cos_phi) = sin_cos_turn(v);
        Frame::about(self.axis()).direction(self.sample(u), sin_phi, cos_phi)
    }

    /// Shape and density at `wi`, whose cosine with `n` is `cos_theta > 0`; lanes where it is not hold nothing of use.
    #[inline(always)]
    pub fn eval(&self, wi: Vec3<L>, cos_theta: L) -> Lobe<L> {
        let diffuse = diffuse::eval(cos_theta);
        if self.phong.none() {
            return diffuse;
        }
        let phong = phong::eval(self.wr, wi, cos_theta, self.alpha);
        Lobe {
            shape: L::select(self.phong, phong.shape, diffuse.shape),
            pdf: L::select(self.phong, phong.pdf, diffuse.pdf),
        }
    }

    /// `shape / pdf` at a direction drawn by [`Self::sample`] with `cos_theta > 0`: what remains after the density and
    /// the model cancel (the hand-out, section 5).
    #[inline(always)]
    pub fn weight(&self, cos_theta: L) -> L {
        L::select(self.phong, cos_theta, L::one())
    }
}
