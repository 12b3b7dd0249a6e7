//! Streams and queues: columns of numbers, filled by packets and read by packets.
//!
//! A packet with idle lanes is packed when it is pushed, so every packet that is read is full but the last. The order
//! of what is pushed does not depend on the width of packets: lanes go in ascending order.

use crate::bsdf::Bsdf;
use crate::estimator::ShadingPoint;
use crate::lane::{Lane, Mask};
use crate::math::Vec3;

/// The most numbers in a column: the samples of a chunk.
pub const CAPACITY: usize = 2048;

/// A push writes a whole packet, also when few of its lanes count.
const STRIDE: usize = CAPACITY + 16;

/// `K` columns of at most [`CAPACITY`] numbers. The length of a column is known when the program is compiled, so that one
/// check of bounds serves all columns.
#[derive(Debug)]
struct Columns<const K: usize> {
    columns: Box<[[f32; STRIDE]; K]>,
    len: usize,
}

impl<const K: usize> Columns<K> {
    fn new() -> Self {
        Self {
            columns: bytemuck::zeroed_box(),
            len: 0,
        }
    }

    #[inline(always)]
    fn push<L: Lane>(&mut self, mask: L::Mask, values: [L; K]) {
        let count = mask.count();
        assert!(
            self.len + L::N <= STRIDE,
            "a stream is never pushed beyond its capacity"
        );
        if count == L::N {
            for k in 0..K {
                values[k].store(&mut self.columns[k][self.len..self.len + L::N]);
            }
        } else {
            let packing = L::packing(mask);
            for k in 0..K {
                values[k]
                    .pack(packing)
                    .store(&mut self.columns[k][self.len..self.len + L::N]);
            }
        }
        self.len += count;
    }

    #[inline(always)]
    fn get<L: Lane>(&self, at: usize) -> (L::Mask, [L; K]) {
        assert!(at + L::N <= STRIDE);
        let mut values = [L::zero(); K];
        for k in 0..K {
            values[k] = L::load(&self.columns[k][at..at + L::N]);
        }
        (L::Mask::first(self.len - at), values)
    }
}

/// What a shading point needs to be found again on the film and in the sequence of random numbers.
#[derive(Clone, Copy, Debug)]
pub struct Address<L: Lane> {
    /// Index of the pixel in its tile.
    pub index: L::Bits,
    /// What stands for the pixel among random numbers.
    pub key: L::Bits,
    /// Pass, counted from the block's first.
    pub pass: L::Bits,
}

/// Shading points that wait for light.
#[derive(Debug)]
pub struct HitStream(Columns<20>);

impl HitStream {
    /// Room for the points of a chunk.
    pub fn new() -> Self {
        Self(Columns::new())
    }

    /// Points in the stream.
    pub fn len(&self) -> usize {
        self.0.len
    }

    /// Empties it.
    pub fn clear(&mut self) {
        self.0.len = 0;
    }

    /// Adds the points of the mask.
    #[inline(always)]
    pub fn push<L: Lane>(&mut self, mask: L::Mask, point: &ShadingPoint<L>, address: &Address<L>) {
        let ShadingPoint { p, ng, bsdf } = point;
        let Bsdf {
            n,
            wr,
            rho,
            alpha,
            reach,
            ..
        } = bsdf;
        let [index, key, pass] = [address.index, address.key, address.pass].map(L::from_bits);
        self.0.push(
            mask,
            [
                p.x, p.y, p.z, ng.x, ng.y, ng.z, n.x, n.y, n.z, wr.x, wr.y, wr.z, rho.x, rho.y, rho.z, *alpha, *reach,
                index, key, pass,
            ],
        );
    }

    /// The packet that starts at point `at`.
    #[inline(always)]
    pub fn packet<L: Lane>(&self, at: usize) -> (L::Mask, ShadingPoint<L>, Address<L>) {
        let (mask, v) = self.0.get::<L>(at);
        let vector = |i: usize| Vec3::new(v[i], v[i + 1], v[i + 2]);
        let alpha = v[15];
        let bsdf = Bsdf {
            n: vector(6),
            wr: vector(9),
            rho: vector(12),
            alpha,
            phong: alpha.gt(L::one()) & mask,
            reach: v[16],
        };
        let point = ShadingPoint {
            p: vector(0),
            ng: vector(3),
            bsdf,
        };
        // Behind the tail lies what an earlier, longer stream left: an idle lane's address must still be one.
        let [index, key, pass] = [v[17], v[18], v[19]].map(|x| x.or_zero(mask).to_bits());
        (mask, point, Address { index, key, pass })
    }
}

/// Rays that carry what they are worth.
#[derive(Debug)]
pub struct RayQueue(Columns<11>);

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
    /// Index of the pixel in its tile.
    pub index: L::Bits,
}

impl RayQueue {
    /// Room for the rays of a chunk.
    pub fn new() -> Self {
        Self(Columns::new())
    }

    /// Rays in the queue.
    pub fn len(&self) -> usize {
        self.0.len
    }

    /// Empties it.
    pub fn clear(&mut self) {
        self.0.len = 0;
    }

    /// Adds the rays of the mask.
    #[inline(always)]
    pub fn push<L: Lane>(&mut self, mask: L::Mask, rays: &QueuedRays<L>) {
        let QueuedRays {
            origin: o,
            direction: d,
            tfar,
            value: v,
            index,
        } = rays;
        self.0.push(
            mask,
            [o.x, o.y, o.z, d.x, d.y, d.z, *tfar, v.x, v.y, v.z, L::from_bits(*index)],
        );
    }

    /// The packet that starts at ray `at`.
    #[inline(always)]
    pub fn packet<L: Lane>(&self, at: usize) -> (L::Mask, QueuedRays<L>) {
        let (mask, v) = self.0.get::<L>(at);
        let vector = |i: usize| Vec3::new(v[i], v[i + 1], v[i + 2]);
        let rays = QueuedRays {
            origin: vector(0),
            direction: vector(3),
            tfar: v[6],
            value: vector(7),
            index: v[10].to_bits(),
        };
        (mask, rays)
    }
}
