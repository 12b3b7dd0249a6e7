//! Estimators of direct light, generic over lanes.
//!
//! `L_o = ∫ L_e V f max(n·wi, 0) dwi`. A sample with a direction `wi` of density `pdf` is `L_e V f_cos / pdf`. There are two forms:
//!
//! - [`per_light`]: `light`, `mis`, `mis2-balance`, `mis2-power`, `projected` and `product` sample one or two directions per light.
//!   Only that light counts, so its radiance is known before tracing and only its visibility is missing. [`density`] defines how light and
//!   BRDF sampling are combined.
//! - [`per_point`]: `uniform` and `brdf` sample one direction per point. Its first hit determines the radiance.
//!
//! Neither depends on the scene or the intersector: they are functions of points, directions and random numbers.

pub mod density;
pub mod kind;
pub mod per_delta;
pub mod per_environment;
pub mod per_light;
pub mod per_point;
pub mod per_sun;
pub mod per_triangle;
pub mod product;

use crate::bsdf::Brdf;
use crate::lane::Lane;
use crate::math::Vec3;

/// A point where light is sampled.
#[derive(Clone, Copy, Debug)]
pub struct ShadingPoint<L: Lane, B> {
    /// The point, offset from its surface.
    pub p: Vec3<L>,
    /// Unit geometric normal on the side of `wo`.
    pub ng: Vec3<L>,
    /// The BRDF, with the shading normal.
    pub bsdf: B,
}

impl<L: Lane, B: Brdf<L>> ShadingPoint<L, B> {
    /// The cosine with the shading normal, and the lanes where `wi` leaves the surface on the side of `wo`.
    #[inline(always)]
    pub fn above(&self, wi: Vec3<L>) -> (L, L::Mask) {
        let cos_theta = self.bsdf.normal().dot(wi);
        let above = cos_theta.gt(L::zero()) & self.ng.dot(wi).gt(L::zero());
        (cos_theta, mutate!(above, HorizonDropped => !above | above))
    }
}

impl<L: Lane, B> ShadingPoint<L, B> {
    /// The same point with another BRDF.
    #[inline(always)]
    pub fn with<C>(&self, bsdf: C) -> ShadingPoint<L, C> {
        ShadingPoint {
            p: self.p,
            ng: self.ng,
            bsdf,
        }
    }
}
