//! Suns: directional lights with an angular radius, i.e. disks of uniform radiance.

use super::reach::Reach;
use crate::lane::Lane;
use crate::math::elementary::sin_cos_turn;
use crate::math::{Frame, Vec3};
use crate::sampling::{Pair, warp};

/// A sun, the same for all lanes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sun {
    /// Unit direction to its center.
    pub axis: [f32; 3],
    /// `1 - cos` of its angular radius, in (0, 1].
    pub one_minus_cos: f32,
    /// Chord between the axis and the rim.
    pub chord: f32,
    /// Radiance.
    pub le: [f32; 3],
}

impl Sun {
    /// The disk about the unit `axis` with this angular radius in radians.
    pub fn new(axis: [f32; 3], angular_radius: f64, le: [f32; 3]) -> Self {
        // 1 - cos and the chord from half the angle, without cancellation.
        let half_sine = (angular_radius / 2.0).sin();
        Self {
            axis,
            one_minus_cos: (2.0 * half_sine * half_sine) as f32,
            chord: (2.0 * half_sine) as f32,
            le,
        }
    }

    /// Bounds of its shadow rays. A disk of more than 45 degrees is treated as the whole sky.
    pub fn reach(&self) -> Reach {
        let cosine = 1.0 - self.one_minus_cos;
        let sine = (self.one_minus_cos * (1.0 + cosine)).sqrt();
        if cosine < 0.7 {
            return Reach::Everywhere;
        }
        Reach::Cone {
            axis: self.axis,
            tangent: sine / cosine,
        }
    }

    /// Samples unit directions uniformly in the cone of the disk.
    #[inline(always)]
    pub fn draw<L: Lane>(&self, numbers: Pair<L::Bits>) -> Vec3<L> {
        let (u, v) = numbers.unit::<L>();
        let (sine, cosine) = sin_cos_turn(v);
        Frame::about(Vec3::splat(self.axis)).direction(warp::cone(u, L::splat(self.one_minus_cos)), sine, cosine)
    }

    /// Reciprocal density of [`Self::draw`], in steradians.
    #[inline(always)]
    pub fn solid_angle<L: Lane>(&self) -> L {
        warp::cone_solid_angle(L::splat(self.one_minus_cos))
    }

    /// Lanes whose unit direction points into the disk. The test uses the chord, which is accurate near the axis. Do not test
    /// directions sampled in the disk: rounding would lose some near the rim.
    #[inline(always)]
    pub fn contains<L: Lane>(&self, wi: Vec3<L>) -> L::Mask {
        let chord = Vec3::splat(self.axis) - wi;
        (chord.length_squared() * L::splat(0.5)).le(L::splat(self.one_minus_cos))
    }

    /// Radiance from unit directions; 0 outside the disk and in inactive lanes.
    #[inline(always)]
    pub fn radiance<L: Lane>(&self, wi: Vec3<L>, active: L::Mask) -> Vec3<L> {
        Vec3::splat(self.le).or_zero(active & self.contains(wi))
    }
}
