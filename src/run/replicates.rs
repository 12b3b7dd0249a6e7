//! Rendering to a target error that replicates measure: [`Goal::error`](super::Goal::error).
//!
//! The error is the root of the mean variance of the pixels' means, over the mean of the picture: `sqrt(mean(Var)) / mean`.
//!
//! # How the error is measured
//!
//! Samples of one low-discrepancy sequence depend on each other, so their spread says nothing about the error of their mean.
//! Therefore several pictures are rendered with different seeds, and the picture is their mean. They are independent for any
//! sampler, so the variance of the mean is the variance of the replicates over their number, without further assumptions.
//!
//! # How accurate the measurement is
//!
//! If a few pixels carry most of the noise, as at silhouettes of small bright lights, the measured error is only as accurate as
//! theirs. The variance of a pixel's sample variance is `(2 R k2^2 + (R - 1) k4) / (R (R + 1))`, without bias (Fisher's
//! k-statistics, Kenney and Keeping 1951). The root of the sum of these over the sum of the sample variances is the relative
//! uncertainty of the variance, and half of it that of the error. The fourth moment accounts for rare bright samples.
//!
//! # How the work grows
//!
//! The replicates form two halves, each of which decides on the other (`run/halves.rs`). For each half, [`next`] doubles the
//! passes of [`LEAST`] replicates while the goal is far. If a doubling could overshoot the goal, replicates are added instead:
//! they lower the variance exactly in proportion, and keep passes a power of two, which is best for Sobol points. If the noise
//! is in few pixels, more replicates are added, and earlier.
//!
//! # Stopping
//!
//! A rule that stops when an estimate falls below a goal favours estimates that are too low, the more so the less certain they
//! are. So the estimate has to be below the goal, and the estimate plus two standard errors below 1.15 times the goal (for a
//! half, 1 and [`SLACK`]). Noise that no sample has found yet cannot be measured: there are at least two looks and 64 samples
//! per pixel. `docs/study/target-error.py` measures the resulting errors.
//!
//! # Cost
//!
//! With `independent` nothing. A Sobol sequence of n points split into R parts loses the advantage of its slope p over 1: the
//! variance is R^(p-1) times that of one sequence, for 8 replicates 1.9 times at p = 1.3.

use serde::{Deserialize, Serialize};

use crate::film::Picture;
use crate::sampling::hash::mix;

/// Minimum replicates of a half: the fourth moment needs this many.
pub const LEAST: usize = 4;

/// Maximum number of replicates that a half adds for certainty alone.
pub const MOST: usize = 16;

/// Samples per pixel of a half at the first look.
pub const FIRST: Work = Work {
    replicates: LEAST,
    passes: 4,
};

/// The same for adaptive replicates, which need more samples to become adaptive.
pub const FIRST_ANEW: Work = Work {
    replicates: LEAST,
    passes: 16,
};

/// Relative amount by which the error of a half plus two standard errors may exceed its goal: 0.15 for both halves together,
/// times the root of 2.
pub const SLACK: f64 = 0.212;

/// Below this multiple of the goal, replicates are added: a doubling of passes may lower the variance by as much or more.
const NEAR: f64 = 2.5;

/// The seed of a replicate. The first has the user's seed; the others are unrelated to it, so renders with neighbouring seeds
/// share no replicate.
pub fn seed(seed: u32, replicate: usize) -> u32 {
    if replicate == 0 {
        seed
    } else {
        // An odd constant separates the replicates of a seed; the mixing separates neighbouring seeds.
        mix(mix(seed).wrapping_add((replicate as u32).wrapping_mul(0x9e37_79b9)))
    }
}

/// The mean of independent pictures.
///
/// # Panics
/// Without pictures, or if sizes differ.
pub fn mean(pictures: &[Picture]) -> Picture {
    let count = pictures.len() as f64;
    let pixel = |p: usize| {
        std::array::from_fn(|c| {
            let sum: f64 = pictures.iter().map(|picture| f64::from(picture.pixels[p][c])).sum();
            (sum / count) as f32
        })
    };
    let Picture {
        width,
        height,
        ref pixels,
    } = pictures[0];
    Picture {
        width,
        height,
        pixels: (0..pixels.len()).map(pixel).collect(),
    }
}

/// The measured error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shown {
    /// The error of their mean; 0 in a black picture.
    pub error: f64,
    /// Relative standard error of this error.
    pub uncertainty: f64,
}

