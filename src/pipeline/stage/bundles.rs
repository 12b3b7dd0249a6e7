//! Occluders on the way to the lights of lists: culled for many lights at once that are near one another in the tree, then for a few of
//! them among those that are left, and last for each.

use super::picks::Picks;
use super::{Chunk, Request};
use crate::linear::Candidates;
use crate::linear::cull::Points;
use crate::pipeline::stream::HitStream;

/// Numbers of lights for which occluders are culled together, the one a multiple of the other. Of the numbers tried, these were best or
/// within the noise of the best (`docs/performance-log.md`).
const MANY: usize = 16;
const SOME: usize = 4;

/// So few shapes are not culled again for fewer lights.
const FEW: usize = 32;

/// What may lie between the points of a stream and some lights.
#[derive(Debug, Default)]
pub struct Bundles {
    /// On the way to [`MANY`] lights.
    many: Candidates,
    /// On the way to [`SOME`] of them, if the others are more than [`FEW`].
    some: Candidates,
}

impl Bundles {
    /// Culls for the bundles that begin with this light; lights must come in order. Nothing, if rays are not culled.
    #[inline(never)]
    pub fn begin(&mut self, chunk: &mut Chunk, stream: &HitStream, points: &mut Points, (picks, run): (&Picks, usize)) {
        let (world, Some(lists)) = (chunk.world, chunk.lists) else {
            return;
        };
        if !world.by_shaft {
            return;
        }
        let mut cull = |size: usize, wide: Option<&Candidates>, set: &mut Candidates| {
            let bounds = picks.bounds(world, lists, run..run + size);
            chunk.request(Request::Bundle {
                stream,
                points,
                bounds,
                wide,
                set,
            });
        };
        if run.is_multiple_of(MANY) {
            cull(MANY, None, &mut self.many);
        }
        if run.is_multiple_of(SOME) && self.many.len() > FEW {
            cull(SOME, Some(&self.many), &mut self.some);
        }
    }

    /// What may lie between the points and the light of the last call and its neighbors; `None` if rays are not culled.
    pub fn wide(&self, chunk: &Chunk) -> Option<&Candidates> {
        let narrowed = self.many.len() > FEW;
        chunk
            .world
            .by_shaft
            .then_some(if narrowed { &self.some } else { &self.many })
    }
}
