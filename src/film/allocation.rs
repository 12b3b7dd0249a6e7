//! Where the samples of an adaptive render go: from the noise that pilot passes showed to the samples of each pixel.
//!
//! **How many.** With `n_i` samples the mean of pixel `i` has the variance `s_i^2 / n_i`, and relMSE, the mean over
//! pixels of `(x - r)^2 / (r^2 + e)`, is expected to be `sum(v_i / n_i) / N` where `v_i = s_i^2 / (r_i^2 + e)`. Under
//! `sum(n_i) = B` Lagrange's condition is `v_i / n_i^2 = const`: so `n_i` is proportional to `sqrt(v_i)`, the relative
//! standard deviation. (Neyman 1934 allocates to strata alike.) Colours add up in `v_i`. Noise is measured on few
//! samples, so `v` is averaged over a window before the root is taken.
//!
//! **Without bias.** If a pixel's own pilot samples decided how many it gets, pixels that look dark by bad luck would be
//! left as they are, and those that were lucky corrected: pooled means would be too dark. So the film is coloured like
//! a chessboard, and the samples of black pixels follow from the noise of white ones alone, and the other way round: the
//! window leaves out the pixel's own colour, and each colour has its fixed share of the budget. Pixels draw independent
//! numbers (given the tables that they share, by their digital shifts), hence a pixel's number of samples is independent
//! of every one of its samples, and the mean of pilot and later samples together is unbiased, exactly: a window that
//! leaves out the pixel alone would still let it act on itself through the total, and through its neighbours' shares.
//!
//! Numbers are even: passes 2k and 2k + 1 are a pair of techniques.
//!
//! **What it is worth.** It sees what the pilot sees. `mis` on Veach's scene gains a factor of 6 at 64 spp, `light` 3; but
//! where light is found so seldom that 16 passes miss most of it, samples follow the few finds and error grows: `brdf` there
//! from a relMSE of 20 to 41, `uniform` from 92 to 312. Averaging `v` over neighbours is better than averaging variances
//! and means apart (0.00053 and 0.00061), and its root better than averaging roots (0.00069): a window of 3 x 3 pixels
//! gives 0.0020, 5 x 5 0.00061, 7 x 7 0.00053, 9 x 9 0.00059.

use rayon::prelude::*;

use crate::scene::FilmSize;

/// What a few passes showed of a pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Noise {
    /// The mean.
    pub mean: [f64; 3],
    /// Variance of a sample, up to one factor for all pixels.
    pub variance: [f64; 3],
}

/// The `e` of relMSE: what is much darker than its root, 0.01, is not worth a small relative error.
const DARK: f64 = 1e-4;

/// Pixels to each side of the window's middle.
const REACH: u32 = 3;

/// No pixel gets more than so many times the average.
const MOST: u64 = 64;

/// No pixel gets less than the average over this, whatever the pilot saw of its neighbours: so no variance is more than four
/// times that of uniform passes. At 1024 spp on Veach's scene an eighth and a quarter make the same relMSE.
const FLOOR: u32 = 4;

/// Passes that every pixel gets before the rest is allocated, of `spp` on average; all of them where there are few.
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

/// Samples of each pixel, row by row, `spp` on average: together `spp` times the pixels exactly, less one if that is odd.
/// `noise` comes from [`pilot`] passes, which count.
pub fn allocate(size: FilmSize, noise: &[Noise], spp: u32) -> Vec<u32> {
    let weights = smooth(size, &noise.iter().map(relative_variance).collect::<Vec<_>>());
    let width = size.width as usize;
    let colour = |i: usize| (i / width + i % width) % 2;
    let pairs = u64::from(spp) * noise.len() as u64 / 2;
    let blacks = (0..noise.len()).filter(|&i| colour(i) == 0).count();
    let black_pairs = (u128::from(pairs) * blacks as u128 / noise.len() as u128) as u64;
    let least = u64::from(pilot(spp).max(spp / FLOOR).div_ceil(2));
    let most = (u64::from(spp) * MOST / 2).min(1 << 30);
    let mut samples = vec![0; noise.len()];
    for (wanted, total) in [(0, black_pairs), (1, pairs - black_pairs)] {
        let pixels: Vec<usize> = (0..noise.len()).filter(|&i| colour(i) == wanted).collect();
        let weights: Vec<f64> = pixels.iter().map(|&i| weights[i]).collect();
        for (i, pairs) in pixels.into_iter().zip(apportion(&weights, total, least, most)) {
            samples[i] = 2 * pairs as u32;
        }
    }
    samples
}

fn relative_variance(noise: &Noise) -> f64 {
    let channels = noise.mean.iter().zip(noise.variance);
    channels.map(|(mean, variance)| variance / (mean * mean + DARK)).sum()
}

/// The root of the mean of `values` over the pixels of the other colour in the window around each pixel; 0 without any.
fn smooth(size: FilmSize, values: &[f64]) -> Vec<f64> {
    let (width, height) = (size.width, size.height);
    let pixel = |x: u32, y: u32| {
        let (mut sum, mut count) = (0.0, 0_u32);
        for row in y.saturating_sub(REACH)..height.min(y + REACH + 1) {
            let left = x.saturating_sub(REACH);
            let first = left + u32::from((left + row + x + y).is_multiple_of(2));
            for column in (first..width.min(x + REACH + 1)).step_by(2) {
                sum += values[row as usize * width as usize + column as usize];
                count += 1;
            }
        }
        (sum / f64::from(count.max(1))).sqrt()
    };
    let rows = (0..height).into_par_iter();
    rows.flat_map_iter(|y| (0..width).map(move |x| pixel(x, y))).collect()
}