/// The error of the mean of at least four independent pictures, from their spread.
pub fn error(pictures: &[Picture]) -> Shown {
    let n = pictures.len() as f64;
    let values = 3 * pictures[0].pixels.len();
    let (mut total, mut variance) = (0.0, 0.0);
    // The channels of a pixel share samples, so sum them: sample variances of the sums, and the variances of these.
    let (mut squares, mut spread) = (0.0, 0.0);
    for p in 0..pictures[0].pixels.len() {
        let moments = |of: &dyn Fn(&Picture) -> f64| {
            let mean = pictures.iter().map(of).sum::<f64>() / n;
            let power = |k: i32| pictures.iter().map(|picture| (of(picture) - mean).powi(k)).sum::<f64>() / n;
            (mean, power(2), power(4))
        };
        for c in 0..3 {
            let (mean, m2, _) = moments(&|picture| f64::from(picture.pixels[p][c]));
            total += mean;
            variance += m2 * n / (n - 1.0) / mutate!(n, ErrorOfOneReplicate => 1.0);
        }
        let (_, m2, m4) = moments(&|picture| picture.pixels[p].iter().copied().map(f64::from).sum());
        let k2 = m2 * n / (n - 1.0);
        let k4 = n * n * ((n + 1.0) * m4 - 3.0 * (n - 1.0) * m2 * m2) / ((n - 1.0) * (n - 2.0) * (n - 3.0));
        squares += k2;
        spread += (2.0 * n * k2 * k2 + (n - 1.0) * k4) / (n * (n + 1.0));
    }
    if total <= 0.0 || variance == 0.0 {
        return Shown {
            error: 0.0,
            uncertainty: 0.0,
        };
    }
    Shown {
        error: (variance / values as f64).sqrt() / (total / values as f64),
        uncertainty: 0.5 * spread.max(0.0).sqrt() / squares,
    }
}

/// Replicates, each with the given number of passes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Work {
    /// Number of replicates.
    pub replicates: usize,
    /// Passes of each: a power of two.
    pub passes: u32,
}

impl Work {
    /// Samples per pixel of all replicates together.
    pub fn samples(self) -> u64 {
        self.replicates as u64 * u64::from(self.passes)
    }
}

/// The work at the next look, given what was `shown` after `done`; `None` once the goal is reached. `first` is the work at the
/// first look.
pub fn next(goal: f64, first: Work, done: Work, shown: Shown) -> Option<Work> {
    let Shown { error, uncertainty } = shown;
    let (count, most) = (done.replicates as f64, MOST as f64);
    // R times as many replicates divide the error e and its uncertainty u by sqrt(R) = 1/t. The condition is e t (1 + 2 u t) =
    // (1 + SLACK) goal.
    let limit = (1.0 + SLACK) * goal;
    let t = 2.0 * limit / (error + (error * error + 8.0 * uncertainty * error * limit).sqrt());
    let (short, unsure) = ((error / goal).powi(2), t.powi(-2).min(most / count));
    // Never stop at the first look: four times four samples may all miss the same edge.
    if done != first && short <= 1.0 && unsure <= 1.0 {
        return None;
    }
    // The factor of replicates needed once the error is near the goal.
    let scarce = (2.0 * uncertainty / SLACK).powi(2).min(most / count).max(1.0);
    Some(if short > NEAR * scarce {
        Work {
            passes: 2 * done.passes,
            ..done
        }
    } else {
        let least = if short <= 1.0 && done == first {
            2.0 * count
        } else {
            count + 1.0
        };
        Work {
            replicates: (count * short.max(unsure)).ceil().clamp(least, NEAR * count) as usize,
            ..done
        }
    })
}

