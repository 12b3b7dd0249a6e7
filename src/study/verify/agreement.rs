//! Pictures whose means must agree: between estimators, samplers, seeds and sample counts.

use super::blocks::Grid;
use super::means::{Estimate, Judgement, POWER};
use super::replicates::{Series, spread};
use super::row::{Evidence, Row, Verdict};
use super::tails::{Source, Tails};

/// Largest hidden share of a block that counts as well sampled. These blocks are tested together if the whole picture has no
/// power.
const CALM: f64 = 0.15;

/// Maximum number of tests per pair of series: the whole, its part with power, and the blocks.
pub const TESTS_OF_A_PAIR: usize = 3;

/// The common inputs of all rows.
#[derive(Clone, Copy, Debug)]
pub struct Judge<'a> {
    /// The cells.
    pub grid: &'a Grid,
    /// Light that samples may have missed.
    pub tails: &'a Tails,
    /// The false-alarm probability of each test.
    pub alpha: f64,
    /// Width of the film in pixels.
    pub width: u32,
}

/// Makes the rows of a family member once its false-alarm rate is known.
pub type Verdicts<'a> = Box<dyn Fn(&Judge<'_>) -> Vec<Row> + 'a>;

impl Judge<'_> {
    /// All values of some cells.
    fn family(&self, cells: impl Iterator<Item = usize>, estimate: impl Fn(usize, usize) -> Estimate) -> Judgement {
        let values = cells.flat_map(|cell| (0..3).map(move |channel| (cell, channel)));
        let estimates: Vec<Estimate> = values.map(|(cell, channel)| estimate(cell, channel)).collect();
        Judgement::new(&estimates, self.alpha)
    }

    /// The share that a series may have missed.
    pub fn hidden(&self, series: &Series, cell: usize) -> [f64; 3] {
        let source = Source::Renderer(series.estimator);
        self.tails.hidden(source, cell, series.passes(), self.alpha)
    }

    /// Blocks with a small hidden share. Only the oracle's probes choose them: the tested pictures have no influence.
    pub fn well_sampled(&self, hidden: impl Fn(usize) -> [f64; 3]) -> Vec<usize> {
        let well_sampled = |cell: &usize| {
            let (light, hidden) = (self.tails.light(*cell), hidden(*cell));
            light.iter().any(|&light| light > 0.0) && (0..3).all(|i| hidden[i] <= CALM * light[i])
        };
        (0..self.grid.blocks()).filter(well_sampled).collect()
    }

    /// The mean over cells, weighted by their pixels.
    pub fn mean(&self, cells: &[usize], of: impl Fn(usize) -> f64) -> f64 {
        let all: f64 = cells.iter().map(|&cell| self.grid.pixels(cell)).sum();
        cells.iter().map(|&cell| self.grid.pixels(cell) * of(cell)).sum::<f64>() / all.max(1.0)
    }

    /// Two estimators, with the same seeds.
    pub fn estimators(&self, a: &Series, b: &Series) -> Vec<Row> {
        let names = [a.estimator.name(), b.estimator.name()];
        self.pair("estimators", a, b, names)
    }

    /// Two samplers.
    pub fn samplers(&self, a: &Series, b: &Series) -> Vec<Row> {
        let names = [a.sampler.name(), b.sampler.name()];
        self.pair("samplers", a, b, names)
    }

    /// The whole, or the part for which both series have enough samples; then single blocks if these have power.
    fn pair(&self, check: &'static str, a: &Series, b: &Series, names: [&str; 2]) -> Vec<Row> {
        let hidden: Vec<[f64; 3]> = (0..self.grid.cells())
            .map(|cell| {
                let (a, b) = (self.hidden(a, cell), self.hidden(b, cell));
                std::array::from_fn(|i| a[i] + b[i])
            })
            .collect();
        // In the worst case, what is hidden in each cell is hidden in all.
        let over = |cells: &[usize], channel: usize| {
            let pairs = a.means.iter().zip(&b.means);
            let differences = pairs.map(|(a, b)| self.mean(cells, |cell| a[cell][channel] - b[cell][channel]));
            let (difference, variance) = spread(&differences.collect::<Vec<f64>>());
            Estimate {
                difference,
                variance,
                dof: a.count() as f64 - 1.0,
                hidden: self.mean(cells, |cell| hidden[cell][channel]),
                size: self.mean(cells, |cell| a.cell(cell, channel).0.max(b.cell(cell, channel).0)),
                light: self.mean(cells, |cell| self.tails.light(cell)[channel]),
            }
        };
        let row = |part: &str, family: &Judgement| {
            let compared = format!("{} and {}, {part}", names[0], names[1]);
            let mut row = Row::of_means(check, compared, family, self.alpha)
                .number("spp_a", f64::from(a.spp))
                .number("spp_b", f64::from(b.spp))
                .number("replicates", a.count() as f64);
            if !family.agrees() {
                row.evidence = Some(Evidence::of_series(a, b, self.width, names.map(str::to_owned)));
            }
            row
        };
        let whole = [self.grid.blocks()];
        let mut together = self.family(std::iter::once(0), |_, channel| over(&whole, channel));
        let mut part = "whole".to_owned();
        if together.agrees() && together.visible().is_some_and(|visible| visible > POWER) {
            let cells = self.well_sampled(|cell| hidden[cell]);
            if !cells.is_empty() {
                part = format!("{} of {} blocks", cells.len(), self.grid.blocks());
                together = self.family(std::iter::once(0), |_, channel| over(&cells, channel));
            }
        }
        let blocks = self.family(0..self.grid.blocks(), |cell, channel| over(&[cell], channel));
        let looks = if part == "whole" { 1.0 } else { 2.0 };
        let rows = [row(&part, &together).number("tests", looks), row("blocks", &blocks)];
        // Blocks without power add nothing if the whole has some; they do not make the pair untested.
        let told = rows[0].verdict == Verdict::Pass && rows[1].verdict == Verdict::NoPower;
        rows.into_iter().take(if told { 1 } else { 2 }).collect()
    }

    /// One half of the seeds against the other.
    pub fn seeds(&self, series: &Series) -> Row {
        let (first, second) = series.means.split_at(series.count() / 2);
        let cell = self.grid.blocks();
        let hidden = self.hidden(series, cell);
        let family = self.family(std::iter::once(cell), |cell, channel| {
            let of =
                |half: &[Vec<[f64; 3]>]| spread(&half.iter().map(|means| means[cell][channel]).collect::<Vec<f64>>());
            let ((a, va), (b, vb)) = (of(first), of(second));
            Estimate {
                difference: a - b,
                variance: va + vb,
                // Conservative: the smaller half alone if its spread dominates.
                dof: first.len() as f64 - 1.0,
                // Each half has half of the samples and may have missed twice as much.
                hidden: 4.0 * hidden[channel],
                size: a.max(b),
                light: self.tails.light(cell)[channel],
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

    /// The early look against the end of each replicate.
    pub fn spp(&self, series: &Series) -> Row {
        let cell = self.grid.blocks();
        let hidden = self.hidden(series, cell);
        let more = f64::from(series.spp) / f64::from(series.early_spp);
        let family = self.family(std::iter::once(cell), |cell, channel| {
            let pairs = series.means.iter().zip(&series.early);
            let differences = pairs.map(|(late, early)| late[cell][channel] - early[cell][channel]);
            let (difference, variance) = spread(&differences.collect::<Vec<f64>>());
            Estimate {
                difference,
                variance,
                dof: series.count() as f64 - 1.0,
                hidden: (1.0 + more) * hidden[channel],
                size: series.cell(cell, channel).0,
                light: self.tails.light(cell)[channel],
            }
        });
        let compared = format!("{}: {} and {}", series.estimator.name(), series.early_spp, series.spp);
        Row::of_means("samples a pixel", compared, &family, self.alpha)
    }
}
