//! One render from its setting-up to its picture.

use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex};
use std::time::Instant;

use rayon::prelude::*;

use super::job::Job;
use super::plan::{Machine, Plan};
use super::replay::{Replay, replay};
use super::stage::Scratch;
use super::world::World;
use super::{Counters, Progress};
use crate::embree::{Device, EmbreeError, layout_canary};
use crate::film::{Film, Noise, Picture, allocation, leaf_passes};
use crate::linear::FEW;
use crate::sampling::PassBlock;
use crate::scene::{Effects, EstimatorKind, Features, FilmSize, SamplerKind, Scene};
use crate::settings::AccelKind;

/// Every choice that makes a picture, resolved.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Settings {
    /// The size of the film.
    pub film: FilmSize,
    /// The estimator.
    pub estimator: EstimatorKind,
    /// The sampler.
    pub sampler: SamplerKind,
    /// The seed of every random number.
    pub seed: u32,
    /// Rays a packet: 1, 8 or 16; 0 leaves it to the plan.
    pub lanes: usize,
    /// Threads; at least 1.
    pub threads: usize,
    /// Who answers rays; `None` leaves it to the plan.
    pub accel: Option<AccelKind>,
    /// Whether Embree closes the edges between triangles, for some of its speed. A line of shapes is what it is.
    pub robust: bool,
    /// Whether shapes that cannot be in the way are left out for all rays of a tile at once, where there are few. Off, every ray is
    /// asked for and asked of every shape; the picture is the same but for the last rounding.
    pub cull: bool,
}

/// Why a render cannot start.
#[derive(Debug, thiserror::Error)]
pub enum SetupError {
    /// Embree refused.
    #[error(transparent)]
    Embree(#[from] EmbreeError),
    /// No kernel does what is asked for.
    #[error("{what}")]
    Unsupported {
        /// What cannot be done.
        what: String,
        /// What would do.
        remedy: &'static str,
    },
    /// The threads could not be started.
    #[error("cannot start the threads: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
}

/// A render: call [`next_block`](Self::next_block) until there are enough passes, look at the picture at any time.
pub struct Renderer {
    settings: Settings,
    features: Features,
    plan: Plan,
    world: Arc<World>,
    film: Film,
    pool: Arc<rayon::ThreadPool>,
    scratch: Mutex<Vec<Scratch>>,
    progress: Arc<Progress>,
    counters: Counters,
    build_seconds: f64,
    embree_version: String,
    passes: u32,
    pause: Option<Instant>,
    /// From the noise of every pixel and samples a pixel on average to the samples of every pixel.
    allocate: fn(FilmSize, &[Noise], u32) -> Vec<u32>,
    /// The most samples of a pixel, once they are allocated.
    most: Option<u32>,
}

/// Passes in a block are no more than this, for the memory that the tables of random numbers take.
const MOST_PASSES: u32 = 4096;

impl Renderer {
    /// Chooses the kernel and builds the accelerator.
    ///
    /// # Errors
    /// [`SetupError`] where the scene cannot be rendered so.
    pub fn new(scene: &Scene, settings: Settings) -> Result<Self, SetupError> {
        Self::holding(scene, settings, Effects::default())
    }

    /// As [`Self::new`], with a kernel that also holds effects which the scene may not call for. The picture is the same, bit
    /// for bit: what it costs is what an unused effect costs.
    ///
    /// # Errors
    /// As for [`Self::new`].
    pub fn holding(scene: &Scene, settings: Settings, effects: Effects) -> Result<Self, SetupError> {
        let features = Features::of(scene, settings.film);
        let device = Device::new(settings.threads)?;
        let Settings {
            estimator,
            lanes,
            accel,
            ..
        } = settings;
        let plan = Plan::choose(&features, effects, estimator, lanes, accel, Machine::of(&device))
            .map_err(|(what, remedy)| SetupError::Unsupported { what, remedy })?;
        layout_canary(&device)?;
        let begin = Instant::now();
        let world = World::build(scene, &device, plan.accel, settings)?;
        let build_seconds = begin.elapsed().as_secs_f64();
        Ok(Self {
            settings,
            features,
            plan,
            world: Arc::new(world),
            film: Film::new(settings.film),
            pool: Arc::new(rayon::ThreadPoolBuilder::new().num_threads(settings.threads).build()?),
            scratch: Mutex::default(),
            progress: Arc::default(),
            counters: Counters::default(),
            build_seconds,
            embree_version: device.version(),
            passes: 0,
            pause: None,
            allocate: allocation::allocate,
            most: None,
        })
    }

