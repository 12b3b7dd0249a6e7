//! Verification of a user's own scene.
//!
//! Three kinds of checks, by module: mistakes in the scene ([`sanity`], [`lights`]); pictures that must agree bit by bit
//! ([`exact`]); pictures that must agree in the mean ([`agreement`], [`oracle`]).
//!
//! # How means are compared
//!
//! Every picture is rendered at least 8 times with independent seeds. The standard error of a difference comes from the spread
//! of those replicates, so it makes no assumption about samples, which depend on each other in a low-discrepancy sequence.
//! Since it is estimated from R values, the quotient follows Student's t with R - 1 degrees of freedom, whose tails are far
//! wider than the normal ones ([`super::distributions`]). Estimators are compared replicate by replicate at the same seed,
//! which cancels the noise of their common camera rays. Silhouettes of visible lights are tested separately ([`silhouettes`]).
//! Every bound includes what all samples together may have missed ([`tails`]). All tests together raise a false alarm with
//! probability [`FALSE_ALARMS`] at most: they share it equally, and so do the values of a test ([`Family`]).
//!
//! A row whose bound exceeds half of the light reports `no power`: it found nothing wrong, but hardly could have. An estimator
//! that is too noisy for the whole picture is first tested on the blocks with a small hidden share together. Where everything
//! is black, any light is a difference.
//!
//! Measured on Veach's scene with 12 s: a density of `mis` wrong by 3 %, missing shadows, a dropped eighth lane and a missing
//! cosine in `brdf` each fail several rows; without a fault nothing fails.

pub mod agreement;
pub mod bench;
pub mod blocks;
pub mod error;
pub mod exact;
pub mod lights;
pub mod means;
pub mod oracle;
#[cfg(test)]
mod planted;
pub mod replicates;
pub mod row;
pub mod sanity;
pub mod schedule;
pub mod silhouettes;
pub mod tails;
pub mod ties;

use std::time::Instant;

pub use bench::Bench;
pub use error::VerifyError;
pub use row::{Evidence, Row, Verdict};

use crate::pipeline::Settings;
use crate::reference::probe::Probe;
use crate::run::Observer;
use crate::scene::{EstimatorKind, FilmSize, SamplerKind, Scene};
use crate::study::family::Family;
use agreement::{Judge, TESTS_OF_A_PAIR, Verdicts};
use blocks::Grid;
use oracle::Oracle;
use tails::Tails;

/// The probability that any row about means fails without a fault.
pub const FALSE_ALARMS: f64 = 1e-4;

/// Minimum number of probes per pixel.
const LEAST_PROBES: u64 = 16;
const MOST_PROBES: u64 = 1000;

/// Options of a verification.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    /// Seconds to spend.
    pub budget: f64,
    /// Threads.
    pub threads: usize,
    /// Common seed.
    pub seed: u32,
}

/// The result of a verification.
#[derive(Debug)]
pub struct Report {
    /// Row by row.
    pub rows: Vec<Row>,
    /// The film of the comparisons of means.
    pub film: FilmSize,
    /// Samples per pixel in each replicate of the best estimator; `brdf` gets 2 and `uniform` 4 times those of `mis`.
    pub spp: u32,
    /// Replicates.
    pub replicates: usize,
    /// Samples per pixel of the oracle.
    pub oracle_spp: u32,
    /// Probes per pixel.
    pub probes: u32,
    /// Renders.
    pub renders: u64,
    /// The version of Embree.
    pub embree_version: String,
    /// Seconds that it took.
    pub seconds: f64,
}

impl Report {
    /// Number of rows with a verdict.
    pub fn count(&self, verdict: Verdict) -> usize {
        self.rows.iter().filter(|row| row.verdict == verdict).count()
    }
}

