//! The points of a block of passes, pair by pair: made once, looked up by every packet.

use std::ops::Range;

use super::sobol::scrambled_point;
use crate::lane::{Bits, Mask};

/// Rows that one instruction looks up.
const RUN: usize = 16;

/// A point for each pair of dimensions and each row, which stands for a pass. The first words of a pair come one after the other,
/// then the second ones.
#[derive(Debug, Default)]
pub struct Table {
    words: Vec<u32>,
    /// Rows, and some that stay 0 up to a whole number of runs.
    rows: usize,
}

impl Table {
    /// Owen-scrambled Sobol points of the pairs below `pairs` for each of the passes.
    pub fn sobol(seed: u32, passes: Range<u32>, pairs: u32) -> Self {
        Self::new(
            (0..pairs).map(|pair| passes.clone().map(move |pass| scrambled_point(pass, pair, seed))),
            passes.len(),
        )
    }

    fn new(pairs: impl Iterator<Item = impl Iterator<Item = [u32; 2]>>, rows: usize) -> Self {
        let rows = rows.next_multiple_of(RUN);
        let mut words = Vec::new();
        for points in pairs {
            let start = words.len();
            words.resize(start + 2 * rows, 0);
            for (row, [a, b]) in points.enumerate() {
                (words[start + row], words[start + rows + row]) = (a, b);
            }
        }
        Self { words, rows }
    }

    /// The same for couples of rows that have their top bits as pair 1 has: where a pair's bit says otherwise, the two rows change
    /// their points. Of a couple one has it set: the first digit of a Sobol point is the last of its index, and scrambles keep a
    /// couple together.
    pub fn tossed(&self) -> Self {
        let pairs = (self.words.len() / (2 * self.rows.max(1))) as u32;
        let point = |row: usize, pair: u32| {
            let [coins, points] = [self.pair(1), self.pair(pair)];
            let row = row ^ ((points.0[row] ^ coins.0[row]) >> 31) as usize;
            [points.0[row], points.1[row]]
        };
        let pairs = if pairs > 1 { 0..pairs } else { 0..0 };
        Self::new(
            pairs.map(|pair| (0..self.rows).map(move |row| point(row, pair))),
            self.rows,
        )
    }

    /// Whether there are no points.
    pub fn is_empty(&self) -> bool {
        self.words.is_empty()
    }

    #[inline(always)]
    fn pair(&self, pair: u32) -> (&[u32], &[u32]) {
        self.words[2 * pair as usize * self.rows..][..2 * self.rows].split_at(self.rows)
    }

    /// The point of each lane's row.
    #[inline(always)]
    pub fn get<B: Bits>(&self, row: B, pair: u32) -> [B; 2] {
        let (first, second) = self.pair(pair);
        let one = row.lane(0);
        // Most packets hold one pass only,
        if row.eq(B::splat(one)).all() {
            return [B::splat(first[one as usize]), B::splat(second[one as usize])];
        }
        // those of neighbouring pixels the passes of a chunk,
        let run = one as usize / RUN;
        if row.shr(RUN.ilog2()).eq(B::splat(run as u32)).all() {
            let (first, second) = (&first[run * RUN..][..RUN], &second[run * RUN..][..RUN]);
            return [B::lookup(first, row), B::lookup(second, row)];
        }
        // and adaptive renders mix them as they come. Through memory and without closures, which would be calls.
        let (mut rows, mut a, mut b) = ([0; 16], [0; 16], [0; 16]);
        row.store(&mut rows);
        for lane in 0..16 {
            (a[lane], b[lane]) = (first[rows[lane] as usize], second[rows[lane] as usize]);
        }
        [B::load(&a), B::load(&b)]
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
        let [a, b] = table.get(Word(36), 2);
        assert_eq!([a.0, b.0], scrambled_point(100, 2, 3));
    }
}
