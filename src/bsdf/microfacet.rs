//! Microfacets with the distribution of Trowbridge and Reitz 1975, called GGX by Walter et al. 2007, "Microfacet Models for
//! Refraction through Rough Surfaces".
//!
//! With the roughness `a` of the distribution, the half vector `h` of `wo` and `wi`, and `c` a cosine with the normal:
//!
//! - distribution: `D = a^2 / (pi (a^2 cos_h^2 + sin_h^2)^2)`;
//! - masking: `G1(w) = 2 c / (c + r(c))`, `r(c) = sqrt(a^2 + (1 - a^2) c^2)` (Smith 1967);
//! - height-correlated masking and shadowing: `G2 = 2 c_o c_i / (c_o r(c_i) + c_i r(c_o))` (Heitz 2014, "Understanding the
//!   Masking-Shadowing Function in Microfacet-Based BRDFs", equation 99);
//! - `f_cos = F D G2 / (4 c_o)`; directions have the density `D G1(w_o) / (4 c_o)`, i.e. visible normals are sampled.
//!
//! No formula here divides by `c_o`, and none computes an angle from a cosine near 1, so `a` may be as small as 1e-8.

use std::f32::consts::FRAC_1_PI;

use super::mirrored;
use crate::lane::Lane;
use crate::math::elementary::sin_cos_turn;
use crate::math::{Frame, Vec3};

/// The largest number below 1.
const BELOW_ONE: f32 = 1.0 - f32::EPSILON / 2.0;

/// A microfacet surface at the points of a packet.
#[derive(Clone, Copy, Debug)]
pub struct Microfacets<L> {
    /// Unit shading normal.
    pub n: Vec3<L>,
    /// Unit view direction, on the side of `n`.
    pub wo: Vec3<L>,
    /// Roughness of the distribution, in (0, 1].
    pub alpha: L,
}

/// Evaluation of a direction.
#[derive(Clone, Copy, Debug)]
pub struct Glint<L> {
    /// `f_cos` of perfectly reflecting facets, per steradian.
    pub value: L,
    /// Sampling density, per steradian.
    pub pdf: L,
    /// Cosine between the direction and the half vector.
    pub cos_half: L,
}

impl<L: Lane> Microfacets<L> {
    /// The surface seen from the unit direction `wo`. If the shading normal is turned away from the camera, `wo` is reflected in
    /// the plane of that normal.
    #[inline(always)]
    pub fn new(n: Vec3<L>, wo: Vec3<L>, alpha: L) -> Self {
        let below = n.dot(wo).min(L::zero());
        let wo = n.mul_add(-(below + below), wo);
        Self { n, wo, alpha }
    }

    /// Cosine of `wo`, in [0, 1].
    #[inline(always)]
    pub fn cos_o(&self) -> L {
        self.n.dot(self.wo).max(L::zero()).min(L::one())
    }

    /// `sqrt(a^2 + (1 - a^2) c^2)`.
    #[inline(always)]
    fn root(&self, cosine: L) -> L {
        let squared = self.alpha * self.alpha;
        (cosine * cosine).mul_add(L::one() - squared, squared).sqrt()
    }

    /// Samples a direction from `u` and `v` in [0, 1): a visible normal on the stretched unit sphere, from a spherical cap (Dupuy
    /// and Benyoub 2023, "Sampling Visible GGX Normals with Spherical Caps"). The direction may point below the horizon.
    ///
    /// With the height `z` of the stretched `wo`, the cap is `-z < height <= 1`. Radius and height above the rim are computed as
    /// products, not as differences of numbers near 1.
    #[inline(always)]
    pub fn draw(&self, u: L, v: L) -> Vec3<L> {
        let frame = Frame::about(self.n);
        let (alpha, cos_o) = (self.alpha, self.cos_o());
        let (x, y) = (alpha * frame.tangent.dot(self.wo), alpha * frame.bitangent.dot(self.wo));
        let across = x.mul_add(x, y * y);
        let scale = L::one() / cos_o.mul_add(cos_o, across).sqrt();
        let above = cos_o.mul_add(scale, L::one());
        let below = across * scale * scale / above;
        let u = u.min(L::splat(BELOW_ONE));
        let height = (L::one() - u) * above;
        let radius = (u * above * (height + below)).sqrt();
        let (sin_phi, cos_phi) = sin_cos_turn(v);
        let (x, y) = (radius.mul_add(cos_phi, x * scale), radius.mul_add(sin_phi, y * scale));
        let along = frame.tangent * (alpha * x) + frame.bitangent * (alpha * y);
        mirrored(self.n.mul_add(height, along).normalize(), self.wo)
    }

    /// Value and density at the unit direction `wi` with the cosine `cos_i > 0`.
    #[inline(always)]
    pub fn eval(&self, wi: Vec3<L>, cos_i: L) -> Glint<L> {
        let half = self.wo + wi;
        let (squared, up) = (half.length_squared(), self.n.dot(half));
        let across = self.n.mul_add(-up, half).length_squared();
        // a |h|^2 / (a^2 up^2 + across^2): its square is pi D, and no term is a difference.
        let along = self.alpha * up;
        let below = along.mul_add(along, across);
        let root = (self.alpha * squared).div_or_zero(below, below.gt(L::zero()));
        let distribution = root * root * L::splat(FRAC_1_PI);
        let cos_o = self.cos_o();
        let root_o = self.root(cos_o);
        // Masking hides facets from wo, shadowing from wi.
        let both = cos_o * self.root(cos_i) / cos_i + root_o;
        let masked = cos_o + root_o;
        let cos_half = (squared.sqrt() * L::splat(0.5)).min(L::one());
        let value = L::splat(0.5) * distribution / mutate!(both, ShadowingForgotten => masked);
        let drawn = L::splat(0.5) * distribution / masked;
        let pdf = mutate!(drawn, HalfVectorForDirection => drawn * cos_half);
        Glint { value, pdf, cos_half }
    }
}

/// `(1 - c)^5`: Schlick's interpolation from the reflectance at normal incidence to 1 (Schlick 1994).
#[inline(always)]
pub fn schlick<L: Lane>(cosine: L) -> L {
    let x = L::one() - cosine;
    let squared = x * x;
    squared * squared * x
}
