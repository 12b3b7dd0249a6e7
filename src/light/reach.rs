//! Where the shadow rays of a light go.

use crate::shape::Ball;

/// What holds all shadow rays of a light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reach {
    /// They end in a ball.
    Ball(Ball),
    /// They have no end, and their directions are this close to an axis.
    Cone {
        /// Unit.
        axis: [f32; 3],
        /// Tangent of the largest angle between a direction and the axis; 0 where all go along it.
        tangent: f32,
    },
    /// They may go anywhere.
    Everywhere,
}

impl Reach {
    /// A ball that all rays from points in `start` go through or end in, if they do so within `far`: then what is nearer than `far` along
    /// the axis and in the way of a ray is between `start` and the ball.
    pub fn ball(&self, start: &Ball, far: f32) -> Option<Ball> {
        match *self {
            Self::Ball(ball) => Some(ball),
            Self::Everywhere => None,
            // At `far` along the axis a ray is beside its start by `far` times its tangent at most; 1e-6 of it for rounding.
            Self::Cone { axis, tangent } => Some(Ball {
                center: std::array::from_fn(|k| start.center[k] + far * axis[k]),
                radius: start.radius + far * (tangent + 1e-6),
            }),
        }
    }
}
