//! The spread of a setting over its seeds, by several weights of pixels.

use super::fit::{Curve, Spread};
use super::measure::Runs;
use super::statistics::{Figure, jackknife};
use super::truth::Truth;
use crate::study::error::RELMSE_FLOOR;

/// Weights of every value, each for one question.
#[derive(Clone, Debug)]
pub struct Weights {
    /// A weighted mean of squares is a relMSE.
    pub relmse: Vec<[f64; 3]>,
    /// No pixel drowns the others: none counts on the rims of visible lights, and elsewhere `1 / (r^2 + m^2)` with m the mean of
    /// the picture. relMSE itself gives a dark pixel that a bright edge touches ten thousand times the weight of its neighbours.
    pub calm: Vec<[f64; 3]>,
    /// A weighted mean of squares is the square of the error that `--target-error` means.
    pub error: Vec<[f64; 3]>,
}

impl Weights {
    /// For errors of pictures that converge to `truth`.
    pub fn new(truth: &Truth) -> Self {
        let mean = truth.mean.iter().flatten().sum::<f64>() / (3 * truth.mean.len()) as f64;
        let square = (mean * mean).max(f64::MIN_POSITIVE);
        let calm = |(r, rim): (&[f64; 3], &bool)| {
            if *rim {
                [0.0; 3]
            } else {
                r.map(|r| 1.0 / (r * r + square))
            }
        };
        Self {
            relmse: truth
                .mean
                .iter()
                .map(|r| r.map(|r| 1.0 / (r * r + RELMSE_FLOOR)))
                .collect(),
            calm: truth.mean.iter().zip(&truth.rims).map(calm).collect(),
            error: vec![[1.0 / square; 3]; truth.mean.len()],
        }
    }
}

/// The spread of a setting by several weights.
pub struct Curves {
    /// As relMSE weighs, of a typical pair of seeds.
    pub relmse: Curve,
    /// For slopes.
    pub calm: Curve,
    /// As `--target-error` weighs.
    pub error: Curve,
}

impl Curves {
    /// From the looks of all runs of a setting.
    pub fn new(runs: &Runs, weights: &Weights) -> Self {
        Self {
            relmse: typical(curve(runs, &weights.relmse)),
            calm: curve(runs, &weights.calm),
            error: curve(runs, &weights.error),
        }
    }

    /// How relMSE falls with samples.
    pub fn slope(&self, without: Option<usize>) -> f64 {
        self.calm.law(without).map_or(-1.0, |law| law.slope)
    }
}

/// The curve of a typical pair of seeds.
fn typical(curve: Curve) -> Curve {
    let points = curve.points.into_iter().map(|(n, spread)| (n, spread.typical()));
    Curve {
        points: points.collect(),
    }
}

fn curve(runs: &Runs, weights: &[[f64; 3]]) -> Curve {
    let looks = runs.first().map_or(0, |run| run.looks.len());
    let points = (0..looks).map(|look| {
        let pixels = |seed: usize| -> &[[f32; 3]] { &runs[seed].looks[look].pixels };
        let spread = Spread::new(runs.len(), |a, b| distance(pixels(a), pixels(b), weights));
        (runs[0].looks[look].spp, spread)
    });
    Curve {
        points: points.collect(),
    }
}

/// The weighted mean of squared differences.
pub fn distance(a: &[[f32; 3]], b: &[[f32; 3]], weights: &[[f64; 3]]) -> f64 {
    let mut sum = 0.0;
    for ((a, b), weights) in a.iter().zip(b).zip(weights) {
        for c in 0..3 {
            let difference = f64::from(a[c]) - f64::from(b[c]);
            sum += weights[c] * difference * difference;
        }
    }
    sum / (3 * a.len()) as f64
}

/// A variance with an interval that is even in logarithms: variances are skewed.
pub fn variance_figure(spread: &Spread) -> Figure {
    if spread.variance(None) > 0.0 {
        jackknife(spread.seeds(), |without| spread.variance(without).ln())
            .figure()
            .exp()
    } else {
        Figure::exact(0.0)
    }
}
