//! Bounds of the shadow rays of a light.

use crate::shape::BoundingSphere;

/// A bound of all shadow rays of a light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reach {
    /// The rays end in a sphere.
    Within(BoundingSphere),
    /// The rays are unbounded, with directions close to an axis.
    Cone {
        /// Unit axis.
        axis: [f32; 3],
        /// Tangent of the largest angle between a direction and the axis; 0 if all are parallel.
        tangent: f32,
    },
    /// Any direction.
    Everywhere,
}

impl Reach {
    /// A sphere that all rays from points in `start` pass through or end in within the distance `far`. Occluders nearer than `far`
    /// along the axis then lie between `start` and this sphere.
    pub fn bounding_sphere(&self, start: &BoundingSphere, far: f32) -> Option<BoundingSphere> {
        match *self {
            Self::Within(ball) => Some(ball),
            Self::Everywhere => None,
            // At `far` along the axis a ray has moved sideways by at most `far` times the tangent; the extra 1e-6 covers rounding.
            Self::Cone { axis, tangent } => Some(BoundingSphere {
                center: std::array::from_fn(|k| start.center[k] + far * axis[k]),
                radius: start.radius + far * (tangent + 1e-6),
            }),
        }
    }
}
