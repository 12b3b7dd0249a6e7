//! Which pixels share lists of lights, and the numbers from which lists are sampled.
//!
//! If all pixels of a tile had one list, they would have one error, and tiles would be plain to see. So pixels that alternate in small
//! squares have lists of their own (interleaved sampling: Keller and Heidrich 2001), and the lists of a tile are stratified together:
//! the error is noise, and the mean of a few pixels has less of it than independent lists would leave.

use crate::film::Tile;
use crate::lane::Word;
use crate::sampling::PassBlock;
use crate::sampling::hash::{mix, pcg4d};

/// Identifies a list: everything its samples depend on besides the table.
#[derive(Clone, Copy, Debug)]
pub struct ListAddress {
    seed: u32,
    /// Key of the tile and the color.
    key: u32,
    /// Index of the list among those of its group.
    index: u32,
    /// The group, and how many its color has.
    group: u32,
    groups: u32,
    /// Whether lists with consecutive indices are stratified together.
    stratified: bool,
}

impl ListAddress {
    /// The list of a group of a tile's pixels in a pass, counted from 0. With one-sample MIS two consecutive passes share a list,
    /// because one of them samples BRDFs and needs none.
    pub fn new(numbers: &PassBlock, tile: &Tile, group: Group, pass: u32, tossed: bool) -> Self {
        let stratified = numbers.one_coin();
        let index = if stratified && tossed { pass / 2 } else { pass };
        let Group { colour, among } = group.of_pass(pass);
        let (colour, index, group) = (
            mutate!(colour, ColorsShareLists => 0),
            mutate!(index, PassesShareLists => 0),
            mutate!(among, GroupsShareLists => 0),
        );
        Self {
            seed: numbers.seed(),
            key: 2 * tile.number() + colour,
            index,
            group,
            groups: groups(pass),
            stratified,
        }
    }

    /// The number in [0, 1) of a stratum. It is a van der Corput sequence over the passes of one group. The groups of one color have
    /// one in each interval of their number; and so have `2^m` passes of all groups: the bits of the group, repeated without end,
    /// are a matrix in which as many consecutive rows as there are bits are always independent. Digital shifts differ by stratum,
    /// tile and color.
    pub(super) fn number(&self, stratum: u32) -> f64 {
        let salt = if self.stratified {
            0
        } else {
            (self.index << GROUP_BITS | self.group).wrapping_add(1)
        };
        let [a, b, ..] = pcg4d([self.key, self.seed, stratum, salt].map(Word));
        let first = if self.stratified {
            a.0 ^ self.index.reverse_bits() ^ repeated(self.group, self.groups.trailing_zeros())
        } else {
            a.0
        };
        (f64::from(first) + f64::from(b.0 >> 12) / f64::from(1 << 20)) / 4_294_967_296.0
    }
}

/// The low bits of a word, repeated from the top of the word, the lowest first.
fn repeated(word: u32, bits: u32) -> u32 {
    let (mut filled, mut length) = (word.reverse_bits(), bits);
    while length > 0 && length < u32::BITS {
        filled |= filled >> length;
        length *= 2;
    }
    filled
}

/// Number of groups of pixels of each color, by pass: first pass, groups. Pixels of a group share lists, so a tile's mean has the error
/// of as many lists as there are groups; but each list costs time. Early passes decide about pictures whose noise shows, and tiles
/// with it (`docs/many-lights.md` has the measurements).
const GROUPS: [(u32, u32); 3] = [(0, 1 << GROUP_BITS), (4, 4), (16, 1)];

/// Bits of the number of a group.
const GROUP_BITS: u32 = 3;

/// Number of groups of each color in a pass.
fn groups(pass: u32) -> u32 {
    let of_pass = GROUPS.iter().rev().find(|&&(first, _)| first <= pass);
    of_pass.map_or(1, |&(_, groups)| groups)
}

/// Pixels of a tile that share lists of lights.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Group {
    /// The checkerboard color.
    colour: u32,
    /// The group among those of the color.
    among: u32,
}

impl Group {
    /// The group of a pixel of a tile, which is given by its place on the film. Every square of 4 x 4 pixels has each group once, and
    /// of 4 groups every half of it; where, differs from square to square, or the eye would find the period.
    pub fn of(tile: &Tile, pixel: [u32; 2]) -> Self {
        Self::at(tile.number(), pixel)
    }

    fn at(tile: u32, [x, y]: [u32; 2]) -> Self {
        // Diagonal neighbors are one apart in `a` or `b`.
        let (a, b) = (x.wrapping_add(y) / 2, (x.wrapping_sub(y) as i32 >> 1) as u32);
        let place = ((a ^ b) & 1) | (a & 1) << 1 | (y & 2) << 1;
        let square = (y / 4 % 4) * 4 + x / 4 % 4;
        let shift = mix(tile << 4 | square);
        Self {
            colour: (x ^ y) & 1,
            among: (place ^ shift) % (1 << GROUP_BITS),
        }
    }

    /// The group in a pass, of as many as the pass has.
    pub fn of_pass(self, pass: u32) -> Self {
        Self {
            among: self.among % groups(pass),
            ..self
        }
    }

    /// An order in which groups of any pass are consecutive, the colors one after the other.
    pub fn rank(self) -> u32 {
        self.colour << GROUP_BITS | self.among.reverse_bits() >> (u32::BITS - GROUP_BITS)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Squares of 4 x 4 pixels have each of 8 groups of a color once, and halves of them each of 4.
    #[test]
    fn pixels_of_a_group_are_apart() {
        for (pass, [across, down]) in [(0, [4, 4]), (4, [4, 2])] {
            for (tile, left, top) in [(0, 0, 0), (5, 16, 32), (77, 20, 4)] {
                let mut groups = Vec::new();
                for y in top..top + down {
                    for x in left..left + across {
                        groups.push(Group::at(tile, [x, y]).of_pass(pass));
                    }
                }
                groups.sort_unstable_by_key(|group| group.rank());
                groups.dedup();
                assert_eq!(groups.len() as u32, across * down, "pass {pass}, tile {tile}");
            }
        }
    }

    /// A group in its passes, all groups in a pass, and all groups in `2^m` passes: one number in each interval.
    #[test]
    fn groups_and_passes_are_stratified_together() {
        for bits in 0..=GROUP_BITS {
            for m in 0..6 {
                let mut cells = vec![0; 1 << (bits + m)];
                for group in 0..1 << bits {
                    let mut own = vec![0; 1 << m];
                    for pass in 0..1_u32 << m {
                        let number = f64::from(pass.reverse_bits() ^ repeated(group, bits)) / 4_294_967_296.0;
                        let cell = |count: usize| (number * count as f64) as usize;
                        let (all, few) = (cell(1 << (bits + m)), cell(1 << m));
                        cells[all] += 1;
                        own[few] += 1;
                    }
                    assert!(own.iter().all(|&count| count == 1), "group {group} of {bits} bits");
                }
                assert!(cells.iter().all(|&count| count == 1), "{bits} bits, 2^{m} passes");
            }
        }
    }
}
