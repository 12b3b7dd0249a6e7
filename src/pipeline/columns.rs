//! Structure-of-arrays columns of numbers. Packets write and read them.
//!
//! A push compacts the active lanes of a packet, so every packet read back is full except the last. Lanes are stored in ascending
//! order, so the order of elements does not depend on the packet width.

use crate::lane::{Lane, Mask};
use crate::math::Vec3;

/// Maximum number of lanes in a packet.
const LANES: usize = 16;

/// Maximum length of a column: the samples of a chunk.
pub const CAPACITY: usize = 4096;

/// Length of a column in memory. A push writes a whole packet even if few lanes are active. Columns are 25 cache lines apart,
/// modulo a page of 64 lines: a load stalls on an earlier store whose address has the same low twelve bits (4K aliasing), and this
/// distance makes that rare between columns.
const STRIDE: usize = CAPACITY + 25 * 16;

/// `K` columns of at most [`CAPACITY`] numbers. The column size is a compile-time constant, so one bounds check serves all columns.
#[derive(Debug)]
pub(super) struct Columns<const K: usize> {
    columns: Box<Aligned<K>>,
    len: usize,
}

/// Aligned to cache lines, so that no packet read from a column straddles two.
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

    /// Makes room for the active lanes of `mask`; [`put`](Self::put) then fills the columns one by one.
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

    // Compacting a full packet costs one instruction per column, which is cheaper than a branch.
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

    /// Number of elements in each column.
    #[inline(always)]
    pub(super) fn len(&self) -> usize {
        self.len
    }

    #[inline(always)]
    pub(super) fn clear(&mut self) {
        self.len = 0;
    }

    /// Changes the number of elements; those behind the end stay.
    #[inline(always)]
    pub(super) fn end_at(&mut self, end: usize) {
        self.len = end;
    }

    /// Repeats the last element of the first columns past the end, so that idle lanes of the last packet hold valid data.
    pub(super) fn pad(&mut self, columns: usize) {
        if self.len > 0 {
            for column in &mut self.columns.0[..columns] {
                let last = column[self.len - 1];
                column[self.len..self.len + LANES - 1].fill(last);
            }
        }
    }

    /// The active lanes of the packet at `at`.
    #[inline(always)]
    pub(super) fn lanes<L: Lane>(&self, at: usize) -> L::Mask {
        L::Mask::first(self.len - at)
    }
}

/// Where a pushed packet is stored.
pub(super) struct Room<L: Lane> {
    at: usize,
    packing: L::Packing,
}
