//! How surfaces reflect: one model a file, each a type that implements [`Brdf`].
//!
//! A model draws a direction, says what it reflects there and with which density it draws it, and which directions it cannot
//! reflect. What it reflects is a [`Tint`]: numbers that wait for the colours of a light and of a material.
//!
//! [`Diffuse`] and [`Phong`] have one shape: a lobe about an axis with the density `(a + 1) / (2 pi) cos^a`. For the diffuse model
//! the axis is the normal and `a = 1`; for Phong it is the mirror direction and `a = alpha`. [`Bsdf`] holds either in each lane.

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
pub use mixed::Bsdf;
pub use phong::Phong;
pub use tint::{Tint, Tints};

use crate::lane::Lane;
use crate::math::Vec3;

/// A model of reflection at the points of a packet, seen from `wo`.
pub trait Brdf<L: Lane>: Copy {
    /// What it says of a direction before colours are known: one number where all of it has the colour of the material.
    type Tint: Tint<L>;

    /// The shading normal; unit.
    fn normal(&self) -> Vec3<L>;

    /// The colour of the material: the reflectance that [`Tint::colour`] is given.
    fn rho(&self) -> Vec3<L>;

    /// Draws a unit direction from `u` and `v` in [0, 1); it may point below the horizon.
    fn draw(&self, u: L, v: L) -> Vec3<L>;

    /// `f_cos` and density at the unit direction `wi`, whose cosine with the normal is `cos_theta > 0`; lanes where it is not hold
    /// nothing of use.
    fn eval(&self, wi: Vec3<L>, cos_theta: L) -> Lobe<L, Self::Tint>;

    /// `f_cos / pdf` at a direction drawn by [`Self::draw`] with `cos_theta > 0`.
    #[inline(always)]
    fn weight(&self, wi: Vec3<L>, cos_theta: L) -> Self::Tint {
        let lobe = self.eval(wi, cos_theta);
        lobe.shape.over(lobe.pdf).kept(lobe.pdf.gt(L::zero()))
    }

    /// Lanes where the model may reflect anything from a ball; elsewhere it is exactly 0 in all of it.
    #[inline(always)]
    fn may_reflect(&self, ball: &Ball<L>) -> L::Mask {
        rises(self.normal(), ball)
    }
}

/// What a model says of a direction.
#[derive(Clone, Copy, Debug)]
pub struct Lobe<L, T = L> {
    /// `f_cos` without the colours, per steradian.
    pub shape: T,
    /// Density of sampling the model, per steradian.
    pub pdf: L,
}

/// A ball as seen from points.
#[derive(Clone, Copy, Debug)]
pub struct Ball<L: Lane> {
    /// To its centre.
    pub to_center: Vec3<L>,
    /// Distance to its centre.
    pub distance: L,
    /// Its radius.
    pub radius: L,
    /// Lanes inside of it.
    pub inside: L::Mask,
}

/// Lanes where any of a ball is above the horizon. All is multiplied by the distance: no division is needed.
#[inline(always)]
fn rises<L: Lane>(n: Vec3<L>, ball: &Ball<L>) -> L::Mask {
    let radius = mutate!(ball.radius, RimForgotten => L::zero());
    let highest = n.dot(ball.to_center) + radius;
    highest.gt(ball.distance * L::splat(-1e-6))
}

/// The mirror direction of `wo` about the unit vector `n`.
#[inline(always)]
fn mirrored<L: Lane>(n: Vec3<L>, wo: Vec3<L>) -> Vec3<L> {
    let twice = n.dot(wo) + n.dot(wo);
    n.mul_add(twice, -wo)
}
