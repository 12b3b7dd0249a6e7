//! Per-thread scratch memory, and the stage trait.

use super::bundles::Bundles;
use super::chunk::Chunk;
use super::grid::Grid;
use super::picks::Picks;
use super::rings::RingBlock;
use crate::embree::TraceLane;
use crate::linear::Candidates;
use crate::linear::cull::Points;
use crate::pipeline::model::Streams;
use crate::pipeline::queue::{RayQueue, WideQueue};

/// A stage of a chunk, written once for packets of any width.
pub trait Stage {
    /// Runs the stage. `#[inline(always)]`, like everything in it that handles lanes.
    fn run<L: TraceLane>(chunk: &mut Chunk, scratch: &mut Scratch);
}

/// Working memory of a thread; allocated once and reused for all chunks.
#[derive(Debug)]
pub struct Scratch {
    /// The pixels of the tile, or the samples of the chunk.
    pub grid: Grid,
    /// Shading points by BRDF model: see [`Model`](crate::pipeline::model::Model).
    pub hits: Streams,
    /// The lights of lists.
    pub picks: Picks,
    /// Shadow rays to be traced. This queue and the next two are empty between stages.
    pub queue: RayQueue,
    /// Rays to triangles of mesh lights, with the triangles' skip ids.
    pub aimed: WideQueue,
    /// BRDF rays, with their densities.
    pub looks: WideQueue,
    /// Bounds of the points of a stream.
    pub points: Points,
    /// Shapes that the current rays may hit.
    pub set: Candidates,
    /// Shapes that rays to some lights of lists may hit.
    pub bundles: Bundles,
    /// The culled occluders between the points of a stream and each light.
    pub shafts: Vec<Shaft>,
    /// Rings of BRDF lobes that overlap lights, between the steps of `product`.
    pub rings: RingBlock,
    /// Output of [`Penumbra`](super::Penumbra).
    pub partly: Vec<u32>,
}

/// Potential occluders of rays from the points of a stream to a light.
#[derive(Debug, Default)]
pub struct Shaft {
    /// Nothing can block the rays, so they need no tracing.
    pub open: bool,
    /// The potential occluders.
    pub set: Candidates,
}

impl Default for Scratch {
    fn default() -> Self {
        Self {
            grid: Grid::default(),
            hits: Streams::default(),
            picks: Picks::default(),
            queue: RayQueue::new(),
            aimed: WideQueue::new(),
            looks: WideQueue::new(),
            points: Points::default(),
            set: Candidates::default(),
            bundles: Bundles::default(),
            shafts: Vec::new(),
            rings: RingBlock::new(),
            partly: Vec::new(),
        }
    }
}
