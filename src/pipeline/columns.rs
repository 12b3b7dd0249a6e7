//! Columns of numbers, filled by packets and read by packets.
//!
//! A packet with idle lanes is packed when it is pushed, so every packet that is read is full but the last. The order
//! of what is pushed does not depend on the width of packets: lanes go in ascending order.

use std::ops::Range;

use crate::lane::{Lane, Mask};
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
pub(super) struct Columns<const K: usize> {
    columns: Box<Aligned<K>>,
    len: usize,
}

/// They start at a line of the cache, as then does every packet that is read: none takes two.
#[derive(Debug, bytemuck::Zeroable)]
#[repr(C, align(64))]
struct Aligned<const K: usize>([[f32; STRIDE]; K]);

impl<const K: usize> Columns<K> {
    pub(super) fn new() -> Self {
        Self {
            columns: bytemuck::zeroed_box(),
            len: 0,
        }
    }

    /// Makes room for the lanes of `mask`; [`put`](Self::put) then fills them column by column.
    #[inline(always)]
    pub(super) fn grow<L: Lane>(&mut self, mask: L::Mask) -> Room<L> {
        let at = self.len;
        assert!(at + L::N <= STRIDE, "no more is pushed than there is room for");
        self.len += mask.count();
        Room {
            at,
            packing: L::packing(mask),
        }
    }

    // Packing a full packet changes nothing and costs one instruction a column: less than asking each time.
    #[inline(always)]
    pub(super) fn put<L: Lane>(&mut self, column: usize, room: &Room<L>, value: L) {
        value
            .pack(room.packing)
            .store(&mut self.columns.0[column][room.at..room.at + L::N]);
    }

    #[inline(always)]
    pub(super) fn put3<L: Lane>(&mut self, column: usize, room: &Room<L>, value: Vec3<L>) {
        self.put(column, room, value.x);
        self.put(column + 1, room, value.y);
        self.put(column + 2, room, value.z);
    }

    #[inline(always)]
    pub(super) fn get<L: Lane>(&self, column: usize, at: usize) -> L {
        L::load(&self.columns.0[column][at..at + L::N])
    }

    #[inline(always)]
    pub(super) fn get3<L: Lane>(&self, column: usize, at: usize) -> Vec3<L> {
        Vec3::new(self.get(column, at), self.get(column + 1, at), self.get(column + 2, at))
    }

    #[inline(always)]
    pub(super) fn set<L: Lane>(&mut self, column: usize, at: usize, value: L) {
        value.store(&mut self.columns.0[column][at..at + L::N]);
    }

    #[inline(always)]
    pub(super) fn set3<L: Lane>(&mut self, column: usize, at: usize, value: Vec3<L>) {
        self.set(column, at, value.x);
        self.set(column + 1, at, value.y);
        self.set(column + 2, at, value.z);
    }

    /// Numbers in a column.
    #[inline(always)]
    pub(super) fn len(&self) -> usize {
        self.len
    }

    #[inline(always)]
    pub(super) fn clear(&mut self) {
        self.len = 0;
    }

    /// Becomes a part of other columns.
    pub(super) fn copy(&mut self, other: &Self, part: Range<usize>) {
        self.len = part.len();
        for (own, others) in self.columns.0.iter_mut().zip(&other.columns.0) {
            own[..part.len()].copy_from_slice(&others[part.clone()]);
        }
    }

    /// Repeats the last number of the first columns behind the end: idle lanes of the last packet then hold it.
    pub(super) fn pad(&mut self, columns: usize) {
        if self.len > 0 {
            for column in &mut self.columns.0[..columns] {
                let last = column[self.len - 1];
                column[self.len..self.len + LANES - 1].fill(last);
            }
        }
    }

    /// The lanes of the packet at `at` that hold anything.
    #[inline(always)]
    pub(super) fn lanes<L: Lane>(&self, at: usize) -> L::Mask {
        L::Mask::first(self.len - at)
    }
}

/// Where a packet goes in a stream.
pub(super) struct Room<L: Lane> {
    at: usize,
    packing: L::Packing,
}
