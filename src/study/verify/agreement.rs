//! Pictures that must agree in the mean: estimators with each other, samplers, seeds, numbers of samples.

use super::blocks::Grid;
use super::means::{Estimate, Family};
use super::replicates::{Series, spread};
use super::row::{Evidence, Row};
use super::tails::{Source, Tails};

/// What every row needs.
#[derive(Clone, Copy, Debug)]
pub struct Judge<'a> {
    /// The cells.
    pub grid: &'a Grid,
    /// What samples may have missed.
    pub tails: &'a Tails,
    /// The false-alarm rate of each row.
    pub alpha: f64,
    /// Pixels in a row of the film.
    pub width: u32,
}

impl Judge<'_> {
    /// All cells of the whole picture, or all of its blocks.
    fn family(&self, whole: bool, estimate: impl Fn(usize, usize) -> Estimate) -> Family {
        let cells = if whole {
            self.grid.blocks()..self.grid.cells()
        } else {
            0..self.grid.blocks()
        };
        let estimates: Vec<Estimate> = cells
            .flat_map(|cell| (0..3).map(move |channel| (cell, channel)))
            .map(|(cell, channel)| estimate(cell, channel))
            .collect();
        Family::new(&estimates, self.alpha)
    }

    /// The part that a series may have missed.
    pub fn hidden(&self, series: &Series, cell: usize, seen: bool) -> [f64; 3] {
        let source = Source::Renderer(series.estimator);
        self.tails.hidden(source, cell, series.passes(), self.alpha, seen)
    }

    /// Two estimators: replicates of the same seed share their eye rays, whose noise cancels in the difference.
    pub fn estimators(&self, a: &Series, b: &Series) -> [Row; 2] {
        let names = [a.estimator.name(), b.estimator.name()];
        self.pair("estimators", a, b, names, false)
    }

    /// Two samplers: nothing is shared.
    pub fn samplers(&self, a: &Series, b: &Series) -> [Row; 2] {
        let names = [a.sampler.name(), b.sampler.name()];
        self.pair("samplers", a, b, names, true)
    }

    fn pair(&self, check: &'static str, a: &Series, b: &Series, names: [&str; 2], seen: bool) -> [Row; 2] {
        let hidden: Vec<[f64; 3]> = (0..self.grid.cells())
            .map(|cell| {
                let (a, b) = (self.hidden(a, cell, seen), self.hidden(b, cell, seen));
                std::array::from_fn(|i| a[i] + b[i])
            })
            .collect();
        let estimate = |cell: usize, channel: usize| {
            let pairs = a.means.iter().zip(&b.means);
            let (difference, variance) = spread(pairs.map(|(a, b)| a[cell][channel] - b[cell][channel]));
            Estimate {
                difference,
                variance,
                dof: a.count() as f64 - 1.0,
                hidden: hidden[cell][channel],
                size: a.cell(cell, channel).0.max(b.cell(cell, channel).0),
                light: self.tails.reflected(cell)[channel],
            }
        };
        [(true, "whole"), (false, "blocks")].map(|(whole, part)| {
            let family = self.family(whole, estimate);
            let compared = format!("{} and {}, {part}", names[0], names[1]);
            let mut row = Row::of_means(check, compared, &family, self.alpha);
            if !family.agrees() {
                row.evidence = Some(Evidence::of_series(a, b, self.width, names.map(str::to_owned)));
            }
            row
        })
    }

    /// One half of the seeds against the other.
    pub fn seeds(&self, series: &Series) -> Row {
        let (first, second) = series.means.split_at(series.count() / 2);
        let cell = self.grid.blocks();
        let hidden = self.hidden(series, cell, true);
        let family = self.family(true, |cell, channel| {
            let of = |half: &[Vec<[f64; 3]>]| spread(half.iter().map(|means| means[cell][channel]));
            let ((a, va), (b, vb)) = (of(first), of(second));
            Estimate {
                difference: a - b,
                variance: va + vb,
                // The smaller half has to carry the test if its spread dominates.
                dof: first.len() as f64 - 1.0,
                // Each half has half of the samples and may miss twice as much.
                hidden: 4.0 * hidden[channel],
                size: a.max(b),
                light: self.tails.reflected(cell)[channel],
            }
        });
        let compared = format!(
            "{}: {} and {} of them",
            series.estimator.name(),
            first.len(),
            second.len()
        );
        Row::of_means("seeds", compared, &family, self.alpha)
    }

    /// The early look against the whole of each replicate.
    pub fn spp(&self, series: &Series) -> Row {
        let cell = self.grid.blocks();
        let hidden = self.hidden(series, cell, true);
        let more = f64::from(series.spp) / f64::from(series.early_spp);
        let family = self.family(true, |cell, channel| {
            let pairs = series.means.iter().zip(&series.early);
            let (difference, variance) = spread(pairs.map(|(late, early)| late[cell][channel] - early[cell][channel]));
            Estimate {
                difference,
                variance,
                dof: series.count() as f64 - 1.0,
                hidden: (1.0 + more) * hidden[channel],
                size: series.cell(cell, channel).0,
                light: self.tails.reflected(cell)[channel],
            }
        });
        let compared = format!("{}: {} and {}", series.estimator.name(), series.early_spp, series.spp);
        Row::of_means("samples a pixel", compared, &family, self.alpha)
    }
}
