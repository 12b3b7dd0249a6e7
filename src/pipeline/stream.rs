//! Streams and queues: columns of numbers, filled by packets and read by packets.
//!
//! A packet with idle lanes is packed when it is pushed, so every packet that is read is full but the last. The order
//! of what is pushed does not depend on the width of packets: lanes go in ascending order.

use crate::bsdf::Bsdf;
use crate::estimator::ShadingPoint;
use crate::estimator::density::{ConeOnly, Density, Projected};
use crate::estimator::per_light::Contribution;
use crate::lane::{Bits, Lane, Mask};
use crate::math::Vec3;

/// The most lanes of a packet.
const LANES: usize = 16;

/// The most numbers in a column: the samples of a chunk.
pub const CAPACITY: usize = 4096;

/// A push writes a whole packet, also when few of its lanes count; and columns are 25 lines of the cache apart, modulo a page of 64.
/// A load waits for a store before it that ends in the same twelve bits: so those of two columns seldom do.
const STRIDE: usize = CAPACITY + 25 * 16;

/// `K` columns of at most [`CAPACITY`] numbers. The length of a column is known when the program is compiled, so that one
/// check of bounds serves all columns.
#[derive(Debug)]
struct Columns<const K: usize> {
    columns: Box<Aligned<K>>,
    len: usize,
}

/// Columns start at a line of the cache, as then does every packet that is read: none takes two.
#[derive(Debug, bytemuck::Zeroable)]
#[repr(C, align(64))]
struct Aligned<const K: usize>([[f32; STRIDE]; K]);

impl<const K: usize> Columns<K> {
    fn new() -> Self {
        Self {
            columns: bytemuck::zeroed_box(),
            len: 0,
        }
    }

    /// Makes room for the lanes of `mask`; [`put`](Self::put) then fills them column by column.
    #[inline(always)]
    fn grow<L: Lane>(&mut self, mask: L::Mask) -> Room<L> {
        let at = self.len;
        assert!(at + L::N <= STRIDE, "a stream is never pushed beyond its capacity");
        self.len += mask.count();
        Room {
            at,
            packing: L::packing(mask),
        }
    }

    // Packing a full packet changes nothing and costs one instruction a column: less than asking each time.
    #[inline(always)]
    fn put<L: Lane>(&mut self, column: usize, room: &Room<L>, value: L) {
        value
            .pack(room.packing)
            .store(&mut self.columns.0[column][room.at..room.at + L::N]);
    }

    #[inline(always)]
    fn put3<L: Lane>(&mut self, column: usize, room: &Room<L>, value: Vec3<L>) {
        self.put(column, room, value.x);
        self.put(column + 1, room, value.y);
        self.put(column + 2, room, value.z);
    }

    #[inline(always)]
    fn get<L: Lane>(&self, column: usize, at: usize) -> L {
        L::load(&self.columns.0[column][at..at + L::N])
    }

    #[inline(always)]
    fn get3<L: Lane>(&self, column: usize, at: usize) -> Vec3<L> {
        Vec3::new(self.get(column, at), self.get(column + 1, at), self.get(column + 2, at))
    }

    #[inline(always)]
    fn set<L: Lane>(&mut self, column: usize, at: usize, value: L) {
        value.store(&mut self.columns.0[column][at..at + L::N]);
    }

    #[inline(always)]
    fn set3<L: Lane>(&mut self, column: usize, at: usize, value: Vec3<L>) {
        self.set(column, at, value.x);
        self.set(column + 1, at, value.y);
        self.set(column + 2, at, value.z);
    }

    #[inline(always)]
    fn put_rays<L: Lane>(&mut self, room: &Room<L>, rays: &QueuedRays<L>) {
        self.put3(0, room, rays.origin);
        self.put3(3, room, rays.direction);
        self.put(6, room, rays.tfar);
        self.put3(7, room, rays.value);
        self.put(10, room, L::from_bits(rays.index));
    }

