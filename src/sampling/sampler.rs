//! Random numbers by address: a number depends only on `(seed, pixel, pass, pair)`.
//!
//! A block of passes is prepared once for all pixels: a table of Owen-scrambled Sobol points for each pair of dimensions. A pixel
//! derives its numbers from the table by an exclusive or with a hash of its address. Such a random digital shift preserves all net
//! properties, and makes each number uniform and pixels mutually independent, at the cost of one hash. Hashing the scramble in
//! every lane costs about eight times as much.

use std::ops::Range;

use super::hash::{mix, mix_lanes, pcg4d};
use super::table::Table;
use crate::lane::{Bits, Lane, Word};
use crate::settings::SamplerKind;

/// See [`Pair::rare`].
pub const RARE: f32 = 256.0;

/// Two uniform random numbers as 32-bit fractions.
#[derive(Clone, Copy, Debug)]
pub struct Pair<B>(pub B, pub B);

impl<B: Bits> Pair<B> {
    /// The two numbers in [0, 1), as multiples of 2^-24; never 1.
    #[inline(always)]
    pub fn unit<L: Lane<Bits = B>>(self) -> (L, L) {
        (unit(self.0), unit(self.1))
    }

    /// Whether one of [`RARE`] events occurs, by the bits that [`Self::unit`] leaves over: independent of its numbers.
    #[inline(always)]
    pub fn rare(self) -> B::Mask {
        mutate!(self.0.shl(24).eq(B::splat(0)), TailAlwaysTaken => crate::lane::Mask::splat(true))
    }

    /// Both numbers shifted by one half, each separately.
    #[inline(always)]
    pub fn opposite(self) -> Self {
        let half = B::splat(1 << 31);
        Self(self.0 ^ half, self.1 ^ half)
    }
}

/// A technique choice with equal probabilities and two uniform random numbers, all independent.
#[derive(Clone, Copy, Debug)]
pub struct TechniqueSample<B: Bits> {
    /// Lanes that chose BRDF sampling.
    pub by_brdf_lanes: B::Mask,
    /// The numbers.
    pub pair: Pair<B>,
}

/// The top 24 bits as a number in [0, 1).
#[inline(always)]
pub fn unit<L: Lane>(bits: L::Bits) -> L {
    L::from_i32(bits.shr(8)) * L::splat(1.0 / 16_777_216.0)
}

/// The random numbers of the passes `first .. first + passes` for all pixels.
#[derive(Debug)]
pub struct PassBlock {
    seed: u32,
    first: u32,
    pairs: u32,
    /// Sobol points; empty for independent numbers.
    table: Table,
    /// The points used with a technique choice.
    tossed: Table,
}

impl PassBlock {
    /// Prepares a block for addresses with `pair < pairs`; technique choices require pair 1.
    pub fn new(kind: SamplerKind, seed: u32, first: u32, passes: u32, pairs: u32) -> Self {
        // Whole couples of passes 2k and 2k + 1, for technique choices.
        let couples = first & !1..(first + passes).next_multiple_of(2);
        let table = match kind {
            SamplerKind::Independent => Table::default(),
            SamplerKind::Sobol => Table::sobol(seed, couples, pairs),
        };
        Self {
            seed,
            first,
            pairs,
            tossed: table.tossed(),
            table,
        }
    }

    /// The index of the last pair.
    pub fn last_pair(&self) -> u32 {
        self.pairs - 1
    }

    /// The first pass.
    pub fn first(&self) -> u32 {
        self.first
    }

    /// The seed.
    pub fn seed(&self) -> u32 {
        self.seed
    }

    /// The key of a pixel in the addresses below; computed once per sample.
    #[inline(always)]
    pub fn key<B: Bits>(&self, pixel: B) -> B {
        if self.table.is_empty() {
            return pixel;
        }
        let address = [pixel, B::splat(self.seed), B::splat(0x5bd1_e995), B::splat(0x1b87_3593)];
        let [key, ..] = pcg4d(mutate!(address, SharedKey => [B::splat(0); 4]));
        key
    }

    /// The numbers of pair `pair` for the pixels of `key`; `pass` is relative to the first of the block.
    #[inline(always)]
    pub fn pair<B: Bits>(&self, key: B, pass: B, pair: u32) -> Pair<B> {
        if self.table.is_empty() {
            return self.independent(key, pass, pair);
        }
        shifted(self.table.get(self.row(pass), pair), key, pair)
    }

