//! Many candidates: the spheres between all points of a tile and a light are more than those between a few neighbors and the light.

use super::Candidates;
use super::balls::{Balls, Packet};
use super::cull::{MARGIN, norm1};
use crate::lane::{F32x8, Lane};
use crate::math::Vec3;
use crate::shape::BoundingSphere;

/// With more spheres than this, each few rays get a selection of their own. Not measured against other values.
const CROWD: usize = 24;

impl Candidates {
    /// Whether a selection for few rays pays off.
    pub fn is_crowded(&self) -> bool {
        self.balls.is_known() && self.balls.len() > CROWD
    }

    /// The candidates without spheres, to be filled by [`Self::narrow`].
    pub fn without_balls(&self) -> Self {
        Self {
            triangles: self.triangles.clone(),
            lights: self.lights.clone(),
            balls: Balls::default(),
            ..*self
        }
    }

    /// Replaces the spheres of `near` by those that segments from a ball to the target may hit.
    pub fn narrow(&self, from: &BoundingSphere, near: &mut Self) {
        match Cone::between(from, &self.target) {
            None => near.balls.clone_from(&self.balls),
            Some(cone) => near.balls.select(&self.balls, |packet| cone.meets(packet)),
        }
    }
}

/// The convex hull of two balls. With `t` along the axis from one center to the other and the radius `r(t)`, which changes by `s` per
/// length, a sphere of radius `r` at the distance `h` from the nearest point of the axis meets the hull only if
/// `h √(1 - s²) <= r + r(t)`.
pub(super) struct Cone {
    origin: [f32; 3],
    axis: [f32; 3],
    length: f32,
    radius: f32,
    slope: f32,
    cosine: f32,
    /// For margins: the sum of absolute coordinates and radii.
    size: f32,
}

impl Cone {
    /// `None` if one ball is nearly inside the other.
    pub fn between(from: &BoundingSphere, target: &BoundingSphere) -> Option<Self> {
        let to: [f32; 3] = std::array::from_fn(|k| target.center[k] - from.center[k]);
        let length = to.iter().map(|x| x * x).sum::<f32>().sqrt();
        let slope = (target.radius - from.radius) / length;
        (slope.is_finite() && slope.abs() <= 0.9).then(|| Self {
            origin: from.center,
            axis: to.map(|x| x / length),
            length,
            radius: from.radius,
            slope,
            cosine: (1.0 - slope * slope).sqrt(),
            size: norm1(from.center) + norm1(target.center) + from.radius + target.radius,
        })
    }

    /// Spheres of a packet that may meet the hull.
    #[inline(always)]
    pub fn meets(&self, packet: &Packet) -> <F32x8 as Lane>::Mask {
        let splat = F32x8::splat;
        let Packet { center, radius, .. } = *packet;
        let axis = Vec3::splat(self.axis);
        let apart = center - Vec3::splat(self.origin);
        let along = apart.dot(axis).max(F32x8::zero()).min(splat(self.length));
        let h = (apart - axis * along) * splat(self.cosine);
        let reach = along.mul_add(splat(self.slope), splat(self.radius)) + radius;
        let margin = splat(MARGIN) * (center.x.abs() + center.y.abs() + center.z.abs() + splat(self.size));
        let reach = reach + margin;
        // Squares: a root takes as long as all of this.
        !h.length_squared().gt(reach * reach)
    }
}
