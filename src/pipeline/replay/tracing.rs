//! The plan's intersector, one ray at a time. A replay traces a handful of rays, so it is not compiled for each intersector.

use crate::embree::{Coherence, Hit, Ray};
use crate::linear::Candidates;
use crate::pipeline::tracer::{BruteForce, ByEmbree, Tracer};
use crate::pipeline::world::World;
use crate::settings::AccelKind;

/// Traces single rays.
pub struct OneByOne<'a> {
    pub world: &'a World,
    accel: AccelKind,
    set: Candidates,
}

impl<'a> OneByOne<'a> {
    /// Traces with this intersector.
    pub fn new(world: &'a World, accel: AccelKind) -> Self {
        let mut set = Candidates::default();
        match accel {
            AccelKind::Embree => ByEmbree::keep_all(world, &mut set),
            AccelKind::Linear => BruteForce::keep_all(world, &mut set),
        }
        Self { world, accel, set }
    }

    /// The closest hit.
    pub fn nearest(&self, ray: &Ray<f32>, coherence: Coherence) -> Hit<f32> {
        match self.accel {
            AccelKind::Embree => ByEmbree::nearest(self.world, &self.set, true, ray, coherence),
            AccelKind::Linear => BruteForce::nearest(self.world, &self.set, true, ray, coherence),
        }
    }

    /// Whether anything is hit but the shape with the ray's skip id.
    pub fn occluded(&self, ray: &Ray<f32>) -> bool {
        match self.accel {
            AccelKind::Embree => ByEmbree::occluded(self.world, &self.set, true, ray, Coherence::Incoherent),
            AccelKind::Linear => BruteForce::occluded(self.world, &self.set, true, ray, Coherence::Incoherent),
        }
    }
}
