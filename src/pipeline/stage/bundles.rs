//! Occluders on the way to the lights of lists: culled for many lights at once that are near one another in the tree, then for fewer
//! among those that are left, and so on.

use super::picks::Picks;
use super::{Chunk, Request};
use crate::linear::Candidates;
use crate::linear::cull::Points;
use crate::pipeline::stream::HitStream;

/// Numbers of lights for which occluders are culled together, each a multiple of the next. Of the sizes tried, 16 and 4 were best or
/// within the noise of the best (`docs/performance-log.md`).
const SIZES: [usize; 2] = [16, 4];

/// So few shapes are not culled again for fewer lights.
const FEW: usize = 32;

/// What may lie between the points of a stream and some lights.
#[derive(Debug, Default)]
pub struct Bundles {
    /// For each of [`SIZES`].
    sets: [Candidates; SIZES.len()],
    /// The last of them that was culled.
    last: usize,
}

impl Bundles {
    /// Culls for the bundles that begin with this light; lights must come in order. Nothing, if rays are not culled.
    #[inline(never)]
    pub fn begin(&mut self, chunk: &mut Chunk, stream: &HitStream, points: &mut Points, (picks, run): (&Picks, usize)) {
        if !chunk.world.by_shaft {
            return;
        }
        let Some(lists) = chunk.lists else { return };
        for (level, size) in SIZES.into_iter().enumerate() {
            if run % size != 0 {
                continue;
            }
            let (above, below) = self.sets.split_at_mut(level);
            let wide = (level > 0).then(|| &above[self.last.min(level - 1)]);
            if wide.is_some_and(|wide| wide.len() <= FEW) {
                continue;
            }
            let bounds = picks.bounds(chunk.world, lists, run..run + size);
            let set = &mut below[0];
            chunk.request(Request::Bundle {
                stream,
                points,
                bounds,
                wide,
                set,
            });
            self.last = level;
        }
    }

    /// What may lie between the points and the light of the last call and its neighbors; `None` if rays are not culled.
    pub fn wide(&self, chunk: &Chunk) -> Option<&Candidates> {
        chunk.world.by_shaft.then(|| &self.sets[self.last])
    }
}
