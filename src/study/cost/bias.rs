//! Whether a setting's pictures converge to the right picture.
//!
//! Two figures. *Brightness* is the signed relative difference between the means of the picture and of the truth; a wrong
//! constant changes it most. *Hidden bias* is the root of the mean squared bias of a pixel; it also sees light in the wrong
//! place, but less sharply.
//! A variant is compared with the defaults seed by seed, which cancels shared noise. The defaults are compared with the oracle.
//! Every interval is widened by what rare samples may have missed ([`Tails`](crate::study::verify::tails)): an estimator that
//! never hit a small light looks noise-free and dark. Silhouette pixels of visible lights get weight 0, see
//! [`Truth::silhouettes`].

use super::measure::Runs;
use super::statistics::{Estimate, Figure, mean};
use super::truth::Truth;
use crate::scene::EstimatorKind;
use crate::study::verify::tails::Source;

/// Side of the blocks over which squared biases are summed. The number of blocks is the number of independent terms.
const BLOCK: usize = 16;

/// The two figures of one setting.
#[derive(Clone, Copy, Debug)]
pub struct Bias {
    /// Mean of the picture over the mean of the truth, less 1.
    pub brightness: Estimate,
    /// Weighted mean of the squared bias of a pixel. An unbiased estimate: may be below 0.
    pub squared: Estimate,
    /// Relative brightness that rare samples may have missed.
    pub hidden: f64,
}

impl Bias {
    /// No difference at all.
    pub const NONE: Self = {
        let none = Estimate {
            value: 0.0,
            stderr: 0.0,
            dof: 1.0,
        };
        Self {
            brightness: none,
            squared: none,
            hidden: 0.0,
        }
    };

    /// The brightness with its interval, including what rare samples may have missed.
    pub fn figure(&self) -> Figure {
        let figure = self.brightness.figure();
        Figure {
            low: figure.low - self.hidden,
            high: figure.high + self.hidden,
            ..figure
        }
    }

    /// Whether the bias is significant (probability `alpha` of error for each of the two figures) and above `size`. The hidden
    /// bias is tested only where almost nothing is hidden.
    pub fn is_real(&self, alpha: f64, size: f64) -> bool {
        let beyond = |estimate: Estimate| estimate.value > 0.0 && estimate.probability_of_zero() < alpha;
        let brightness = Estimate {
            value: self.brightness.value.abs() - self.hidden,
            ..self.brightness
        };
        let relevant = self.brightness.value.abs() > size && beyond(brightness);
        let misplaced = self.squared.value > size * size && self.hidden < CALM && beyond(self.squared);
        relevant || misplaced
    }
}

/// A hidden share below this is negligible.
const CALM: f64 = 1e-3;

/// The share of light that `passes` samples of each source may have missed, given the probability of a false alarm.
fn hidden(truth: &Truth, sources: [(Source, f64); 2], false_alarms: f64) -> f64 {
    let light: f64 = truth.tails.light(truth.whole).iter().sum();
    let missed = |(source, passes): (Source, f64)| -> f64 {
        let missed = truth.tails.hidden(source, truth.whole, passes, false_alarms);
        missed.iter().sum()
    };
    if light > 0.0 {
        sources.map(missed).iter().sum::<f64>() / light
    } else {
        0.0
    }
}

/// Samples per pixel of all runs together.
fn samples(runs: &Runs) -> f64 {
    runs.iter()
        .filter_map(|run| run.looks.last())
        .map(|look| f64::from(look.spp))
        .sum()
}

/// A variant against the defaults, at the last look of each, seed by seed. Each comes with its estimator.
pub fn of_variant(
    (runs, estimator): (&Runs, EstimatorKind),
    (defaults, default): (&Runs, EstimatorKind),
    weights: &[[f64; 3]],
    truth: &Truth,
    false_alarms: f64,
) -> Bias {
    if runs.iter().all(|run| run.same_bits) {
        return Bias::NONE;
    }
    let differences: Vec<Vec<[f64; 3]>> = runs
        .iter()
        .zip(defaults)
        .map(|(run, default)| {
            let (a, b) = (last(run), last(default));
            let minus = |(a, b): (&[f32; 3], &[f32; 3])| std::array::from_fn(|i| f64::from(a[i]) - f64::from(b[i]));
            a.iter().zip(b).map(minus).collect()
        })
        .collect();
    let scale = mean_of(&truth.mean, &truth.silhouettes).max(f64::MIN_POSITIVE);
    let brightness: Vec<f64> = differences
        .iter()
        .map(|d| mean_of(d, &truth.silhouettes) / scale)
        .collect();
    Bias {
        brightness: mean(&brightness),
        squared: squared(&differences, &vec![[0.0; 3]; weights.len()], weights),
        hidden: hidden(
            truth,
            [
                (Source::Renderer(estimator), samples(runs)),
                (Source::Renderer(default), samples(defaults)),
            ],
            false_alarms,
        ),
    }
}

