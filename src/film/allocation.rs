//! Allocates the samples of an adaptive render: from the noise of pilot passes to the sample count of each pixel.
//!
//! **Optimum.** With `n_i` samples the mean of pixel `i` has the variance `s_i^2 / n_i`, and relMSE, the mean over pixels of
//! `(x - r)^2 / (r^2 + e)`, has the expectation `sum(v_i / n_i) / N` where `v_i = s_i^2 / (r_i^2 + e)`. Under `sum(n_i) = B`
//! Lagrange's condition is `v_i / n_i^2 = const`: so `n_i` is proportional to `sqrt(v_i)`, the relative standard deviation.
//! (Neyman 1934 allocates to strata alike.) `v_i` sums over colours. Noise is measured from few samples, so `v` is averaged
//! over a window before the root is taken.
//!
//! **Without bias.** If a pixel's own pilot samples decided its sample count, pixels that are too dark by chance would stay so,
//! while too bright ones would be corrected: means over all samples would be too dark. Therefore the film is coloured like a
//! chessboard, and the sample counts of black pixels follow from the noise of white ones alone, and vice versa: the window
//! leaves out the pixel's own colour, and each colour has a fixed share of the budget. Pixels use independent random numbers
//! (digital shifts of shared tables), hence a pixel's sample count is independent of all of its samples, and the mean of pilot
//! and later samples together is exactly unbiased. A window that only leaves out the pixel itself would not suffice: the pixel
//! would still act on itself through the total, and through its neighbours' shares.
//!
//! **Edges.** The noise of a pixel with an edge resembles that of its neighbours on the edge, not that of the surfaces beside
//! it. So the window only includes pixels of the same [`Kind`]. The kind comes from rays whose random numbers no render uses:
//! it is independent of all samples, so the mean stays unbiased. Rare features, such as a sliver of a bright surface in a dark
//! pixel, are mostly missed by all pilot samples of a window: edges get at least the average.
//!
//! Sample counts are even: passes 2k and 2k + 1 are a pair of techniques.
//!
//! **Gain.** It depends on what the pilot sees. `mis` on Veach's scene gains a factor of 6 at 64 spp, `light` 3. But where 16
//! passes miss most of the light because it is rarely found, samples follow the few finds and the error grows: `brdf` there
//! from a relMSE of 20 to 41, `uniform` from 92 to 312. Averaging `v` over neighbours is better than averaging variances and
//! means separately (0.00053 and 0.00061), and its root better than averaging roots (0.00069): a window of 3 x 3 pixels gives
//! 0.0020, 5 x 5 0.00061, 7 x 7 0.00053, 9 x 9 0.00059.

mod share;

use std::ops::Range;

use rayon::prelude::*;

use self::share::{Bounds, Weights};
use crate::scene::FilmSize;

/// Statistics of a pixel over a few passes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Noise {
    /// The mean.
    pub mean: [f64; 3],
    /// Variance of a sample, up to one factor for all pixels.
    pub variance: [f64; 3],
}

impl Noise {
    /// The variance of a sample relative to the squared mean, as in relMSE, summed over colours.
    pub fn relative(&self) -> f64 {
        let channels = self.mean.iter().zip(self.variance);
        channels.map(|(mean, variance)| variance / (mean * mean + DARK)).sum()
    }
}

/// The content of a pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Kind {
    /// One smooth surface, or none.
    #[default]
    Plain,
    /// The pixel or a neighbour shows another surface.
    Edge,
    /// The same, and one of the surfaces emits light.
    Rim,
}

/// The `e` of relMSE: pixels much darker than its root, 0.01, do not need a small relative error.
const DARK: f64 = 1e-4;

/// Half width of the window in pixels.
const REACH: u32 = 3;

/// The same for edges, which are thin: it takes a larger window to contain as many neighbours of their kind.
const REACH_OF_EDGES: u32 = 5;

/// Edges get at least the average while at most one pixel in this many is an edge.
const EDGES: usize = 8;

/// Maximum samples of a pixel, relative to the average.
const MOST: u64 = 64;

/// Every pixel gets at least the average divided by this, whatever the pilot saw of its neighbours: so no variance exceeds four
/// times that of uniform passes. At 1024 spp on Veach's scene an eighth and a quarter give the same relMSE.
const FLOOR: u32 = 4;

