//! Queues of rays, each with its contribution, that wait to be traced.

use std::ops::Range;

use super::columns::{Columns, Room};
use super::stream::Address;
use crate::estimator::ShadingPoint;
use crate::estimator::per_light::Contribution;
use crate::lane::Lane;
use crate::math::Vec3;
use crate::shape::BoundingSphere;

/// Waiting rays, in `K` columns.
#[derive(Debug)]
pub struct Queue<const K: usize>(Columns<K>);

/// Rays with a contribution.
pub type RayQueue = Queue<11>;

/// Rays with a contribution and one additional number.
pub type WideQueue = Queue<12>;

/// A packet of queued rays.
#[derive(Clone, Copy, Debug)]
pub struct QueuedRays<L: Lane> {
    /// Origins.
    pub origin: Vec3<L>,
    /// Unit directions.
    pub direction: Vec3<L>,
    /// Upper ends of the rays.
    pub tfar: L,
    /// A contribution; a throughput if the radiance is not yet known.
    pub value: Vec3<L>,
    /// Index of the pixel's sum in the chunk.
    pub index: L::Bits,
}

impl<L: Lane> QueuedRays<L> {
    /// The shadow rays of a contribution.
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
    /// A queue with room for the rays of a chunk.
    pub fn new() -> Self {
        Self(Columns::new())
    }

    /// Rays in the queue.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Empties the queue.
    pub fn clear(&mut self) {
        self.0.clear();
    }

    /// Iterates over the rays.
    pub fn each(&self) -> impl Iterator<Item = QueuedRays<f32>> {
        (0..self.len()).map(|at| self.rays::<f32>(at, at).1)
    }

    /// A bounding sphere of the origins of some rays, at most 16.
    pub fn origins(&self, some: Range<usize>) -> BoundingSphere {
        let mut points = [[0.0; 3]; 16];
        let number = some.len();
        for (point, at) in points.iter_mut().zip(some) {
            *point = self.0.get3::<f32>(0, at).lane(0);
        }
        BoundingSphere::around(&points[..number])
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

    /// The rays at `at` with the values at `value`, which equals `at`. Lanes past the end get index 0.
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
    /// Pushes the active rays of the mask.
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
    /// Pushes the active rays of the mask, each with a number.
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
