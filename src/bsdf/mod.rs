//! BRDF models: one per file, each a type that implements [`Brdf`].
//!
//! A model samples a direction, evaluates `f_cos` and its sampling density there, and tells which directions it cannot reflect.
//! Values are [`Tint`]s: numbers to be multiplied by the colors of a light and of a material.
//!
//! [`Diffuse`] and [`Phong`] share a form: a lobe around an axis with the density `(a + 1) / (2 pi) cos^a`. For the diffuse model
//! the axis is the normal and `a = 1`; for Phong it is the mirror direction and `a = alpha`. [`DiffuseOrPhong`] holds either in each lane.

mod conductor;
pub mod diffuse;
mod ggx;
mod microfacet;
mod mixed;
pub mod phong;
mod tint;

pub use conductor::{Conductor, fresnel};
pub use diffuse::Diffuse;
pub use ggx::Ggx;
pub use microfacet::{Glint, Microfacets};
pub use mixed::DiffuseOrPhong;
pub use phong::Phong;
pub use tint::{Tint, Tints};

use crate::lane::Lane;
use crate::math::Vec3;

/// A BRDF at the points of a packet, seen from `wo`.
pub trait Brdf<L: Lane>: Copy {
    /// The type of values before colors: a single number if all reflection has the color of the material.
    type Tint: Tint<L>;

    /// Whether `f` is the same for all directions.
    const EVEN: bool = false;

    /// The unit shading normal.
    fn normal(&self) -> Vec3<L>;

    /// The color of the material: the reflectance argument of [`Tint::colour`].
    fn rho(&self) -> Vec3<L>;

    /// Samples a unit direction from `u` and `v` in [0, 1); it may point below the horizon.
    fn draw(&self, u: L, v: L) -> Vec3<L>;

    /// `f_cos` and density at the unit direction `wi`, whose cosine with the normal is `cos_theta > 0`; other lanes are undefined.
    fn eval(&self, wi: Vec3<L>, cos_theta: L) -> Lobe<L, Self::Tint>;

    /// `f_cos / pdf` at a direction from [`Self::draw`] with `cos_theta > 0`.
    #[inline(always)]
    fn weight(&self, wi: Vec3<L>, cos_theta: L) -> Self::Tint {
        let lobe = self.eval(wi, cos_theta);
        lobe.shape.over(lobe.pdf).kept(lobe.pdf.gt(L::zero()))
    }

    /// Lanes where the BRDF may be nonzero for a direction to a sphere; in the others it is exactly 0 for all of them.
    #[inline(always)]
    fn may_reflect(&self, sphere: &SeenSphere<L>) -> L::Mask {
        rises(self.normal(), sphere)
    }
}

/// The evaluation of a direction.
#[derive(Clone, Copy, Debug)]
pub struct Lobe<L, T = L> {
    /// `f_cos` without colors, per steradian.
    pub shape: T,
    /// Density of BRDF sampling, per steradian.
    pub pdf: L,
}

/// A sphere as seen from points.
#[derive(Clone, Copy, Debug)]
pub struct SeenSphere<L: Lane> {
    /// Vector to its center.
    pub to_center: Vec3<L>,
    /// Distance to its center.
    pub distance: L,
    /// Its radius.
    pub radius: L,
    /// Lanes inside the sphere.
    pub inside: L::Mask,
}

/// Lanes where any part of a sphere is above the horizon. Both sides are multiplied by the distance to avoid a division.
#[inline(always)]
fn rises<L: Lane>(n: Vec3<L>, sphere: &SeenSphere<L>) -> L::Mask {
    let radius = mutate!(sphere.radius, RimForgotten => L::zero());
    let highest = n.dot(sphere.to_center) + radius;
    highest.gt(sphere.distance * L::splat(-1e-6))
}

/// The mirror direction of `wo` about the unit vector `n`.
#[inline(always)]
fn mirrored<L: Lane>(n: Vec3<L>, wo: Vec3<L>) -> Vec3<L> {
    let twice = n.dot(wo) + n.dot(wo);
    n.mul_add(twice, -wo)
}
