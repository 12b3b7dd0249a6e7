//! A scene ready to render: tables, accelerator, plan and threads.

use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::time::{Duration, Instant};

use super::outlook::{self, Partly};
use super::plan::{Machine, Plan};
use super::replay::{Replay, replay};
use super::settings::Settings;
use super::stage::Scratch;
use super::world::World;
use crate::embree::{Device, EmbreeError, layout_canary};
use crate::film::allocation::Kind;
use crate::film::{Film, Tile};
use crate::scene::{Effects, Features, Scene};
use crate::settings::{AccelKind, EstimatorKind, Lanes};

/// Why a render cannot start.
#[derive(Debug, thiserror::Error)]
pub enum SetupError {
    /// Embree reported an error.
    #[error(transparent)]
    Embree(#[from] EmbreeError),
    /// No kernel supports the request.
    #[error("{what}")]
    Unsupported {
        /// What is not supported.
        what: String,
        /// What to do instead.
        remedy: &'static str,
    },
    /// The threads could not be started.
    #[error("cannot start the threads: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
}

/// Lists of lights, and the tree from which they are sampled.
#[derive(Clone, Copy, Debug)]
pub struct ListsOfLights {
    /// Number of lights that a pass samples in each tile.
    pub length: u32,
    /// Lights in the tree.
    pub lights: usize,
    /// Walks down the tree of each point in a pass, where points walk.
    pub walks: u32,
    /// Of the tables that runs have needed so far, those by which points walk, and those of lists.
    pub tables: [usize; 2],
    /// Memory of the tree and its indices in bytes, without the lights.
    pub bytes: usize,
    /// How long it took to build.
    pub build_time: Duration,
}

/// The number of a tile, and for each of its pixels the lights that it sees partially.
type TileMarks = (u32, Vec<u32>);

/// A scene ready to render with some [`Settings`]. It is immutable, so any number of [runs](crate::run::Run) can share it, one
/// after the other or concurrently. Clones are cheap.
#[derive(Clone, Debug)]
pub struct Prepared {
    pub(super) settings: Settings,
    pub(super) plan: Arc<Plan>,
    pub(super) world: Arc<World>,
    pub(super) pool: Arc<rayon::ThreadPool>,
    /// Scratch memory of the threads, reused from chunk to chunk.
    pub(super) scratch: Arc<Mutex<Vec<Scratch>>>,
    /// Where lights are partially visible; computed on first use.
    partly: Arc<OnceLock<Partly>>,
    /// The same of the tile that was replayed last, by its number.
    replayed: Arc<Mutex<Option<TileMarks>>>,
    features: Features,
    machine: Machine,
    scene_hash: Arc<str>,
    build_time: Duration,
    embree_version: Arc<str>,
}

impl Prepared {
    /// Chooses the kernel, builds the accelerator, and starts the threads.
    ///
    /// # Errors
    /// [`SetupError`] if the scene cannot be rendered with these settings.
    pub fn new(scene: &Scene, settings: Settings) -> Result<Self, SetupError> {
        Self::holding(scene, settings, Effects::default())
    }

    /// Like [`Self::new`], with additional `effects` compiled into the kernel. The picture is the same, bit for bit; the extra time
    /// is the cost of an unused effect.
    ///
    /// # Errors
    /// As for [`Self::new`].
    pub fn holding(scene: &Scene, settings: Settings, effects: Effects) -> Result<Self, SetupError> {
        let settings = Settings {
            threads: settings.threads.max(1),
            ..settings
        };
        let features = Features::of(scene, settings.film);
        let device = Device::new(settings.threads)?;
        let machine = Machine::of(&device);
        let plan = plan(&features, effects, settings, machine)?;
        layout_canary(&device)?;
        let begin = Instant::now();
        let world = World::build(
            scene,
            &device,
            plan.intersector,
            settings.robust,
            settings.film,
            plan.lists,
        )?;
        Ok(Self {
            settings,
            features,
            machine,
            plan: Arc::new(plan),
            world: Arc::new(world),
            pool: Arc::new(rayon::ThreadPoolBuilder::new().num_threads(settings.threads).build()?),
            scratch: Arc::default(),
            partly: Arc::default(),
            replayed: Arc::default(),
            scene_hash: scene.hash().into(),
            build_time: begin.elapsed(),
            embree_version: device.version().into(),
        })
    }

