//! Chooses the number and size of replicates that fit into the budget.

use std::time::Instant;

use super::bench::{Bench, Cost};
use super::blocks::Grid;
use super::error::VerifyError;
use super::replicates::Series;
use crate::scene::{EstimatorKind, FilmSize, SamplerKind};

/// Minimum number of replicates: fewer do not determine their own spread.
const LEAST_REPLICATES: usize = 8;

/// Planned number of replicates. More barely tighten the quantile; the time is better spent on samples.
const REPLICATES: usize = 16;

/// Maximum number of replicates.
const MOST_REPLICATES: usize = 64;

/// Target samples per pixel of a replicate when choosing the film size.
const SPP: f64 = 64.0;

/// Pixels for which the replicates get about `SPP` samples in so many seconds.
pub fn comparable_pixels(costs: &[Cost], seconds: f64) -> f64 {
    let (setup, sample) = of_round(costs);
    let round = (seconds / REPLICATES as f64 - setup).max(0.2 * seconds / REPLICATES as f64);
    (round / sample / SPP).clamp(256.0, 60_000.0)
}

/// Seconds of a round of replicates: setup, and a pass of one pixel. The last estimator runs twice, once with the other
/// sampler.
fn of_round(costs: &[Cost]) -> (f64, f64) {
    let all = costs.iter().chain(costs.last());
    all.fold((0.0, 1e-12), |(setup, sample), cost| {
        (
            setup + cost.setup_s,
            sample + f64::from(weight(cost.estimator)) * cost.sample_s,
        )
    })
}

/// Samples of an estimator relative to `mis`: estimators with one direction per point cost less and need more.
const fn weight(estimator: EstimatorKind) -> u32 {
    match estimator {
        EstimatorKind::Uniform => 4,
        EstimatorKind::Brdf => 2,
        EstimatorKind::Light
        | EstimatorKind::Mis
        | EstimatorKind::Mis2Balance
        | EstimatorKind::Mis2Power
        | EstimatorKind::Projected
        | EstimatorKind::Product => 1,
    }
}

/// A round whose time is off by more than this factor is repeated with other sample counts.
const SURPRISE: f64 = 1.4;

/// Replicates of every estimator with the same seeds, and of the last one with the other sampler, until the budget is spent; at
/// least 8 rounds.
///
/// # Errors
/// As [`Bench::render`].
pub fn replicate(
    bench: &mut Bench<'_>,
    costs: &[Cost],
    film: FilmSize,
    grid: &Grid,
) -> Result<(Vec<Series>, Series), VerifyError> {
    let pixels = f64::from(film.width) * f64::from(film.height);
    let (setup, sample) = of_round(costs);
    bench.settings.film = film;
    let planned = |bench: &Bench<'_>| bench.until(0.96).max(0.1 * bench.budget()) / REPLICATES as f64;
    let round = planned(bench);
    let spp = even(((round - setup).max(0.1 * round)) / (sample * pixels));
    let mut rounds = Rounds::new(costs, spp);
    let begun = bench.elapsed();
    rounds.render(bench, grid)?;
    let took = bench.elapsed() - begun;
    if took > SURPRISE * round || round > SURPRISE * took {
        // The machine's load has changed since the costs were measured.
        let better = even(f64::from(spp) * planned(bench) / took);
        if better != spp {
            rounds = Rounds::new(costs, better);
        }
    }
    let mut longest = 0.0_f64;
    while rounds.count() < LEAST_REPLICATES || (rounds.count() < MOST_REPLICATES && bench.until(0.99) > longest) {
        let started = Instant::now();
        rounds.render(bench, grid)?;
        // The longest of the last few rounds, as the load of the machine varies: an old one counts 20 % less each round.
        longest = started.elapsed().as_secs_f64().max(0.8 * longest);
    }
    Ok((rounds.series, rounds.other))
}

/// A sample count that suits low-discrepancy sequences.
fn even(spp: f64) -> u32 {
    let spp = spp.clamp(4.0, 65_536.0) as u32;
    if spp >= 32 { spp / 16 * 16 } else { spp / 2 * 2 }
}

/// All series, extended together.
struct Rounds {
    series: Vec<Series>,
    other: Series,
}

impl Rounds {
    fn new(costs: &[Cost], spp: u32) -> Self {
        let sobol = |cost: &Cost| Series::new(cost.estimator, SamplerKind::Sobol, spp * weight(cost.estimator));
        let best = costs.last().map_or(EstimatorKind::Mis, |cost| cost.estimator);
        Self {
            series: costs.iter().map(sobol).collect(),
            other: Series::new(best, SamplerKind::Independent, spp * weight(best)),
        }
    }

    fn count(&self) -> usize {
        self.other.count()
    }

    fn render(&mut self, bench: &mut Bench<'_>, grid: &Grid) -> Result<(), VerifyError> {
        // A large odd step, so that the seeds of other values of --seed differ.
        let number = self.count() as u32 + 1;
        let seed = bench.settings.seed.wrapping_add(number.wrapping_mul(0x9e37_79b1));
        for one in self.series.iter_mut().chain(Some(&mut self.other)) {
            bench.announce(&format!("means of {}, seed {number}", one.estimator.name()))?;
            one.render(bench, grid, seed)?;
        }
        Ok(())
    }
}
