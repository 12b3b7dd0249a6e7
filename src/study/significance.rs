//! Whether two pictures differ by more than their noise.
//!
//! A z-score is a difference over its standard error. If two pictures have the same expectation, their z-scores have an RMS of
//! 1, and one in 16 000 lies beyond 4. With few, heavy-tailed samples single pixels are too noisy for this, because their
//! standard errors are only estimates; means of 8 x 8 pixels are nearly normal.

use serde::Serialize;

/// Side of a block in pixels.
const BLOCK: usize = 8;

/// Half a unit in the last place of an `f32`, relative, and the smallest `f32` above 0: the least uncertainty of a stored
/// value, whatever its standard error. Otherwise the tails of narrow Phong lobes (1e-60 in `f64`, the smallest subnormal when
/// stored) would differ by 1e15 standard errors.
const ROUNDING: (f64, f64) = (5.960_464_477_539_063e-8, 1.401_298_464_324_817e-45);

/// A picture with the standard errors of its values, where they are known.
#[derive(Clone, Copy, Debug)]
pub struct Measured<'a, T> {
    /// The pixel values.
    pub pixels: &'a [[T; 3]],
    /// Their standard errors; `None` treats the picture as exact.
    pub stderr: Option<&'a [[T; 3]]>,
}

/// The difference `x - r` in units of its standard error `s`, with `s^2 = stderr_x^2 + stderr_r^2`.
///
/// If only the reference has standard errors, `s` lacks the noise of `x`: the z-scores then only show how much noisier `x` is.
/// Expect an RMS near 1 only when both are given, or when `x` has far less noise than the reference.
///
/// Values whose `s` is 0 are left out, because their error is unknown (pixels wholly inside an emitter have no noise; neither
/// has a pixel whose samples all happened to be black). Values that are not finite are left out too.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Significance {
    /// For each channel: `sum(x - r) / sqrt(sum(s^2))` over the picture. Channels are separate because they share their
    /// samples.
    pub z_mean: [f64; 3],
    /// The z-scores `(x - r) / s` of values. Expect a few beyond 10 if `x` has a few hundred samples: an edge pixel of an
    /// emitter whose samples all fell inside reports no noise.
    pub pixels: ZScores,
    /// Over blocks of 8 x 8 pixels and channels (smaller ones at the right and lower edge):
    /// `sum(x - r) / sqrt(sum(s^2))` of each block.
    pub blocks: ZScores,
    /// Values left out because their standard error is 0.
    pub left_out: u64,
    /// Left-out values that nevertheless differ, by more than 1e-5 of the larger one and 1.2e-38 (below which an `f32` loses
    /// digits).
    pub left_out_different: u64,
}

/// A summary of many z-scores.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct ZScores {
    /// How many there are.
    pub count: u64,
    /// Root of the mean square; 1 is expected.
    pub rms: f64,
    /// The largest in magnitude.
    pub max: f64,
}

/// A sum of differences and of their variances.
#[derive(Clone, Copy, Default)]
struct Sum {
    difference: f64,
    variance: f64,
}

impl Significance {
    /// Compares `x` with `r`; both are `width` pixels wide.
    ///
    /// # Panics
    /// If `width` is 0 or the pictures and standard errors have different numbers of pixels.
    pub fn between<X, R>(x: Measured<X>, r: Measured<R>, width: usize) -> Self
    where
        X: Copy + Into<f64>,
        R: Copy + Into<f64>,
    {
        let pixels = x.pixels.len();
        let others = [Some(r.pixels.len()), x.stderr.map(<[_]>::len), r.stderr.map(<[_]>::len)];
        assert!(
            others.iter().flatten().all(|&other| other == pixels),
            "pictures of different sizes"
        );
        let per_row = width.div_ceil(BLOCK);
        let mut blocks = vec![[Sum::default(); 3]; per_row * pixels.div_ceil(width).div_ceil(BLOCK)];
        let mut whole = [Sum::default(); 3];
        let mut scores = Scores::default();
        let (mut left_out, mut left_out_different) = (0, 0);
        for index in 0..pixels {
            let block = (index / width / BLOCK) * per_row + index % width / BLOCK;
            for channel in 0..3 {
                let a: f64 = x.pixels[index][channel].into();
                let b: f64 = r.pixels[index][channel].into();
                let noise = x.stderr.map_or(0.0, |e| e[index][channel].into()).powi(2)
                    + r.stderr.map_or(0.0, |e| e[index][channel].into()).powi(2);
                let (size, difference) = (a.abs().max(b.abs()), a - b);
                if !(difference.is_finite() && noise.is_finite()) {
                    continue;
                }
                if noise == 0.0 {
                    left_out += 1;
                    left_out_different += u64::from(difference.abs() > 1e-5 * size + f64::from(f32::MIN_POSITIVE));
                    continue;
                }
                let variance = noise + (ROUNDING.0 * size).powi(2) + ROUNDING.1.powi(2);
                let sum = Sum { difference, variance };
                scores.add(sum.score());
                whole[channel].add(sum);
                blocks[block][channel].add(sum);
            }
        }
        let mut block_scores = Scores::default();
        blocks
            .iter()
            .flatten()
            .filter(|sum| sum.variance > 0.0)
            .for_each(|sum| block_scores.add(sum.score()));
        Self {
            z_mean: whole.map(|sum| sum.score()),
            pixels: scores.summary(),
            blocks: block_scores.summary(),
            left_out,
            left_out_different,
        }
    }
}

