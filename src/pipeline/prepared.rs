//! A scene that is ready to be rendered: the tables, the accelerator, the plan and the threads.

use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::time::{Duration, Instant};

use super::outlook::{self, Partly};
use super::plan::{Machine, Plan};
use super::replay::{Replay, replay};
use super::settings::Settings;
use super::stage::Scratch;
use super::world::World;
use crate::embree::{Device, EmbreeError, layout_canary};
use crate::film::Film;
use crate::scene::{Effects, Features, Scene};
use crate::settings::{AccelKind, Lanes};

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

/// Lists of lights, and the tree that they are drawn from.
#[derive(Clone, Copy, Debug)]
pub struct ListsOfLights {
    /// Lights that a pass asks in each tile.
    pub length: u32,
    /// Lights in the tree.
    pub lights: usize,
    /// Bytes that the tree and its numbers take beside the lights themselves.
    pub bytes: usize,
    /// How long it took to build.
    pub build_time: Duration,
}

/// A scene that is ready to be rendered with some [`Settings`]. Nothing of it changes, so any number of
/// [runs](crate::run::Run) share it, one after the other or at the same time; a clone is cheap.
#[derive(Clone, Debug)]
pub struct Prepared {
    pub(super) settings: Settings,
    pub(super) plan: Arc<Plan>,
    pub(super) world: Arc<World>,
    pub(super) pool: Arc<rayon::ThreadPool>,
    /// What threads work with, kept from chunk to chunk.
    pub(super) scratch: Arc<Mutex<Vec<Scratch>>>,
    /// Where lights are seen in part, once somebody has asked.
    partly: Arc<OnceLock<Partly>>,
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
    /// [`SetupError`] where the scene cannot be rendered so.
    pub fn new(scene: &Scene, settings: Settings) -> Result<Self, SetupError> {
        Self::holding(scene, settings, Effects::default())
    }

    /// As [`Self::new`], with a kernel that also holds effects which the scene may not call for. The picture is the same, bit
    /// for bit: the time that it takes more is what an unused effect costs.
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
            scene_hash: scene.hash().into(),
            build_time: begin.elapsed(),
            embree_version: device.version().into(),
        })
    }

    /// Something for a thread to work with; to be [put back](Self::put_back).
    pub(super) fn scratch(&self) -> Scratch {
        // A panic elsewhere leaves whole scratch pads behind: they hold nothing between chunks.
        let mut scratches = self.scratch.lock().unwrap_or_else(PoisonError::into_inner);
        scratches.pop().unwrap_or_default()
    }

    /// Keeps it for the next who asks.
    pub(super) fn put_back(&self, scratch: Scratch) {
        self.scratch
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .push(scratch);
    }

    /// Where lights are seen in part, if the estimator sends more rays there: found when it is asked for first.
    pub(super) fn partly(&self) -> Option<&Partly> {
        self.plan.find_penumbrae?;
        Some(self.partly.get_or_init(|| outlook::partly(self)))
    }

    /// The same scene with another seed. Everything that was built is shared.
    #[must_use]
    pub fn with_seed(&self, seed: u32) -> Self {
        let settings = Settings { seed, ..self.settings };
        Self {
            settings,
            ..self.clone()
        }
    }

    /// The same scene with other settings that leave what was built as it is: estimator, sampler, seed and lanes. For a view whose
    /// user turns a knob while it renders.
    ///
    /// # Errors
    /// [`SetupError::Unsupported`] where another setting differs, which needs a [`Prepared::new`]; or where no kernel does what is
    /// asked for.
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
                what: "the film, the threads, the accelerator, robust, cull and lights cannot change once a scene is prepared"
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

    /// What was asked for.
    pub fn settings(&self) -> Settings {
        self.settings
    }

    /// The name of the kernel that the plan chose.
    pub fn kernel(&self) -> &str {
        &self.plan.name
    }

    /// Why the plan chose it, in a sentence.
    pub fn why(&self) -> &str {
        &self.plan.why
    }

    /// Rays in a packet.
    pub fn lanes(&self) -> Lanes {
        self.plan.lanes
    }

    /// Rays that whoever answers them takes at a time: those of a packet, or 1 where Embree has no packets of that width.
    pub fn rays_together(&self) -> usize {
        self.plan.together
    }

    /// Who answers rays.
    pub fn accel(&self) -> AccelKind {
        self.plan.intersector.accel
    }

    /// Whether Embree closes the edges between triangles; `None` where it is not asked.
    pub fn robust(&self) -> Option<bool> {
        (self.plan.intersector.accel == AccelKind::Embree).then_some(self.settings.robust)
    }

    /// Whether occluders are culled for all rays of a tile at once; `None` where there are too many shapes for it.
    pub fn cull(&self) -> Option<bool> {
        self.plan.intersector.cull
    }

    /// What lists of lights are drawn from; `None` where every pass asks all lights.
    pub fn lists(&self) -> Option<ListsOfLights> {
        let lists = self.world.lists.as_ref()?;
        Some(ListsOfLights {
            length: lists.length(),
            lights: lists.tree().len(),
            bytes: lists.bytes(),
            build_time: lists.build_time(),
        })
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

    /// The version of Embree that answers rays.
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

    /// The sample of pixel `x, y` in a pass, step by step; `None` beside the film.
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
        let tile = Film::new(self.settings.film).pixel(x, y);
        let Some(tile) = tile else {
            return Ok(None);
        };
        let partly = if pass >= outlook::SPLIT_FROM {
            self.partly()
        } else {
            None
        };
        let marks = partly.map_or(&[][..], |partly| &partly[tile.number() as usize]);
        let mark = Film::new(self.settings.film).tiles()[tile.number() as usize]
            .pixels()
            .zip(marks)
            .find_map(|(pixel, &mark)| (pixel == [x, y]).then_some(mark));
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