    /// A choice between two techniques for one-sample MIS, and the numbers of pair `pair`. The choice is the top bit of the first
    /// number, which is removed from it.
    ///
    /// With Sobol points the choice is stratified: of passes 2k and 2k + 1 of a pixel, one samples the BRDF. All pairs use the
    /// choice of pair 1: where the top bit of a pair differs from it, the two passes swap their points. From pass 2 on the pixels
    /// of a `group` share the choice, so that packets seldom mix techniques. (The first two passes do not: in a picture of one pass
    /// the groups would be visible.) The choice has equal probabilities and is independent of the numbers.
    #[inline(always)]
    pub fn technique_sample<B: Bits>(&self, key: B, pass: B, pair: u32, group: u32) -> TechniqueSample<B> {
        TechniqueSample {
            by_brdf_lanes: self.by_brdf_lanes(key, pass, pair, group),
            pair: self.after_toss(key, pass, pair),
        }
    }

    /// The choice of [`Self::technique_sample`].
    #[inline(always)]
    pub fn by_brdf_lanes<B: Bits>(&self, key: B, pass: B, pair: u32, group: u32) -> B::Mask {
        let by_brdf_lanes = if self.table.is_empty() {
            self.independent(key, pass, pair).0.top_bit()
        } else {
            let flip = if self.first < 2 {
                let [flip, _] = shift(key, 1);
                flip
            } else {
                B::splat(mix(group ^ self.seed))
            };
            let [coin, _] = self.table.get(self.row(pass), 1);
            (coin ^ flip).top_bit()
        };
        mutate!(by_brdf_lanes, AlwaysHeads => crate::lane::Mask::splat(true))
    }

    /// The numbers of [`Self::technique_sample`].
    #[inline(always)]
    pub fn after_toss<B: Bits>(&self, key: B, pass: B, pair: u32) -> Pair<B> {
        let Pair(a, b) = if self.table.is_empty() {
            self.independent(key, pass, pair)
        } else {
            shifted(self.tossed.get(self.row(pass), pair), key, pair)
        };
        Pair(a.shl(1), b)
    }

    /// Passes, relative to the first of the block, in processing order. Passes with the same technique are consecutive, so that
    /// packets of few pixels and many passes mix techniques no more than others.
    pub fn by_technique(&self, passes: Range<u32>) -> Vec<u32> {
        let mut passes: Vec<u32> = passes.collect();
        if self.one_coin() {
            passes.sort_by_key(|&pass| self.table.point(self.row(Word(pass)).0 as usize, 1)[0] >> 31);
        }
        passes
    }

    /// Whether all pairs share one technique choice.
    #[inline(always)]
    pub fn one_coin(&self) -> bool {
        !self.table.is_empty()
    }

    /// The table row of a pass; the first pass may be the second of its couple.
    #[inline(always)]
    fn row<B: Bits>(&self, pass: B) -> B {
        pass + B::splat(self.first & 1)
    }

    #[inline(always)]
    fn independent<B: Bits>(&self, pixel: B, pass: B, pair: u32) -> Pair<B> {
        let address = [pixel, pass + B::splat(self.first), B::splat(pair), B::splat(self.seed)];
        let [a, b, ..] = pcg4d(address);
        Pair(a, b)
    }
}

#[inline(always)]
fn shifted<B: Bits>([a, b]: [B; 2], key: B, pair: u32) -> Pair<B> {
    let [sa, sb] = shift(key, pair);
    Pair(a ^ sa, b ^ sb)
}

