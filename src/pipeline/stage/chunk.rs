//! A chunk of work, and the addresses of its random numbers.

use super::ask::Answers;
use crate::estimator::density::Mix;
use crate::film::{ChunkSum, Tile};
use crate::lane::{Lane, Mask};
use crate::pipeline::progress::Counters;
use crate::pipeline::queue::Queue;
use crate::pipeline::stream::Address;
use crate::pipeline::world::World;
use crate::sampling::{PassBlock, TechniqueSample};

/// The order of a chunk's samples. A pixel's own samples come in the order of the chunk's turns in each, so a picture does not
/// depend on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    /// Pass by pass, in each the pixels of the tile: packets hold one pass, so mostly one technique.
    Passes,
    /// Four neighbouring pixels after the other, each with all its passes: packets are as narrow as they can be. On a mesh
    /// whose triangles are smaller than pixels the rays of a packet then share most of their way.
    Neighbours,
    /// Pass by pass, in each the pixels of the tile of one colour of the chessboard, then those of the other: those that share a list
    /// of lights come after each other.
    Lists,
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
    pub pass_order: &'a [u32],
    /// How they make packets.
    pub order: Order,
    /// How directions of lights and of the BRDF are combined, for the stages that ask.
    pub mix: Mix,
    /// What the intersector answers.
    pub answers: Answers,
    /// Of each pixel of the tile, the lights that `product` sends two rays to: bits from the lowest on; empty where it never does.
    pub partly: &'a [u32],
    /// Sums of the chunk, slot by slot and in each pixel by pixel of its tile.
    pub sum: &'a mut ChunkSum,
    /// What was traced.
    pub counters: &'a mut Counters,
    /// Where a replay keeps the shadow rays that were traced; a render keeps none.
    pub log: Option<Vec<Segment>>,
}

/// A ray of which it was asked what is in its way.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Segment {
    /// Where it starts, relative to the pinhole.
    pub origin: [f32; 3],
    /// Unit.
    pub direction: [f32; 3],
    /// Where it ends; infinite where it has no end.
    pub tfar: f32,
}

impl Chunk<'_> {
    /// Keeps the rays of a queue that is about to be traced, if anybody wants them: one look for a whole queue.
    #[inline(always)]
    pub fn keep<const K: usize>(&mut self, queue: &Queue<K>) {
        if let Some(log) = &mut self.log {
            log.extend(queue.each().map(|ray| Segment {
                origin: ray.origin.lane(0),
                direction: ray.direction.lane(0),
                tfar: ray.tfar,
            }));
        }
    }

    /// How often [`Self::technique_sample`] has to be called for a light.
    #[inline(always)]
    pub fn tosses(&self) -> u32 {
        if self.mix.both() { 2 } else { 1 }
    }

    /// Which points of a packet follow their BRDF in looking for light `i`, and the numbers for it: by a coin, or all of them the
    /// second time. The direction of the BRDF is then the same for all lights.
    #[inline(always)]
    pub fn technique_sample<L: Lane>(&self, address: &Address<L>, i: usize, time: u32) -> TechniqueSample<L::Bits> {
        let (numbers, key, pass) = (self.numbers, address.key, address.pass);
        if !self.mix.both() {
            return numbers.technique_sample(key, pass, pairs::light(i), self.tile.number());
        }
        let pair = if time == 0 { pairs::light(i) } else { pairs::DIRECTION };
        TechniqueSample {
            by_brdf_lanes: L::Mask::splat(time == 1),
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
