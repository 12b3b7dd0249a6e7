//! A chunk of work, and the addresses of its random numbers.

use super::request::RequestHandler;
use crate::bsdf::Brdf;
use crate::estimator::density::Mix;
use crate::estimator::kind::LightKind;
use crate::film::{ChunkSum, Tile};
use crate::lane::{Lane, Mask};
use crate::pipeline::lists::Lists;
use crate::pipeline::progress::Counters;
use crate::pipeline::queue::Queue;
use crate::pipeline::stream::Address;
use crate::pipeline::world::World;
use crate::sampling::{PassBlock, TechniqueSample};

/// The order of a chunk's samples. The samples of one pixel keep the order of the chunk's passes in all variants, so the picture
/// does not depend on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    /// Pass by pass, and in each the pixels of the tile. A packet holds one pass, so mostly one sampling technique.
    Passes,
    /// Groups of four neighboring pixels, each group with all its passes. Packets are as narrow as possible, so their rays share
    /// most of the traversal on meshes whose triangles are smaller than pixels.
    Neighbours,
    /// Pass by pass, and in each first the tile's pixels of one checkerboard color, then those of the other: points that share a
    /// list of lights are consecutive.
    Lists,
}

/// A chunk of work: some passes of a block, for every pixel of a tile that takes part in them.
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
    /// First pass, relative to the first of the block.
    pub first: u32,
    /// All passes, relative to the first of the block, in processing order; at least one.
    pub pass_order: &'a [u32],
    /// How samples are grouped into packets.
    pub order: Order,
    /// How light sampling and BRDF sampling are combined, for stages that read it at run time.
    pub mix: Mix,
    /// Whether [`LightKind::product`] decides where it may.
    pub product: bool,
    /// The lists of lights from which the stages draw, if any.
    pub lists: Option<&'a Lists>,
    /// The request handler of the intersector.
    pub handler: RequestHandler,
    /// For each pixel of the tile, the lights to which `product` traces two rays: a bit mask, lowest bit first; empty if there are
    /// none.
    pub partly: &'a [u32],
    /// Sums of the chunk, slot by slot, and in each slot pixel by pixel.
    pub sum: &'a mut ChunkSum,
    /// Ray counts.
    pub counters: &'a mut Counters,
    /// Log of traced shadow rays for a replay; `None` in a render.
    pub log: Option<Vec<Segment>>,
}

/// A traced shadow ray.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Segment {
    /// Origin, relative to the pinhole.
    pub origin: [f32; 3],
    /// Unit direction.
    pub direction: [f32; 3],
    /// Length; infinite for an unbounded ray.
    pub tfar: f32,
}

impl Chunk<'_> {
    /// Logs the rays of a queue before tracing, if a log exists: one check per queue.
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

    /// How light sampling and BRDF sampling are combined for a kind of light at points with a BRDF.
    #[inline(always)]
    pub fn mix_of<L: Lane, K: LightKind, M: Brdf<L>>(&self) -> Mix {
        match K::product::<L, M>() {
            Some(mix) if self.product => mix,
            _ => self.mix,
        }
    }

    /// Which points of a packet sample their BRDF for light `i`, and the random numbers: by one-sample MIS, or all points in the
    /// second call of [`Mix::times`]. Techniques that stand alone in `product` take the whole pair. The BRDF-sampled direction of the
    /// second call is the same for all lights.
    #[inline(always)]
    pub fn technique_sample<L: Lane>(
        &self,
        mix: Mix,
        address: &Address<L>,
        i: usize,
        time: u32,
    ) -> TechniqueSample<L::Bits> {
        let (numbers, key, pass) = (self.numbers, address.key, address.pass);
        if !mix.both() && !self.product {
            return numbers.technique_sample(key, pass, pairs::light(i), self.tile.number());
        }
        let pair = if time == 0 { pairs::light(i) } else { pairs::DIRECTION };
        TechniqueSample {
            by_brdf_lanes: L::Mask::splat(time == 1 || mix == Mix::Lobe),
            pair: numbers.pair(key, pass, pair),
        }
    }
}

/// Pairs of random numbers of a sample: the film position first, then one pair per direction.
pub mod pairs {
    /// Position in the pixel.
    pub const PIXEL: u32 = 0;
    /// The single direction of `uniform` and `brdf`; the BRDF direction shared by all spheres in `mis`, and by all lights in
    /// `mis2-balance` and `mis2-power`.
    pub const DIRECTION: u32 = 1;
    /// Direction to light `i`.
    pub const fn light(i: usize) -> u32 {
        2 + i as u32
    }
}
