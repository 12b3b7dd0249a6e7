//! Ray-sphere intersection.

use crate::lane::{Lane, Mask};
use crate::math::Vec3;

/// A sphere.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BoundingSphere {
    /// Center.
    pub center: [f32; 3],
    /// Radius.
    pub radius: f32,
}

impl BoundingSphere {
    /// A bounding sphere of points, slightly enlarged, around the center of their bounding box.
    pub fn around(points: &[[f32; 3]]) -> Self {
        let middle = |k: usize| {
            let (low, high) = points
                .iter()
                .fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), p| {
                    (low.min(p[k]), high.max(p[k]))
                });
            0.5 * low + 0.5 * high
        };
        let center = [middle(0), middle(1), middle(2)];
        let apart = |p: &[f32; 3]| (0..3).map(|k| (p[k] - center[k]).powi(2)).sum::<f32>().sqrt();
        let size = center.iter().fold(0.0_f32, |m, x| m.max(x.abs()));
        let radius = points.iter().map(apart).fold(0.0, f32::max) * (1.0 + 1e-6) + size * 1e-6;
        Self { center, radius }
    }

    /// Closest intersection in `[tnear, tfar]` of rays with the sphere, from outside or inside.
    ///
    /// The discriminant uses the point of the ray closest to the center, which is precise for a small distant sphere. The roots use
    /// the sum without cancellation: Haines et al. 2019, "Precision Improvements for Ray/Sphere Intersection", Ray Tracing Gems
    /// chapter 7. Directions need not be unit.
    #[inline(always)]
    pub fn intersect<L: Lane>(&self, origin: Vec3<L>, direction: Vec3<L>, tnear: L, tfar: L) -> (L::Mask, L) {
        let radius = L::splat(self.radius);
        let r2 = radius * radius;
        let from_center = origin - Vec3::splat(self.center);
        let a = direction.length_squared();
        let b = -from_center.dot(direction);
        let closest = direction.mul_add(b / a, from_center);
        let discriminant = r2 - closest.length_squared();
        let meets = discriminant.ge(L::zero());
        if meets.none() {
            return (meets, tfar);
        }
        let c = from_center.length_squared() - r2;
        let root = (a * discriminant).safe_sqrt();
        let q = b + root.negated(b.lt(L::zero()));
        let (t0, t1) = (c / q, q / a);
        let (near, far) = (t0.min(t1), t0.max(t1));
        let near_counts = near.ge(tnear) & near.le(tfar);
        let far_counts = far.ge(tnear) & far.le(tfar);
        (meets & (near_counts | far_counts), L::select(near_counts, near, far))
    }
}
