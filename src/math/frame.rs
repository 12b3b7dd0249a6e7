//! Orthonormal frames around a unit vector, without branches.

use super::Vec3;
use crate::lane::{Bits, Lane};

/// Two unit vectors that form a right-handed orthonormal frame with a third, `axis`.
#[derive(Clone, Copy, Debug)]
pub struct Frame<L> {
    /// First tangent.
    pub tangent: Vec3<L>,
    /// Second tangent.
    pub bitangent: Vec3<L>,
    /// The unit vector around which the frame was built.
    pub axis: Vec3<L>,
}

impl<L: Lane> Frame<L> {
    /// The frame around the unit vector `axis`: Duff et al. 2017, "Building an Orthonormal Basis, Revisited", listing 3. Continuous
    /// except at the plane z = 0, and without singularities, even at the poles.
    #[inline(always)]
    pub fn about(axis: Vec3<L>) -> Self {
        let sign_bit = axis.z.to_bits() & L::Bits::splat(1 << 31);
        let sign = L::from_bits(sign_bit | L::one().to_bits());
        let a = -(L::one() / (sign + axis.z));
        let b = axis.x * axis.y * a;
        let tangent = Vec3::new(
            (sign * axis.x * axis.x).mul_add(a, L::one()),
            sign * b,
            -(sign * axis.x),
        );
        let bitangent = Vec3::new(b, (axis.y * axis.y).mul_add(a, sign), -axis.y);
        Self {
            tangent,
            bitangent,
            axis,
        }
    }

    /// The direction at `1 - cos = t` from the axis and azimuth `phi`; unit up to rounding.
    ///
    /// Using `t` instead of the cosine is accurate for directions close to the axis: `sin = sqrt(t (2 - t))`.
    #[inline(always)]
    pub fn direction(&self, t: L, sin_phi: L, cos_phi: L) -> Vec3<L> {
        let sine = (t * (L::splat(2.0) - t)).safe_sqrt();
        let along = L::one() - t;
        let about = self.tangent * (sine * cos_phi) + self.bitangent * (sine * sin_phi);
        self.axis.mul_add(along, about)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_orthonormal_everywhere() {
        let mut worst = 0.0_f64;
        let mut check = |n: [f32; 3]| {
            let frame = Frame::about(Vec3::<f32>::splat(n));
            let v = [frame.tangent, frame.bitangent, frame.axis].map(|v| v.lane(0).map(f64::from));
            let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
            for i in 0..3 {
                for j in 0..3 {
                    worst = worst.max((dot(v[i], v[j]) - f64::from(u8::from(i == j))).abs());
                }
            }
        };
        for axis in [
            [0.0, 0.0, 1.0],
            [0.0, 0.0, -1.0],
            [1.0, 0.0, 0.0],
            [1.0, 0.0, -0.0],
            [0.0, 1.0, -0.0],
        ] {
            check(axis);
        }
        for i in 0..1_000_000_u32 {
            // A Fibonacci sphere, concentrated towards the poles.
            let u = (f64::from(i) + 0.5) / 1e6;
            let z = (1.0 - 2.0 * u).powi(if i % 3 == 0 { 1 } else { 3 }).clamp(-1.0, 1.0);
            let r = (1.0 - z * z).sqrt();
            let phi = f64::from(i) * 2.399_963_229_728_653;
            let n = [r * phi.cos(), r * phi.sin(), z].map(|x| x as f32);
            check(n);
        }
        assert!(worst <= 3e-7, "worst deviation {worst:e}");
    }
}
