//! The stages of a chunk, in the order of flow: [`eye`] fills the hit streams, [`shade`] fills the shadow queue,
//! [`shadow`] empties it onto the film.

pub mod eye;
pub mod shade;
pub mod shadow;

use super::Counters;
use super::stream::{HitStream, RayQueue};
use super::world::World;
use crate::film::TileSum;
use crate::sampling::PassBlock;

/// The most samples that a chunk holds.
pub const CHUNK: usize = 2048;

/// Kinds of surfaces, each with a stream of its own so that a packet seldom mixes them.
pub const BINS: usize = 2;

/// What a thread works with; made once, used for chunk after chunk.
#[derive(Debug)]
pub struct Scratch {
    /// Shading points by kind of surface: diffuse, Phong.
    pub hits: [HitStream; BINS],
    /// Rays that wait for their visibility.
    pub queue: RayQueue,
}

impl Scratch {
    /// Room for one chunk.
    pub fn new() -> Self {
        Self {
            hits: std::array::from_fn(|_| HitStream::new(CHUNK)),
            queue: RayQueue::new(CHUNK),
        }
    }
}

impl Default for Scratch {
    fn default() -> Self {
        Self::new()
    }
}

/// A chunk of work and where its results go.
#[derive(Debug)]
pub struct Chunk<'a> {
    /// The scene.
    pub world: &'a World,
    /// The random numbers of the block that the chunk is part of.
    pub numbers: &'a PassBlock,
    /// Sums of the chunk, pixel by pixel of its tile.
    pub sum: &'a mut TileSum,
    /// What was traced.
    pub counters: &'a mut Counters,
}

/// Pairs of random numbers of a sample: the point in the pixel, then one for each direction.
pub mod pairs {
    /// Point in the pixel.
    pub const PIXEL: u32 = 0;
    /// The one direction of `uniform` and `brdf`.
    pub const DIRECTION: u32 = 1;
    /// Direction for light `i`.
    pub const fn light(i: usize) -> u32 {
        1 + i as u32
    }
}
