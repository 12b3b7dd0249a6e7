//! Many candidates: the spheres between all points of a tile and a light are more than those between a few neighbors and the light.

use super::Candidates;
use super::columns::Columns;
use super::cull::{MARGIN, norm1};
use crate::lane::{F32x8, Lane, Mask};
use crate::math::Vec3;
use crate::shape::Ball;

/// With more spheres than this, each few rays get a selection of their own. Not measured against other values.
const CROWD: usize = 24;

impl Candidates {
    /// Whether a selection for few rays pays off.
    pub fn is_crowded(&self) -> bool {
        self.columns.len() > CROWD
    }

    /// The candidates without spheres, to be filled by [`Self::narrow`].
    pub fn without_balls(&self) -> Self {
        Self {
            triangles: self.triangles.clone(),
            lights: self.lights.clone(),
            balls: Vec::new(),
            columns: Columns::default(),
            ..*self
        }
    }

    /// Replaces the spheres of `near` by those that segments from a ball to the target may hit.
    ///
    /// The segments lie in the convex hull of two balls. With `t` along the axis from one center to the other and the radius
    /// `r(t)`, which changes by `s` per length, a sphere of radius `r` at the distance `h` from the nearest point of the axis meets
    /// the hull only if `h √(1 - s²) <= r + r(t)`.
    pub fn narrow(&self, from: &Ball, near: &mut Self) {
        near.balls.clear();
        let to: [f32; 3] = std::array::from_fn(|k| self.target.center[k] - from.center[k]);
        let length = to.iter().map(|x| x * x).sum::<f32>().sqrt();
        let slope = (self.target.radius - from.radius) / length;
        if !slope.is_finite() || slope.abs() > 0.9 {
            near.balls.extend(&self.balls);
            return;
        }
        let axis: Vec3<F32x8> = Vec3::splat(to.map(|x| x / length));
        let origin: Vec3<F32x8> = Vec3::splat(from.center);
        let splat = F32x8::splat;
        let cosine = splat((1.0 - slope * slope).sqrt());
        let size = norm1(from.center) + norm1(self.target.center) + from.radius + self.target.radius;
        for (at, lanes) in self.columns.packets::<F32x8>() {
            let center: Vec3<F32x8> = self.columns.get3(0, at);
            let apart = center - origin;
            let along = apart.dot(axis).max(F32x8::zero()).min(splat(length));
            let h = (apart - axis * along).length();
            let reach = along.mul_add(splat(slope), splat(from.radius)) + self.columns.get::<F32x8>(3, at);
            let margin = splat(MARGIN) * (center.x.abs() + center.y.abs() + center.z.abs() + splat(size));
            let kept = lanes & !(h * cosine).gt(reach + margin);
            near.balls.extend(kept.lanes().map(|lane| self.balls[at + lane]));
        }
    }
}