/// Runs all checks that the scene and the budget allow.
///
/// # Errors
/// Where renders cannot start, or a stop was requested.
pub fn run(scene: &Scene, options: Options, watch: &dyn Observer) -> Result<Report, VerifyError> {
    let settings = Settings {
        film: scene.film(),
        estimator: EstimatorKind::Mis,
        sampler: SamplerKind::Sobol,
        seed: options.seed,
        threads: options.threads,
        ..Settings::default()
    };
    let mut bench = Bench::new(scene, settings, options.budget, watch);
    bench.announce("the scene")?;
    let mut rows = sanity::check(scene);
    let costs = bench.costs()?;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(options.threads).build()?;

    rows.extend(exact::check(&mut bench, &costs, 0.15 * options.budget)?);

    let film = bench.film(schedule::comparable_pixels(&costs, 0.5 * options.budget));
    let (left_out, ties) = pool.install(|| ties::pixels(scene, film, u64::from(options.seed)));
    let (grid, tails, probe_s) = probe(&bench, &pool, film, &left_out)?;
    rows.push(ties::row(scene, &grid, &ties));
    rows.push(lights::reach(scene, &tails.lights_nothing()));
    // The oracle traces as many rays as a probe. It gets a fifth of the budget.
    let oracle = Oracle::render(&bench, &pool, &grid, film, 0.2 * options.budget / probe_s)?;
    if grid.pixels(grid.blocks()) + grid.pixels(grid.silhouettes()) == 0.0 {
        rows.push(Row::pass("means", "no pixel").judged(
            Verdict::NoPower,
            "there is nothing to compare: every pixel depends on faces that lie in one another",
        ));
    }
    let (series, other) = schedule::replicate(&mut bench, &costs, film, &grid)?;

    bench.announce("the verdicts")?;
    let best = &series[series.len() - 1];
    let mut family: Family<Verdicts<'_>> = Family::new(FALSE_ALARMS);
    for (i, a) in series.iter().enumerate() {
        for b in &series[i + 1..] {
            family.add_several(TESTS_OF_A_PAIR, Box::new(move |judge| judge.estimators(a, b)));
        }
    }
    let oracle = &oracle;
    for (i, one) in series.iter().enumerate() {
        let last = i + 1 == series.len();
        let test = move |judge: &Judge<'_>| oracle.rows(judge, one, last);
        family.add_several(Oracle::tests(last), Box::new(test));
    }
    family.add_several(TESTS_OF_A_PAIR, Box::new(|judge| judge.samplers(best, &other)));
    family.add(Box::new(|judge| vec![judge.seeds(best)]));
    family.add(Box::new(|judge| vec![judge.spp(best)]));
    let (alpha, tests) = family.close();
    let judge = Judge {
        grid: &grid,
        tails: &tails,
        alpha,
        width: film.width,
    };
    rows.extend(tests.iter().flat_map(|test| test(&judge)));
    rows.push(invalid(&bench));
    Ok(Report {
        rows,
        film,
        spp: best.spp,
        replicates: best.count(),
        oracle_spp: oracle.spp,
        probes: tails.passes() as u32,
        renders: bench.renders,
        seconds: bench.elapsed(),
        embree_version: bench.embree_version,
    })
}

/// Probes for a twentieth of the budget, 16 passes at least. Also returns the seconds per pass.
fn probe(
    bench: &Bench<'_>,
    pool: &rayon::ThreadPool,
    film: FilmSize,
    left_out: &[bool],
) -> Result<(Grid, Tails, f64), VerifyError> {
    bench.announce("tails")?;
    let probe = Probe::new(bench.scene, film);
    let started = Instant::now();
    let seed = u64::from(bench.settings.seed);
    let pass = |number: u64| pool.install(|| probe.pass(seed << 16 | number));
    let first: Vec<_> = (0..LEAST_PROBES).map(pass).collect();
    let pass_s = (started.elapsed().as_secs_f64() / LEAST_PROBES as f64).max(1e-9);
    let grid = Grid::without(film, &silhouettes::find(bench.scene, &probe, film, &first), left_out);
    let mut tails = Tails::new(grid.clone(), &probe);
    first.iter().for_each(|found| tails.add(found));
    let mut number = LEAST_PROBES;
    while started.elapsed().as_secs_f64() < 0.05 * bench.budget() && number < MOST_PROBES {
        bench.announce("tails")?;
        tails.add(&pass(number));
        number += 1;
    }
    Ok((grid, tails, pass_s))
}

/// Rejected contributions, and invalid picture values.
fn invalid(bench: &Bench<'_>) -> Row {
    let thrown = bench.counters.invalid_nan + bench.counters.invalid_inf + bench.counters.invalid_negative;
    let count = thrown + bench.invalid.total();
    let row = Row::pass(
        "valid samples",
        format!("{:.0} million samples", bench.counters.samples as f64 * 1e-6),
    )
    .figures(format!("{count} invalid"), "0")
    .number("samples", bench.counters.samples as f64)
    .number("thrown_away", thrown as f64)
    .number("in_pictures", bench.invalid.total() as f64);
    if count == 0 {
        return row;
    }
    row.judged(
        Verdict::Fail,
        "samples are NaN, infinite or negative; they are left out, and the picture may be too dark",
    )
}
