//! What a render is asked to do, with every choice made.

use crate::scene::{FilmSize, Scene};
use crate::settings::{AccelKind, EstimatorKind, Lanes, LightsAsked, SamplerKind};

/// Every choice that makes a picture, resolved.
///
/// [`Settings::of`] takes what a scene says; the default is for scenes that say nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Settings {
    /// The size of the film in pixels.
    pub film: FilmSize,
    /// The estimator.
    pub estimator: EstimatorKind,
    /// The sampler.
    pub sampler: SamplerKind,
    /// The seed of every random number.
    pub seed: u32,
    /// Rays in a packet; `None` leaves it to the plan, which takes the most that there are.
    pub lanes: Option<Lanes>,
    /// Threads; 0 counts as 1.
    pub threads: usize,
    /// Who answers rays; `None` leaves it to the plan.
    pub accel: Option<AccelKind>,
    /// Whether Embree closes the edges between triangles, for some of its speed. It has no effect where shapes are tested in a line.
    pub robust: bool,
    /// Whether occluders are culled for all rays of a tile at once where there are few shapes. Without it every ray is traced; the
    /// picture differs in the last rounding alone.
    pub cull: bool,
    /// Which lights a pass asks.
    pub lights: LightsAsked,
}

impl Default for Settings {
    /// 768 x 512 pixels, `mis`, `sobol`, seed 0, the widest packets and all threads that the machine offers.
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
    /// What the scene says of its film, estimator, sampler and seed; the default for the rest.
    pub fn of(scene: &Scene) -> Self {
        let default = Self::default();
        Self {
            film: scene.film(),
            estimator: scene.render().estimator.unwrap_or(default.estimator),
            sampler: scene.render().sampler.unwrap_or(default.sampler),
            seed: scene.render().seed.unwrap_or(default.seed),
            ..default
        }
    }
}

/// As many threads as the machine offers.
pub fn all_threads() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}
