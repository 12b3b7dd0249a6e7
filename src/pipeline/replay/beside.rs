//! Rays of a sample to lights that are not listed one by one.

use serde::Serialize;

use super::{Met, OneByOne, met};
use crate::math::Vec3;
use crate::pipeline::stage::Segment;

/// A ray to a large emissive mesh or the environment.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Beside {
    /// Unit direction.
    pub wi: [f32; 3],
    /// Distance to the light; `None` for the environment.
    pub distance: Option<f32>,
    /// The first hit before the light.
    pub blocked_by: Option<Met>,
}

/// A ray counts as blocked if it hits something within this fraction of its length: the light itself may be hit at the end.
const WAY: f32 = 0.999;

/// Classifies a ray.
pub fn of(tracer: &OneByOne, segment: &Segment) -> Beside {
    let space = &tracer.world.space;
    let end = segment.tfar.is_finite().then_some(segment.tfar);
    let met = met(tracer, Vec3::splat(segment.origin), Vec3::splat(segment.direction));
    let before = |met: &Met| end.is_none_or(|end| met.distance < space.in_scene(end * WAY));
    Beside {
        wi: segment.direction,
        distance: end.map(|end| space.in_scene(end)),
        blocked_by: met.filter(before),
    }
}