    /// Takes scratch memory; return it with [`Self::put_back`].
    pub(super) fn scratch(&self) -> Scratch {
        // Scratch memory holds nothing between chunks, so it stays valid after a panic elsewhere poisons the lock.
        let mut scratches = self.scratch.lock().unwrap_or_else(PoisonError::into_inner);
        scratches.pop().unwrap_or_default()
    }

    /// Returns scratch memory to the pool.
    pub(super) fn put_back(&self, scratch: Scratch) {
        self.scratch
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .push(scratch);
    }

    /// Where lights are partially visible, if the estimator traces more rays there. Computed on first use.
    pub(super) fn partly(&self) -> Option<&Partly> {
        self.plan.find_penumbrae?;
        Some(self.partly.get_or_init(|| outlook::partly(self)))
    }

    /// The lights that a pixel of this tile sees partially: as a render has found them, or from a survey of the tile alone.
    fn mark(&self, tile: &mut Tile, pixel: [u32; 2]) -> Option<u32> {
        let number = tile.number();
        let mut replayed = self.replayed.lock().unwrap_or_else(PoisonError::into_inner);
        if replayed.as_ref().is_none_or(|(of, _)| *of != number) {
            let marks = match self.partly.get() {
                Some(all) => all[number as usize].clone(),
                None => outlook::partly_of(self, tile),
            };
            *replayed = Some((number, marks));
        }
        let (_, marks) = replayed.as_ref()?;
        let found = tile.pixels().zip(marks).find(|(at, _)| *at == pixel);
        found.map(|(_, &mark)| mark)
    }

    /// The pixels, row by row, in which a light ends before something else, or which touch such a pixel: of them a few samples tell
    /// little, by any estimator. An environment that emits is a light too. Takes one ray a pixel, which misses most lights that are
    /// smaller than one.
    pub fn rims(&self) -> Vec<bool> {
        let kinds = outlook::kinds(self);
        kinds.into_iter().map(|kind| kind == Kind::Rim).collect()
    }

    /// Whether the whole film was surveyed for lights that are partially visible.
    #[cfg(test)]
    pub(super) fn has_surveyed(&self) -> bool {
        self.partly.get().is_some()
    }

    /// The same scene with another seed. All tables are shared.
    #[must_use]
    pub fn with_seed(&self, seed: u32) -> Self {
        let settings = Settings { seed, ..self.settings };
        Self {
            settings,
            ..self.clone()
        }
    }

    /// The same scene with other settings that need no rebuild: estimator, sampler, seed and lanes. For interactive views, where
    /// the user changes a setting during rendering.
    ///
    /// # Errors
    /// [`SetupError::Unsupported`] if any other setting differs, which requires a [`Prepared::new`], or if no kernel supports the
    /// request.
    pub fn with_settings(&self, settings: Settings) -> Result<Self, SetupError> {
        let same = Settings {
            estimator: self.settings.estimator,
            sampler: self.settings.sampler,
            seed: self.settings.seed,
            lanes: self.settings.lanes,
            ..settings
        };
        if same != self.settings {
            return Err(SetupError::Unsupported {
                what: "the film, the threads, the intersector, robust, cull and lights cannot change once a scene is prepared"
                    .to_owned(),
                remedy: "prepare the scene again",
            });
        }
        let plan = plan(&self.features, self.plan.held, settings, self.machine)?;
        Ok(Self {
            settings,
            plan: Arc::new(plan),
            ..self.clone()
        })
    }

