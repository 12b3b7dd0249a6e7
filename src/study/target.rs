//! Rendering until an error is reached: `octolux render --target-error E`.
//!
//! The error is the root of the mean variance of the pixels' means, over the mean of the picture: `sqrt(mean(Var)) / mean`.
//!
//! # How it is known
//!
//! Samples of one low-discrepancy sequence depend on each other, so their spread says nothing of the error of their mean. So
//! [`REPLICATES`] pictures are rendered side by side, each with a seed of its own, and the picture is their mean. They are
//! independent whatever the sampler, hence the variance of the mean is that of the replicates over their number, without any
//! assumption, averaged over all pixels with three degrees of freedom each. Where a few pixels carry most of the noise, as at the
//! rims of small visible lights, it is as uncertain as they are.
//!
//! # What it costs
//!
//! With `independent` nothing. A Sobol sequence of n points split into R parts gives up what its slope p gains over 1: the
//! variance is R^(p-1) times that of one sequence, 1.5 times at p = 1.3.
//!
//! # Stopping
//!
//! A rule that stops when an estimate falls below a goal prefers estimates that are too low. The estimate is looked at few
//! times (at 4, 8, 16, ... passes, and where the goal is foretold), and where many pixels make the noise a single one has next to
//! no say in the mean over all of them. Noise that no sample has met yet cannot be known: there are 16 samples a pixel at least.
//! `docs/study/target-error.py` measures what comes of it.

use crate::film::Picture;
use crate::sampling::hash::mix;

/// Pictures side by side.
pub const REPLICATES: usize = 4;

/// Passes of each replicate at the first look.
pub const FIRST_LOOK: u32 = 4;

/// The seed of a replicate. The first has the user's; the others have nothing to do with it, so that renders of neighbouring
/// seeds share no replicate.
pub fn seed(seed: u32, replicate: usize) -> u32 {
    if replicate == 0 {
        seed
    } else {
        // An odd constant keeps the replicates of a seed apart, the mixing those of its neighbours.
        mix(mix(seed).wrapping_add((replicate as u32).wrapping_mul(0x9e37_79b9)))
    }
}

/// The mean of independent pictures.
///
/// # Panics
/// Without pictures, or if their sizes differ.
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

/// The error of the mean of independent pictures, from their spread; 0 in a black picture.
pub fn error(pictures: &[Picture]) -> f64 {
    let count = pictures.len() as f64;
    let values = 3 * pictures[0].pixels.len();
    let (mut total, mut variance) = (0.0, 0.0);
    for p in 0..pictures[0].pixels.len() {
        for c in 0..3 {
            let of = |picture: &Picture| f64::from(picture.pixels[p][c]);
            let mean = pictures.iter().map(of).sum::<f64>() / count;
            let squares: f64 = pictures.iter().map(|picture| (of(picture) - mean).powi(2)).sum();
            total += mean;
            variance += squares / (count - 1.0) / mutate!(count, ErrorOfOneReplicate => 1.0);
        }
    }
    if total > 0.0 {
        (variance / values as f64).sqrt() / (total / values as f64)
    } else {
        0.0
    }
}

/// On the way to an error.
#[derive(Clone, Copy, Debug)]
pub struct Approach {
    goal: f64,
    before: Option<(f64, f64)>,
}

impl Approach {
    /// At the start.
    pub fn new(goal: f64) -> Self {
        Self { goal, before: None }
    }

    /// Where to look next, after `passes` passes showed `error`; `None` once the goal is reached. Also the passes at which it is
    /// expected to be.
    ///
    /// The passes double while the goal is far. From there the exponent of the last doubling foretells them.
    pub fn next(&mut self, passes: u32, error: f64) -> Option<(u32, u32)> {
        if error <= self.goal {
            return None;
        }
        let n = f64::from(passes);
        // Of the variance: 1 for independent samples; noise must not make it absurd.
        let exponent = match self.before {
            Some((m, e)) if n >= 1.5 * m => (2.0 * (e / error).ln() / (n / m).ln()).clamp(0.8, 2.0),
            _ => 1.0,
        };
        if self.before.is_none_or(|(m, _)| n >= 1.5 * m) {
            self.before = Some((n, error));
        }
        let expected = n * (error / self.goal).powf(2.0 / exponent);
        // One part in 32 at least, or noise could ask for look upon look.
        let least = n + (n / 32.0).ceil();
        let next = expected.ceil().clamp(least, 2.0 * n.max(1.0));
        Some((next as u32, expected.min(f64::from(u32::MAX)) as u32))
    }
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
        // Pixel 0: 1 2 3 6 has a variance of 14/3, its mean 7/6; pixel 1 has none. Mean over both 7/12, of the picture 2.
        let pictures = [1.0, 2.0, 3.0, 6.0].map(|v| picture(&[v, 1.0]));
        assert_eq!(mean(&pictures).pixels, [[3.0; 3], [1.0; 3]]);
        assert!((error(&pictures) - (7.0_f64 / 12.0).sqrt() / 2.0).abs() < 1e-12);
        assert_eq!(error(&[picture(&[0.0]), picture(&[0.0])]), 0.0);
    }

    #[test]
    fn every_power_law_is_followed_to_just_below_the_goal_in_few_looks() {
        for exponent in [0.9, 1.0, 1.3, 1.6] {
            for goal in [0.3, 0.01, 0.001] {
                let mut approach = Approach::new(goal);
                let law = |n: u32| 2.0 * f64::from(n).powf(-exponent / 2.0);
                let (mut passes, mut looks) = (FIRST_LOOK, 1);
                while let Some((next, _)) = approach.next(passes, law(passes)) {
                    assert!(next > passes && next <= 2 * passes);
                    (passes, looks) = (next, looks + 1);
                }
                assert!(
                    law(passes) <= goal && law(passes) > 0.88 * goal,
                    "{exponent} {goal}: {passes}"
                );
                let doublings = (f64::from(passes) / 4.0).log2().ceil() as usize;
                assert!(looks <= doublings + 4, "{looks} looks for {doublings} doublings");
            }
        }
    }

    #[test]
    fn neighbouring_seeds_share_no_replicate() {
        let mut seen = std::collections::HashSet::new();
        for user in 0..100 {
            for replicate in 0..REPLICATES {
                assert!(seen.insert(seed(user, replicate)));
            }
        }
        assert_eq!(seed(7, 0), 7);
    }
}
