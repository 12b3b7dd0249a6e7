//! Microfacet surfaces, in textbook forms: Trowbridge and Reitz's distribution by its tangent, Smith's masking by `Lambda`,
//! Heitz's sampling of visible normals by an ellipsoid, Fresnel's equations with complex numbers.

use std::f64::consts::PI;
use std::ops::{Add, Div, Mul, Sub};

use glam::DVec3;
use rand::{Rng, RngExt};

/// Reflectance of a dielectric coat at normal incidence.
pub const COAT: f64 = 0.04;

/// Microfacets about the normal `n`, seen from `wo`, which is turned to its side.
#[derive(Clone, Copy, Debug)]
pub struct Mirrors {
    n: DVec3,
    wo: DVec3,
    alpha: f64,
}

impl Mirrors {
    /// Microfacets of this roughness, seen from `wo`, or from its mirror image if it is below the plane of `n`.
    pub fn new(n: DVec3, wo: DVec3, roughness: f64) -> Self {
        let height = n.dot(wo);
        Self {
            n,
            wo: wo - n * (height - height.abs()),
            alpha: roughness * roughness,
        }
    }

    /// Cosine of the view direction.
    pub fn cos_o(&self) -> f64 {
        self.n.dot(self.wo)
    }

    fn tangent(&self, w: DVec3) -> f64 {
        self.n.cross(w).length() / self.n.dot(w)
    }

    /// `(sqrt(1 + a^2 tan^2) - 1) / 2` (Heitz 2014, equation 72).
    fn lambda(&self, w: DVec3) -> f64 {
        let x = (self.alpha * self.tangent(w)).powi(2);
        0.5 * x / ((1.0 + x).sqrt() + 1.0)
    }

    /// `1 / (pi a^2 cos^4 (1 + tan^2 / a^2)^2)` (Walter et al. 2007, equation 33).
    fn distribution(&self, h: DVec3) -> f64 {
        let cosine = self.n.dot(h);
        if cosine <= 0.0 {
            return 0.0;
        }
        let x = 1.0 + (self.tangent(h) / self.alpha).powi(2);
        1.0 / (PI * (self.alpha * cosine * cosine * x).powi(2))
    }

    fn half(&self, wi: DVec3) -> DVec3 {
        (self.wo + wi).normalize()
    }

    /// Cosine between `wi` and the microfacets that reflect it.
    pub fn cos_half(&self, wi: DVec3) -> f64 {
        self.half(wi).dot(wi)
    }

    /// `f cos` of perfectly reflecting microfacets, sr⁻¹.
    pub fn value_cos(&self, wi: DVec3) -> f64 {
        let (cos_o, cos_i) = (self.cos_o(), self.n.dot(wi));
        if cos_o <= 0.0 || cos_i <= 0.0 {
            return 0.0;
        }
        let g2 = 1.0 / (1.0 + self.lambda(self.wo) + self.lambda(wi));
        self.distribution(self.half(wi)) * g2 / (4.0 * cos_o)
    }

    /// Density of [`sample`](Self::sample) at `wi`, sr⁻¹.
    pub fn density(&self, wi: DVec3) -> f64 {
        let cos_o = self.cos_o();
        if cos_o <= 0.0 {
            return 0.0;
        }
        let g1 = 1.0 / (1.0 + self.lambda(self.wo));
        self.distribution(self.half(wi)) * g1 / (4.0 * cos_o)
    }

    /// Samples a direction: the reflection about a visible normal (Heitz 2018, "Sampling the GGX Distribution of Visible
    /// Normals").
    pub fn sample(&self, rng: &mut impl Rng) -> DVec3 {
        let x = self.n.any_orthonormal_vector();
        let y = self.n.cross(x);
        let stretched = |v: DVec3| DVec3::new(self.alpha * v.x, self.alpha * v.y, v.z).normalize();
        let seen = stretched(DVec3::new(x.dot(self.wo), y.dot(self.wo), self.cos_o()));
        let first = DVec3::Z.cross(seen).try_normalize().unwrap_or(DVec3::X);
        let second = seen.cross(first);
        let (radius, (sin, cos)) = (rng.random::<f64>().sqrt(), (2.0 * PI * rng.random::<f64>()).sin_cos());
        let (a, half) = (radius * cos, 0.5 * (1.0 + seen.z));
        let b = (1.0 - half) * (1.0 - a * a).sqrt() + half * radius * sin;
        let normal = stretched(first * a + second * b + seen * (1.0 - a * a - b * b).max(0.0).sqrt());
        let h = x * normal.x + y * normal.y + self.n * normal.z;
        (2.0 * self.wo.dot(h) * h - self.wo).normalize()
    }
}

/// Schlick's `(1 - cos)^5`.
pub fn schlick(cosine: f64) -> f64 {
    (1.0 - cosine).max(0.0).powi(5)
}

