//! One render from its setting-up to its picture.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use rayon::prelude::*;

use super::plan::Plan;
use super::stage::{Chunk, Scratch};
use super::stream::CAPACITY;
use super::world::World;
use super::{Counters, Progress};
use crate::embree::{Device, EmbreeError, layout_canary};
use crate::film::{Film, Picture, Tile, TileSum};
use crate::sampling::PassBlock;
use crate::scene::{EstimatorKind, Features, FilmSize, SamplerKind, Scene};
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
    /// Rays a packet: 1 or 8.
    pub lanes: usize,
    /// Threads; at least 1.
    pub threads: usize,
    /// Who answers rays; `None` leaves it to the plan.
    pub accel: Option<AccelKind>,
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
    world: World,
    film: Film,
    pool: rayon::ThreadPool,
    scratch: Mutex<Vec<Scratch>>,
    progress: Arc<Progress>,
    counters: Counters,
    build_seconds: f64,
    embree_version: String,
    passes: u32,
}

impl Renderer {
    /// Chooses the kernel and builds the accelerator.
    ///
    /// # Errors
    /// [`SetupError`] where the scene cannot be rendered so.
    pub fn new(scene: &Scene, settings: Settings) -> Result<Self, SetupError> {
        let features = Features::of(scene);
        let plan = Plan::choose(&features, settings.estimator, settings.lanes, settings.accel)
            .map_err(|(what, remedy)| SetupError::Unsupported { what, remedy })?;
        let device = Device::new(settings.threads)?;
        layout_canary(&device)?;
        let begin = Instant::now();
        let world = World::build(scene, settings.film, &device, plan.accel)?;
        let build_seconds = begin.elapsed().as_secs_f64();
        Ok(Self {
            settings,
            features,
            plan,
            world,
            film: Film::new(settings.film),
            pool: rayon::ThreadPoolBuilder::new().num_threads(settings.threads).build()?,
            scratch: Mutex::default(),
            progress: Arc::default(),
            counters: Counters::default(),
            build_seconds,
            embree_version: device.version(),
            passes: 0,
        })
    }

    /// The name of the kernel that the plan chose.
    pub fn kernel(&self) -> &str {
        &self.plan.name
    }

    /// Why the plan chose it, in a sentence.
    pub fn why(&self) -> &str {
        &self.plan.why
    }

    /// What the scene calls for, in words.
    pub fn needs(&self) -> Vec<&'static str> {
        self.features.needs()
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

    /// Passes that every pixel has so far.
    pub fn passes(&self) -> u32 {
        self.passes
    }

    /// The number of passes after the next block. Blocks end at 1, 2, 4, 8, … passes up to the block size of the film and
    /// at its multiples from there on, whoever asks: so a picture's bits do not depend on when it was looked at.
    pub fn next_stop(&self) -> u32 {
        let block = self.block_passes();
        if self.passes < block {
            (self.passes * 2).max(1)
        } else {
            (self.passes / block + 1).saturating_mul(block)
        }
    }

    /// 16 passes, and more for small films: enough work to keep threads busy between two barriers.
    fn block_passes(&self) -> u32 {
        let FilmSize { width, height } = self.settings.film;
        let pixels = u64::from(width) * u64::from(height);
        ((1 << 18) / pixels).clamp(16, 4096).next_power_of_two() as u32
    }

    /// Renders up to `min(limit, next_stop())` passes and returns the passes that every pixel has then. If a stop is
    /// requested meanwhile, tiles keep what they have: each pixel is divided by its own number of passes.
    pub fn next_block(&mut self, limit: u32) -> u32 {
        let first = self.passes;
        let end = self.next_stop().min(limit);
        if end <= first {
            return first;
        }
        let numbers = PassBlock::new(
            self.settings.sampler,
            self.settings.seed,
            first,
            end - first,
            self.plan.pairs,
        );
        let Self {
            plan,
            world,
            film,
            pool,
            scratch,
            progress,
            settings,
            ..
        } = self;
        let job = Job {
            plan,
            world,
            numbers: &numbers,
            scratch,
            progress,
            film: settings.film,
            passes: end - first,
        };
        let counters = pool.install(|| {
            film.tiles_mut()
                .par_iter_mut()
                .map(|tile| job.render(tile))
                .collect::<Vec<_>>()
        });
        counters.into_iter().for_each(|c| self.counters += c);
        self.passes = self.film.tiles().iter().map(Tile::passes).min().unwrap_or(end);
        self.passes
    }

    /// The picture so far.
    pub fn picture(&self) -> Picture {
        self.film.picture()
    }

    /// What was traced so far.
    pub fn counters(&self) -> Counters {
        self.counters
    }
}

/// One block for all tiles.
struct Job<'a> {
    plan: &'a Plan,
    world: &'a World,
    numbers: &'a PassBlock,
    scratch: &'a Mutex<Vec<Scratch>>,
    progress: &'a Progress,
    film: FilmSize,
    passes: u32,
}

impl Job<'_> {
    /// Renders a tile chunk by chunk, on as many threads as are free, and adds the chunks in order.
    fn render(&self, tile: &mut Tile) -> Counters {
        let mut counters = Counters::default();
        if self.progress.stop_requested() {
            return counters;
        }
        // A power of two, so that chunks are the same whatever the block.
        let per_chunk = (CAPACITY / tile.pixels.len()).max(1);
        let per_chunk = if per_chunk.is_power_of_two() {
            per_chunk
        } else {
            per_chunk.next_power_of_two() / 2
        } as u32;
        let starts: Vec<u32> = (0..self.passes).step_by(per_chunk as usize).collect();
        let chunks: Vec<_> = starts
            .par_iter()
            .map(|&start| self.chunk(tile, start, per_chunk.min(self.passes - start)))
            .collect();
        for (start, (sum, chunk)) in starts.iter().zip(&chunks) {
            tile.add(sum, per_chunk.min(self.passes - start));
            counters += *chunk;
        }
        counters
    }

    fn chunk(&self, tile: &Tile, first: u32, passes: u32) -> (TileSum, Counters) {
        let mut sum = TileSum::new(tile.pixels.len());
        let mut counters = Counters::default();
        // A panic elsewhere leaves whole scratch pads behind: they hold nothing between chunks.
        let pads = || self.scratch.lock().unwrap_or_else(PoisonError::into_inner);
        let mut scratch = pads().pop().unwrap_or_default();
        let mut chunk = Chunk {
            world: self.world,
            numbers: self.numbers,
            tile,
            film_width: self.film.width,
            first,
            passes,
            sum: &mut sum,
            counters: &mut counters,
        };
        (self.plan.kernel)(&mut chunk, &mut scratch);
        pads().push(scratch);
        self.progress
            .add(counters.samples, counters.eye_rays + counters.shadow_rays);
        (sum, counters)
    }
}
