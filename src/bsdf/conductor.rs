//! Metals with a complex index of refraction `eta + i k` and a rough surface of [`Microfacets`].

use super::microfacet::Microfacets;
use super::{Brdf, Lobe};
use crate::lane::Lane;
use crate::math::Vec3;

/// A metal at the points of a packet.
#[derive(Clone, Copy, Debug)]
pub struct Conductor<L: Lane> {
    /// The microfacet surface.
    pub facets: Microfacets<L>,
    /// Factor of the reflectance: 1, or the value of a texture.
    pub rho: Vec3<L>,
    /// Index of refraction for red, green and blue; positive.
    pub eta: Vec3<L>,
    /// Extinction coefficient for red, green and blue; nonnegative.
    pub k: Vec3<L>,
}

/// Fresnel reflectance of unpolarized light for the cosine of incidence `c` in [0, 1].
///
/// With `a^2 - b^2 = eta^2 - k^2 - sin^2` and `a b = eta k`, the amplitudes of both polarizations are rational in `a` and
/// `a^2 + b^2` (Born and Wolf, "Principles of Optics", section 14.2).
#[inline(always)]
pub fn fresnel<L: Lane>(c: L, eta: L, k: L) -> L {
    let (cosine, one) = (c * c, L::one());
    let sine = one - cosine;
    let (eta, k) = (eta * eta, k * k);
    let difference = eta - k - sine;
    let product = L::splat(4.0) * eta * k;
    let sum = difference.mul_add(difference, product).sqrt();
    // 2 a^2 without cancellation: for metals k exceeds eta.
    let negative = difference.lt(L::zero());
    let twice = L::select(
        negative,
        product.div_or_zero(sum - difference, negative),
        sum + difference,
    );
    let along = (twice + twice).sqrt() * c;
    let (plus, minus) = (sum + cosine + along, sum + cosine - along);
    let across = minus / plus;
    let (whole, part) = (cosine.mul_add(sum, sine * sine), along * sine);
    let both = across + across * (whole - part) / (whole + part);
    (both * L::splat(0.5)).max(L::zero()).min(one)
}

impl<L: Lane> Brdf<L> for Conductor<L> {
    type Tint = Vec3<L>;

    #[inline(always)]
    fn normal(&self) -> Vec3<L> {
        self.facets.n
    }

    #[inline(always)]
    fn rho(&self) -> Vec3<L> {
        self.rho
    }

    #[inline(always)]
    fn draw(&self, u: L, v: L) -> Vec3<L> {
        self.facets.draw(u, v)
    }

    #[inline(always)]
    fn eval(&self, wi: Vec3<L>, cos_theta: L) -> Lobe<L, Vec3<L>> {
        let glint = self.facets.eval(wi, cos_theta);
        let of = |eta: L, k: L| fresnel(glint.cos_half, eta, k);
        let (eta, k) = (self.eta, self.k);
        let reflectance = Vec3::new(of(eta.x, k.x), of(eta.y, k.y), of(eta.z, k.z));
        Lobe {
            shape: reflectance * glint.value,
            pdf: glint.pdf,
        }
    }
}
