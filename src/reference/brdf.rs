//! BRDF models: value, sampling and density, directly from their formulas.

use std::f64::consts::PI;

use glam::{DMat3, DVec3};
use rand::{Rng, RngExt};

use super::microfacet::{COAT, Mirrors, fresnel, schlick, through};
use crate::scene::Bsdf;

/// A point on a reflecting surface, seen from `wo`. All directions are unit and point away from the surface.
#[derive(Clone, Copy, Debug)]
pub struct Shading {
    /// The reflection model.
    pub bsdf: Bsdf,
    /// Unit direction to the viewer.
    pub wo: DVec3,
    /// Shading normal, on the same side as `ng`.
    pub n: DVec3,
    /// Geometric normal, on the side of `wo`.
    pub ng: DVec3,
    /// The texture value; the colours of `bsdf` already include it.
    pub tint: DVec3,
}

impl Shading {
    /// `f(wo, wi) max(dot(n, wi), 0)`, sr⁻¹; 0 where `wi` is below either normal's horizon.
    pub fn value_cos(&self, wi: DVec3) -> DVec3 {
        let cos_theta = self.n.dot(wi);
        if cos_theta <= 0.0 || self.ng.dot(wi) <= 0.0 {
            return DVec3::ZERO;
        }
        cos_theta
            * match self.bsdf {
                Bsdf::Diffuse { rho } => rho / PI,
                Bsdf::Phong { rho, alpha } => rho * self.lobe(alpha, wi),
                Bsdf::Blend { rho, specular, alpha } => rho / PI + specular * self.lobe(alpha, wi),
                Bsdf::Ggx {
                    base,
                    metallic,
                    roughness,
                } => {
                    let mirrors = self.mirrors(roughness);
                    let (shine, s) = (mirrors.value_cos(wi) / cos_theta, schlick(mirrors.cos_half(wi)));
                    let metal = (base + (DVec3::ONE - base) * s) * shine;
                    let coat = DVec3::splat(COAT + (1.0 - COAT) * s) * shine;
                    let passes = through(mirrors.cos_o(), roughness) * through(cos_theta, roughness);
                    metallic * metal + (1.0 - metallic) * (coat + base * (1.0 - COAT) * passes / PI)
                }
                Bsdf::Conductor { eta, k, roughness } => {
                    let mirrors = self.mirrors(roughness);
                    let cosine = mirrors.cos_half(wi).min(1.0);
                    let reflectance = [0, 1, 2].map(|i| fresnel(cosine, eta[i], k[i]));
                    self.tint * DVec3::from_array(reflectance) * mirrors.value_cos(wi) / cos_theta
                }
            }
    }

    fn mirrors(&self, roughness: f64) -> Mirrors {
        Mirrors::new(self.n, self.wo, roughness)
    }

    /// A direction drawn with the density [`density`](Self::density): a cosine lobe around the normal, a power of the cosine
    /// around the mirror direction, or the reflection about a visible normal. A blend and a coated material choose between two
    /// of them with probability 1/2. The direction may point below the surface.
    pub fn sample(&self, rng: &mut impl Rng) -> DVec3 {
        let (axis, exponent) = match self.bsdf {
            Bsdf::Diffuse { .. } => (self.n, 1.0),
            Bsdf::Phong { alpha, .. } => (self.mirror(), alpha),
            Bsdf::Blend { alpha, .. } if rng.random() => (self.mirror(), alpha),
            Bsdf::Blend { .. } => (self.n, 1.0),
            Bsdf::Conductor { roughness, .. } => return self.mirrors(roughness).sample(rng),
            Bsdf::Ggx {
                metallic, roughness, ..
            } if metallic == 1.0 || rng.random() => return self.mirrors(roughness).sample(rng),
            Bsdf::Ggx { .. } => (self.n, 1.0),
        };
        // cos = u^(1 / (exponent + 1)), and 1 - cos^2 without the cancellation that narrow lobes cause.
        let log_cos = (1.0 - rng.random::<f64>()).ln() / (exponent + 1.0);
        around(axis, log_cos.exp(), (-(2.0 * log_cos).exp_m1()).sqrt(), rng.random())
    }