/// Divides `total` in proportion to the weights, each share within `least..=most`: `clamp(scale * weight)` with the one
/// scale that spends everything, rounded so that the shares so far are true to one at any place. The total must lie
/// between `least` and `most` for each.
fn apportion(weights: &[f64], total: u64, least: u64, most: u64) -> Vec<u64> {
    let mean = weights.iter().sum::<f64>() / weights.len() as f64;
    // So that no pixel is out of reach of any scale, and pixels without any noise share alike.
    let sure = if mean > 0.0 { mean * 1e-4 } else { 1.0 };
    let (low, high) = (least as f64, most as f64);
    let share = |scale: f64, weight: f64| (scale * weight.max(sure)).clamp(low, high);
    // Eight sums side by side, which the compiler makes a vector of.
    let spent = |scale: f64| {
        let (eights, rest) = weights.as_chunks::<8>();
        let mut sums = [0.0; 8];
        for eight in eights {
            for (sum, &weight) in sums.iter_mut().zip(eight) {
                *sum += share(scale, weight);
            }
        }
        sums.iter().sum::<f64>() + rest.iter().map(|&weight| share(scale, weight)).sum::<f64>()
    };
    let (mut below, mut above) = (0.0, high / sure);
    // Right if there were no bounds; the floor makes it less.
    let mut scale = total as f64 / (mean.max(sure) * weights.len() as f64);
    for _ in 0..100 {
        let off = spent(scale) - total as f64;
        if off.abs() < 0.25 {
            break;
        }
        *(if off > 0.0 { &mut above } else { &mut below }) = scale;
        scale = below.midpoint(above);
    }
    let (mut sum, mut given) = (0.0, 0);
    let mut shares: Vec<u64> = Vec::with_capacity(weights.len());
    for &weight in weights {
        sum += share(scale, weight);
        let upto = sum.round() as u64;
        shares.push(upto - given);
        given = upto;
    }
    // Beyond 2^50 samples the sums above are themselves rounded; the last pixel takes the difference.
    if let Some(last) = shares.last_mut() {
        *last = (*last + total).saturating_sub(given);
    }
    shares
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::hash::mix;

    /// Noise over seven orders of magnitude.
    fn noise(pixels: u32, seed: u32) -> Vec<Noise> {
        let unit = |i: u32| f64::from(mix(mix(i) ^ seed)) / 4_294_967_296.0;
        let one = |i| Noise {
            mean: [unit(4 * i), unit(4 * i + 1), 0.0],
            variance: [10_f64.powf(7.0 * unit(4 * i + 2) - 5.0), unit(4 * i + 3), 0.0],
        };
        (0..pixels).map(one).collect()
    }

    #[test]
    fn the_budget_is_spent_exactly_in_pairs_between_floor_and_cap() {
        for (width, height) in [(1, 1), (1, 9), (2, 2), (37, 21), (64, 48)] {
            for spp in [9, 16, 64, 77, 1000] {
                let (size, pixels) = (FilmSize { width, height }, width * height);
                for noise in [noise(pixels, spp), vec![Noise::default(); pixels as usize]] {
                    let samples = allocate(size, &noise, spp);
                    let total: u64 = samples.iter().map(|&n| u64::from(n)).sum();
                    let budget = u64::from(pixels) * u64::from(spp);
                    assert_eq!(total, budget & !1, "{width} x {height}, {spp} spp");
                    let least = pilot(spp).max(spp / FLOOR);
                    assert!(samples.iter().all(|n| n % 2 == 0 && (least..=64 * spp).contains(n)));
                }
            }
        }
    }

    /// What makes the mean unbiased: nothing that a pixel saw changes its own number, by no way.
    #[test]
    fn a_pixel_has_no_say_in_its_own_samples() {
        let size = FilmSize { width: 23, height: 18 };
        let mut noise = noise(23 * 18, 5);
        let before = allocate(size, &noise, 64);
        for at in 0..noise.len() {
            let own = noise[at];
            noise[at].variance = [1e6; 3];
            let after = allocate(size, &noise, 64);
            noise[at] = own;
            assert!(before != after, "others do listen");
            for i in (0..before.len()).filter(|i| (i / 23 + i % 23) % 2 == (at / 23 + at % 23) % 2) {
                assert_eq!(before[i], after[i], "pixel {at} acts on {i}, of its own colour");
            }
        }
    }

    #[test]
    fn samples_follow_the_relative_deviation() {
        // Left: a deviation of 1 at a mean of 1; right: 3. The root of a mean far from the border is the value itself.
        let size = FilmSize { width: 64, height: 32 };
        let pixel = |i: u32| Noise {
            mean: [1.0; 3],
            variance: [if i % 64 < 32 { 1.0 } else { 9.0 }; 3],
        };
        let samples = allocate(size, &(0..64 * 32).map(pixel).collect::<Vec<_>>(), 100);
        let mean = |from: usize| (from..from + 20).map(|x| f64::from(samples[16 * 64 + x])).sum::<f64>() / 20.0;
        assert!((mean(4) - 50.0).abs() < 2.0, "{}", mean(4));
        assert!((mean(40) - 150.0).abs() < 2.0, "{}", mean(40));
    }

    #[test]
    fn pilots_are_even_and_leave_something() {
        assert_eq!(
            [1, 7, 8, 9, 25, 32, 64, 110, 4096].map(pilot),
            [1, 7, 8, 8, 12, 16, 16, 26, 64]
        );
    }
}
