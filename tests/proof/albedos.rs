//! What rough surfaces reflect of all that arrives, and Fresnel's reflectance, against quadrature and complex numbers in `f64`.

use std::f64::consts::TAU;

use glam::DVec3;
use octolux::bsdf::{Ggx, fresnel};
use octolux::estimator::per_point;
use octolux::lane::Word;
use octolux::math::Vec3;
use octolux::sampling::PassBlock;
use octolux::scene::SamplerKind;

use super::ggx::{Said, Truth, at, coated};
use super::stats::integrate;

/// Albedo of a surface of perfectly reflecting microfacets, weighted by `f`, by quadrature over normals.
fn mirrors(alpha: f64, cosine: f64, f: impl Fn(&Said) -> f64) -> f64 {
    let n = DVec3::Z;
    let truth = Truth {
        n,
        wo: DVec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine),
        alpha,
    };
    // Over normals, as `D cos` has them: `wi` follows, with the Jacobian of the reflection.
    let edge = |k: i32| 1.0 - 0.5_f64.powi(k);
    let ring = |k| {
        integrate(edge(k), edge(k + 1), 3, |share| {
            integrate(0.0, 0.5, 24, |turn| {
                let h = truth.normal_along(share, turn);
                let wi = 2.0 * truth.wo.dot(h) * h - truth.wo;
                if wi.z <= 0.0 || truth.wo.dot(h) <= 0.0 {
                    return 0.0;
                }
                let tangent = alpha * (share / (1.0 - share)).sqrt();
                let said = truth.at(wi);
                2.0 * f(&said) * said.value * 4.0 * said.cos_half / (truth.distribution(tangent) * h.z)
            })
        })
    };
    (0..30).map(ring).sum()
}

/// Albedo of a white coated body: the coat by quadrature, the body below it in closed form.
fn coated_body(alpha: f64, cosine: f64) -> f64 {
    let g = 1.0 / (1.0 + 4.0 * alpha + 15.0 * alpha * alpha);
    let through = 1.0 - g * (1.0 - cosine).powi(5);
    let coat = mirrors(alpha, cosine, |said| 0.04 + 0.96 * (1.0 - said.cos_half).powi(5));
    coat + 0.96 * through * (1.0 - g / 21.0)
}

impl Truth {
    /// As [`Self::normal`], with azimuths counted from the plane of `wo`, which is that of x and z.
    fn normal_along(&self, share: f64, turn: f64) -> DVec3 {
        let tangent = self.alpha * (share / (1.0 - share)).sqrt();
        let (s, c) = (TAU * turn).sin_cos();
        DVec3::new(tangent * c, tangent * s, 1.0).normalize()
    }
}

/// In a white furnace surfaces reflect what quadrature says, and never more than arrives. Mean of 2^14 Sobol directions of `brdf`; what
/// it may be off is stated: 0.002.
pub fn furnace() {
    for roughness in [0.1_f64, 0.3, 0.5, 0.7, 1.0] {
        let alpha = roughness * roughness;
        for cosine in [0.05, 0.2, 0.5, 0.8, 1.0] {
            let (metal, body) = (mirrors(alpha, cosine, |_| 1.0), coated_body(alpha, cosine));
            assert!(metal <= 1.0 + 1e-6 && body <= 1.0, "{roughness}, {cosine}: {body}");
            for (metallic, expected) in [(1.0, metal), (0.0, body)] {
                let bsdf = Ggx {
                    rho: Vec3::splat([1.0; 3]),
                    ..coated::<f32>(alpha, f64::acos(cosine), metallic)
                };
                let numbers = PassBlock::new(SamplerKind::Sobol, 17, 0, 1 << 14, 1);
                let mut sum = 0.0;
                for pass in 0..1 << 14 {
                    let pair = numbers.pair(numbers.key(Word(3)), Word(pass), 0);
                    if let Some(found) = per_point::sample::<f32, per_point::Lobe>(&at(bsdf), pair, true) {
                        let value = f64::from(found.throughput.y);
                        assert!(metallic == 0.0 || value <= 1.0 + 1e-5, "a weight of {value}");
                        sum += value;
                    }
                }
                let mean = sum / f64::from(1 << 14);
                assert!(
                    (mean - expected).abs() < 2e-3,
                    "roughness {roughness}, cosine {cosine}, metallic {metallic}: {mean} instead of {expected}"
                );
            }
        }
    }
}

/// By the formulas, of 800 roughnesses and angles from straight on to grazing, no coated body of reflectance 1 reflects more than
/// arrives. [`furnace`] holds the program to these formulas.
pub fn no_light_is_made() {
    for i in 0..20 {
        let alpha = 10.0_f64.powf(-3.0 * f64::from(i) / 19.0);
        for j in 0..40 {
            let cosine = ((f64::from(j) + 0.5) / 40.0).powi(3);
            let body = coated_body(alpha, cosine);
            assert!(body <= 1.0 + 1e-4, "alpha {alpha}, cosine {cosine}: {body}");
        }
    }
}

/// Reflectances in `f32` against complex arithmetic: 1e-5 at most, absolute.
pub fn reflectances() {
    for (eta, k) in [
        (0.143, 3.983),
        (0.05, 4.0),
        (1.442, 1.603),
        (3.0, 0.0),
        (1.5, 0.0),
        (0.001, 0.0),
        (1000.0, 1000.0),
        (0.2, 9.0),
    ] {
        for i in 0..=1000 {
            let c = f64::from(i) / 1000.0;
            let found = f64::from(fresnel(c as f32, eta as f32, k as f32));
            let truth = by_complex_numbers(c, eta, k);
            assert!(
                (found - truth).abs() < 1e-5,
                "{eta} + {k} i at {c}: {found} and {truth}"
            );
        }
    }
}

/// Fresnel's amplitudes with `n cos(theta_t) = sqrt(n^2 - sin^2)`, real and imaginary parts written out.
fn by_complex_numbers(c: f64, eta: f64, k: f64) -> f64 {
    let squared = [eta * eta - k * k, 2.0 * eta * k];
    let (re, im) = (squared[0] - (1.0 - c * c), squared[1]);
    let (length, angle) = (re.hypot(im).sqrt(), 0.5 * im.atan2(re));
    let root = [length * angle.cos(), length * angle.sin()];
    let ratio = |a: [f64; 2], b: [f64; 2]| {
        let norm = |z: [f64; 2]| z[0] * z[0] + z[1] * z[1];
        norm([a[0] - b[0], a[1] - b[1]]) / norm([a[0] + b[0], a[1] + b[1]])
    };
    0.5 * (ratio([c, 0.0], root) + ratio([squared[0] * c, squared[1] * c], root))
}