/// Number of uniform passes before the rest is allocated, of `spp` on average; all of them if there are few.
///
/// A quarter of them, but 16 where that is no more than half, and 64 at most. relMSE on Veach's scene, 768 x 512, without
/// the reference's own 3e-5: at 64 spp 0.00078 after 8 passes, 0.00050 after 16, 0.00049 after 24, 0.00052 after 32 (and
/// 0.00314 without); at 256 spp 0.000105 after 16, 0.000083 after 32, 0.000080 after 64 (0.00064).
pub fn pilot(spp: u32) -> u32 {
    if spp <= 8 {
        spp
    } else {
        (spp / 2).min(16).max(spp / 4).clamp(8, 64) & !1
    }
}

/// Samples of each pixel, row by row, `spp` on average: together exactly `spp` times the pixels, less one if that is odd.
/// `noise` is [`Noise::relative`] in [`pilot`] passes, which are included in the counts; `kinds` must not depend on any sample.
pub fn allocate(size: FilmSize, noise: &[f64], kinds: &[Kind], spp: u32) -> Vec<u32> {
    let width = size.width as usize;
    let pairs = u64::from(spp) * noise.len() as u64 / 2;
    let blacks = noise.len().div_ceil(2);
    let black_pairs = (u128::from(pairs) * blacks as u128 / noise.len() as u128) as u64;
    let least = u64::from(pilot(spp).max(spp / FLOOR).div_ceil(2));
    let edges = kinds.iter().filter(|&&kind| kind != Kind::Plain).count();
    let bounds = Bounds {
        least,
        of_edges: if edges * EDGES <= kinds.len() {
            least.max(u64::from(spp / 2))
        } else {
            least
        },
        most: (u64::from(spp) * MOST / 2).min(1 << 30),
    };
    let [black, white] = smooth(size, noise, kinds);
    let (blacks, whites) = rayon::join(
        || black.apportion(black_pairs, bounds),
        || white.apportion(pairs - black_pairs, bounds),
    );
    let mut samples = vec![0; noise.len()];
    let mut shares = [blacks.into_iter(), whites.into_iter()];
    for (y, row) in samples.chunks_mut(width).enumerate() {
        for (x, samples) in row.iter_mut().enumerate() {
            *samples = 2 * shares[(x + y) % 2].next().unwrap_or_default();
        }
    }
    samples
}

/// Size of a block relative to the samples before it. A few large blocks are best, since each leaves a partly filled chunk in
/// every tile; but a render stopped by its time limit should have progressed equally in all pixels.
const BLOCK: u64 = 3;

/// The end of a block that begins at pass `first`, where pixels take part in `goals` passes: an even number of passes later, at
/// least two, and with at most three times the samples so far.
pub fn next_stop(goals: impl Iterator<Item = u32>, first: u32) -> u32 {
    let (mut before, mut active, mut ends) = (0, 0_u64, Vec::new());
    for goal in goals {
        before += u64::from(goal.min(first));
        if goal > first {
            active += 1;
            let block = ((goal - first - 1) / 2) as usize;
            ends.resize(ends.len().max(block + 1), 0);
            ends[block] += 1;
        }
    }
    let (mut pass, mut more) = (first, 0);
    for end in ends {
        more += 2 * active;
        if more > BLOCK * before && pass > first {
            break;
        }
        pass += 2;
        active -= end;
    }
    pass
}

/// Rows that are smoothed together; even.
const BAND: usize = 8;

/// For the pixels of each chessboard colour, row by row, the root of the mean of `values` over the pixels of the other colour and of
/// their kind in the window around them; over all kinds if there are none of their kind.
fn smooth(size: FilmSize, values: &[f64], kinds: &[Kind]) -> [Weights; 2] {
    let (width, height) = (size.width as usize, size.height as usize);
    // Two rows have as many pixels of one colour as of the other. If the number is odd, there is one black pixel more.
    let most = values.len().div_ceil(2);
    let mut weights = [vec![0.0; most], vec![0.0; most]];
    let [black, white] = &mut weights;
    let bands = black
        .par_chunks_mut(BAND / 2 * width)
        .zip(white.par_chunks_mut(BAND / 2 * width));
    bands.enumerate().for_each(|(band, (black, white))| {
        let rows = band * BAND..height.min((band + 1) * BAND);
        let plain = PlainBand::around(&rows, (width, height), values, kinds);
        let mut next = [black.iter_mut(), white.iter_mut()];
        let (mut sums, mut counts) = (vec![0.0; width], vec![0; width]);
        for y in rows {
            plain.sum(y, (width, height), &mut sums, &mut counts);
            for x in 0..width {
                let window = |reach: u32| window((x, y), (width, height), reach as usize);
                let (mut sum, mut count) = (sums[x], u32::from(counts[x]));
                let own = kinds[y * width + x];
                if own != Kind::Plain {
                    let same = window(REACH_OF_EDGES).filter(|&at| kinds[at] == own);
                    (sum, count) = same.fold((0.0, 0), |(sum, count), at| (sum + values[at], count + 1));
                }
                if count == 0 {
                    let all = window(if own == Kind::Plain { REACH } else { REACH_OF_EDGES });
                    (sum, count) = all.fold((0.0, 0), |(sum, count), at| (sum + values[at], count + 1));
                }
                if let Some(weight) = next[(x + y) % 2].next() {
                    *weight = (sum / f64::from(count.max(1))).sqrt();
                }
            }
        }
    });
    let mut edges = [0, 1].map(|_| Vec::with_capacity(most));
    for (y, row) in kinds.chunks(width).enumerate() {
        for (x, &kind) in row.iter().enumerate() {
            edges[(x + y) % 2].push(kind != Kind::Plain);
        }
    }
    let [black, mut white] = weights;
    white.truncate(values.len() - most);
    let [of_black, of_white] = edges;
    [(black, of_black), (white, of_white)].map(|(weights, edges)| Weights { weights, edges })
}

