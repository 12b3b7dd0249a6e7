//! Warps from two uniform numbers to a direction, with their densities, in terms of `t = 1 - cos` about an axis.
//!
//! The azimuth comes from the second number by [`crate::math::elementary::sin_cos_turn`]; a warp here only computes `t`. It uses
//! `t` instead of the cosine because lobes and cones get as narrow as 1e-7, where the cosine rounds to 1.

use std::f32::consts::{FRAC_1_PI, PI};

use crate::lane::Lane;
use crate::math::elementary::{expm1, ln, sin_cos_turn};

/// Uniform over the sphere: `t` in [0, 2].
#[inline(always)]
pub fn sphere<L: Lane>(u: L) -> L {
    u + u
}

/// Density of [`sphere`] per steradian.
pub const SPHERE_PDF: f32 = 0.25 * FRAC_1_PI;

/// Uniform over the unit disk, by a continuous map that turns concentric squares into circles (Shirley and Chiu, "A Low Distortion
/// Map Between Disk and Square", 1997). Density `1 / pi`.
#[inline(always)]
pub fn disk<L: Lane>(u: L, v: L) -> (L, L) {
    let (a, b) = (u + u - L::one(), v + v - L::one());
    let wide = a.abs().gt(b.abs());
    let (radius, other) = (L::select(wide, a, b), L::select(wide, b, a));
    // At the exact center any angle works.
    let ratio = other / L::select(radius.abs().gt(L::zero()), radius, L::one());
    // Half a turn is added to keep the argument positive: the angle from the axis is at most an eighth of a turn, to either side.
    let (sine, cosine) = sin_cos_turn(ratio.mul_add(L::splat(0.125), L::splat(0.5)));
    let (along, across) = (-(cosine * radius), -(sine * radius));
    (L::select(wide, along, across), L::select(wide, across, along))
}

/// Uniform in the cone with `one_minus_cos_max = 1 - cos(theta_max)`: `t` in [0, `one_minus_cos_max`].
#[inline(always)]
pub fn cone<L: Lane>(u: L, one_minus_cos_max: L) -> L {
    mutate!(u, ConeTowardsTheAxis => u * u) * one_minus_cos_max
}

/// Density of [`cone`] per steradian, inside the cone.
#[inline(always)]
pub fn cone_pdf<L: Lane>(one_minus_cos_max: L) -> L {
    L::one() / cone_solid_angle(one_minus_cos_max)
}

/// Solid angle of the cone, in steradians.
#[inline(always)]
pub fn cone_solid_angle<L: Lane>(one_minus_cos_max: L) -> L {
    L::splat(2.0 * PI) * one_minus_cos_max
}

/// Proportional to the cosine over the hemisphere: `t = 1 - sqrt(1 - u)`, without cancellation.
#[inline(always)]
pub fn cosine<L: Lane>(u: L) -> L {
    u / (L::one() + (L::one() - u).sqrt())
}

/// Density of [`cosine`] per steradian; 0 below the horizon.
#[inline(always)]
pub fn cosine_pdf<L: Lane>(cosine: L) -> L {
    cosine.max(L::zero()) * L::splat(FRAC_1_PI)
}

/// Proportional to `cos^alpha` over the hemisphere: `cos = (1 - u)^(1 / (alpha + 1))` (the course assignment, section 5), so `t =
/// -expm1(ln(1 - u) / (alpha + 1))`, which is accurate for every exponent. `1 - u` is exact and nonzero.
#[inline(always)]
pub fn power<L: Lane>(u: L, alpha: L) -> L {
    -expm1(ln(L::one() - u) / (alpha + L::one()))
}

/// Density of [`power`] per steradian, given `cos^alpha` (0 below the horizon).
#[inline(always)]
pub fn power_pdf<L: Lane>(cos_to_the_alpha: L, alpha: L) -> L {
    let normalisation = (alpha + mutate!(L::one(), WrongNormalisation => L::splat(2.0))) * L::splat(0.5 * FRAC_1_PI);
    normalisation * cos_to_the_alpha
}

#[cfg(test)]
mod tests {
    use super::disk;

    /// The map scales areas of small squares by the same factor everywhere: pi.
    #[test]
    fn the_disk_is_filled_evenly_and_to_its_rim() {
        let (h, mut largest) = (1.0 / 64.0_f32, 0.0_f32);
        for i in 0..63 {
            for j in 0..63 {
                let (u, v) = (i as f32 * h + 0.3 * h, j as f32 * h + 0.6 * h);
                // Skips squares across a diagonal, which are bent, and those around the center, whose sides are bent.
                let middle = i32::abs(i - 31) < 8 && i32::abs(j - 31) < 8;
                if middle || i32::abs(i - j) <= 1 || i32::abs(i + j - 63) <= 2 {
                    continue;
                }
                let corners = [(u, v), (u + h, v), (u + h, v + h), (u, v + h)].map(|(u, v)| disk(u, v));
                let shoelace = |k: usize| {
                    let ((a, b), (c, d)) = (corners[k], corners[(k + 1) % 4]);
                    a * d - c * b
                };
                let area = 0.5 * (0..4).map(shoelace).sum::<f32>().abs();
                assert!(
                    (area / (std::f32::consts::PI * h * h) - 1.0).abs() < 2e-3,
                    "{u} {v}: {area}"
                );
                largest = corners.iter().fold(largest, |m, (x, y)| m.max(x * x + y * y));
            }
        }
        assert!(largest <= 1.0 + 1e-6 && largest > 0.98);
        assert_eq!(disk(0.5_f32, 0.5), (0.0, 0.0));
    }
}