    /// The settings of this render.
    pub fn settings(&self) -> Settings {
        self.settings
    }

    /// The name of the kernel that the plan chose.
    pub fn kernel(&self) -> &str {
        &self.plan.name
    }

    /// The reason for the choice of kernel, as a sentence.
    pub fn why(&self) -> &str {
        &self.plan.why
    }

    /// Rays per packet.
    pub fn lanes(&self) -> Lanes {
        self.plan.lanes
    }

    /// Rays that the intersector traces at a time: the packet width, or 1 if Embree has no packets of that width.
    pub fn rays_together(&self) -> usize {
        self.plan.together
    }

    /// The intersector.
    pub fn accel(&self) -> AccelKind {
        self.plan.intersector.accel
    }

    /// Whether Embree runs in robust mode, which closes the edges between triangles; `None` if Embree is not the intersector.
    pub fn robust(&self) -> Option<bool> {
        (self.plan.intersector.accel == AccelKind::Embree).then_some(self.settings.robust)
    }

    /// Whether occluders are culled for all rays of a tile at once; `None` if there are too many shapes to cull.
    pub fn cull(&self) -> Option<bool> {
        self.plan.intersector.cull
    }

    /// The estimator whose stages run: the one asked for, but `mis` for `product` where lights are in lists.
    pub fn estimator(&self) -> EstimatorKind {
        self.plan.estimator
    }

    /// The lists of lights from which the estimator draws; `None` if it draws from none.
    pub fn lists(&self) -> Option<ListsOfLights> {
        let lists = self.world.lists_of(self.plan.draws)?;
        Some(ListsOfLights {
            length: lists.length(),
            lights: lists.tree().len(),
            walks: lists.walks(),
            tables: lists.tables(),
            bytes: lists.bytes(),
            build_time: lists.build_time(),
        })
    }

    /// The effects that the scene requires, by name.
    pub fn needs(&self) -> Vec<&'static str> {
        self.features.effects().names()
    }

    /// The features of the scene, with counts.
    pub fn features(&self) -> &Features {
        &self.features
    }

    /// The effects compiled into the kernel.
    pub fn held(&self) -> Effects {
        self.plan.held
    }

    /// The version of Embree.
    pub fn embree_version(&self) -> &str {
        &self.embree_version
    }

    /// How long it took to build the tables and the accelerator.
    pub fn build_time(&self) -> Duration {
        self.build_time
    }

    /// The hash of the scene, in hexadecimal.
    pub fn scene_hash(&self) -> &str {
        &self.scene_hash
    }

    /// Replays the sample of pixel `x, y` in a pass step by step; `None` outside the film.
    ///
    /// # Errors
    /// [`SetupError::Unsupported`] with more than one lane.
    pub fn replay(&self, [x, y, pass]: [u32; 3]) -> Result<Option<Replay>, SetupError> {
        if self.plan.lanes != Lanes::One {
            return Err(SetupError::Unsupported {
                what: "a sample is replayed by the kernel of one lane, which has the bits of all".to_owned(),
                remedy: "prepare the scene with Lanes::One",
            });
        }
        let mut film = Film::new(self.settings.film);
        let Some(tile) = film.pixel(x, y) else {
            return Ok(None);
        };
        let splits = self.plan.find_penumbrae.is_some() && pass >= outlook::SPLIT_FROM;
        let whole_tile = &mut film.tiles_mut()[tile.number() as usize];
        let mark = splits.then(|| self.mark(whole_tile, [x, y])).flatten();
        let partly = mark.as_slice();
        Ok(Some(replay(
            &self.plan,
            &self.world,
            &self.settings,
            &tile,
            partly,
            [x, y, pass],
        )))
    }
}

fn plan(features: &Features, effects: Effects, settings: Settings, machine: Machine) -> Result<Plan, SetupError> {
    Plan::choose(features, effects, &settings, machine)
        .map_err(|(what, remedy)| SetupError::Unsupported { what, remedy })
}
