//! Numbers of shapes in columns, to be looked at as many shapes at a time as there are lanes.

use crate::lane::{Lane, Mask};
use crate::math::Vec3;

/// Shapes beside each other: the most lanes of a packet.
const LANES: usize = 16;

/// `K` numbers of every shape, with zeros behind the last.
#[derive(Clone, Debug, Default)]
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

    /// How many shapes there are.
    pub fn len(&self) -> usize {
        self.len
    }

    /// As many, and what fills up the last packet.
    pub fn room(&self) -> usize {
        self.blocks.len() * LANES
    }

    /// The first shape of each packet, and which lanes are shapes.
    pub fn packets<L: Lane>(&self) -> impl Iterator<Item = (usize, L::Mask)> {
        let len = self.len;
        (0..len).step_by(L::N).map(move |at| (at, L::Mask::first(len - at)))
    }

    /// A number of the packet at shape `at`, which is one of [`Self::packets`].
    pub fn get<L: Lane>(&self, column: usize, at: usize) -> L {
        L::load(&self.blocks[at / LANES][column][at % LANES..])
    }

    /// Three numbers from a column on.
    pub fn get3<L: Lane>(&self, column: usize, at: usize) -> Vec3<L> {
        Vec3::new(self.get(column, at), self.get(column + 1, at), self.get(column + 2, at))
    }
}
