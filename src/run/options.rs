//! One-call rendering from a scene to a picture.

use std::time::Duration;

use super::{DEFAULT_SPP, Goal, MOST_SPP};
use crate::film::Picture;
use crate::pipeline::{Chosen, Prepared, Settings, SetupError};
use crate::scene::{FilmSize, Scene};
use crate::settings::{AccelKind, EstimatorAsked, Lanes, LightsAsked, SamplerKind};

/// What to render and how. `None` uses the scene's value, or the default if the scene has none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RenderOptions {
    /// Samples per pixel, 1 to [`MOST_SPP`]; default 64.
    pub spp: u32,
    /// Adaptive sampling: pixels with more relative error get more of these samples.
    pub adaptive: bool,
    /// Time limit of rendering; may end with fewer samples.
    pub time: Option<Duration>,
    /// Render until the noise falls to this share of the picture, ignoring `spp`: see [`Goal::error`].
    pub target_error: Option<f64>,
    /// The size of the picture in pixels.
    pub size: Option<FilmSize>,
    /// The estimator. `None` takes the scene's, or if it names none, as `auto`, [`Chosen::AUTO`].
    pub estimator: Option<EstimatorAsked>,
    /// The sampler.
    pub sampler: Option<SamplerKind>,
    /// The seed of every random number.
    pub seed: Option<u32>,
    /// Packet width; does not change the picture.
    pub lanes: Option<Lanes>,
    /// Number of threads; does not change the picture.
    pub threads: Option<usize>,
    /// The intersector; `None` lets the plan decide.
    pub accel: Option<AccelKind>,
    /// Embree's robust mode, which closes the edges between triangles.
    pub robust: bool,
    /// Whether occluders are culled where there are few shapes.
    pub cull: bool,
    /// Which lights a pass samples.
    pub lights: LightsAsked,
}

impl Default for RenderOptions {
    /// 64 samples of every pixel, and the scene's values.
    fn default() -> Self {
        Self {
            spp: DEFAULT_SPP,
            adaptive: false,
            time: None,
            target_error: None,
            size: None,
            estimator: None,
            sampler: None,
            seed: None,
            lanes: None,
            threads: None,
            accel: None,
            robust: true,
            cull: true,
            lights: LightsAsked::Auto,
        }
    }
}

impl RenderOptions {
    /// Resolves every option: the value here, then the scene's, then the default.
    pub fn settings(&self, scene: &Scene) -> Settings {
        let of = Settings::of(scene);
        Settings {
            film: self.size.unwrap_or(of.film),
            estimator: Chosen::of(scene, self.estimator).estimator,
            sampler: self.sampler.unwrap_or(of.sampler),
            seed: self.seed.unwrap_or(of.seed),
            lanes: self.lanes,
            threads: self.threads.unwrap_or(of.threads),
            accel: self.accel,
            robust: self.robust,
            cull: self.cull,
            lights: self.lights,
        }
    }

    /// The goal of the run.
    pub fn goal(&self) -> Goal {
        let goal = match self.target_error {
            Some(error) if self.adaptive => Goal::adaptive_error(error),
            Some(error) => Goal::error(error),
            None if self.adaptive => Goal::adaptive(self.spp),
            None => Goal::passes(self.spp),
        };
        match self.time {
            Some(time) => goal.within(time),
            None => goal,
        }
    }

    /// Checks the ranges of the numbers.
    fn check(&self) -> Result<(), RenderError> {
        let size = self.size.unwrap_or(FilmSize { width: 1, height: 1 });
        let refused = if !(1..=MOST_SPP).contains(&self.spp) {
            Some(format!("spp is {}, and goes from 1 to {MOST_SPP}", self.spp))
        } else if let Some(error) = self.target_error.filter(|error| !(1e-6..=100.0).contains(error)) {
            Some(format!(
                "target_error is {error}, and goes from 1e-6 to 100, such as 0.01"
            ))
        } else if !(1..=65_536).contains(&size.width) || !(1..=65_536).contains(&size.height) {
            Some(format!(
                "size is {} x {}, and sides go from 1 to 65536",
                size.width, size.height
            ))
        } else if self.threads.is_some_and(|threads| !(1..=1024).contains(&threads)) {
            Some(format!(
                "threads is {}, and goes from 1 to 1024",
                self.threads.unwrap_or(0)
            ))
        } else {
            None
        };
        refused.map_or(Ok(()), |what| Err(RenderError::Options(what)))
    }
}

/// Why there is no picture.
#[derive(Debug, thiserror::Error)]
pub enum RenderError {
    /// An option is out of range: which one, and the valid range.
    #[error("{0}")]
    Options(String),
    /// The scene cannot be rendered with these settings.
    #[error(transparent)]
    Setup(#[from] SetupError),
}

/// Renders a scene: `height` rows of `width` linear RGB radiances.
///
/// For intermediate pictures, stopping, or several renders of one scene, use [`Prepared`] and its [runs](super::Run).
///
/// # Errors
/// [`RenderError`] where an option is out of range or the scene cannot be rendered with these settings.
pub fn render(scene: &Scene, options: &RenderOptions) -> Result<Picture, RenderError> {
    options.check()?;
    let prepared = Prepared::new(scene, options.settings(scene))?;
    let run = prepared.start(options.goal()).finish();
    match run.failure() {
        Some(error) => Err(SetupError::Embree(error.clone()).into()),
        None => Ok(run.picture()),
    }
}
