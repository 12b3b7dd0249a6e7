//! The falloff of a spot light: full inside the inner cone, 0 outside the outer cone, smooth between.

use crate::lane::Lane;
use crate::math::Vec3;

/// The cones of the lights in the lanes of a packet.
#[derive(Clone, Copy, Debug)]
pub struct Cones<L: Lane> {
    /// Unit axes.
    pub axis: Vec3<L>,
    /// `1 - cos` of the outer angles.
    pub outer: L,
    /// Reciprocals of the differences of the cosines.
    pub slope: L,
}

impl<L: Lane> Cones<L> {
    /// Fraction of the intensity at points that see the light in the unit direction `wi`.
    #[inline(always)]
    pub fn at(&self, wi: Vec3<L>) -> L {
        // 1 - cos from the chord, which keeps precision for narrow cones.
        let from_axis = (self.axis + wi).length_squared() * L::splat(0.5);
        let x = ((self.outer - from_axis) * self.slope).max(L::zero()).min(L::one());
        x * x * (L::splat(3.0) - (x + x))
    }
}

/// `x² (3 - 2 x)` of `x = (c - cos outer) / (cos inner - cos outer)`, clamped to [0, 1], with `c` the cosine of the angle from the axis
/// (pbrt-v4, `SpotLight`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Falloff {
    /// Unit axis of the spot.
    axis: [f32; 3],
    /// `1 - cos` of the outer angle.
    outer: f32,
    /// Reciprocal of the difference of the cosines.
    slope: f32,
}

impl Falloff {
    /// Full in all directions, to the bit: `x` is 1.
    pub const NONE: Self = Self {
        axis: [0.0; 3],
        outer: f32::MAX,
        slope: 1.0,
    };

    /// A spot along the unit `axis`, with cone angles in radians, `0 <= inner <= outer`.
    pub fn new(axis: [f32; 3], [inner, outer]: [f64; 2]) -> Self {
        let one_minus_cos = |angle: f64| 2.0 * (angle / 2.0).sin().powi(2);
        let width = one_minus_cos(outer) - one_minus_cos(inner);
        Self {
            axis,
            outer: one_minus_cos(outer) as f32,
            // Equal angles make a hard edge, with the steepest slope that `f32` holds.
            slope: (1.0 / width).min(f64::from(f32::MAX)) as f32,
        }
    }

    /// Fraction of the intensity at points that see the spot in the unit direction `wi`.
    #[inline(always)]
    pub fn at<L: Lane>(&self, wi: Vec3<L>) -> L {
        let cones = Cones {
            axis: Vec3::splat(self.axis),
            outer: L::splat(self.outer),
            slope: L::splat(self.slope),
        };
        cones.at(wi)
    }

    /// Axis, `1 - cos` of the outer angle, and slope: one column each of [`Cones`].
    pub fn columns(&self) -> [f32; 5] {
        let [x, y, z] = self.axis;
        [x, y, z, self.outer, self.slope]
    }
}