    /// The rays at `at` with the values at `value`, which is the same place.
    #[inline(always)]
    fn rays<L: Lane>(&self, at: usize, value: usize) -> QueuedRays<L> {
        QueuedRays {
            origin: self.get3(0, at),
            direction: self.get3(3, at),
            tfar: self.get(6, at),
            value: self.get3(7, value),
            index: self.get::<L>(10, at).to_bits(),
        }
    }

    /// The lanes of the packet at `at` that hold anything.
    #[inline(always)]
    fn lanes<L: Lane>(&self, at: usize) -> L::Mask {
        L::Mask::first(self.len - at)
    }
}

/// Where a packet goes in a stream.
struct Room<L: Lane> {
    at: usize,
    packing: L::Packing,
}

/// What a shading point needs to be found again on the film and in the sequence of random numbers.
#[derive(Clone, Copy, Debug)]
pub struct Address<L: Lane> {
    /// Where the pixel sums up in its chunk.
    pub index: L::Bits,
    /// What stands for the pixel among random numbers.
    pub key: L::Bits,
    /// Pass, counted from the block's first.
    pub pass: L::Bits,
}

/// A model of reflection. Points of each have a stream of their own, which holds what that model needs and no more: what
/// treats its packets is compiled for it.
pub trait Model {
    /// Which stream is theirs.
    const STREAM: usize;
    /// Whether their lobe is Phong's.
    const PHONG: bool;
    /// The density of `projected`: a lobe of Phong's model is not in proportion to the cosine, so cones have to do for it.
    type Projected: Density;
}

/// Lambert's model.
pub struct Diffuse;

/// Phong's model.
pub struct Phong;

impl Model for Diffuse {
    const STREAM: usize = 0;
    const PHONG: bool = false;
    type Projected = Projected;
}

impl Model for Phong {
    const STREAM: usize = 1;
    const PHONG: bool = true;
    type Projected = ConeOnly;
}