/// Like [`next`] for renders that restart for every number of passes, as adaptive ones do: passes then double up to three times
/// at once, as far as variances proportional to the power -1.3 of the passes allow. This wastes a seventh of the samples.
pub fn next_anew(goal: f64, done: Work, shown: Shown) -> Option<Work> {
    let further = next(goal, FIRST_ANEW, done, shown)?;
    if further.passes == done.passes {
        return Some(further);
    }
    let doublings = ((shown.error / goal).powi(2).log2() / 1.3).clamp(1.0, 3.0) as u32;
    Some(Work {
        passes: done.passes << doublings,
        ..done
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(values: &[f32]) -> Picture {
        Picture {
            width: values.len() as u32,
            height: 1,
            pixels: values.iter().map(|&v| [v; 3]).collect(),
        }
    }

    #[test]
    fn the_error_is_that_of_the_mean() {
        // Pixel 0: 1 2 3 6 has the variance 14/3, its mean 7/6; pixel 1 has none. The mean over both is 7/12, of the picture 2.
        let pictures = [1.0, 2.0, 3.0, 6.0].map(|v| picture(&[v, 1.0]));
        assert_eq!(mean(&pictures).pixels, [[3.0; 3], [1.0; 3]]);
        assert!((error(&pictures).error - (7.0_f64 / 12.0).sqrt() / 2.0).abs() < 1e-12);
        let black = std::array::from_fn::<_, 4, _>(|_| picture(&[0.0]));
        assert_eq!(error(&black).error, 0.0);
    }

    /// In each pixel one replicate of four has 1, the others 0: a variance of 1/4, doubled by another such pixel. With H rare
    /// hits the relative uncertainty of the variance is that of their number, 1 / sqrt(H), and that of the error half.
    #[test]
    fn rare_hits_count_as_what_they_are() {
        for hits in [1, 4, 25] {
            let pictures = [0, 1, 2, 3].map(|replicate| {
                let lit = |pixel: usize| f32::from(u8::from(pixel < hits && pixel % 4 == replicate));
                picture(&(0..40).map(lit).collect::<Vec<_>>())
            });
            let expected = 0.5 / (hits as f64).sqrt();
            assert!((error(&pictures).uncertainty - expected).abs() < 1e-12, "{hits}");
        }
    }

    /// Sums of 12 uniform numbers are nearly normal: with K pixels and R replicates the variance has K (R - 1) degrees of
    /// freedom.
    #[test]
    fn normal_noise_has_as_many_degrees_of_freedom_as_pixels_and_replicates() {
        for (pixels, replicates) in [(4000, 4), (500, 16)] {
            let noise = |r: usize, p: usize| -> f32 {
                let uniform = |k: usize| mix((12 * (4000 * r + p) + k) as u32) as f32 / u32::MAX as f32;
                (0..12).map(uniform).sum()
            };
            let of = |r: usize| picture(&(0..pixels).map(|p| noise(r, p)).collect::<Vec<_>>());
            let pictures: Vec<_> = (0..replicates).map(of).collect();
            let expected = (0.5 / (pixels * (replicates - 1)) as f64).sqrt();
            let seen = error(&pictures).uncertainty;
            assert!((seen / expected - 1.0).abs() < 0.1, "{seen} {expected}");
        }
    }

    /// For errors of any power law, and noise of many pixels or few: the goal is reached in few looks and rarely overshot by
    /// more than a tenth.
    #[test]
    fn every_power_law_is_followed_to_just_below_the_goal_in_few_looks() {
        for exponent in [0.9, 1.0, 1.3, 1.6] {
            for goal in [0.1, 0.01, 0.001] {
                for pixels in [2.0, 10.0, 10_000.0] {
                    let law = |work: Work| {
                        let count = work.replicates as f64;
                        let variance = 4.0 * f64::from(work.passes).powf(-exponent) / count;
                        Shown {
                            error: variance.sqrt(),
                            uncertainty: (0.5 / (pixels * (count - 1.0))).sqrt(),
                        }
                    };
                    let (mut work, mut looks) = (FIRST, 1);
                    while let Some(further) = next(goal, FIRST, work, law(work)) {
                        let more = further.samples() as f64 / work.samples() as f64;
                        assert!(more > 1.0 && more <= NEAR && further.passes.is_power_of_two());
                        (work, looks) = (further, looks + 1);
                    }
                    let Shown { error, uncertainty } = law(work);
                    let what = format!("n^-{exponent}, {goal}, {pixels} pixels: {error} +- {uncertainty} by {work:?}");
                    assert!(error <= goal && error > 0.87 * goal, "{what}");
                    assert!(
                        error * (1.0 + 2.0 * uncertainty) <= (1.0 + SLACK) * goal || work.replicates >= MOST,
                        "{what}"
                    );
                    let doublings = (work.samples() as f64 / 16.0).log2().ceil() as usize;
                    assert!(
                        looks <= doublings + 5,
                        "{looks} looks for {doublings} doublings, {what}"
                    );
                }
            }
        }
    }

    #[test]
    fn neighbouring_seeds_share_no_replicate() {
        let mut seen = std::collections::HashSet::new();
        for user in 0..100 {
            for replicate in 0..2 * MOST {
                assert!(seen.insert(seed(user, replicate)));
            }
        }
        assert_eq!(seed(7, 0), 7);
    }
}
