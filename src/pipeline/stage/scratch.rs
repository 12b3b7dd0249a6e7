//! What threads work with, and what a stage is.

use super::chunk::Chunk;
use super::grid::Grid;
use super::rings::RingBlock;
use crate::embree::TraceLane;
use crate::light::tree::Pick;
use crate::linear::Candidates;
use crate::linear::cull::Points;
use crate::pipeline::model::Streams;
use crate::pipeline::queue::{RayQueue, WideQueue};

/// A step of a chunk, written once for packets of any width.
pub trait Stage {
    /// Does the step. `#[inline(always)]`, as is everything in it that handles lanes.
    fn run<L: TraceLane>(chunk: &mut Chunk, scratch: &mut Scratch);
}

/// What a thread works with; made once, used for chunk after chunk.
#[derive(Debug)]
pub struct Scratch {
    /// The pixels of the tile, or the samples of the chunk.
    pub grid: Grid,
    /// Shading points by model of reflection: see [`Model`](crate::pipeline::model::Model).
    pub hits: Streams,
    /// Points that share a list of lights, by model.
    pub parts: Streams,
    /// That list.
    pub list: Vec<Pick>,
    /// Rays that wait for their visibility; empty between steps, as the next two.
    pub queue: RayQueue,
    /// Rays to triangles of meshes that emit, with the names of these.
    pub aimed: WideQueue,
    /// Rays along directions of the BRDF, with their densities.
    pub looks: WideQueue,
    /// Where the points of a stream are.
    pub points: Points,
    /// Shapes that rays at hand may meet.
    pub set: Candidates,
    /// The ways from the points of a stream to each light.
    pub shafts: Vec<Shaft>,
    /// Rings of lobes that lights lie in, between the steps of `product`.
    pub rings: RingBlock,
    /// What [`Penumbra`](super::Penumbra) has found.
    pub partly: Vec<u32>,
}

/// What may be in the way of rays from the points of a stream to a light.
#[derive(Debug, Default)]
pub struct Shaft {
    /// Nothing at all: the rays need not be asked for.
    pub open: bool,
    /// The shapes that may be.
    pub set: Candidates,
}

impl Default for Scratch {
    fn default() -> Self {
        Self {
            grid: Grid::default(),
            hits: Streams::default(),
            parts: Streams::default(),
            list: Vec::new(),
            queue: RayQueue::new(),
            aimed: WideQueue::new(),
            looks: WideQueue::new(),
            points: Points::default(),
            set: Candidates::default(),
            shafts: Vec::new(),
            rings: RingBlock::new(),
            partly: Vec::new(),
        }
    }
}
