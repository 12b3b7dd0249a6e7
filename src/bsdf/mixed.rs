//! The diffuse and the Phong model together, one per lane. Renders have a stream per model and do not use this type; tests and
//! `selftest` use it to check both models at once.

use super::{Brdf, Diffuse, Lobe, Phong, SeenSphere, diffuse, phong, rises};
use crate::lane::Lane;
use crate::math::elementary::sin_cos_turn;
use crate::math::{Frame, Vec3};

/// One of two models in each lane.
#[derive(Clone, Copy, Debug)]
pub struct DiffuseOrPhong<L: Lane> {
    /// Unit shading normal, on the side of `wo`.
    pub n: Vec3<L>,
    /// Unit mirror direction of `wo` about `n`.
    pub wr: Vec3<L>,
    /// Reflectance: diffuse or specular.
    pub rho: Vec3<L>,
    /// The exponent: 1 is diffuse, above 1 is Phong.
    pub alpha: L,
    /// Lanes with the Phong model.
    pub phong: L::Mask,
    /// See [`Phong`].
    pub reach: L,
}

impl<L: Lane> DiffuseOrPhong<L> {
    /// The models at a point seen from the unit direction `wo`.
    #[inline(always)]
    pub fn new(n: Vec3<L>, wo: Vec3<L>, rho: Vec3<L>, alpha: L) -> Self {
        let Phong { wr, reach, .. } = Phong::new(n, wo, rho, alpha, phong::reach(alpha));
        Self {
            n,
            wr,
            rho,
            alpha,
            phong: alpha.gt(L::one()),
            reach,
        }
    }

    /// The Phong model; valid in its lanes.
    #[inline(always)]
    pub fn as_phong(&self) -> Phong<L> {
        let Self {
            n,
            wr,
            rho,
            alpha,
            reach,
            ..
        } = *self;
        Phong {
            n,
            wr,
            rho,
            alpha,
            reach,
        }
    }

    /// The diffuse model; valid in the other lanes.
    #[inline(always)]
    pub fn as_diffuse(&self) -> Diffuse<L> {
        Diffuse {
            n: self.n,
            rho: self.rho,
        }
    }

    /// The axis of each lane's lobe.
    #[inline(always)]
    pub fn axis(&self) -> Vec3<L> {
        Vec3::select(self.phong, self.wr, self.n)
    }

    /// Samples `t = 1 - cos` about the axis from `u` in [0, 1).
    #[inline(always)]
    pub fn sample(&self, u: L) -> L {
        L::select(self.phong, phong::sample(u, self.alpha), diffuse::sample(u))
    }
}

impl<L: Lane> Brdf<L> for DiffuseOrPhong<L> {
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
        Frame::about(self.axis()).direction(self.sample(u), sin_phi, cos_phi)
    }

    #[inline(always)]
    fn eval(&self, wi: Vec3<L>, cos_theta: L) -> Lobe<L> {
        let (diffuse, phong) = (diffuse::eval(cos_theta), self.as_phong().eval(wi, cos_theta));
        Lobe {
            shape: L::select(self.phong, phong.shape, diffuse.shape),
            pdf: L::select(self.phong, phong.pdf, diffuse.pdf),
        }
    }

    #[inline(always)]
    fn weight(&self, _: Vec3<L>, cos_theta: L) -> L {
        L::select(self.phong, cos_theta, L::one())
    }

    #[inline(always)]
    fn may_reflect(&self, sphere: &SeenSphere<L>) -> L::Mask {
        rises(self.n, sphere) & (!self.phong | self.as_phong().near(sphere))
    }
}
