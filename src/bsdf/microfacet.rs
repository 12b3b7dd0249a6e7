//! A rough surface of small mirrors with the distribution of Trowbridge and Reitz 1975, called GGX by Walter et al. 2007,
//! "Microfacet Models for Refraction through Rough Surfaces".
//!
//! With `a` the roughness of the distribution, `h` the half vector of `wo` and `wi`, `c` a cosine with the normal:
//!
//! - distribution: `D = a^2 / (pi (a^2 cos_h^2 + sin_h^2)^2)`;
//! - masking: `G1(w) = 2 c / (c + r(c))`, `r(c) = sqrt(a^2 + (1 - a^2) c^2)` (Smith 1967);
//! - height-correlated masking and shadowing: `G2 = 2 c_o c_i / (c_o r(c_i) + c_i r(c_o))` (Heitz 2014, "Understanding the
//!   Masking-Shadowing Function in Microfacet-Based BRDFs", equation 99);
//! - `f_cos = F D G2 / (4 c_o)`, and directions are drawn with `D G1(w_o) / (4 c_o)`: the normals that `wo` sees.
//!
//! No form here divides by `c_o`, and none takes a cosine near 1 for an angle: `a` may be 1e-8.

use std::f32::consts::FRAC_1_PI;

use super::mirrored;
use crate::lane::Lane;
use crate::math::elementary::sin_cos_turn;
use crate::math::{Frame, Vec3};

/// The largest number below 1.
const BELOW_ONE: f32 = 1.0 - f32::EPSILON / 2.0;

/// A surface of small mirrors at the points of a packet.
#[derive(Clone, Copy, Debug)]
pub struct Microfacets<L> {
    /// Shading normal; unit.
    pub n: Vec3<L>,
    /// Where it is seen from, on the side of `n`; unit.
    pub wo: Vec3<L>,
    /// Roughness of the distribution, in (0, 1].
    pub alpha: L,
}

/// What small mirrors say of a direction.
#[derive(Clone, Copy, Debug)]
pub struct Glint<L> {
    /// `f_cos` of perfect mirrors, per steradian.
    pub value: L,
    /// Density of drawing it, per steradian.
    pub pdf: L,
    /// Cosine between the direction and the mirrors that reflect it.
    pub cos_half: L,
}

impl<L: Lane> Microfacets<L> {
    /// The surface seen from the unit direction `wo`. A shading normal may be turned away from the eye: then the surface is seen
    /// from where `wo` has its image in the plane of that normal.
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

    /// Draws a direction from `u` and `v` in [0, 1): one of the spherical cap of normals that `wo` sees on the unit sphere, stretched
    /// (Dupuy and Benyoub 2023, "Sampling Visible GGX Normals with Spherical Caps"). It may point below the horizon.
    ///
    /// With `z` the height of the stretched `wo`, the cap is `-z < height <= 1`. Height over its rim and radius are products here,
    /// not differences of numbers near 1.
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
        // a |h|^2 / (a^2 up^2 + across^2): its square is pi D, and no term of it is a difference.
        let along = self.alpha * up;
        let below = along.mul_add(along, across);
        let root = (self.alpha * squared).div_or_zero(below, below.gt(L::zero()));
        let distribution = root * root * L::splat(FRAC_1_PI);
        let cos_o = self.cos_o();
        let root_o = self.root(cos_o);
        // Masked is what wo does not see, shadowed what wi does not.
        let both = cos_o * self.root(cos_i) / cos_i + root_o;
        let masked = cos_o + root_o;
        let cos_half = (squared.sqrt() * L::splat(0.5)).min(L::one());
        let value = L::splat(0.5) * distribution / mutate!(both, ShadowingForgotten => masked);
        let drawn = L::splat(0.5) * distribution / masked;
        let pdf = mutate!(drawn, HalfVectorForDirection => drawn * cos_half);
        Glint { value, pdf, cos_half }
    }
}

/// `(1 - c)^5`: how far Schlick's reflectance is from that at normal incidence to 1 (Schlick 1994).
#[inline(always)]
pub fn schlick<L: Lane>(cosine: L) -> L {
    let x = L::one() - cosine;
    let squared = x * x;
    squared * squared * x
}