    /// Density of [`sample`](Self::sample) at `wi`, sr⁻¹.
    pub fn density(&self, wi: DVec3) -> f64 {
        match self.bsdf {
            Bsdf::Diffuse { .. } => self.n.dot(wi).max(0.0) / PI,
            Bsdf::Phong { alpha, .. } => self.lobe(alpha, wi),
            Bsdf::Blend { alpha, .. } => 0.5 * (self.n.dot(wi).max(0.0) / PI + self.lobe(alpha, wi)),
            Bsdf::Conductor { roughness, .. } => self.mirrors(roughness).density(wi),
            Bsdf::Ggx {
                metallic, roughness, ..
            } => {
                let shine = self.mirrors(roughness).density(wi);
                if metallic == 1.0 {
                    shine
                } else {
                    0.5 * (self.n.dot(wi).max(0.0) / PI + shine)
                }
            }
        }
    }

    /// The lobe of Phong's model normalised over the sphere, sr⁻¹. In `f64` the power of a dot product is accurate to about
    /// `alpha` 2e-16.
    fn lobe(&self, alpha: f64, wi: DVec3) -> f64 {
        (alpha + 1.0) / (2.0 * PI) * self.mirror().dot(wi).clamp(0.0, 1.0).powf(alpha)
    }

    fn mirror(&self) -> DVec3 {
        (2.0 * self.n.dot(self.wo) * self.n - self.wo).normalize()
    }
}

/// The unit direction at the polar angle given by its cosine and sine from `axis` (unit), and at the azimuth
/// `2 pi turn`.
pub fn around(axis: DVec3, cos: f64, sin: f64, turn: f64) -> DVec3 {
    let tangent = axis.any_orthonormal_vector();
    let frame = DMat3::from_cols(tangent, axis.cross(tangent), axis);
    let (y, x) = (2.0 * PI * turn).sin_cos();
    (frame * DVec3::new(sin * x, sin * y, cos)).normalize()
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_pcg::Pcg64;

    use super::*;

    fn shading(bsdf: Bsdf) -> Shading {
        let n = DVec3::new(0.3, -0.2, 0.9).normalize();
        Shading {
            bsdf,
            wo: DVec3::new(-0.4, 0.5, 0.8).normalize(),
            n,
            ng: n,
            tint: DVec3::ONE,
        }
    }

    fn models() -> [Bsdf; 4] {
        let rho = DVec3::ONE;
        let phong = |alpha| Bsdf::Phong { rho, alpha };
        [Bsdf::Diffuse { rho }, phong(2.0), phong(50.0), phong(1e6)]
    }

    /// Under the right density, the cosine to the power `exponent + 1` from the lobe's axis is uniform in [0, 1]:
    /// its first two moments must be 1/2 and 1/3.
    #[test]
    fn samples_follow_their_density() {
        for bsdf in models() {
            let point = shading(bsdf);
            let (axis, exponent) = match bsdf {
                Bsdf::Phong { alpha, .. } => (point.mirror(), alpha),
                _ => (point.n, 1.0),
            };
            let peak = (exponent + 1.0) / (2.0 * PI);
            let mut rng = Pcg64::seed_from_u64(5);
            let count = 40_000;
            let (mut first, mut second) = (0.0, 0.0);
            for _ in 0..count {
                let wi = point.sample(&mut rng);
                let u = axis.dot(wi).powf(exponent + 1.0);
                (first, second) = (first + u, second + u * u);
                let expected = peak * axis.dot(wi).powf(exponent);
                assert!((point.density(wi) - expected).abs() <= 1e-9 * peak, "{bsdf:?}");
            }
            let count = f64::from(count);
            // Four standard deviations of u and u^2: sqrt(1/12) and sqrt(4/45).
            assert!(
                (first / count - 0.5).abs() < 4.0 * (1.0 / 12.0 / count).sqrt(),
                "{bsdf:?}"
            );
            assert!(
                (second / count - 1.0 / 3.0).abs() < 4.0 * (4.0 / 45.0 / count).sqrt(),
                "{bsdf:?}"
            );
        }
    }

    #[test]
    fn nothing_is_reflected_below_either_horizon() {
        let mut point = shading(Bsdf::Diffuse { rho: DVec3::ONE });
        assert_eq!(point.value_cos(-point.n), DVec3::ZERO);
        let wi = around(point.n, 0.1, 0.99_f64.sqrt(), 0.2);
        assert!(point.value_cos(wi).x > 0.0);
        point.ng = (point.n - 0.5 * wi).normalize();
        assert_eq!(point.value_cos(wi), DVec3::ZERO);
    }
}
