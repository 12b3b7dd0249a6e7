//! What accuracy costs in time, measured on a scene.
//!
//! Every setting (the defaults, and each setting changed alone: [`settings`]) is rendered with at least 16 seeds, in rounds
//! ([`measure`]). Its *spread* over the seeds is the error that falls with time ([`fit`]); its *bias* is the error that stays
//! ([`bias`], measured against the independent oracle of [`truth`]). [`price`] combines the two.

pub mod bias;
pub mod curves;
mod expected;
pub mod fit;
pub mod measure;
pub mod phases;
pub mod price;
pub mod schedule;
pub mod settings;
pub mod statistics;
pub mod strip;
pub mod truth;
pub mod warnings;

use std::path::PathBuf;
use std::time::Instant;

use serde::Serialize;

use crate::pipeline::{Prepared, Settings, SetupError};
use crate::run::Observer;
use crate::scene::{FilmSize, Scene};
use crate::study::error::{Errors, NotFinite};
use measure::{Effort, Runs};
use phases::Phases;
use price::{Price, Verdict};
use schedule::TooSlow;
use settings::Variant;
use strip::Strip;
use truth::Truth;

/// Options of a study.
#[derive(Clone, Debug)]
pub struct Options {
    /// The defaults; every variant changes one of these settings.
    pub settings: Settings,
    /// Seconds to spend.
    pub budget: f64,
    /// Cache folder of references; `None` disables the cache.
    pub cache: Option<PathBuf>,
    /// Skips the pictures and phases.
    pub prices_only: bool,
}

/// Why a study failed.
#[derive(Debug, thiserror::Error)]
pub enum StudyError {
    /// A render cannot start.
    #[error(transparent)]
    Setup(#[from] SetupError),
    /// Threads for the oracle could not be started.
    #[error("cannot start the threads: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
    /// A stop was requested.
    #[error("stopped")]
    Stopped,
    /// A picture or a figure that the study depends on is NaN or infinite.
    #[error("{what}; this is a fault of Octolux, please report the scene")]
    NotFinite {
        /// What is wrong.
        what: String,
    },
    /// The picture is black, so no relative error is defined.
    #[error("the picture is black, so there is no error to speak of")]
    Black,
}

/// Accuracy of the reference.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Quality {
    /// Samples per pixel.
    pub spp: u32,
    /// Its own relative mean squared error, computed from its standard errors.
    pub relative_mse: f64,
    /// It was read from the cache.
    pub cached: bool,
}

/// One look at one run: one line of the CSV.
#[derive(Clone, Debug, Serialize)]
pub struct Line {
    /// The setting's name.
    pub setting: String,
    /// Its arguments.
    pub arguments: String,
    /// The seed.
    pub seed: u32,
    /// Samples per pixel.
    pub spp: u32,
    /// Seconds of rendering.
    pub seconds: f64,
    /// Distances from the reference, including its noise.
    #[serde(flatten)]
    pub errors: Distances,
    /// The bits are those of the defaults with the same seed.
    pub same_bits: bool,
}

/// Distances from the reference, each a mean over pixels and colours.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Distances {
    /// `sqrt(mean((x - r)^2))`
    pub rmse: f64,
    /// `mean((x - r)^2 / (r^2 + 1e-4))`
    pub relmse: f64,
    /// `mean(|x - r| / (|x| + |r|))`
    pub smape: f64,
    /// `mean(x)`
    pub mean: f64,
}

/// Settings that the scene does not allow, with the reason.
pub type Impossible = Vec<(String, String)>;

/// The results of a study.
#[derive(Clone, Debug, Serialize)]
pub struct Study {
    /// The film of the comparisons.
    pub film: [u32; 2],
    /// The scene's own film.
    pub scene_film: [u32; 2],
    /// Number of seeds per setting.
    pub seeds: usize,
    /// The first seed.
    pub seed: u32,
    /// The reference.
    pub reference: Quality,
    /// Costs by setting, the defaults first.
    pub prices: Vec<Price>,
    /// Settings that the scene does not allow, with the reason.
    pub impossible: Impossible,
    /// Settings that were not measured because the budget is too short for them.
    pub too_slow: Vec<TooSlow>,
    /// Estimators at equal time.
    pub strip: Strip,
    /// Timing of one render at the scene's own film size.
    pub phases: Phases,
    /// Reasons for less certainty.
    pub warnings: Vec<String>,
    /// Seconds that it took.
    pub seconds: f64,
    /// Every look at every run.
    #[serde(skip)]
    pub lines: Vec<Line>,
    /// The picture that errors are measured against.
    #[serde(skip)]
    pub truth: Truth,
}

