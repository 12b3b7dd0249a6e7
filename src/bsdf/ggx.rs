//! The metallic-roughness model of glTF 2.0: base color, metallic and roughness.
//!
//! A share `m` of the surface is metal with Schlick's Fresnel reflectance `rho + (1 - rho) s_h`. The rest is a diffuse body of
//! reflectance `rho` below a dielectric coat of reflectance `F = F0 + (1 - F0) s_h`, `F0 = 0.04`. Here `s_o`, `s_i` and `s_h` are
//! `(1 - cos)^5`, with the cosine of `wo`, of `wi`, and between `wi` and the half vector. With the reflection `S` of perfectly
//! reflecting [`Microfacets`]:
//!
//! `f_cos = m (rho + (1 - rho) s_h) S + (1 - m) (F S + rho (1 - F0) (1 - g s_o) (1 - g s_i) cos_i / pi)`
//!
//! glTF has `1 - F` instead of the product, which reflects up to twice the incident light at grazing angles. The product is from
//! Ashikhmin and Shirley (2000, "An Anisotropic Phong BRDF Model"); it equals glTF's at normal incidence and is reciprocal. Rough
//! coats reflect less at grazing angles and transmit more: `g = 1 / (1 + 4 a + 15 a^2)`, where `a` is the `alpha` of the facets.
//! The model conserves energy for all roughnesses and angles (`docs/effects/ggx.md` has the table).

use std::f32::consts::FRAC_1_PI;

use super::microfacet::{Microfacets, schlick};
use super::{Brdf, Diffuse, Lobe, Tints};
use crate::lane::{Lane, Mask};
use crate::math::Vec3;
use crate::sampling::warp;

/// Reflectance of the coat at normal incidence, for an index of refraction of 1.5.
const F0: f32 = 0.04;

/// Minimum probability of sampling the coat, because its highlights are hard to find.
const LEAST_COAT: f32 = 0.25;

/// The metallic-roughness model at the points of a packet.
#[derive(Clone, Copy, Debug)]
pub struct Ggx<L: Lane> {
    /// The facets of the metal or the coat.
    pub facets: Microfacets<L>,
    /// Base color.
    pub rho: Vec3<L>,
    /// Share of metal, in [0, 1].
    pub metallic: L,
}

impl<L: Lane> Ggx<L> {
    /// The fraction of light that the coat transmits to or from the body, without the factor `1 - F0`.
    #[inline(always)]
    fn through(&self, cosine: L) -> L {
        let a = self.facets.alpha;
        let spread = (a * L::splat(15.0) + L::splat(4.0)).mul_add(a, L::one());
        L::one() - schlick(cosine) / spread
    }

    /// Probability of sampling the body: its share of the reflected light, as far as known without `wi`. 0 for metal.
    #[inline(always)]
    fn body(&self) -> L {
        let through = self.through(self.facets.cos_o());
        let (body, coat) = (L::one() - self.metallic, L::one() - through);
        let largest = self.rho.max_abs();
        let diffuse = body * largest * L::splat(1.0 - F0) * through;
        let metal = self.metallic * (largest * through + coat);
        let sum = diffuse + metal + body * coat.mul_add(L::splat(1.0 - F0), L::splat(F0));
        diffuse
            .div_or_zero(sum, sum.gt(L::zero()))
            .min(L::splat(1.0 - LEAST_COAT))
    }
}

impl<L: Lane> Brdf<L> for Ggx<L> {
    type Tint = Tints<L>;

    #[inline(always)]
    fn normal(&self) -> Vec3<L> {
        self.facets.n
    }

    #[inline(always)]
    fn rho(&self) -> Vec3<L> {
        self.rho
    }

    /// Small `u` samples the body, the rest the coat or the metal; each range is rescaled to [0, 1).
    #[inline(always)]
    fn draw(&self, u: L, v: L) -> Vec3<L> {
        let body = self.body();
        let of_body = u.lt(body);
        let coat = L::one() - body;
        let facet = self.facets.draw(((u - body) / coat).max(L::zero()), v);
        if of_body.none() {
            return facet;
        }
        let diffuse = Diffuse {
            n: self.facets.n,
            rho: self.rho,
        };
        let u = u.div_or_zero(body, of_body).min(L::one());
        Vec3::select(of_body, diffuse.draw(u, v), facet)
    }

    #[inline(always)]
    fn eval(&self, wi: Vec3<L>, cos_theta: L) -> Lobe<L, Tints<L>> {
        let glint = self.facets.eval(wi, cos_theta);
        let s = schlick(glint.cos_half);
        let body = L::one() - self.metallic;
        let metal = self.metallic * (L::one() - s);
        let coat = body * s.mul_add(L::splat(1.0 - F0), L::splat(F0));
        let cosine = cos_theta * L::splat(FRAC_1_PI);
        let passes = self.through(self.facets.cos_o()) * self.through(cos_theta);
        let share = self.body();
        Lobe {
            shape: Tints {
                tinted: metal * glint.value + body * L::splat(1.0 - F0) * passes * cosine,
                white: self.metallic.mul_add(s, coat) * glint.value,
            },
            pdf: share.mul_add(warp::cosine_pdf(cos_theta), (L::one() - share) * glint.pdf),
        }
    }
}
