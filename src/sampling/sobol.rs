//! Owen-scrambled Sobol points in pairs of dimensions.
//!
//! Every pair of dimensions uses the first two Sobol dimensions, a (0, 2)-sequence: each aligned run of 2^m points has one point in
//! every elementary interval of area 2^-m. Pairs are combined by padding: a nested uniform scramble of the index shuffles the order
//! of the points, and another scrambles the values (Owen 1995; Burley 2020, "Practical Hash-based Owen Scrambling"). Each pair has
//! its own scrambles, so pairs are independent.

use super::hash::{mix, mix_lanes};
use crate::lane::Bits;

/// Nested uniform scramble of `x`: from the top, each bit is flipped by a hash of the bits above it and of the seed. This is
/// exactly Owen's permutation tree, with 32 hashes per number; used only while tables are built.
#[inline(always)]
pub fn owen_scramble<B: Bits>(x: B, seed: u32) -> B {
    let mut result = B::splat(0);
    let mut path = B::splat(mix(seed ^ 0x9e37_79b9));
    for bit in (0..32).rev() {
        let digit = x.shr(bit) & B::splat(1);
        result = result ^ (digit ^ path.shr(31)).shl(bit);
        // The path identifies the node of the tree: it depends on the digits of x so far and on the seed.
        path = mix_lanes(path ^ digit.shl(16) ^ B::splat(bit + 1));
    }
    result
}

/// Point `index` of the two-dimensional Sobol sequence, as 32-bit fractions.
#[inline(always)]
pub fn sobol_2d<B: Bits>(index: B) -> [B; 2] {
    let (mut first, mut second) = (B::splat(0), B::splat(0));
    let mut direction = 1_u32 << 31;
    for bit in 0..32 {
        let digit = index.shr(bit) & B::splat(1);
        first = first ^ digit.shl(31 - bit);
        second = second ^ (digit * B::splat(direction));
        direction ^= direction >> 1;
    }
    [first, second]
}

/// Point `pass` of the pair `pair` under `seed`, shuffled and scrambled. A chain of 96 hashes, so eight points take little longer than
/// one.
#[inline(always)]
pub fn scrambled_point<B: Bits>(pass: B, pair: u32, seed: u32) -> [B; 2] {
    let key = mix(mix(seed).wrapping_add(mutate!(pair, PairReused => 0).wrapping_mul(0x85eb_ca6b)));
    // A nested scramble of the index maps every aligned run of 2^m indices to another one.
    let index = owen_scramble(pass, key ^ 0x68bc_21eb);
    let [a, b] = sobol_2d(index);
    [owen_scramble(a, key ^ 0x02e5_be93), owen_scramble(b, key ^ 0x967a_889b)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lane::Word;

    #[test]
    fn the_first_points_are_those_of_sobol() {
        let halves = |index| sobol_2d(Word(index)).map(|x| f64::from(x.0) / 2.0_f64.powi(32));
        assert_eq!(halves(0), [0.0, 0.0]);
        assert_eq!(halves(1), [0.5, 0.5]);
        assert_eq!(halves(2), [0.25, 0.75]);
        assert_eq!(halves(3), [0.75, 0.25]);
        assert_eq!(halves(4), [0.125, 0.625]);
    }

    #[test]
    fn scrambling_is_a_bijection_that_keeps_prefixes() {
        for seed in 0..64 {
            for depth in [1, 4, 9] {
                let shift = 32 - depth;
                let mut seen = vec![false; 1 << depth];
                for prefix in 0..1_u32 << depth {
                    let a = owen_scramble(Word(prefix << shift), seed).0 >> shift;
                    let b = owen_scramble(Word((prefix << shift) | ((1 << shift) - 1)), seed).0 >> shift;
                    assert_eq!(a, b, "the image of a prefix depends on the prefix alone");
                    assert!(
                        !std::mem::replace(&mut seen[a as usize], true),
                        "two prefixes, one image"
                    );
                }
            }
        }
    }

    #[test]
    fn every_elementary_interval_of_an_aligned_run_holds_one_point() {
        for pair in 0..5 {
            for m in [2_u32, 4, 8] {
                for start in [0, 3 << m] {
                    for a in 0..=m {
                        let mut seen = vec![false; 1 << m];
                        for i in 0..1 << m {
                            let [Word(x), Word(y)] = scrambled_point(Word(start + i), pair, 42);
                            let column = if a == 0 { 0 } else { x >> (32 - a) };
                            let row = if a == m { 0 } else { y >> (32 - (m - a)) };
                            let cell = (column << (m - a)) | row;
                            assert!(
                                !std::mem::replace(&mut seen[cell as usize], true),
                                "pair {pair}, m {m}, a {a}"
                            );
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn one_point_is_uniform_over_seeds() {
        // 64 cells, 64 000 seeds: chi-square with 63 degrees of freedom is below 120 with probability 1 - 2e-5.
        for pass in [0, 1, 7, 1_000_003] {
            let mut counts = [0_u32; 64];
            for seed in 0..64_000 {
                let [Word(x), Word(y)] = scrambled_point(Word(pass), 3, seed);
                counts[(((x >> 29) << 3) | (y >> 29)) as usize] += 1;
            }
            let chi2: f64 = counts.iter().map(|&c| (f64::from(c) - 1000.0).powi(2) / 1000.0).sum();
            assert!(chi2 < 120.0, "pass {pass}: chi-square {chi2}");
        }
    }
}
