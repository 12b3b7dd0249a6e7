//! Rays of a sample to lights that are not listed one by one.

use serde::Serialize;

use super::{Met, met};
use crate::math::Vec3;
use crate::pipeline::stage::Segment;
use crate::pipeline::tracer::Tracer;
use crate::pipeline::world::World;

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
pub fn of<T: Tracer>(world: &World, segment: &Segment) -> Beside {
    let end = segment.tfar.is_finite().then_some(segment.tfar);
    let met = met::<T>(world, Vec3::splat(segment.origin), Vec3::splat(segment.direction));
    let before = |met: &Met| end.is_none_or(|end| met.distance < world.space.in_scene(end * WAY));
    Beside {
        wi: segment.direction,
        distance: end.map(|end| world.space.in_scene(end)),
        blocked_by: met.filter(before),
    }
}