/// The part of `1 - s` that the base transmits through a coat of this roughness, for one direction.
pub fn through(cosine: f64, roughness: f64) -> f64 {
    let alpha = roughness * roughness;
    1.0 - schlick(cosine) / (1.0 + 4.0 * alpha + 15.0 * alpha * alpha)
}

/// A complex number.
#[derive(Clone, Copy, Debug)]
struct Complex(f64, f64);

impl Complex {
    fn squared_length(self) -> f64 {
        self.0 * self.0 + self.1 * self.1
    }

    fn sqrt(self) -> Self {
        let (length, angle) = (self.squared_length().sqrt(), self.1.atan2(self.0));
        let (sin, cos) = (0.5 * angle).sin_cos();
        Self(length.sqrt() * cos, length.sqrt() * sin)
    }
}

impl Add for Complex {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self(self.0 + other.0, self.1 + other.1)
    }
}

impl Sub for Complex {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self(self.0 - other.0, self.1 - other.1)
    }
}

impl Mul for Complex {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        Self(self.0 * other.0 - self.1 * other.1, self.0 * other.1 + self.1 * other.0)
    }
}

impl Div for Complex {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        let scale = 1.0 / other.squared_length();
        let Self(re, im) = self * Self(other.0, -other.1);
        Self(re * scale, im * scale)
    }
}

/// Reflectance of unpolarised light by a metal of index `eta + i k`: Fresnel's amplitudes with Snell's law for complex angles.
pub fn fresnel(cosine: f64, eta: f64, k: f64) -> f64 {
    let (cos_i, index) = (Complex(cosine, 0.0), Complex(eta, k));
    let sine = Complex(1.0 - cosine * cosine, 0.0);
    let cos_t = (Complex(1.0, 0.0) - sine / (index * index)).sqrt();
    let across = (cos_i - index * cos_t) / (cos_i + index * cos_t);
    let along = (index * cos_i - cos_t) / (index * cos_i + cos_t);
    0.5 * (across.squared_length() + along.squared_length())
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_pcg::Pcg64;

    use super::*;

    /// By quadrature over the sphere the density integrates to 1; the weight of a sampled direction is `G2 / G1`, at most 1;
    /// and the mean of the weights is the albedo by quadrature, within 5 standard errors.
    #[test]
    fn visible_normals_are_sampled_with_their_density() {
        let mut rng = Pcg64::seed_from_u64(8);
        for (roughness, slope) in [(0.3, 0.4), (0.5, 1.2), (0.8, 0.2), (1.0, 1.5)] {
            let n = DVec3::new(0.3, -0.2, 0.9).normalize();
            let wo = n * f64::cos(slope) + n.any_orthonormal_vector() * f64::sin(slope);
            let mirrors = Mirrors::new(n, wo, roughness);
            let (mut whole, mut albedo) = (0.0, 0.0);
            let (rows, columns) = (2000, 1000);
            for row in 0..rows {
                let cosine = 1.0 - 2.0 * (f64::from(row) + 0.5) / f64::from(rows);
                for column in 0..columns {
                    let turn = (f64::from(column) + 0.5) / f64::from(columns);
                    let wi = super::super::brdf::around(n, cosine, (1.0 - cosine * cosine).sqrt(), turn);
                    let area = 4.0 * PI / f64::from(rows * columns);
                    whole += mirrors.density(wi) * area;
                    albedo += mirrors.value_cos(wi) * area;
                }
            }
            assert!((whole - 1.0).abs() < 2e-3, "{roughness}, {slope}: {whole}");
            let count = 100_000;
            let (mut sum, mut squares) = (0.0, 0.0);
            for _ in 0..count {
                let wi = mirrors.sample(&mut rng);
                let weight = mirrors.value_cos(wi) / mirrors.density(wi);
                assert!((0.0..=1.0 + 1e-12).contains(&weight));
                (sum, squares) = (sum + weight, squares + weight * weight);
            }
            let mean = sum / f64::from(count);
            let error = ((squares / f64::from(count) - mean * mean) / f64::from(count)).sqrt();
            assert!(
                (mean - albedo).abs() < 5.0 * error + 1e-3,
                "{roughness}, {slope}: {mean} and {albedo}"
            );
        }
    }

    /// A glass plate at normal incidence, gold, a dielectric at Brewster's angle, and grazing incidence.
    #[test]
    fn reflectances_are_known_ones() {
        assert!((fresnel(1.0, 1.5, 0.0) - 0.04).abs() < 1e-15);
        assert!((fresnel(1.0, 0.143, 3.983) - 0.966_6).abs() < 1e-3);
        let brewster = (1.0_f64 / (1.0 + 1.5 * 1.5)).sqrt();
        let across = ((1.5 * 1.5 - 1.0_f64) / (1.5 * 1.5 + 1.0)).powi(2);
        assert!((fresnel(brewster, 1.5, 0.0) - 0.5 * across).abs() < 1e-14);
        assert!((fresnel(1e-9, 0.2, 3.0) - 1.0).abs() < 1e-7);
    }
}
