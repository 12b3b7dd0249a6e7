//! Shape data in columns, to test one shape per lane.

use crate::lane::{Lane, Mask};
use crate::math::Vec3;

/// Maximum number of lanes in a packet.
const LANES: usize = 16;

/// `K` numbers per shape, padded with zeros.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Columns<const K: usize> {
    blocks: Vec<[[f32; LANES]; K]>,
    len: usize,
}

impl<const K: usize> Columns<K> {
    /// Adds a shape.
    pub fn push(&mut self, numbers: [f32; K]) {
        let lane = self.len % LANES;
        if lane == 0 {
            self.blocks.push([[0.0; LANES]; K]);
        }
        let block = self.blocks.last_mut().expect("just pushed");
        for (column, number) in block.iter_mut().zip(numbers) {
            column[lane] = number;
        }
        self.len += 1;
    }

    /// Number of shapes.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Number of shapes, rounded up to full packets.
    pub fn room(&self) -> usize {
        self.blocks.len() * LANES
    }

    /// The first shape of each packet, and the lanes that hold shapes.
    pub fn packets<L: Lane>(&self) -> impl Iterator<Item = (usize, L::Mask)> {
        let len = self.len;
        (0..len).step_by(L::N).map(move |at| (at, L::Mask::first(len - at)))
    }

    /// A column of the packet at shape `at`, which is one of [`Self::packets`].
    pub fn get<L: Lane>(&self, column: usize, at: usize) -> L {
        L::load(&self.blocks[at / LANES][column][at % LANES..])
    }

    /// Three consecutive columns of the packet.
    pub fn get3<L: Lane>(&self, column: usize, at: usize) -> Vec3<L> {
        Vec3::new(self.get(column, at), self.get(column + 1, at), self.get(column + 2, at))
    }
}