/// The pixels of the other colour in the window around a pixel, row by row.
fn window((x, y): (usize, usize), (width, height): (usize, usize), reach: usize) -> impl Iterator<Item = usize> {
    let columns = x.saturating_sub(reach)..width.min(x + reach + 1);
    (y.saturating_sub(reach)..height.min(y + reach + 1)).flat_map(move |row| {
        let first = columns.start + (columns.start + row + x + y + 1) % 2;
        (first..columns.end).step_by(2).map(move |column| row * width + column)
    })
}

/// The plain pixels of some rows and of those that their windows reach: values and a 1, or 0 for other pixels.
struct PlainBand {
    first: usize,
    values: Vec<f64>,
    ones: Vec<u8>,
}

impl PlainBand {
    fn around(rows: &Range<usize>, (width, height): (usize, usize), values: &[f64], kinds: &[Kind]) -> Self {
        let first = rows.start.saturating_sub(REACH as usize);
        let all = first * width..height.min(rows.end + REACH as usize) * width;
        let plain = kinds[all.clone()].iter().map(|&kind| kind == Kind::Plain);
        Self {
            first,
            values: (values[all].iter().zip(plain.clone()))
                .map(|(&value, plain)| if plain { value } else { 0.0 })
                .collect(),
            ones: plain.map(u8::from).collect(),
        }
    }

