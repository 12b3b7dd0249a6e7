//! Buffers between the steps of `product` on Phong surfaces.
//!
//! In one loop, rings, arc and direction form a chain of some 370 dependent instructions, and the processor works on one packet at
//! a time. In three loops over a block, packets overlap. Columns hold the data of the packets between the loops.

use crate::lane::{Lane, Mask};
use crate::light::{Cone, Ring, Rings, SphereLight};

/// Points per block; its columns fit the L1 cache.
pub const BLOCK: usize = 256;

/// Six numbers of [`Rings`], the sampled ring, its weight and the random number for its arc, and the light's cone.
const COLUMNS: usize = 15;

/// The first column of the cone.
const CONE: usize = 10;

/// The packets of a block in which the light overlaps the lobe of any lane.
#[derive(Debug)]
pub struct RingBlock {
    columns: Box<Aligned>,
    /// Start of each packet in its stream, and its active lanes.
    packets: Vec<(usize, u32)>,
}

#[derive(Debug, bytemuck::Zeroable)]
#[repr(C, align(64))]
struct Aligned([[f32; BLOCK]; COLUMNS]);

/// The result of [`RingBlock::sampled`].
pub struct Drawn<L: Lane> {
    /// Active lanes.
    pub active: L::Mask,
    /// The sampled ring.
    pub ring: Ring<L>,
    /// [`Rings::weight`] of the ring.
    pub weight: L,
    /// The random number for its arc.
    pub v: L,
    /// The cone of the light.
    pub cone: Cone<L>,
}

impl RingBlock {
    /// An empty block.
    pub fn new() -> Self {
        Self {
            columns: bytemuck::zeroed_box(),
            packets: Vec::with_capacity(BLOCK),
        }
    }

    /// Empties the block.
    #[inline(always)]
    pub fn clear(&mut self) {
        self.packets.clear();
    }

    /// Number of packets in the block.
    #[inline(always)]
    pub fn len(&self) -> usize {
        self.packets.len()
    }

    /// Start of packet `i` in its stream.
    #[inline(always)]
    pub fn start(&self, i: usize) -> usize {
        self.packets[i].0
    }

    /// Pushes the rings of the packet that starts at `start`, and the cone that they are cut by.
    #[inline(always)]
    pub fn push<L: Lane>(&mut self, start: usize, active: L::Mask, rings: &Rings<L>, cone: &Cone<L>) {
        let i = self.packets.len();
        self.packets.push((start, active.to_bitmask()));
        let numbers = [
            rings.apart,
            rings.nearest,
            rings.width,
            rings.one_minus_cos_max,
            rings.share,
            rings.mass,
        ];
        for (k, number) in numbers.into_iter().enumerate() {
            self.set(k, i, number);
        }
        for (k, number) in cone.columns().into_iter().enumerate() {
            self.set(CONE + k, i, number);
        }
    }

    /// The rings of packet `i`.
    #[inline(always)]
    pub fn rings<L: Lane>(&self, i: usize) -> Rings<L> {
        Rings {
            apart: self.get(0, i),
            nearest: self.get(1, i),
            width: self.get(2, i),
            one_minus_cos_max: self.get(3, i),
            share: self.get(4, i),
            mass: self.get(5, i),
        }
    }

    /// Stores the sampled ring of packet `i`.
    #[inline(always)]
    pub fn set_drawn<L: Lane>(&mut self, i: usize, ring: &Ring<L>, weight: L, v: L) {
        for (k, number) in [ring.t, ring.half_arc, weight, v].into_iter().enumerate() {
            self.set(6 + k, i, number);
        }
    }

    /// The sampled ring of packet `i`, and the cone of `light`.
    #[inline(always)]
    pub fn sampled<L: Lane>(&self, i: usize, light: &SphereLight) -> Drawn<L> {
        // No `map`: closures are not inlined into AVX-512 code.
        let cone = [
            self.get(CONE, i),
            self.get(CONE + 1, i),
            self.get(CONE + 2, i),
            self.get(CONE + 3, i),
            self.get(CONE + 4, i),
        ];
        Drawn {
            cone: light.cone_of_columns(cone, self.get(3, i)),
            active: L::Mask::from_bitmask(self.packets[i].1),
            ring: Ring {
                t: self.get(6, i),
                half_arc: self.get(7, i),
            },
            weight: self.get(8, i),
            v: self.get(9, i),
        }
    }

    #[inline(always)]
    fn get<L: Lane>(&self, column: usize, i: usize) -> L {
        L::load(&self.columns.0[column][i * L::N..(i + 1) * L::N])
    }

    #[inline(always)]
    fn set<L: Lane>(&mut self, column: usize, i: usize, value: L) {
        value.store(&mut self.columns.0[column][i * L::N..(i + 1) * L::N]);
    }
}