/// Shading points of one model that wait for light.
#[derive(Debug)]
pub struct HitStream(Columns<27>);

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
    pub fn push<L: Lane, M: Model>(&mut self, mask: L::Mask, point: &ShadingPoint<L>, address: &Address<L>) {
        let bsdf = &point.bsdf;
        let room = self.0.grow::<L>(mask);
        self.0.put3(0, &room, point.p);
        self.0.put3(3, &room, point.ng);
        self.0.put3(6, &room, bsdf.n);
        self.0.put3(12, &room, bsdf.rho);
        if M::PHONG {
            self.0.put3(9, &room, bsdf.wr);
            self.0.put(15, &room, bsdf.alpha);
            self.0.put(16, &room, bsdf.reach);
        }
        self.0.put(17, &room, L::from_bits(address.index));
        self.0.put(18, &room, L::from_bits(address.key));
        self.0.put(19, &room, L::from_bits(address.pass));
    }

    /// Repeats the last point behind the end: idle lanes of the last packet hold it, and no place and no address that is not one of
    /// the stream's. To be called once all points are there.
    pub fn pad(&mut self) {
        let len = self.len();
        if len > 0 {
            for column in &mut self.0.columns.0[..20] {
                let last = column[len - 1];
                column[len..len + LANES - 1].fill(last);
            }
        }
    }

    /// Where the points of the packet at `at` are.
    #[inline(always)]
    pub fn position<L: Lane>(&self, at: usize) -> Vec3<L> {
        self.0.get3(0, at)
    }

    /// The lanes of the packet at `at`.
    #[inline(always)]
    pub fn lanes<L: Lane>(&self, at: usize) -> L::Mask {
        mutate!(self.0.lanes::<L>(at), StaleTail => L::Mask::splat(true))
    }

    /// Notes which points of the packet at `at` follow their BRDF, and the direction that it gave them.
    #[inline(always)]
    pub fn set_drawn<L: Lane>(&mut self, at: usize, heads: L::Mask, wi: Vec3<L>) {
        self.0.set(20, at, L::select(heads, -L::zero(), L::zero()));
        self.0.set3(21, at, wi);
    }

    /// The points of the packet at `at` that follow their BRDF.
    #[inline(always)]
    pub fn heads<L: Lane>(&self, at: usize) -> L::Mask {
        self.0.get::<L>(20, at).to_bits().top_bit()
    }

    /// The directions of the BRDF for the packet at `at`.
    #[inline(always)]
    pub fn drawn<L: Lane>(&self, at: usize) -> Vec3<L> {
        self.0.get3(21, at)
    }

    /// Sets the light that reaches the points of the packet at `at`.
    #[inline(always)]
    pub fn set_light<L: Lane>(&mut self, at: usize, light: Vec3<L>) {
        self.0.set3(24, at, light);
    }

    /// The light that reaches the points of the packet at `at`.
    #[inline(always)]
    pub fn light<L: Lane>(&self, at: usize) -> Vec3<L> {
        self.0.get3(24, at)
    }

    /// Where the pixels of the packet at `at` sum up.
    #[inline(always)]
    pub fn index<L: Lane>(&self, at: usize) -> L::Bits {
        self.0.get::<L>(17, at).to_bits()
    }

    /// The reflectance at the points of the packet at `at`.
    #[inline(always)]
    pub fn reflectance<L: Lane>(&self, at: usize) -> Vec3<L> {
        self.0.get3(12, at)
    }

    /// The packet that starts at point `at`; the stream must be [padded](Self::pad).
    #[inline(always)]
    pub fn packet<L: Lane, M: Model>(&self, at: usize) -> (L::Mask, ShadingPoint<L>, Address<L>) {
        let columns = &self.0;
        let mask = self.lanes::<L>(at);
        let (n, rho) = (columns.get3(6, at), columns.get3(12, at));
        let bsdf = if M::PHONG {
            Bsdf {
                n,
                wr: columns.get3(9, at),
                rho,
                alpha: columns.get(15, at),
                phong: mask,
                reach: columns.get(16, at),
            }
        } else {
            Bsdf::diffuse(n, rho)
        };
        let point = ShadingPoint {
            p: columns.get3(0, at),
            ng: columns.get3(3, at),
            bsdf,
        };
        let address = Address {
            index: self.index::<L>(at),
            key: columns.get::<L>(18, at).to_bits(),
            pass: columns.get::<L>(19, at).to_bits(),
        };
        (mask, point, address)
    }
}

/// Rays that carry what they are worth, and one more number each.
#[derive(Debug)]
pub struct WideQueue(Columns<12>);

impl WideQueue {
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

    /// Adds the rays of the mask, with a number.
    #[inline(always)]
    pub fn push<L: Lane>(&mut self, mask: L::Mask, rays: &QueuedRays<L>, number: L) {
        let room = self.0.grow::<L>(mask);
        self.0.put_rays(&room, rays);
        self.0.put(11, &room, number);
    }

    /// The packet that starts at ray `at`, with its numbers.
    #[inline(always)]
    pub fn packet<L: Lane>(&self, at: usize) -> (L::Mask, QueuedRays<L>, L) {
        (self.0.lanes::<L>(at), self.0.rays(at, at), self.0.get(11, at))
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
    /// Where the pixel sums up in its chunk.
    pub index: L::Bits,
}

impl<L: Lane> QueuedRays<L> {
    /// The rays that a contribution waits for.
    #[inline(always)]
    pub fn to_light(point: &ShadingPoint<L>, address: &Address<L>, found: &Contribution<L>) -> Self {
        Self {
            origin: point.p,
            direction: found.wi,
            tfar: found.distance,
            value: found.ld,
            index: address.index,
        }
    }
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
        let room = self.0.grow::<L>(mask);
        self.0.put_rays(&room, rays);
    }

    /// The packet that starts at ray `at`.
    #[inline(always)]
    pub fn packet<L: Lane>(&self, at: usize) -> (L::Mask, QueuedRays<L>) {
        let value = mutate!(at, LaneShift => at + usize::from(L::N > 1));
        (self.0.lanes::<L>(at), self.0.rays(at, value))
    }
}
