//! The estimators of direct light, written once, generic over lanes.
//!
//! `L_o = ∫ L_e V f max(n·wi, 0) dwi`. One sample of it is, for a direction `wi` drawn with density `pdf`,
//! `L_e V f_cos / pdf`. Two shapes of that:
//!
//! - [`per_light`]: `light`, `mis`, `mis2-balance`, `mis2-power` and `projected` draw one direction for every light, or two. It
//!   counts that light alone, so its radiance is known before any ray is traced and only its visibility is missing.
//!   [`density`] says how directions of the light and of the BRDF are combined.
//! - [`per_point`]: `uniform` and `brdf` draw one direction for the point. Whatever it meets first brings the radiance.
//!
//! Both know neither scene nor accelerator: they are functions of points, directions and random numbers.

pub mod density;
pub mod kind;
pub mod per_delta;
pub mod per_environment;
pub mod per_light;
pub mod per_point;
pub mod per_sun;
pub mod per_triangle;

use crate::bsdf::Brdf;
use crate::lane::Lane;
use crate::math::Vec3;

/// Where light is asked for.
#[derive(Clone, Copy, Debug)]
pub struct ShadingPoint<L: Lane, B> {
    /// The point, already moved off its surface.
    pub p: Vec3<L>,
    /// Geometric normal on the side of `wo`; unit.
    pub ng: Vec3<L>,
    /// The model of reflection, with the shading normal.
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
    /// The same point with another model.
    #[inline(always)]
    pub fn with<C>(&self, bsdf: C) -> ShadingPoint<L, C> {
        ShadingPoint {
            p: self.p,
            ng: self.ng,
            bsdf,
        }
    }
}
