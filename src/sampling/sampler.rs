//! Random numbers with addresses: `(seed, pixel, pass, pair)` and nothing else decides a number.
//!
//! A block of passes is prepared once for all pixels: a table of Owen-scrambled Sobol points for each pair of
//! dimensions. A pixel draws its own numbers from the table by an exclusive or with a hash of its address. Such a random
//! digital shift keeps every net property and makes each number uniform and pixels independent of each other, at the
//! price of one hash; hashing the scramble in every lane costs about eight times as much.

use super::hash::{mix, mix_lanes, pcg4d};
use super::sobol::scrambled_point;
use crate::lane::{Bits, Lane, Mask};
use crate::settings::SamplerKind;

/// Two uniform numbers as 32-bit fractions.
#[derive(Clone, Copy, Debug)]
pub struct Pair<B>(pub B, pub B);

impl<B: Bits> Pair<B> {
    /// The two numbers in [0, 1), multiples of 2^-24: never 1.
    #[inline(always)]
    pub fn unit<L: Lane<Bits = B>>(self) -> (L, L) {
        (unit(self.0), unit(self.1))
    }
}

/// A fair coin and two uniform numbers, independent of each other.
#[derive(Clone, Copy, Debug)]
pub struct Toss<B: Bits> {
    /// Lanes where it fell on heads.
    pub heads: B::Mask,
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
    passes: usize,
    pairs: u32,
    /// `pairs x passes` points, empty for independent numbers.
    table: Vec<[u32; 2]>,
}

impl PassBlock {
    /// Prepares a block for addresses with `pair < pairs`.
    pub fn new(kind: SamplerKind, seed: u32, first: u32, passes: u32, pairs: u32) -> Self {
        let table = match kind {
            SamplerKind::Independent => Vec::new(),
            SamplerKind::Sobol => (0..pairs)
                .flat_map(|pair| (first..first + passes).map(move |pass| scrambled_point(pass, pair, seed)))
                .collect(),
        };
        Self {
            seed,
            first,
            passes: passes as usize,
            pairs,
            table,
        }
    }

    /// The number of the last pair.
    pub fn last_pair(&self) -> u32 {
        self.pairs - 1
    }

    /// The first pass.
    pub fn first(&self) -> u32 {
        self.first
    }

    /// What stands for a pixel in the addresses below: computed once a sample.
    #[inline(always)]
    pub fn key<B: Bits>(&self, pixel: B) -> B {
        if self.table.is_empty() {
            return pixel;
        }
        let address = [pixel, B::splat(self.seed), B::splat(0x5bd1_e995), B::splat(0x1b87_3593)];
        let [key, ..] = pcg4d(mutate!(address, SharedKey => [B::splat(0); 4]));
        key
    }

    /// The numbers of pair `pair` for the pixels of `key`; `pass` counts from the block's first.
    #[inline(always)]
    pub fn pair<B: Bits>(&self, key: B, pass: B, pair: u32) -> Pair<B> {
        if self.table.is_empty() {
            return self.independent(key, pass, pair);
        }
        let Pair(a, b) = self.points(pass, pair);
        let [sa, sb] = shift(key, pair);
        Pair(a ^ sa, b ^ sb)
    }

    /// As [`Self::pair`], with a coin for the choice between two techniques: the top bit of the first number.
    ///
    /// With Sobol points the coin is stratified, of passes 2k and 2k + 1 of a pixel one has heads, and from pass 2 on
    /// the pixels of a `group` share it, so that packets seldom mix techniques. (The first two passes do without: a picture
    /// of one pass would show the groups.) Each coin is fair and independent of the numbers that come with it.
    #[inline(always)]
    pub fn toss<B: Bits>(&self, key: B, pass: B, pair: u32, group: u32) -> Toss<B> {
        let (heads, Pair(a, b)) = if self.table.is_empty() {
            let numbers = self.independent(key, pass, pair);
            (numbers.0.top_bit(), numbers)
        } else {
            let Pair(a, b) = self.points(pass, pair);
            let [sa, sb] = shift(key, pair);
            let coin = if self.first < 2 {
                sa
            } else {
                B::splat(mix(mix(group ^ self.seed).wrapping_add(pair)))
            };
            ((a ^ coin).top_bit(), Pair(a ^ sa, b ^ sb))
        };
        Toss {
            heads,
            pair: Pair(a.shl(1), b),
        }
    }

    #[inline(always)]
    fn independent<B: Bits>(&self, pixel: B, pass: B, pair: u32) -> Pair<B> {
        let address = [pixel, pass + B::splat(self.first), B::splat(pair), B::splat(self.seed)];
        let [a, b, ..] = pcg4d(address);
        Pair(a, b)
    }

    /// The points of the table for each lane's pass.
    #[inline(always)]
    fn points<B: Bits>(&self, pass: B, pair: u32) -> Pair<B> {
        let row = &self.table[pair as usize * self.passes..][..self.passes];
        // Most packets hold one pass only.
        let one = pass.lane(0);
        if pass.eq(B::splat(one)).all() {
            let [a, b] = row[one as usize];
            return Pair(B::splat(a), B::splat(b));
        }
        // Through memory and without closures: adaptive renders mix passes often. Lanes that there are not read row 0.
        let (mut passes, mut first, mut second) = ([0; 16], [0; 16], [0; 16]);
        pass.store(&mut passes);
        for lane in 0..16 {
            [first[lane], second[lane]] = row[passes[lane] as usize];
        }
        Pair(B::load(&first), B::load(&second))
    }
}

/// The digital shift of a pixel for a pair: two words mixed from the pixel's key.
#[inline(always)]
fn shift<B: Bits>(key: B, pair: u32) -> [B; 2] {
    let a = mix_lanes(key ^ B::splat(mix(pair ^ 0x68bc_21eb)));
    [a, mix_lanes(a ^ B::splat(0x02e5_be93))]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lane::{F32x8, U32x8, Word};

    /// Chi-square of the first `passes` passes of many pixels over 16 x 16 cells.
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
                    let toss = |p| {
                        block
                            .toss(block.key(U32x8::splat(pixel)), U32x8::splat(p), 4, pixel / 7)
                            .heads
                            .to_bitmask()
                    };
                    assert_eq!(toss(pass) ^ toss(pass + 1), 0xff);
                }
            }
        }
    }

    #[test]
    fn a_coin_is_fair_over_groups_and_says_nothing_of_its_numbers() {
        // 8 cells of coin and two top bits, 80 000 groups: chi-square with 7 degrees of freedom is below 45 with
        // probability 1 - 1e-7; six of them.
        for kind in SamplerKind::ALL {
            for pass in [0, 3, 6] {
                let block = PassBlock::new(kind, 11, if pass == 0 { 0 } else { 8 }, 8, 3);
                let mut counts = [0_u32; 8];
                for group in 0..80_000 {
                    let toss = block.toss(block.key(Word(group * 31)), Word(pass), 2, group);
                    let cell = (u32::from(toss.heads) << 2) | ((toss.pair.0.0 >> 31) << 1) | (toss.pair.1.0 >> 31);
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