/// Studies a scene.
///
/// # Errors
/// Where renders cannot start, the picture is black, or a stop was requested.
pub fn run(scene: &Scene, options: &Options, watch: &dyn Observer) -> Result<Study, StudyError> {
    let started = Instant::now();
    let budget = options.budget;
    let say = |what: &str| {
        watch.doing((started.elapsed().as_secs_f64() / budget).min(1.0), what);
        if watch.stopped() {
            Err(StudyError::Stopped)
        } else {
            Ok(())
        }
    };
    say("what the settings cost")?;
    let (mut variants, impossible) = possible(scene, options.settings)?;
    let mut costs = schedule::costs(scene, &variants, scene.film(), 0.08 * budget, watch)?;
    let too_slow = schedule::leave_out(&mut variants, &mut costs, scene.film(), budget);
    let effort = schedule::effort(
        &costs,
        scene.film(),
        schedule::FOR_ROUNDS * budget,
        options.settings.seed,
    );
    say("the reference")?;
    let truth = reference(scene, &effort, options)?;
    say("the rounds")?;
    let mut last = Instant::now();
    let more = |rounds: usize| {
        let (spent, round) = (started.elapsed().as_secs_f64(), last.elapsed().as_secs_f64());
        last = Instant::now();
        watch.doing((spent / budget).min(1.0), "the rounds");
        // The first callback comes after several rounds.
        let round = if rounds == effort.rounds {
            round / rounds as f64
        } else {
            round
        };
        rounds < schedule::MOST_ROUNDS && spent + round < schedule::UNTIL_PRICES * budget
    };
    let all = measure::rounds(scene, &variants, &effort, watch, more)?;
    say("the prices")?;
    let analysed = || analyse(scene, &variants, &all, &effort, truth, price::FALSE_ALARMS);
    let mut study = threads(options)?.install(analysed)?;
    study.impossible = impossible;
    study.too_slow = too_slow;
    if !options.prices_only {
        say("the pictures")?;
        study.strip = strip::render(scene, &variants, &all, &effort, &study.truth, watch)?;
        say("the phases")?;
        let left = (budget - started.elapsed().as_secs_f64()).clamp(0.01 * budget, 0.1 * budget);
        let whole = Settings {
            film: scene.film(),
            ..options.settings
        };
        study.phases = phases::measure(scene, whole, left, watch)?;
    }
    say("the page")?;
    study.seconds = started.elapsed().as_secs_f64();
    Ok(study)
}

/// The settings that the scene allows, the defaults first, and the others with the reason.
fn possible(scene: &Scene, settings: Settings) -> Result<(Vec<Variant>, Impossible), SetupError> {
    let tiny = FilmSize { width: 1, height: 1 };
    let starts = |settings: Settings| {
        let small = Settings { film: tiny, ..settings };
        Prepared::new(scene, small)
    };
    let first = starts(settings)?;
    let (mut variants, mut impossible) = (Vec::new(), Vec::new());
    let emitters = first.features().emitters;
    for variant in settings::variants(
        settings,
        (first.accel(), first.lanes()),
        first.cull().is_some(),
        emitters,
    ) {
        match starts(variant.choice.settings) {
            Ok(_) => variants.push(variant),
            Err(error @ SetupError::Unsupported { .. }) => impossible.push((variant.label(), error.to_string())),
            Err(error) => return Err(error),
        }
    }
    Ok((variants, impossible))
}

/// A thread pool for work that does not render.
fn threads(options: &Options) -> Result<rayon::ThreadPool, rayon::ThreadPoolBuildError> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(options.settings.threads)
        .build()
}

fn reference(scene: &Scene, effort: &Effort, options: &Options) -> Result<Truth, StudyError> {
    threads(options)?.install(|| {
        let few = 4;
        let started = Instant::now();
        truth::find(scene, effort.film, few, None);
        let sample = (started.elapsed().as_secs_f64() / f64::from(few)).max(1e-9);
        let spp = (schedule::FOR_REFERENCE * options.budget / sample).clamp(16.0, 65_536.0);
        let truth = truth::find(scene, effort.film, spp as u32, options.cache.as_deref());
        finite("the reference", &truth.mean, truth.film.width)?;
        finite("the reference's standard errors", &truth.stderr, truth.film.width)?;
        let lit = truth.mean.iter().flatten().any(|&x| x > 0.0);
        if lit { Ok(truth) } else { Err(StudyError::Black) }
    })
}

