//! Queues: rays that carry what they are worth until somebody has told what they meet.

use super::columns::{Columns, Room};
use super::stream::Address;
use crate::estimator::ShadingPoint;
use crate::estimator::per_light::Contribution;
use crate::lane::Lane;
use crate::math::Vec3;

/// Rays that wait, in `K` columns.
#[derive(Debug)]
pub struct Queue<const K: usize>(Columns<K>);

/// Rays that carry what they are worth.
pub type RayQueue = Queue<11>;

/// Rays that carry what they are worth, and one more number each.
pub type WideQueue = Queue<12>;

/// A packet of queued rays.
#[derive(Clone, Copy, Debug)]
pub struct QueuedRays<L: Lane> {
    /// Where they start.
    pub origin: Vec3<L>,
    /// Unit directions.
    pub direction: Vec3<L>,
    /// Where they end.
    pub tfar: L,
    /// A contribution, or a throughput where the radiance is not known yet.
    pub value: Vec3<L>,
    /// Where the pixel sums up in its chunk.
    pub index: L::Bits,
}

impl<L: Lane> QueuedRays<L> {
    /// The rays that a contribution waits for.
    #[inline(always)]
    pub fn to_light<B>(point: &ShadingPoint<L, B>, address: &Address<L>, found: &Contribution<L>) -> Self {
        Self {
            origin: point.p,
            direction: found.wi,
            tfar: found.distance,
            value: found.ld,
            index: address.index,
        }
    }
}

impl<const K: usize> Queue<K> {
    /// Room for the rays of a chunk.
    pub fn new() -> Self {
        Self(Columns::new())
    }

    /// Rays in the queue.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Empties it.
    pub fn clear(&mut self) {
        self.0.clear();
    }

    /// The rays one by one.
    pub fn each(&self) -> impl Iterator<Item = QueuedRays<f32>> {
        (0..self.len()).map(|at| self.rays::<f32>(at, at).1)
    }

    #[inline(always)]
    fn put<L: Lane>(&mut self, mask: L::Mask, rays: &QueuedRays<L>) -> Room<L> {
        let room = self.0.grow::<L>(mask);
        self.0.put3(0, &room, rays.origin);
        self.0.put3(3, &room, rays.direction);
        self.0.put(6, &room, rays.tfar);
        self.0.put3(7, &room, rays.value);
        self.0.put(10, &room, L::from_bits(rays.index));
        room
    }

    /// The rays at `at` with the values at `value`, which is the same place. Lanes behind the end have place 0.
    #[inline(always)]
    fn rays<L: Lane>(&self, at: usize, value: usize) -> (L::Mask, QueuedRays<L>) {
        let lanes = self.0.lanes::<L>(at);
        let rays = QueuedRays {
            origin: self.0.get3(0, at),
            direction: self.0.get3(3, at),
            tfar: self.0.get(6, at),
            value: self.0.get3(7, value),
            index: self.0.get::<L>(10, at).or_zero(lanes).to_bits(),
        };
        (lanes, rays)
    }
}

impl RayQueue {
    /// Adds the rays of the mask.
    #[inline(always)]
    pub fn push<L: Lane>(&mut self, mask: L::Mask, rays: &QueuedRays<L>) {
        self.put(mask, rays);
    }

    /// The packet that starts at ray `at`.
    #[inline(always)]
    pub fn packet<L: Lane>(&self, at: usize) -> (L::Mask, QueuedRays<L>) {
        let value = mutate!(at, LaneShift => at + usize::from(L::N > 1));
        self.rays(at, value)
    }
}

impl WideQueue {
    /// Adds the rays of the mask, with a number.
    #[inline(always)]
    pub fn push<L: Lane>(&mut self, mask: L::Mask, rays: &QueuedRays<L>, number: L) {
        let room = self.put(mask, rays);
        self.0.put(11, &room, number);
    }

    /// The packet that starts at ray `at`, with its numbers.
    #[inline(always)]
    pub fn packet<L: Lane>(&self, at: usize) -> (L::Mask, QueuedRays<L>, L) {
        let (lanes, rays) = self.rays(at, at);
        (lanes, rays, self.0.get(11, at))
    }
}
