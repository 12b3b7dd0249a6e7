//! What the steps of `product` on Phong surfaces hand to each other.
//!
//! Written in one loop, rings, arc and direction are a chain of some 370 dependent instructions, of which a processor has one packet in
//! work at a time. In three loops over a block the packets overlap. Between the loops a packet's numbers lie in columns.

use crate::lane::{Lane, Mask};
use crate::light::{Ring, Rings};

/// Points of a block: its columns stay in the nearest cache.
pub const BLOCK: usize = 256;

/// Six numbers of [`Rings`], then the ring that was drawn, its weight and the number for its arc.
const COLUMNS: usize = 10;

/// Packets of a block that the light and the lobe of a lane have anything in common for.
#[derive(Debug)]
pub struct RingBlock {
    columns: Box<Aligned>,
    /// Where each packet starts in its stream, and which of its lanes count.
    packets: Vec<(usize, u32)>,
}

#[derive(Debug, bytemuck::Zeroable)]
#[repr(C, align(64))]
struct Aligned([[f32; BLOCK]; COLUMNS]);

/// What [`RingBlock::sampled`] gives back.
pub struct Drawn<L: Lane> {
    /// Lanes that count.
    pub active: L::Mask,
    /// The ring.
    pub ring: Ring<L>,
    /// [`Rings::weight`] of it.
    pub weight: L,
    /// The number for its arc.
    pub v: L,
}

impl RingBlock {
    /// An empty block.
    pub fn new() -> Self {
        Self {
            columns: bytemuck::zeroed_box(),
            packets: Vec::with_capacity(BLOCK),
        }
    }

    /// Empties it.
    #[inline(always)]
    pub fn clear(&mut self) {
        self.packets.clear();
    }

    /// Packets in the block.
    #[inline(always)]
    pub fn len(&self) -> usize {
        self.packets.len()
    }

    /// Where packet `i` starts in its stream.
    #[inline(always)]
    pub fn start(&self, i: usize) -> usize {
        self.packets[i].0
    }

    /// Adds the rings of the packet that starts at `start`.
    #[inline(always)]
    pub fn push<L: Lane>(&mut self, start: usize, active: L::Mask, rings: &Rings<L>) {
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

    /// Notes the ring that was drawn for packet `i`.
    #[inline(always)]
    pub fn set_drawn<L: Lane>(&mut self, i: usize, ring: &Ring<L>, weight: L, v: L) {
        for (k, number) in [ring.t, ring.half_arc, weight, v].into_iter().enumerate() {
            self.set(6 + k, i, number);
        }
    }

    /// The ring that was drawn for packet `i`.
    #[inline(always)]
    pub fn sampled<L: Lane>(&self, i: usize) -> Drawn<L> {
        Drawn {
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
