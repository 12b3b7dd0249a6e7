//! Independently seeded replicates of a picture: they measure the noise of a mean without assumptions.
//!
//! Samples of a low-discrepancy sequence are not independent, so their spread says little about the error of their mean.
//! Pictures of different seeds are independent.

use super::Bench;
use super::blocks::Grid;
use super::error::VerifyError;
use crate::film::Picture;
use crate::scene::{EstimatorKind, SamplerKind};
use crate::study::estimate::Estimate;

/// Replicates of one kind.
#[derive(Clone, Debug)]
pub struct Series {
    /// The estimator.
    pub estimator: EstimatorKind,
    /// The sampler.
    pub sampler: SamplerKind,
    /// Passes of each replicate.
    pub spp: u32,
    /// Passes at the early look.
    pub early_spp: u32,
    /// Means of the cells, replicate by replicate.
    pub means: Vec<Vec<[f64; 3]>>,
    /// The same at the early look.
    pub early: Vec<Vec<[f64; 3]>>,
    /// Sums over replicates of each value and of its square, per pixel.
    sums: Vec<[[f64; 2]; 3]>,
}

impl Series {
    /// An empty series.
    pub fn new(estimator: EstimatorKind, sampler: SamplerKind, spp: u32) -> Self {
        // A power of two up to a quarter of `spp`: blocks of passes end there.
        let early_spp = 1 << (spp / 4).max(1).ilog2();
        Self {
            estimator,
            sampler,
            spp,
            early_spp,
            means: Vec::new(),
            early: Vec::new(),
            sums: Vec::new(),
        }
    }

    /// Renders one more replicate.
    ///
    /// # Errors
    /// Where the render cannot start, or a stop was requested.
    pub fn render(&mut self, bench: &mut Bench<'_>, grid: &Grid, seed: u32) -> Result<(), VerifyError> {
        let settings = crate::pipeline::Settings {
            estimator: self.estimator,
            sampler: self.sampler,
            seed,
            ..bench.settings
        };
        let looks = bench.render(settings, &[self.early_spp, self.spp])?;
        if let [early, last] = &looks[..] {
            self.take(grid, early, last);
        }
        Ok(())
    }

    /// Adds a replicate rendered elsewhere: its pictures at the early look and at the end.
    pub fn take(&mut self, grid: &Grid, early: &Picture, last: &Picture) {
        self.early.push(grid.means(&early.pixels));
        self.add(grid, last);
    }

    fn add(&mut self, grid: &Grid, picture: &Picture) {
        self.means.push(grid.means(&picture.pixels));
        self.sums.resize(picture.pixels.len(), [[0.0; 2]; 3]);
        for (sums, pixel) in self.sums.iter_mut().zip(&picture.pixels) {
            for (sum, &value) in sums.iter_mut().zip(pixel) {
                let value = f64::from(value);
                sum[0] += value;
                sum[1] += value * value;
            }
        }
    }

    /// Number of replicates.
    pub fn count(&self) -> usize {
        self.means.len()
    }

    /// Samples per pixel in all replicates together.
    pub fn passes(&self) -> f64 {
        self.count() as f64 * f64::from(self.spp)
    }

    /// The mean picture and the variance of that mean, from the spread of the replicates.
    pub fn picture(&self) -> Vec<[(f64, f64); 3]> {
        let n = self.count() as f64;
        let of = |[sum, squares]: [f64; 2]| {
            let mean = sum / n;
            (mean, ((squares / n - mean * mean) / (n - 1.0).max(1.0)).max(0.0))
        };
        self.sums.iter().map(|sums| sums.map(of)).collect()
    }

    /// The mean of a cell and the variance of that mean.
    pub fn cell(&self, cell: usize, channel: usize) -> (f64, f64) {
        spread(
            &self
                .means
                .iter()
                .map(|means| means[cell][channel])
                .collect::<Vec<f64>>(),
        )
    }
}

/// The mean of independent values and the variance of that mean.
pub fn spread(values: &[f64]) -> (f64, f64) {
    let estimate = Estimate::of(values);
    (estimate.mean, estimate.variance)
}
