//! The spread of a setting over its seeds, under several pixel weights.

use super::fit::{Curve, Spread};
use super::measure::Runs;
use super::statistics::{Figure, bootstrap};
use super::truth::Truth;

/// Two weights of every value.
#[derive(Clone, Debug)]
pub struct Weights {
    /// A weighted mean of squares under these weights is the relative mean squared error of a study. Silhouette pixels of
    /// visible lights get 0, all others `1 / (s^2 + m^2)`, with s^2 the mean of r^2 over the pixel and its neighbours and m the
    /// mean of the picture. The usual relMSE weighs a dark pixel touched by a bright edge ten thousand times as much as its
    /// neighbours. Without averaging over neighbours, 50 pixels beside the reflections of the smallest light would dominate the
    /// noise of Veach's scene; with it, 700 do.
    pub well_sampled: Vec<[f64; 3]>,
    /// A weighted mean of squares is the square of the error that `--target-error` means.
    pub error: Vec<[f64; 3]>,
}

impl Weights {
    /// Weights for errors of pictures that converge to `truth`.
    pub fn new(truth: &Truth) -> Self {
        let mean = truth.mean.iter().flatten().sum::<f64>() / (3 * truth.mean.len()) as f64;
        let square = (mean * mean).max(f64::MIN_POSITIVE);
        let near = around(truth);
        let well_sampled = |(near, rim): (&[f64; 3], &bool)| {
            if *rim {
                [0.0; 3]
            } else {
                near.map(|near| 1.0 / (near + square))
            }
        };
        Self {
            well_sampled: near.iter().zip(&truth.silhouettes).map(well_sampled).collect(),
            error: vec![[1.0 / square; 3]; truth.mean.len()],
        }
    }
}

/// The mean square of each pixel and its neighbours.
fn around(truth: &Truth) -> Vec<[f64; 3]> {
    let (width, height) = (truth.film.width as usize, truth.film.height as usize);
    let reach = |at: usize, end: usize| at.saturating_sub(1)..(at + 2).min(end);
    let pixel = |i: usize| {
        let rows = reach(i / width, height);
        let pixels = rows.flat_map(|row| reach(i % width, width).map(move |column| truth.mean[row * width + column]));
        let (sum, count) = pixels.fold(([0.0; 3], 0.0), |(sum, count): ([f64; 3], f64), r| {
            (std::array::from_fn(|c| sum[c] + r[c] * r[c]), count + 1.0)
        });
        sum.map(|sum| sum / count)
    };
    (0..truth.mean.len()).map(pixel).collect()
}

/// The spread of a setting by several weights.
pub struct Curves {
    /// The relative mean squared error, without bias.
    pub well_sampled: Curve,
    /// As `--target-error` weighs.
    pub error: Curve,
}

impl Curves {
    /// The spread at every look of all runs of a setting.
    pub fn new(runs: &Runs, weights: &Weights) -> Self {
        Self {
            well_sampled: curve(runs, &weights.well_sampled),
            error: curve(runs, &weights.error),
        }
    }

    /// The slope for extrapolating to more samples, from the given seeds: see [`far`].
    pub fn slope(&self, drawn: &[usize]) -> f64 {
        self.well_sampled.law_of(drawn).map_or(-1.0, |law| far(law.slope))
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

/// Limits a slope for extrapolation. No variance falls slower than 1/n in the long run, not even with scrambled nets (Owen
/// 1997); a flatter fit means that rare samples came late.
pub fn far(slope: f64) -> f64 {
    slope.min(-1.0)
}

/// The weighted mean of squared differences.
pub fn distance(a: &[[f32; 3]], b: &[[f32; 3]], weights: &[[f64; 3]]) -> f64 {
    let differences = a.iter().zip(b);
    weighted(
        differences.map(|(a, b)| std::array::from_fn(|c| f64::from(a[c]) - f64::from(b[c]))),
        weights,
    )
}

/// The weighted mean of squares.
pub fn weighted(values: impl Iterator<Item = [f64; 3]>, weights: &[[f64; 3]]) -> f64 {
    let pixel = |(v, w): ([f64; 3], &[f64; 3])| w[0] * v[0] * v[0] + w[1] * v[1] * v[1] + w[2] * v[2] * v[2];
    values.zip(weights).map(pixel).sum::<f64>() / (3 * weights.len()) as f64
}

/// A variance with an interval that is symmetric in the logarithm, since variances are skewed.
pub fn variance_figure(spread: &Spread) -> Figure {
    if spread.variance() > 0.0 {
        bootstrap(spread.seeds(), |drawn| spread.variance_of(drawn).ln())
            .figure()
            .exp()
    } else {
        Figure::exact(0.0)
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::scene::{FilmSize, Scene};
    use crate::study::cost::truth;

    #[test]
    fn what_stands_beside_a_bright_pixel_weighs_as_little_as_it() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/tests/furnace-diffuse.toml");
        let scene = Scene::load(Path::new(path)).unwrap();
        let film = FilmSize { width: 5, height: 4 };
        let mut mean = vec![[0.0; 3]; 20];
        mean[6] = [6.0; 3]; // second row, second column
        let mut silhouettes = vec![false; 20];
        silhouettes[0] = true;
        let truth = Truth {
            mean,
            silhouettes,
            ..truth::find(&scene, film, 2, None)
        };
        // m = 6 / 20; of 9 pixels in the middle, of 6 at the side one has 36.
        let weights = Weights::new(&truth).well_sampled;
        let expected = |near: f64| 1.0 / (near + 0.09);
        for (at, weight) in [
            (0, 0.0),
            (6, expected(4.0)),
            (5, expected(6.0)),
            (12, expected(4.0)),
            (13, expected(0.0)),
        ] {
            assert!((weights[at][1] - weight).abs() < 1e-12 * weight.max(1.0), "{at}");
        }
    }
}