    /// A render of the same scene with another seed, from its start. It shares what was built, the threads, and the progress.
    pub fn with_seed(&self, seed: u32) -> Self {
        Self {
            settings: Settings { seed, ..self.settings },
            features: self.features,
            plan: self.plan.clone(),
            world: self.world.clone(),
            film: Film::new(self.settings.film),
            pool: self.pool.clone(),
            scratch: Mutex::default(),
            progress: self.progress.clone(),
            counters: Counters::default(),
            build_seconds: self.build_seconds,
            embree_version: self.embree_version.clone(),
            passes: 0,
            pause: None,
            allocate: self.allocate,
            most: None,
        }
    }

    /// The name of the kernel that the plan chose.
    pub fn kernel(&self) -> &str {
        &self.plan.name
    }

    /// Why the plan chose it, in a sentence.
    pub fn why(&self) -> &str {
        &self.plan.why
    }

    /// Rays a packet.
    pub fn lanes(&self) -> usize {
        self.plan.lanes
    }

    /// Rays that whoever answers them takes at a time: those of a packet, or 1 where Embree has no packets of that width.
    pub fn rays_together(&self) -> usize {
        self.plan.together
    }

    /// Who answers rays.
    pub fn accel(&self) -> AccelKind {
        self.plan.accel
    }

    /// Whether Embree closes the edges between triangles; `None` where it is not asked.
    pub fn robust(&self) -> Option<bool> {
        (self.plan.accel == AccelKind::Embree).then_some(self.settings.robust)
    }

    /// Whether shapes are left out for all rays of a tile at once; `None` where there are too many for it.
    pub fn cull(&self) -> Option<bool> {
        let few = self.plan.accel == AccelKind::Linear || self.features.shapes <= FEW;
        few.then_some(self.settings.cull)
    }

    /// What the scene calls for, in words.
    pub fn needs(&self) -> Vec<&'static str> {
        self.features.effects().names()
    }

    /// What the scene calls for, counted.
    pub fn features(&self) -> &Features {
        &self.features
    }

    /// What the kernel holds.
    pub fn held(&self) -> Effects {
        self.plan.held
    }

    /// The version of Embree that answers the rays.
    pub fn embree_version(&self) -> &str {
        &self.embree_version
    }

    /// Seconds spent building the accelerator.
    pub fn build_seconds(&self) -> f64 {
        self.build_seconds
    }

    /// Where to read counts and ask for a stop.
    pub fn progress(&self) -> Arc<Progress> {
        self.progress.clone()
    }

    /// Begins at another pass than 0, the start of a leaf: for one shard of a render. To be called before the first block.
    pub fn begin_at(&mut self, pass: u32) {
        self.film.begin_at(pass);
        self.passes = pass;
    }

    /// Goes on from a film of the same render, and what was traced for it.
    pub fn restore(&mut self, film: Film, counters: Counters) {
        self.progress
            .add(counters.samples, counters.eye_rays + counters.shadow_rays);
        self.passes = film.passes().end;
        self.most = film.most_samples();
        (self.film, self.counters) = (film, counters);
    }

    /// Begins no further tile from then on but the first of a block, until another time is set: blocks then return early, and the
    /// next one takes up what this one left. No bit depends on it.
    pub fn pause_at(&mut self, time: Option<Instant>) {
        self.pause = time;
    }

