//! Settings of a render, all resolved.

use super::Chosen;
use crate::scene::{FilmSize, Scene};
use crate::settings::{AccelKind, EstimatorKind, Lanes, LightsAsked, SamplerKind};

/// All settings that determine a picture.
///
/// [`Settings::of`] reads them from a scene; the default applies where a scene is silent, but for the estimator, which then is
/// [`Chosen::AUTO`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Settings {
    /// The size of the film in pixels.
    pub film: FilmSize,
    /// The estimator.
    pub estimator: EstimatorKind,
    /// The sampler.
    pub sampler: SamplerKind,
    /// The seed of all random numbers.
    pub seed: u32,
    /// Rays per packet; `None` selects the widest packets available.
    pub lanes: Option<Lanes>,
    /// Number of threads; 0 counts as 1.
    pub threads: usize,
    /// The intersector; `None` leaves the choice to the plan.
    pub accel: Option<AccelKind>,
    /// Whether Embree runs in robust mode, which closes the edges between triangles at some cost in speed. Ignored by the
    /// brute-force intersector.
    pub robust: bool,
    /// Whether occluders are culled for all rays of a tile at once if there are few shapes. Without culling every ray is traced;
    /// the picture differs only by rounding.
    pub cull: bool,
    /// Which lights a pass samples.
    pub lights: LightsAsked,
}

impl Default for Settings {
    /// Without a scene to choose by: 768 x 512 pixels, `mis`, `sobol`, seed 0, the widest packets and all threads of the machine.
    fn default() -> Self {
        Self {
            film: FilmSize {
                width: 768,
                height: 512,
            },
            estimator: EstimatorKind::Mis,
            sampler: SamplerKind::Sobol,
            seed: 0,
            lanes: None,
            threads: all_threads(),
            accel: None,
            robust: true,
            cull: true,
            lights: LightsAsked::Auto,
        }
    }
}

impl Settings {
    /// The scene's film, estimator, sampler and seed, the estimator by [`Chosen`]; defaults for the rest.
    pub fn of(scene: &Scene) -> Self {
        let default = Self::default();
        Self {
            film: scene.film(),
            estimator: Chosen::of(scene, None).estimator,
            sampler: scene.render().sampler.unwrap_or(default.sampler),
            seed: scene.render().seed.unwrap_or(default.seed),
            ..default
        }
    }
}

/// Number of hardware threads.
pub fn all_threads() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}
