//! Random numbers of one sample, two by two.

use octolux::lane::Word;
use octolux::sampling::PassBlock;
use octolux::scene::SamplerKind;

use super::Family;
use super::stats::chi_square;

/// The two numbers of a pair and those of another one, of a sample.
type Sample = [f32; 4];

fn sample(block: &PassBlock, pixel: u32, pass: u32, pairs: [u32; 2]) -> Sample {
    let key = block.key(Word(pixel));
    let [(a, b), (c, d)] = pairs.map(|pair| block.pair(key, Word(pass), pair).unit::<f32>());
    [a, b, c, d]
}

/// Tests each two of four numbers against the uniform distribution on the square.
fn two_by_two(family: &mut Family, what: &str, samples: &[Sample]) {
    let cell = |x: f32| (x * 16.0) as usize;
    for i in 0..4 {
        for j in 0..i {
            let mut counts = vec![0.0; 256];
            samples.iter().for_each(|s| counts[16 * cell(s[i]) + cell(s[j])] += 1.0);
            let test = chi_square(&counts, &[samples.len() as f64 / 256.0; 256]);
            // The points of one pair are more even than chance: only what is less even counts.
            family.add(test.p, format!("{what}, numbers {i} and {j}: {test:?}"));
        }
    }
}

/// Pairs of pairs over pixels, over the passes of a pixel and over seeds.
pub fn numbers_of_a_sample(draws: u32) {
    let mut family = Family::new("samplers");
    for kind in SamplerKind::ALL {
        for pairs in [[0, 1], [1, 2], [2, 6], [3, 4]] {
            let block = PassBlock::new(kind, 5, 0, 8, 7);
            let name = kind.name();
            for pass in [0, 5] {
                let over_pixels: Vec<Sample> = (0..draws).map(|pixel| sample(&block, pixel, pass, pairs)).collect();
                two_by_two(
                    &mut family,
                    &format!("{name}, pass {pass} of all pixels, pairs {pairs:?}"),
                    &over_pixels,
                );
            }
            let long = PassBlock::new(kind, 6, 16, 4096, 7);
            for pixel in [0, 1, 77_777] {
                let over_passes: Vec<Sample> = (0..4096).map(|pass| sample(&long, pixel, pass, pairs)).collect();
                two_by_two(
                    &mut family,
                    &format!("{name}, passes of pixel {pixel}, pairs {pairs:?}"),
                    &over_passes,
                );
            }
            let over_seeds: Vec<Sample> = (0..draws)
                .map(|seed| sample(&PassBlock::new(kind, seed, 3, 1, 7), 9, 0, pairs))
                .collect();
            two_by_two(&mut family, &format!("{name}, seeds, pairs {pairs:?}"), &over_seeds);
        }
    }
    family.judge();
}
