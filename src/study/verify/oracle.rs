//! The renderer against the independent oracle.

use super::agreement::Judge;
use super::bench::Bench;
use super::blocks::Grid;
use super::error::VerifyError;
use super::means::{Estimate, Judgement};
use super::replicates::{Series, spread};
use super::row::{Evidence, Row, Verdict};
use super::tails::Source;
use crate::reference;
use crate::scene::FilmSize;
use crate::study::distributions::{rms_bound, t_as_normal, t_quantile};
use crate::study::family::Family;

/// The oracle renders this many parts with different seeds, so that it can be stopped in between.
const PARTS: u32 = 4;

/// Blocks whose hidden share exceeds this part of their bound are too far from normal for the RMS.
const NEARLY_NORMAL: f64 = 0.2;

/// Tolerance factor of the RMS, for blocks with few samples that are not quite normal.
const ROOM: f64 = 1.05;

/// The oracle's picture.
#[derive(Clone, Debug)]
pub struct Oracle {
    /// Samples per pixel.
    pub spp: u32,
    /// Mean and its variance, pixel by pixel.
    pixels: Vec<[(f64, f64); 3]>,
    /// The same for the cells.
    cells: Vec<[(f64, f64); 3]>,
}

impl Oracle {
    /// Renders about `spp` samples per pixel.
    ///
    /// # Errors
    /// If a stop was requested.
    pub fn render(
        bench: &Bench<'_>,
        pool: &rayon::ThreadPool,
        grid: &Grid,
        film: FilmSize,
        spp: f64,
    ) -> Result<Self, VerifyError> {
        let each = (spp / f64::from(PARTS)).clamp(2.0, 1e6) as u32;
        let mut pixels = vec![[(0.0, 0.0); 3]; film.width as usize * film.height as usize];
        for part in 0..PARTS {
            bench.announce("the oracle")?;
            let seed = u64::from(bench.settings.seed) << 8 | u64::from(part);
            let result = pool.install(|| reference::render(bench.scene, film, each, seed, &|_| {}));
            for pixels in [&result.picture, &result.stderr] {
                VerifyError::unless_finite("the oracle's", pixels, film.width)?;
            }
            for (sum, (mean, stderr)) in pixels.iter_mut().zip(result.picture.iter().zip(&result.stderr)) {
                for channel in 0..3 {
                    sum[channel].0 += mean[channel] / f64::from(PARTS);
                    sum[channel].1 += (stderr[channel] / f64::from(PARTS)).powi(2);
                }
            }
        }
        let means = grid.sums(pixels.iter().map(|pixel| pixel.map(|(mean, _)| mean)));
        let variances = grid.sums(pixels.iter().map(|pixel| pixel.map(|(_, variance)| variance)));
        let cells = (0..grid.cells()).map(|cell| {
            let count = grid.pixels(cell).max(1.0);
            [0, 1, 2].map(|channel| (means[cell][channel] / count, variances[cell][channel] / (count * count)))
        });
        Ok(Self {
            spp: each * PARTS,
            cells: cells.collect(),
            pixels,
        })
    }

    /// Maximum number of tests in [`Self::rows`]: the whole and its part with power; three more for blocks.
    pub const fn tests(blocks: bool) -> usize {
        if blocks { 5 } else { 2 }
    }

    /// Tests the whole picture; with `blocks`, also the blocks, the RMS of their z-scores, and the silhouettes of lights.
    pub fn rows(&self, judge: &Judge<'_>, series: &Series, blocks: bool) -> Vec<Row> {
        let name = series.estimator.name();
        let (whole, silhouettes) = (judge.grid.blocks(), judge.grid.silhouettes());
        let row = |cells: &[Vec<usize>], part: &str| {
            let compared = format!("{name} and oracle, {part}");
            let estimates: Vec<Estimate> = cells
                .iter()
                .flat_map(|cells| self.estimates(judge, series, cells))
                .collect();
            let family = Judgement::new(&estimates, judge.alpha);
            let mut row = Row::of_means("oracle", compared, &family, judge.alpha);
            if !family.agrees() {
                row.evidence = Some(self.evidence(judge, series));
            }
            row
        };
        let mut rows = vec![row(&[vec![whole]], "whole")];
        if rows[0].verdict == Verdict::NoPower {
            let well_sampled = judge.well_sampled(|cell| self.hidden(judge, series, cell));
            if !well_sampled.is_empty() {
                let part = format!("{} of {whole} blocks", well_sampled.len());
                rows[0] = row(&[well_sampled], &part).number("tests", 2.0);
            }
        }
        if blocks {
            rows.push(row(&(0..whole).map(|block| vec![block]).collect::<Vec<_>>(), "blocks"));
            rows.push(self.rms(judge, series, format!("{name} and oracle, blocks")));
            if judge.grid.pixels(silhouettes) > 0.0 {
                rows.push(row(&[vec![silhouettes]], "lights' rims"));
            }
        }
        rows
    }

