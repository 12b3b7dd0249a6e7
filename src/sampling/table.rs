//! The points of a block of passes for each pair: built once, read by every packet.

use std::ops::Range;

use super::sobol::scrambled_point;
use crate::lane::{Bits, Mask, U32x8};

/// Number of rows in one lookup instruction.
const RUN: usize = 16;

/// Points of this many consecutive rows: the first words, then the second.
type Run = [[u32; RUN]; 2];

/// A point for each pair of dimensions and each row; a row is a pass.
#[derive(Debug, Default)]
pub struct Table {
    runs: Vec<Run>,
    /// Number of runs per pair; in the last one some rows may stay 0.
    per_pair: usize,
}

impl Table {
    /// Owen-scrambled Sobol points for each of the passes and the pairs below `pairs`.
    pub fn sobol(seed: u32, passes: Range<u32>, pairs: u32) -> Self {
        const LANES: usize = 8;
        let mut table = Self::zeroed(pairs, passes.len());
        for (i, [a, b]) in table.runs.iter_mut().enumerate() {
            let (pair, run) = (i / table.per_pair, i % table.per_pair);
            let rows = run * RUN..passes.len().min((run + 1) * RUN);
            for row in rows.step_by(LANES) {
                let pass = U32x8::from_fn(|lane| passes.start.wrapping_add((row + lane) as u32));
                let [x, y] = scrambled_point(pass, pair as u32, seed);
                x.store(&mut a[row % RUN..]);
                y.store(&mut b[row % RUN..]);
            }
        }
        table
    }

    fn zeroed(pairs: u32, rows: usize) -> Self {
        let per_pair = rows.div_ceil(RUN);
        let runs = vec![[[0; RUN]; 2]; pairs as usize * per_pair];
        Self { runs, per_pair }
    }

    /// The table with the points of a pair swapped within couples of rows, so that their top bits are those of pair 1. In each
    /// couple one row has the bit set: the first digit of a Sobol point is the last of its index, and scrambles keep couples
    /// together.
    pub fn tossed(&self) -> Self {
        let pairs = (self.runs.len() / self.per_pair.max(1)) as u32;
        let mut tossed = Self::zeroed(if pairs > 1 { pairs } else { 0 }, self.per_pair * RUN);
        for (i, [a, b]) in tossed.runs.iter_mut().enumerate() {
            let (pair, run) = ((i / self.per_pair) as u32, i % self.per_pair);
            for row in run * RUN..(run + 1) * RUN {
                let turned = (self.point(row, pair)[0] ^ self.point(row, 1)[0]) >> 31;
                [a[row % RUN], b[row % RUN]] = self.point(row ^ turned as usize, pair);
            }
        }
        tossed
    }

    /// Whether there are no points.
    pub fn is_empty(&self) -> bool {
        self.runs.is_empty()
    }

    /// The point of a row.
    #[inline(always)]
    pub fn point(&self, row: usize, pair: u32) -> [u32; 2] {
        self.run(row, pair).map(|words| words[row % RUN])
    }

    #[inline(always)]
    fn run(&self, row: usize, pair: u32) -> &Run {
        &self.runs[pair as usize * self.per_pair + row / RUN]
    }

    /// The point of each lane's row.
    #[inline(always)]
    pub fn get<B: Bits>(&self, row: B, pair: u32) -> [B; 2] {
        let one = row.lane(0);
        let [a, b] = self.run(one as usize, pair);
        // Most packets hold a single pass.
        if row.eq(B::splat(one)).all() {
            let at = one as usize % RUN;
            return [B::splat(a[at]), B::splat(b[at])];
        }
        // Packets of neighboring pixels hold the passes of a chunk, and those of adaptive renders a few consecutive passes: mostly
        // of one run, seldom of more than three.
        let (mut first, mut second) = (B::lookup(a, row), B::lookup(b, row));
        let runs = row.shr(RUN.ilog2());
        let mut rest = !runs.eq(B::splat(one / RUN as u32));
        if rest.none() {
            return [first, second];
        }
        let mut rows = [0; 16];
        row.store(&mut rows);
        while let Some(lane) = rest.lanes().next() {
            let [a, b] = self.run(rows[lane] as usize, pair);
            let those = runs.eq(B::splat(rows[lane] / RUN as u32));
            first = B::select(those, B::lookup(a, row), first);
            second = B::select(those, B::lookup(b, row), second);
            rest = rest & !those;
        }
        [first, second]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lane::{U32x8, Word};

    #[test]
    fn packets_of_one_row_of_a_run_and_of_any_rows_find_the_points_of_single_rows() {
        let table = Table::sobol(3, 64..101, 3);
        let mixes: [fn(u32) -> u32; 4] = [
            |_| 21,
            |lane| 16 + 5 * lane % 16,
            |lane| 11 * lane % 37,
            |lane| 36 - lane,
        ];
        for table in [&table, &table.tossed()] {
            for row in mixes {
                for pair in 0..3 {
                    let [a, b] = table.get(U32x8::from_fn(|lane| row(lane as u32)), pair);
                    for lane in 0..8 {
                        let [x, y] = table.get(Word(row(lane as u32)), pair);
                        assert_eq!((a.lane(lane), b.lane(lane)), (x.0, y.0), "lane {lane}");
                    }
                }
            }
        }
        for (pair, row) in (0..3).flat_map(|pair| (0..37).map(move |row| (pair, row))) {
            let [Word(a), Word(b)] = scrambled_point(Word(64 + row), pair, 3);
            assert_eq!(table.point(row as usize, pair), [a, b], "pair {pair}, row {row}");
        }
    }
}
