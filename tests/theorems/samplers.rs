//! Random numbers: uniform over pixels, groups and seeds, and independent between the pairs of one sample.
//!
//! A pair may be as stratified as it likes within itself; two pairs of a sample must know nothing of each other, over
//! pixels (else pictures are biased) and over the passes of one pixel (else they do not converge). Chi-square on 16 x 16
//! cells, or 2 x 2 for coins; 65 536 samples see a dependence that moves a cell by a third, coins by 1.5 %.

use crate::proof::Family;
use crate::proof::stats::chi_square;
use octolux::lane::{Lane, Word};
use octolux::sampling::{Pair, PassBlock};
use octolux::scene::SamplerKind;

#[test]
fn numbers_of_a_sample_are_uniform_and_independent() {
    crate::proof::samplers::numbers_of_a_sample(1 << 16);
}

/// A coin against the top bits of the numbers that come with it, and against the coin of another light or, where lights
/// share it, against a number of that light: over groups, over passes of one group, over the pixels of the first two passes.
#[test]
fn coins_are_fair_and_independent_of_each_other_and_of_their_numbers() {
    let mut family = Family::new("coins");
    for kind in SamplerKind::ALL {
        let (early, late) = (PassBlock::new(kind, 8, 0, 2, 9), PassBlock::new(kind, 8, 16, 4096, 9));
        type Way<'a> = (&'a str, &'a PassBlock, &'a dyn Fn(u32) -> [u32; 3]);
        let ways: [Way; 3] = [
            ("pixels of pass 1", &early, &|i| [i, 1, i / 256]),
            ("groups", &late, &|i| [i, 3, i]),
            ("passes", &late, &|i| [5, i % 4096, 7]),
        ];
        for (what, block, address) in ways {
            for lights in [[1, 2], [2, 8], [4, 5]] {
                let mut counts = [[0.0; 4]; 3];
                let draws = if what == "passes" { 4096 } else { 65_536 };
                for i in 0..draws {
                    let [pixel, pass, group] = address(i);
                    let technique_sample =
                        |light| block.technique_sample(block.key(Word(pixel)), Word(pass), light, group);
                    let (a, b) = (technique_sample(lights[0]), technique_sample(lights[1]));
                    let (Pair(u, v), Pair(w, _)) = (a.pair, b.pair);
                    let other = if block.one_coin() {
                        assert_eq!(a.by_brdf_lanes, b.by_brdf_lanes);
                        w.0 >> 31 == 1
                    } else {
                        b.by_brdf_lanes
                    };
                    for (count, other) in counts.iter_mut().zip([other, u.0 >> 31 == 1, v.0 >> 31 == 1]) {
                        count[2 * usize::from(a.by_brdf_lanes) + usize::from(other)] += 1.0;
                    }
                }
                for (count, other) in counts.iter().zip(["other light", "first number", "second number"]) {
                    let test = chi_square(count, &[f64::from(draws) / 4.0; 4]);
                    let name = kind.name();
                    family.add(
                        test.p,
                        format!("{name}, {what}, lights {lights:?}, {other}: {count:?} {test:?}"),
                    );
                }
            }
        }
    }
    family.judge();
}

/// The numbers are the multiples of 2^-24 below 1, all bits in use.
#[test]
fn numbers_have_24_bits_and_stay_below_one() {
    for kind in SamplerKind::ALL {
        let block = PassBlock::new(kind, 1, 0, 4, 2);
        let (mut ones, mut zeros) = (0, 0);
        for pixel in 0..10_000 {
            let (x, y) = block.pair(block.key(Word(pixel)), Word(2), 1).unit::<f32>();
            for x in [x, y] {
                assert!((0.0..1.0).contains(&x), "{kind:?}: {x}");
                let bits = Lane::to_i32(x * 16_777_216.0).0;
                ones |= bits;
                zeros |= !bits & 0xff_ffff;
            }
        }
        assert_eq!((ones, zeros), (0xff_ffff, 0xff_ffff), "{kind:?}: a bit never changes");
    }
}
