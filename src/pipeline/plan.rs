//! Which kernel a scene gets, and why.

use super::stage::{Chunk, Scratch, eye, shade};
use crate::embree::TraceLane;
use crate::estimator::{per_light, per_point};
use crate::lane::F32x8;
use crate::scene::{EstimatorKind, Features};

/// Renders a chunk: eye, shade and shadow in one.
pub type Kernel = fn(&mut Chunk, &mut Scratch);

/// A kernel that was chosen.
#[derive(Clone, Debug)]
pub struct Plan {
    /// Its name.
    pub name: String,
    /// Pairs of random numbers that a sample takes.
    pub pairs: u32,
    /// The kernel.
    pub kernel: Kernel,
}

impl Plan {
    /// The kernel for a scene with `features`.
    ///
    /// # Errors
    /// A sentence where no kernel supports what is asked for.
    pub fn choose(features: &Features, estimator: EstimatorKind, lanes: usize) -> Result<Self, String> {
        let per_light = matches!(estimator, EstimatorKind::Light | EstimatorKind::Mis);
        if per_light && features.mesh_lights > 0 {
            return Err(format!(
                "estimator \"{}\" cannot sample lights that are meshes yet, and this scene has {}; use \"brdf\" or \"uniform\"",
                estimator.name(),
                features.mesh_lights,
            ));
        }
        let kernel = match lanes {
            1 => kernel::<f32>(estimator),
            8 => kernel::<F32x8>(estimator),
            other => return Err(format!("there are kernels of 1 and of 8 lanes, not of {other}")),
        };
        let pairs = 1 + if per_light { features.sphere_lights as u32 } else { 1 };
        Ok(Self {
            name: format!("embree-f32x{lanes}-{}", estimator.name()),
            pairs,
            kernel,
        })
    }
}

fn kernel<L: TraceLane>(estimator: EstimatorKind) -> Kernel {
    match estimator {
        EstimatorKind::Uniform => directions::<L, per_point::Sphere>,
        EstimatorKind::Brdf => directions::<L, per_point::Lobe>,
        EstimatorKind::Light => lights::<L, per_light::ConeOnly>,
        EstimatorKind::Mis => lights::<L, per_light::Average>,
    }
}

fn lights<L: TraceLane, D: per_light::Density>(chunk: &mut Chunk, scratch: &mut Scratch) {
    eye::trace::<L>(chunk, scratch);
    shade::lights::<L, D>(chunk, scratch);
}

fn directions<L: TraceLane, D: per_point::Density>(chunk: &mut Chunk, scratch: &mut Scratch) {
    eye::trace::<L>(chunk, scratch);
    shade::directions::<L, D>(chunk, scratch);
}