/// Refuses a picture in which a value is NaN or infinite.
fn finite<T: Copy + Into<f64>>(whose: &str, pixels: &[[T; 3]], width: u32) -> Result<(), StudyError> {
    NotFinite::find(pixels, width).map_or(Ok(()), |wrong| {
        let what = format!("{whose} cannot be used: {wrong}");
        Err(StudyError::NotFinite { what })
    })
}

/// Computes costs from measurements; `false_alarms` as for [`price::prices`].
///
/// # Errors
/// [`StudyError::Stopped`] with fewer than two rounds, [`StudyError::NotFinite`] where a picture or a figure is NaN or
/// infinite.
pub fn analyse(
    scene: &Scene,
    variants: &[Variant],
    all: &[Runs],
    effort: &Effort,
    truth: Truth,
    false_alarms: f64,
) -> Result<Study, StudyError> {
    if all.iter().any(|runs| runs.len() < 2) {
        return Err(StudyError::Stopped);
    }
    for (variant, runs) in variants.iter().zip(all) {
        for look in runs.iter().flat_map(|run| &run.looks) {
            finite(
                &format!("a picture by {}", variant.label()),
                &look.pixels,
                truth.film.width,
            )?;
        }
    }
    let prices = price::prices(variants, all, &truth, false_alarms);
    if let Some((label, figure)) = prices.iter().find_map(|p| Some((&p.label, p.not_a_number()?))) {
        let what = format!("the {figure} of {label} is no number");
        return Err(StudyError::NotFinite { what });
    }
    Ok(Study {
        film: [effort.film.width, effort.film.height],
        scene_film: [scene.film().width, scene.film().height],
        seeds: all[0].len(),
        seed: effort.seed,
        reference: Quality {
            spp: truth.spp,
            relative_mse: curves::weighted(truth.stderr.iter().copied(), &curves::Weights::new(&truth).well_sampled),
            cached: truth.cached,
        },
        lines: lines(variants, all, &truth),
        prices,
        impossible: Vec::new(),
        too_slow: Vec::new(),
        strip: Strip::default(),
        phases: Phases::default(),
        warnings: Vec::new(),
        seconds: 0.0,
        truth,
    })
}

fn lines(variants: &[Variant], all: &[Runs], truth: &Truth) -> Vec<Line> {
    let mut lines = Vec::new();
    for (variant, runs) in variants.iter().zip(all) {
        for run in runs {
            for look in &run.looks {
                let errors = Errors::between(&look.pixels, &truth.mean);
                lines.push(Line {
                    setting: variant.label(),
                    arguments: variant.arguments().trim().to_owned(),
                    seed: run.seed,
                    spp: look.spp,
                    seconds: look.seconds,
                    errors: Distances {
                        rmse: errors.rmse,
                        relmse: errors.relmse,
                        smape: errors.smape,
                        mean: errors.mean,
                    },
                    same_bits: run.same_bits,
                });
            }
        }
    }
    lines
}

impl Study {
    /// The fastest unbiased setting for a `--target-error`; the defaults if all are biased.
    pub fn cheapest(&self, error: f64) -> &Price {
        self.first_by(|price| price.seconds_for_error(error))
    }

    /// The same for a relative mean squared error.
    pub fn cheapest_by_mse(&self, mse: f64) -> &Price {
        self.first_by(|price| price.seconds_for_mse(mse))
    }

    fn first_by(&self, seconds: impl Fn(&Price) -> f64) -> &Price {
        self.prices
            .iter()
            .filter(|price| price.verdict != Verdict::Harmful)
            .min_by(|a, b| seconds(a).total_cmp(&seconds(b)))
            .unwrap_or(&self.prices[0])
    }

    /// The arguments to add to `octolux render SCENE` for the cheapest way to an error.
    pub fn recommendation(&self, error: f64) -> String {
        let best = self.cheapest(error);
        if best.variant.choice.adaptive {
            let samples = best.by_error.map_or(1.0, |law| law.samples(error)).ceil();
            format!("{} --spp {samples}", best.arguments)
        } else {
            format!("{} --target-error {error}", best.arguments)
        }
    }
}