impl Sum {
    fn add(&mut self, other: Self) {
        self.difference += other.difference;
        self.variance += other.variance;
    }

    /// The z-score; 0 for an empty sum.
    fn score(&self) -> f64 {
        if self.variance > 0.0 {
            self.difference / self.variance.sqrt()
        } else {
            0.0
        }
    }
}

#[derive(Default)]
struct Scores {
    count: u64,
    squares: f64,
    max: f64,
}

impl Scores {
    fn add(&mut self, z: f64) {
        self.count += 1;
        self.squares += z * z;
        self.max = self.max.max(z.abs());
    }

    fn summary(&self) -> ZScores {
        ZScores {
            count: self.count,
            rms: (self.squares / self.count.max(1) as f64).sqrt(),
            max: self.max,
        }
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64;

    use super::*;

    /// 20 x 12 pixels: two full blocks and a narrow one in each of two rows of blocks.
    const WIDTH: usize = 20;
    const PIXELS: usize = 240;

    /// Noise of variance 1: the sum of 12 uniform numbers, centred.
    fn noisy(rng: &mut Pcg64) -> Vec<[f64; 3]> {
        let mut normal = || 100.0 + (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0;
        (0..PIXELS).map(|_| [normal(), normal(), normal()]).collect()
    }

    #[test]
    fn equal_expectations_have_scores_of_one() {
        let mut rng = Pcg64::seed_from_u64(8);
        let (x, r, one) = (noisy(&mut rng), noisy(&mut rng), vec![[1.0; 3]; PIXELS]);
        let (mx, mr) = (
            Measured {
                pixels: &x,
                stderr: Some(&one),
            },
            Measured {
                pixels: &r,
                stderr: Some(&one),
            },
        );
        let both = Significance::between(mx, mr, WIDTH);
        assert!(both.z_mean.iter().all(|z| z.abs() < 3.5), "{both:?}");
        assert_eq!((both.pixels.count, both.blocks.count), (720, 18));
        assert!(
            (both.pixels.rms - 1.0).abs() < 0.1 && (both.blocks.rms - 1.0).abs() < 0.5,
            "{both:?}"
        );
        // Without the errors of x, its noise counts as a difference: sqrt(2) times as much.
        let one_sided = Significance::between(
            Measured {
                pixels: &x,
                stderr: None,
            },
            mr,
            WIDTH,
        );
        assert!((one_sided.pixels.rms / both.pixels.rms - 2.0_f64.sqrt()).abs() < 1e-9);
        // A bias of a third of s is invisible in single pixels, and clear in the mean.
        let biased: Vec<_> = x.iter().map(|pixel| pixel.map(|value| value + 0.5)).collect();
        let shifted = Significance::between(Measured { pixels: &biased, ..mx }, mr, WIDTH);
        assert!(
            shifted.pixels.rms < 1.2 && shifted.z_mean.iter().all(|&z| z > 2.0),
            "{shifted:?}"
        );
    }

    #[test]
    fn values_without_noise_are_left_out_and_those_that_differ_counted() {
        let (x, r) = (
            [[1.0_f32, 2.0, 0.0], [1e-45, 3.0, f32::NAN]],
            [[1.0_f32, 1.0, 0.0], [0.0, 2.0, 1.0]],
        );
        let stderr = [[0.0_f32, 0.0, 0.0], [1e-45, 0.5, 1.0]];
        let result = Significance::between(
            Measured {
                pixels: &x,
                stderr: None,
            },
            Measured {
                pixels: &r,
                stderr: Some(&stderr),
            },
            2,
        );
        assert_eq!((result.left_out, result.left_out_different), (3, 1));
        assert_eq!(result.pixels.count, 2);
        assert!(
            (result.pixels.max - 2.0).abs() < 1e-6 && result.z_mean[0] < 1.0,
            "{result:?}"
        );
    }
}
