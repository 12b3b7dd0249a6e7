//! Renders for the checks: counted, timed and interruptible.

use std::time::Instant;

use crate::film::Picture;
use crate::pipeline::{Counters, Prepared, Settings};
use crate::run::Observer;
use crate::scene::{Effects, EstimatorKind, FilmSize, SamplerKind, Scene};
use crate::study::error::Invalid;

use super::blocks::shrink;
use super::error::VerifyError;

/// The cost of a render.
#[derive(Clone, Copy, Debug)]
pub struct Cost {
    /// The estimator.
    pub estimator: EstimatorKind,
    /// Seconds before the first pass.
    pub setup_s: f64,
    /// Seconds per pass of one pixel.
    pub sample_s: f64,
}

/// The scene under test and its renders.
pub struct Bench<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// Settings of all renders unless a check changes them.
    pub settings: Settings,
    /// Ray counts of all renders.
    pub counters: Counters,
    /// Invalid picture values.
    pub invalid: Invalid,
    /// Renders so far.
    pub renders: u64,
    /// The version of Embree.
    pub embree_version: String,
    watch: &'a dyn Observer,
    started: Instant,
    budget: f64,
    /// The last prepared scene with the effects that were forced on, reused because replicates differ only in the seed.
    last: Option<(Effects, Prepared)>,
}

impl<'a> Bench<'a> {
    /// Starts the clock.
    pub fn new(scene: &'a Scene, settings: Settings, budget: f64, watch: &'a dyn Observer) -> Self {
        Self {
            scene,
            settings,
            counters: Counters::default(),
            invalid: Invalid::default(),
            renders: 0,
            embree_version: String::new(),
            watch,
            started: Instant::now(),
            budget,
            last: None,
        }
    }

    /// Rejected contributions, and invalid picture values.
    pub fn invalid(&self) -> u64 {
        let Counters {
            invalid_nan,
            invalid_inf,
            invalid_negative,
            ..
        } = self.counters;
        invalid_nan + invalid_inf + invalid_negative + self.invalid.total()
    }

    /// Seconds to spend.
    pub fn budget(&self) -> f64 {
        self.budget
    }

    /// Seconds since the start.
    pub fn elapsed(&self) -> f64 {
        self.started.elapsed().as_secs_f64()
    }

    /// Seconds until `share` of the budget is spent; may be negative.
    pub fn until(&self, share: f64) -> f64 {
        share * self.budget - self.elapsed()
    }

    /// Announces the next step.
    ///
    /// # Errors
    /// If a stop was requested.
    pub fn announce(&self, what: &str) -> Result<(), VerifyError> {
        if self.watch.stopped() {
            return Err(VerifyError::Stopped);
        }
        self.watch.doing((self.elapsed() / self.budget).min(1.0), what);
        Ok(())
    }

    /// Renders up to the last of `looks` (ascending pass counts) and returns the picture at each.
    ///
    /// # Errors
    /// Where the render cannot start, or a stop was requested.
    pub fn render(&mut self, settings: Settings, looks: &[u32]) -> Result<Vec<Picture>, VerifyError> {
        self.holding(settings, Effects::default(), looks)
    }

    /// The same with a kernel that also includes `effects`.
    ///
    /// # Errors
    /// As [`Self::render`].
    pub fn holding(
        &mut self,
        settings: Settings,
        effects: Effects,
        looks: &[u32],
    ) -> Result<Vec<Picture>, VerifyError> {
        if self.watch.stopped() {
            return Err(VerifyError::Stopped);
        }
        let mut run = self.prepared(settings, effects)?.passes(0);
        let mut pictures = Vec::with_capacity(looks.len());
        for &look in looks {
            run.extend(look);
            let _ = run.run(self.watch);
            if self.watch.stopped() {
                return Err(VerifyError::Stopped);
            }
            let picture = run.picture();
            VerifyError::unless_finite("a render's", &picture.pixels, picture.width)?;
            let invalid = Invalid::count(&picture.pixels);
            self.invalid.nan += invalid.nan;
            self.invalid.infinite += invalid.infinite;
            self.invalid.negative += invalid.negative;
            pictures.push(picture);
        }
        self.counters += run.counters();
        self.renders += 1;
        run.prepared().embree_version().clone_into(&mut self.embree_version);
        Ok(pictures)
    }

    fn prepared(&mut self, settings: Settings, effects: Effects) -> Result<Prepared, VerifyError> {
        if let Some((forced, last)) = &self.last
            && *forced == effects
            && let Ok(prepared) = last.with_settings(settings)
        {
            return Ok(prepared);
        }
        let prepared = Prepared::holding(self.scene, settings, effects)?;
        self.last = Some((effects, prepared.clone()));
        Ok(prepared)
    }

    /// The estimators, `mis` last.
    pub fn estimators(&self) -> Vec<EstimatorKind> {
        let mut all = EstimatorKind::ALL.to_vec();
        all.sort_by_key(|&estimator| estimator == EstimatorKind::Mis);
        all
    }

    /// Measures the cost of each estimator, on a small film.
    ///
    /// # Errors
    /// As [`render`](Self::render).
    pub fn costs(&mut self) -> Result<Vec<Cost>, VerifyError> {
        let film = shrink(self.settings.film, 4096.0);
        let pixels = f64::from(film.width) * f64::from(film.height);
        let mut costs = Vec::new();
        for estimator in self.estimators() {
            let settings = Settings {
                estimator,
                film,
                sampler: SamplerKind::Sobol,
                ..self.settings
            };
            // The first pass also warms up caches, so passes are multiplied until a render takes 0.4 % of the budget.
            let (mut passes, mut before) = (2, 0.0);
            costs.push(loop {
                let started = Instant::now();
                self.render(settings, &[passes])?;
                let seconds = started.elapsed().as_secs_f64();
                if passes > 2 && (seconds > 0.004 * self.budget || passes >= 512) {
                    // Two measurements separate the setup, which does not grow with passes.
                    let short = f64::from(passes / 4) * pixels;
                    let sample_s = ((seconds - before) / (3.0 * short)).max(0.1 * seconds / (4.0 * short));
                    let setup_s = (seconds - sample_s * 4.0 * short).max(0.0);
                    break Cost {
                        estimator,
                        setup_s,
                        sample_s,
                    };
                }
                (passes, before) = (passes * 4, seconds);
            });
        }
        Ok(costs)
    }

    /// A film with the scene's aspect ratio and at most so many pixels.
    pub fn film(&self, pixels: f64) -> FilmSize {
        shrink(self.settings.film, pixels)
    }
}