    fn evidence(&self, judge: &Judge<'_>, series: &Series) -> Evidence {
        let names = [series.estimator.name().to_owned(), "oracle".to_owned()];
        Evidence::of_measured(&series.picture(), &self.pixels, judge.width, names)
    }

    /// The share that both may have missed.
    fn hidden(&self, judge: &Judge<'_>, series: &Series, cell: usize) -> [f64; 3] {
        let renderer = judge.hidden(series, cell);
        let own = judge
            .tails
            .hidden(Source::Oracle, cell, f64::from(self.spp), judge.alpha);
        std::array::from_fn(|channel| renderer[channel] + own[channel])
    }

    /// The mean over cells in each channel.
    fn estimates(&self, judge: &Judge<'_>, series: &Series, cells: &[usize]) -> [Estimate; 3] {
        let hidden: Vec<[f64; 3]> = cells.iter().map(|&cell| self.hidden(judge, series, cell)).collect();
        let pixels: f64 = cells.iter().map(|&cell| judge.grid.pixels(cell)).sum();
        [0, 1, 2].map(|channel| {
            let replicates = series
                .means
                .iter()
                .map(|means| judge.mean(cells, |cell| means[cell][channel]));
            let (mean, variance) = spread(&replicates.collect::<Vec<f64>>());
            let oracle = judge.mean(cells, |cell| self.cells[cell][channel].0);
            let own = |&cell: &usize| (judge.grid.pixels(cell) / pixels.max(1.0)).powi(2) * self.cells[cell][channel].1;
            let all = variance + cells.iter().map(own).sum::<f64>();
            // Welch and Satterthwaite; the oracle's standard error comes from thousands of samples and counts as exact.
            let dof = (series.count() as f64 - 1.0) * (all / variance).powi(2);
            Estimate {
                difference: mean - oracle,
                variance: all,
                dof: if dof.is_nan() { 1e6 } else { dof.clamp(1.0, 1e6) },
                hidden: cells
                    .iter()
                    .zip(&hidden)
                    .map(|(&cell, hidden)| judge.grid.pixels(cell) / pixels.max(1.0) * hidden[channel])
                    .sum(),
                size: mean.max(oracle),
                light: judge.mean(cells, |cell| judge.tails.light(cell)[channel]),
            }
        })
    }

    /// One z-score per block, of the channel with the most light: channels share their samples.
    fn rms(&self, judge: &Judge<'_>, series: &Series, compared: String) -> Row {
        let whole = self.cells[judge.grid.blocks()].map(|(mean, _)| mean);
        let brightest = |a: &usize, b: &usize| whole[*a].total_cmp(&whole[*b]);
        let channel = (0..3).max_by(brightest).unwrap_or(1);
        let (each, _) = Family::of(judge.alpha, 0..judge.grid.blocks()).close();
        let scores: Vec<f64> = (0..judge.grid.blocks())
            .map(|cell| self.estimates(judge, series, &[cell])[channel])
            .filter(|estimate| estimate.variance > 0.0 && estimate.light > 0.0)
            .filter(|estimate| {
                let noise = t_quantile(each, estimate.dof) * estimate.variance.sqrt();
                estimate.hidden < NEARLY_NORMAL * (noise + estimate.hidden)
            })
            .map(|estimate| t_as_normal(estimate.difference / estimate.variance.sqrt(), estimate.dof))
            .collect();
        let count = scores.len() as f64;
        let row = Row::pass("oracle z", compared)
            .number("blocks", count)
            .number("tests", 1.0)
            .number("false_alarm_rate", judge.alpha);
        if scores.len() < 4 {
            return row.figures(format!("{count} blocks"), "").judged(
                Verdict::NoPower,
                "too few blocks have enough samples for a z-score: give it a larger --budget",
            );
        }
        let rms = (scores.iter().map(|z| z * z).sum::<f64>() / count).sqrt();
        let bound = ROOM * rms_bound(judge.alpha, scores.len());
        let row = row.figures(format!("rms {rms:.3} of {count}"), format!("{bound:.3}"));
        let row = row.number("rms", rms).number("rms_bound", bound);
        if rms <= bound {
            return row;
        }
        let mut row = row.judged(
            Verdict::Fail,
            "the blocks scatter around the oracle by more than their noise",
        );
        row.evidence = Some(self.evidence(judge, series));
        row
    }
}