/// The digital shift of a pixel for a pair: two words hashed from the pixel's key. They are computed independently: an integer
/// product takes ten cycles in eight lanes, and each word requires two in sequence.
#[inline(always)]
fn shift<B: Bits>(key: B, pair: u32) -> [B; 2] {
    let (a, b) = (mix(pair ^ 0x68bc_21eb), mix(pair ^ 0x02e5_be93));
    [mix_lanes(key ^ B::splat(a)), mix_lanes(key ^ B::splat(b))]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lane::{F32x8, Mask, U32x8};

    /// Chi-square of the first passes of many pixels over 16 x 16 cells.
    fn chi_square(kind: SamplerKind, seed: u32) -> f64 {
        let block = PassBlock::new(kind, seed, 0, 4, 3);
        let mut counts = [0_u32; 256];
        for pixel in 0..4096 {
            for pass in 0..4 {
                let bits = block.pair(block.key(Word(pixel)), Word(pass), 2);
                let (x, y) = bits.unit::<f32>();
                counts[(x * 16.0) as usize * 16 + (y * 16.0) as usize] += 1;
            }
        }
        counts.iter().map(|&c| (f64::from(c) - 64.0).powi(2) / 64.0).sum()
    }

    #[test]
    fn numbers_fill_the_square_evenly_over_pixels() {
        // 255 degrees of freedom: below 380 with probability 1 - 5e-7.
        for kind in SamplerKind::ALL {
            for seed in 0..4 {
                let chi2 = chi_square(kind, seed);
                assert!(chi2 < 380.0, "{kind:?}, seed {seed}: {chi2}");
            }
        }
    }

    #[test]
    fn a_number_depends_on_its_address_alone() {
        for kind in SamplerKind::ALL {
            let long = PassBlock::new(kind, 9, 0, 32, 4);
            let short = PassBlock::new(kind, 9, 16, 8, 4);
            for pixel in [0, 77, 1 << 20] {
                for pass in 16..24 {
                    let Pair(a, b) = long.pair(long.key(Word(pixel)), Word(pass), 3);
                    let Pair(c, d) = short.pair(short.key(Word(pixel)), Word(pass - 16), 3);
                    assert_eq!((a, b), (c, d));
                    let wide = short.pair(
                        short.key(U32x8::splat(pixel)),
                        U32x8::from_fn(|i| (pass - 16 + i as u32) % 8),
                        3,
                    );
                    assert_eq!((wide.0.lane(0), wide.1.lane(0)), (a.0, b.0));
                }
            }
        }
    }

    #[test]
    fn the_coin_falls_on_both_sides_in_every_pair_of_passes() {
        for first in [0, 2, 16] {
            let block = PassBlock::new(SamplerKind::Sobol, 5, first, 16, 6);
            for pixel in 0..100 {
                for pass in (0..16).step_by(2) {
                    let technique_sample = |p| {
                        block
                            .technique_sample(block.key(U32x8::splat(pixel)), U32x8::splat(p), 4, pixel / 7)
                            .by_brdf_lanes
                            .to_bitmask()
                    };
                    assert_eq!(technique_sample(pass) ^ technique_sample(pass + 1), 0xff);
                }
            }
        }
    }

    #[test]
    fn the_passes_of_either_side_are_a_net_in_every_pair() {
        // 64 passes, 32 per technique: one number in each elementary interval of area 1/32. All pairs share the technique.
        for (first, pixel) in [(0, 3), (64, 9), (192, 10)] {
            let block = PassBlock::new(SamplerKind::Sobol, 6, first, 64, 5);
            let key = block.key(Word(pixel));
            for pair in 1..5 {
                for side in [false, true] {
                    let of_side = |pass: &u32| block.by_brdf_lanes(key, Word(*pass), 1, 8) == side;
                    let passes: Vec<u32> = (0..64).filter(of_side).collect();
                    for cut in 0..=5 {
                        let mut cells = [0; 32];
                        for &pass in &passes {
                            let technique_sample = block.technique_sample(key, Word(pass), pair, 8);
                            assert_eq!(technique_sample.by_brdf_lanes, side);
                            let Pair(a, b) = technique_sample.pair;
                            let (x, y) = (u64::from(a.0) << cut >> 32, u64::from(b.0) << (5 - cut) >> 32);
                            cells[(x << (5 - cut) | y) as usize] += 1;
                        }
                        assert_eq!(cells, [1; 32], "pair {pair}, first pass {first}, cut {cut}");
                    }
                }
            }
        }
    }

    #[test]
    fn a_coin_is_fair_over_groups_and_says_nothing_of_its_numbers() {
        // 8 cells of the choice and two top bits, 80 000 groups: chi-square with 7 degrees of freedom is below 45 with probability
        // 1 - 1e-7; six of them.
        for kind in SamplerKind::ALL {
            for pass in [0, 3, 6] {
                let block = PassBlock::new(kind, 11, if pass == 0 { 0 } else { 8 }, 8, 3);
                let mut counts = [0_u32; 8];
                for group in 0..80_000 {
                    let technique_sample = block.technique_sample(block.key(Word(group * 31)), Word(pass), 2, group);
                    let cell = (u32::from(technique_sample.by_brdf_lanes) << 2)
                        | ((technique_sample.pair.0.0 >> 31) << 1)
                        | (technique_sample.pair.1.0 >> 31);
                    counts[cell as usize] += 1;
                }
                let chi2: f64 = counts.iter().map(|&c| (f64::from(c) - 1e4).powi(2) / 1e4).sum();
                assert!(chi2 < 45.0, "{kind:?}, pass {pass}: {chi2} {counts:?}");
            }
        }
    }

    #[test]
    fn numbers_stay_below_one() {
        assert_eq!(unit::<F32x8>(U32x8::splat(u32::MAX)).lane(3), 1.0 - 1.0 / 16_777_216.0);
        assert_eq!(unit::<F32x8>(U32x8::splat(0)).lane(3), 0.0);
    }
}
