//! One render from its setting-up to its picture.

use std::sync::Arc;

use super::{Counters, Progress};
use crate::film::Picture;
use crate::scene::{EstimatorKind, FilmSize, SamplerKind, Scene};

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
}

/// Why a render cannot start.
#[derive(Debug, thiserror::Error)]
pub enum SetupError {
    /// Embree refused.
    #[error("Embree: {0}")]
    Embree(String),
    /// The estimator cannot do this scene.
    #[error("{0}")]
    Unsupported(String),
}

/// A render: call [`next_block`](Self::next_block) until there are enough passes, look at the picture at any time.
pub struct Renderer {
    settings: Settings,
    progress: Arc<Progress>,
    passes: u32,
}

impl Renderer {
    /// Builds the accelerator and chooses the kernel.
    ///
    /// # Errors
    /// [`SetupError`] where the scene cannot be rendered so.
    pub fn new(_scene: &Scene, settings: Settings) -> Result<Self, SetupError> {
        Ok(Self {
            settings,
            progress: Arc::new(Progress::default()),
            passes: 0,
        })
    }

    /// The name of the kernel that the plan chose.
    pub fn kernel(&self) -> &str {
        "none"
    }

    /// What the scene calls for, in words ("sphere lights", "phong", ...).
    pub fn needs(&self) -> Vec<&'static str> {
        Vec::new()
    }

    /// Seconds spent building the accelerator.
    pub fn build_seconds(&self) -> f64 {
        0.0
    }

    /// Where to read counts and ask for a stop.
    pub fn progress(&self) -> Arc<Progress> {
        self.progress.clone()
    }

    /// Passes that every pixel has so far.
    pub fn passes(&self) -> u32 {
        self.passes
    }

    /// The number of passes after the next block: blocks end at 1, 2, 4, 8, 16 and every further 16.
    pub fn next_stop(&self) -> u32 {
        if self.passes < 16 {
            (self.passes * 2).max(1)
        } else {
            (self.passes / 16 + 1) * 16
        }
    }

    /// Renders up to `min(limit, next_stop())` passes and returns the passes that every pixel has then.
    pub fn next_block(&mut self, limit: u32) -> u32 {
        self.passes = self.next_stop().min(limit);
        self.passes
    }

    /// The picture so far.
    pub fn picture(&self) -> Picture {
        let FilmSize { width, height } = self.settings.film;
        Picture {
            width,
            height,
            pixels: vec![[0.0; 3]; width as usize * height as usize],
        }
    }

    /// What was traced so far.
    pub fn counters(&self) -> Counters {
        Counters::default()
    }
}