/// The defaults against the oracle, whose own standard error counts too.
pub fn of_defaults(
    (runs, estimator): (&Runs, EstimatorKind),
    weights: &[[f64; 3]],
    truth: &Truth,
    false_alarms: f64,
) -> Bias {
    let differences: Vec<Vec<[f64; 3]>> = runs
        .iter()
        .map(|run| {
            let minus = |(a, r): (&[f32; 3], &[f64; 3])| std::array::from_fn(|i| f64::from(a[i]) - r[i]);
            last(run).iter().zip(&truth.mean).map(minus).collect()
        })
        .collect();
    let scale = mean_of(&truth.mean, &truth.silhouettes).max(f64::MIN_POSITIVE);
    let brightness: Vec<f64> = differences
        .iter()
        .map(|d| mean_of(d, &truth.silhouettes) / scale)
        .collect();
    let off_rims = truth.stderr.iter().zip(&truth.silhouettes).filter(|(_, rim)| !**rim);
    let values = 3.0 * off_rims.clone().count() as f64;
    // The channels of a pixel share samples, so their errors are correlated: add errors, not squares.
    let variance: f64 = off_rims.map(|(e, _)| e.iter().sum::<f64>().powi(2)).sum();
    let oracle = Estimate {
        value: 0.0,
        stderr: variance.sqrt() / values / scale,
        dof: f64::from(truth.spp.max(2) - 1),
    };
    let variances: Vec<[f64; 3]> = truth.stderr.iter().map(|e| e.map(|e| e * e)).collect();
    Bias {
        brightness: mean(&brightness).plus(oracle),
        squared: squared(&differences, &variances, weights),
        hidden: hidden(
            truth,
            [
                (Source::Renderer(estimator), samples(runs)),
                (Source::Oracle, f64::from(truth.spp)),
            ],
            false_alarms,
        ),
    }
}

fn last(run: &super::measure::Run) -> &[[f32; 3]] {
    run.looks.last().map_or(&[], |look| &look.pixels)
}

/// The mean of all pixels outside silhouettes.
fn mean_of(pixels: &[[f64; 3]], silhouettes: &[bool]) -> f64 {
    let off_rims = pixels.iter().zip(silhouettes).filter(|(_, rim)| !**rim);
    let (sum, count) = off_rims.fold((0.0, 0), |(sum, count), (p, _)| {
        (sum + p.iter().sum::<f64>(), count + 3)
    });
    sum / f64::from(count.max(1))
}

/// The weighted mean over pixels of the squared mean difference, minus the noise: the variance over seeds and the known
/// variance `further`. Blocks of pixels are independent because pixels use independent random numbers; the spread of blocks
/// gives the standard error.
fn squared(differences: &[Vec<[f64; 3]>], further: &[[f64; 3]], weights: &[[f64; 3]]) -> Estimate {
    let n = differences.len() as f64;
    let pixel = |p: usize| {
        let mut sum = 0.0;
        for c in 0..3 {
            let mean = differences.iter().map(|d| d[p][c]).sum::<f64>() / n;
            let squares: f64 = differences.iter().map(|d| (d[p][c] - mean).powi(2)).sum();
            sum += weights[p][c] * (mean * mean - squares / (n * (n - 1.0)) - further[p][c]);
        }
        sum / 3.0
    };
    let pixels: Vec<f64> = (0..weights.len()).map(pixel).collect();
    let blocks: Vec<f64> = pixels
        .chunks(BLOCK)
        .map(|block| block.iter().sum::<f64>() / block.len() as f64)
        .collect();
    if blocks.len() < 2 {
        return Estimate {
            value: blocks.first().copied().unwrap_or(0.0),
            stderr: f64::INFINITY,
            dof: 1.0,
        };
    }
    mean(&blocks)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::pipeline::Counters;
    use crate::study::cost::measure::{Look, Run};
    use crate::study::cost::truth;

    /// Runs whose pictures are `value(seed, pixel)` in every channel.
    fn runs(seeds: u32, pixels: usize, value: impl Fn(u32, usize) -> f32) -> Runs {
        let run = |seed| Run {
            seed,
            looks: vec![Look {
                spp: 1,
                seconds: 1.0,
                pixels: Arc::new((0..pixels).map(|p| [value(seed, p); 3]).collect()),
            }],
            counters: Counters::default(),
            same_bits: false,
        };
        (0..seeds).map(run).collect()
    }

    /// Every seed errs by +-e, half of them in each direction: the mean is right, and all squares are noise.
    #[test]
    fn brightness_is_signed_and_noise_is_no_bias() {
        let noise = |seed: u32, p: usize| {
            if (seed as usize + p).is_multiple_of(2) {
                0.25
            } else {
                -0.25
            }
        };
        let plain = runs(8, 320, |seed, p| 2.0 + noise(seed, p));
        let weights = vec![[0.25; 3]; 320];
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/tests/furnace-diffuse.toml");
        let scene = crate::scene::Scene::load(std::path::Path::new(path)).unwrap();
        let film = crate::scene::FilmSize { width: 20, height: 16 };
        let brighter = runs(8, 320, |seed, p| (2.0 + noise(seed, p)) * 1.01);
        let truth = Truth {
            mean: vec![[2.0; 3]; 320],
            stderr: vec![[0.1; 3]; 320],
            silhouettes: vec![false; 320],
            ..truth::find(&scene, film, 2, None)
        };
        let with = |runs| (runs, EstimatorKind::Mis);
        let bias = of_variant(with(&brighter), with(&plain), &weights, &truth, 1e-3);
        assert!((bias.brightness.value - 0.01).abs() < 1e-6, "{bias:?}");
        assert!((bias.squared.value - 1e-4).abs() < 1e-6, "{bias:?}");
        assert!(bias.brightness.probability_of_zero() < 1e-6);
        let right = of_defaults(with(&plain), &weights, &truth, 1e-3);
        assert_eq!(right.brightness.value, 0.0);
        // The oracle's standard error: 0.1 per pixel, 320 pixels, relative to 2.
        assert!((right.brightness.stderr - 0.05 / 320.0_f64.sqrt()).abs() < 1e-9);
        // Means are exact here, so only the subtracted noise remains: the spread 1/16 over 7, and 0.01, times 1/4.
        let expected = -0.25 * (0.0625 / 7.0 + 0.01);
        assert!((right.squared.value - expected).abs() < 1e-9, "{right:?}");
    }
}
