//! The stages of a chunk, in the order of flow: [`eye`] fills the hit streams, [`shade`] fills the shadow queue,
//! [`shadow`] empties it onto the film.

pub mod environment;
pub mod eye;
pub mod grid;
pub mod shade;
pub mod shadow;
pub mod surface;
pub mod triangles;

use super::Counters;
use super::queue::{RayQueue, WideQueue};
use super::stream::{Address, HitStream};
use super::tracer::Tracer;
use super::world::World;
use crate::embree::TraceLane;
use crate::estimator::density::Mix;
use crate::film::{ChunkSum, Tile};
use crate::lane::{Lane, Mask};
use crate::linear::Candidates;
use crate::linear::cull::Points;
use crate::sampling::{PassBlock, Toss};

/// A step of a chunk, written once for packets of any width and whoever answers rays.
pub trait Stage {
    /// Does the step. `#[inline(always)]`, as is everything in it that handles lanes.
    fn run<L: TraceLane, T: Tracer>(chunk: &mut Chunk, scratch: &mut Scratch);
}

/// What a thread works with; made once, used for chunk after chunk.
#[derive(Debug)]
pub struct Scratch {
    /// The pixels of the tile, or the samples of the chunk.
    pub grid: grid::Grid,
    /// Shading points by model of reflection: see [`Model`](super::stream::Model).
    pub hits: [HitStream; 2],
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
            grid: grid::Grid::default(),
            hits: [HitStream::new(), HitStream::new()],
            queue: RayQueue::new(),
            aimed: WideQueue::new(),
            looks: WideQueue::new(),
            points: Points::default(),
            set: Candidates::default(),
            shafts: Vec::new(),
        }
    }
}

/// A chunk of work: some passes of a block for every pixel of a tile that takes part in them.
#[derive(Debug)]
pub struct Chunk<'a> {
    /// The scene.
    pub world: &'a World,
    /// The random numbers of the block.
    pub numbers: &'a PassBlock,
    /// The pixels.
    pub tile: &'a Tile,
    /// Pixels in a row of the film.
    pub film_width: u32,
    /// First pass, counted from the block's first.
    pub first: u32,
    /// All passes, counted so too, in the order in which they are taken; there is one at least.
    pub turns: &'a [u32],
    /// How they make packets.
    pub order: grid::Order,
    /// How directions of lights and of the BRDF are combined, for the stages that ask.
    pub mix: Mix,
    /// Sums of the chunk, slot by slot and in each pixel by pixel of its tile.
    pub sum: &'a mut ChunkSum,
    /// What was traced.
    pub counters: &'a mut Counters,
}

impl Chunk<'_> {
    /// How often [`Self::toss`] has to be called for a light.
    #[inline(always)]
    pub fn tosses(&self) -> u32 {
        if self.mix.both() { 2 } else { 1 }
    }

    /// Which points of a packet follow their BRDF in looking for light `i`, and the numbers for it: by a coin, or all of them the
    /// second time. The direction of the BRDF is then the same for all lights.
    #[inline(always)]
    pub fn toss<L: Lane>(&self, address: &Address<L>, i: usize, time: u32) -> Toss<L::Bits> {
        let (numbers, key, pass) = (self.numbers, address.key, address.pass);
        if !self.mix.both() {
            return numbers.toss(key, pass, pairs::light(i), self.tile.number());
        }
        let pair = if time == 0 { pairs::light(i) } else { pairs::DIRECTION };
        Toss {
            heads: L::Mask::splat(time == 1),
            pair: numbers.pair(key, pass, pair),
        }
    }
}

/// Pairs of random numbers of a sample: the point in the pixel, then one for each direction.
pub mod pairs {
    /// Point in the pixel.
    pub const PIXEL: u32 = 0;
    /// The one direction of `uniform` and `brdf`, and that of the BRDF which all spheres share in `mis`, all lights in `mis2-balance`
    /// and `mis2-power`.
    pub const DIRECTION: u32 = 1;
    /// Direction to light `i`.
    pub const fn light(i: usize) -> u32 {
        2 + i as u32
    }
}