    /// The sums so far.
    pub fn film(&self) -> &Film {
        &self.film
    }

    /// Passes so far, in which every pixel took part unless samples are allocated.
    pub fn passes(&self) -> u32 {
        self.passes
    }

    /// The number of passes after the next block. Blocks end at 1, 2, 4, 8, … passes up to the block size of the film and
    /// at its multiples from there on, whoever asks: so a picture's bits do not depend on when it was looked at.
    pub fn next_stop(&self) -> u32 {
        let block = leaf_passes(self.settings.film);
        if self.passes < block {
            (self.passes * 2).max(1)
        } else {
            (self.passes / block + 1).saturating_mul(block)
        }
    }

    /// Renders up to `min(limit, next_stop())` passes and returns the passes that every pixel has then. If a stop is
    /// requested meanwhile, tiles keep what they have: each pixel is divided by its own number of passes.
    pub fn next_block(&mut self, limit: u32) -> u32 {
        let first = self.passes;
        let end = self.next_stop().min(limit);
        if end <= first {
            return first;
        }
        self.block(first, end);
        self.passes
    }

    /// Renders a further part of `spp` samples a pixel on average: first pilot passes, then what each pixel needs (see
    /// [`allocation`]). Returns whether there is more to do; the picture is unbiased after every part. `spp` must be
    /// the same each time, and [`Self::next_block`] must not be called in between.
    ///
    /// Blocks double the passes. Their number is then small however far the busiest pixel goes, and of the table of random
    /// numbers at most half is for passes that nobody takes.
    pub fn next_adaptive_block(&mut self, spp: u32) -> bool {
        let (first, pilot) = (self.passes, allocation::pilot(spp));
        let steered = pilot < spp;
        if first == 0 && steered && !self.film.measures_noise() {
            self.film.measure_noise();
        }
        if first == pilot && steered && self.most.is_none() {
            let noise = self.film.noise();
            let goals = self.pool.install(|| (self.allocate)(self.settings.film, &noise, spp));
            self.film.set_goals(&goals);
            self.most = goals.into_iter().max();
        }
        let last = self.most.unwrap_or(pilot);
        let end = (first * 2).max(2).min(first + MOST_PASSES).min(last);
        self.block(first, end);
        self.passes < last || (steered && self.most.is_none())
    }

    /// Renders the passes `first..end`; of each pixel, those that it takes part in.
    fn block(&mut self, first: u32, end: u32) {
        let Settings {
            sampler,
            seed,
            film: size,
            ..
        } = self.settings;
        let numbers = PassBlock::new(sampler, seed, first, end - first, self.plan.pairs);
        let job = Job {
            plan: &self.plan,
            world: &self.world,
            numbers: &numbers,
            scratch: &self.scratch,
            progress: &self.progress,
            film: size,
            passes: end - first,
            pause: self.pause,
            begun: AtomicBool::new(false),
        };
        let tiles = self.film.tiles_mut();
        let counters = self
            .pool
            .install(|| tiles.par_iter_mut().map(|tile| job.render(tile)).collect::<Vec<_>>());
        counters.into_iter().for_each(|c| self.counters += c);
        self.passes = self.film.passes().end;
    }

    /// The sample of pixel `x, y` in a pass, step by step; `None` beside the film. For a renderer of one lane, before its first
    /// pass; it is not changed.
    pub fn replay(&self, [x, y, pass]: [u32; 3]) -> Option<Replay> {
        let tile = self.film.pixel(x, y)?;
        Some(replay(&self.plan, &self.world, &self.settings, &tile, [x, y, pass]))
    }

    /// The picture so far.
    pub fn picture(&self) -> Picture {
        self.film.picture()
    }

    /// Samples of each pixel so far, row by row.
    pub fn samples(&self) -> Vec<u32> {
        self.film.samples()
    }

    /// What was traced so far.
    pub fn counters(&self) -> Counters {
        self.counters
    }
}

#[cfg(test)]
mod tests;