    /// Sums over the window of each column of row `y`. Adds one place of the window for the whole row at a time: in vectors.
    fn sum(&self, y: usize, (width, height): (usize, usize), sums: &mut [f64], counts: &mut [u8]) {
        let reach = REACH as usize;
        sums.fill(0.0);
        counts.fill(0);
        for row in y.saturating_sub(reach)..height.min(y + reach + 1) {
            for across in (0..=2 * reach).filter(|across| (row + y + across + reach) % 2 == 1) {
                // Column `x + across - reach`.
                let first = reach.saturating_sub(across);
                let end = width.min((width + reach).saturating_sub(across));
                if first >= end {
                    continue;
                }
                let begin = (row - self.first) * width + first + across - reach;
                let others = begin..begin + end - first;
                for (sum, value) in sums[first..end].iter_mut().zip(&self.values[others.clone()]) {
                    *sum += value;
                }
                for (count, one) in counts[first..end].iter_mut().zip(&self.ones[others]) {
                    *count += one;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::hash::mix;

    /// Noise over seven orders of magnitude.
    fn noise(pixels: u32, seed: u32) -> Vec<f64> {
        let unit = |i: u32| f64::from(mix(mix(i) ^ seed)) / 4_294_967_296.0;
        let one = |i| Noise {
            mean: [unit(4 * i), unit(4 * i + 1), 0.0],
            variance: [10_f64.powf(7.0 * unit(4 * i + 2) - 5.0), unit(4 * i + 3), 0.0],
        };
        (0..pixels).map(|i| one(i).relative()).collect()
    }

    /// Edges in one pixel of `of`.
    fn kinds(pixels: u32, of: u32) -> Vec<Kind> {
        let one = |i: u32| match mix(i) % (2 * of) {
            0 => Kind::Edge,
            1 => Kind::Rim,
            _ => Kind::Plain,
        };
        (0..pixels).map(one).collect()
    }

    #[test]
    fn the_budget_is_spent_exactly_in_pairs_between_floor_and_cap() {
        for (width, height) in [(1, 1), (1, 9), (2, 2), (37, 21), (64, 48)] {
            for spp in [9, 16, 64, 77, 1000] {
                let (size, pixels) = (FilmSize { width, height }, width * height);
                let kinds = kinds(pixels, spp);
                for noise in [noise(pixels, spp), vec![0.0; pixels as usize]] {
                    let samples = allocate(size, &noise, &kinds, spp);
                    let total: u64 = samples.iter().map(|&n| u64::from(n)).sum();
                    let budget = u64::from(pixels) * u64::from(spp);
                    assert_eq!(total, budget & !1, "{width} x {height}, {spp} spp");
                    let least = pilot(spp).max(spp / FLOOR);
                    assert!(samples.iter().all(|n| n % 2 == 0 && (least..=64 * spp).contains(n)));
                }
            }
        }
    }

    /// The reason why the mean is unbiased: a pixel's samples do not affect its own count in any way.
    #[test]
    fn a_pixel_has_no_say_in_its_own_samples() {
        let size = FilmSize { width: 23, height: 18 };
        let mut noise = noise(23 * 18, 5);
        let kinds = kinds(23 * 18, 3);
        let before = allocate(size, &noise, &kinds, 64);
        for at in 0..noise.len() {
            let own = noise[at];
            noise[at] = 1e9;
            let after = allocate(size, &noise, &kinds, 64);
            noise[at] = own;
            assert!(before != after || kinds[at] != Kind::Plain, "others do listen");
            for i in (0..before.len()).filter(|i| (i / 23 + i % 23) % 2 == (at / 23 + at % 23) % 2) {
                assert_eq!(before[i], after[i], "pixel {at} acts on {i}, of its own colour");
            }
        }
    }

    #[test]
    fn samples_follow_the_relative_deviation() {
        // Left: a deviation of 1 at a mean of 1; right: 3. Far from the border between them the smoothed value equals the
        // value.
        let size = FilmSize { width: 64, height: 32 };
        let pixel = |i: u32| Noise {
            mean: [1.0; 3],
            variance: [if i % 64 < 32 { 1.0 } else { 9.0 }; 3],
        };
        let pixel = |i: u32| pixel(i).relative();
        let plain = [Kind::Plain; 64 * 32];
        let samples = allocate(size, &(0..64 * 32).map(pixel).collect::<Vec<_>>(), &plain, 100);
        let mean = |from: usize| (from..from + 20).map(|x| f64::from(samples[16 * 64 + x])).sum::<f64>() / 20.0;
        assert!((mean(4) - 50.0).abs() < 2.0, "{}", mean(4));
        assert!((mean(40) - 150.0).abs() < 2.0, "{}", mean(40));
    }

    #[test]
    fn edges_listen_to_edges_and_get_the_average_at_least() {
        // One column in sixteen is an edge; only the noise of edges differs above and below.
        let size = FilmSize { width: 64, height: 64 };
        let edge = |i: u32| i % 16 == 8;
        let kinds: Vec<Kind> = (0..64 * 64)
            .map(|i| if edge(i) { Kind::Edge } else { Kind::Plain })
            .collect();
        let variance = |i: u32| if edge(i) && i < 64 * 32 { 100.0 } else { 1.0 };
        let pixel = |i: u32| Noise {
            mean: [1.0; 3],
            variance: [variance(i); 3],
        };
        let pixel = |i: u32| pixel(i).relative();
        let samples = allocate(size, &(0..64 * 64).map(pixel).collect::<Vec<_>>(), &kinds, 64);
        let of = |x: usize, y: usize| samples[64 * y + x];
        for x in 0..64 {
            let (above, below) = (of(x, 16), of(x, 48));
            if edge(x as u32) {
                assert!(above > 9 * of(0, 16), "{above} of {}", of(0, 16));
                assert_eq!(below, 64);
            } else {
                assert!(above.abs_diff(below) <= 2 && above < 64, "{above} and {below}");
            }
        }
    }

    #[test]
    fn a_block_has_up_to_three_times_the_samples_before_it() {
        // 16 samples each; two pixels continue to 18, one to 40: 3 + 3 + 1 + 1 … further ones, of at most 144.
        let goals = || [18, 18, 40].into_iter();
        assert_eq!(next_stop(goals(), 16), 40);
        assert_eq!(next_stop(goals(), 40), 40);
        // 2 x 96 samples of 64 pixels after 2: at most 3 x 2 of each.
        assert_eq!(next_stop([100; 64].into_iter(), 2), 8);
        assert_eq!(next_stop([100; 64].into_iter(), 0), 2);
    }

    #[test]
    fn pilots_are_even_and_leave_something() {
        assert_eq!(
            [1, 7, 8, 9, 25, 32, 64, 110, 4096].map(pilot),
            [1, 7, 8, 8, 12, 16, 16, 26, 64]
        );
    }
}
