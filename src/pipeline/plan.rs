//! Which kernel a scene gets, and why.

use std::marker::PhantomData;

use super::stage::{Chunk, Scratch, eye, shade};
use crate::embree::TraceLane;
use crate::estimator::{per_light, per_point};
use crate::lane::{F32x8, F32x16, Work, has_avx512, with_avx512};
use crate::scene::{EstimatorKind, Features};

/// Renders a chunk: eye, shade and shadow in one.
pub type Kernel = fn(&mut Chunk, &mut Scratch);

/// The widest packets that this processor has kernels for.
pub fn widest_lanes() -> usize {
    if has_avx512() { 16 } else { 8 }
}

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
            16 if has_avx512() => kernel16(estimator),
            16 => return Err("16 lanes need a processor with AVX-512; use 8".to_owned()),
            other => return Err(format!("there are kernels of 1, 8 and 16 lanes, not of {other}")),
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

/// The kernels of sixteen lanes, each compiled as a whole for AVX-512.
fn kernel16(estimator: EstimatorKind) -> Kernel {
    match estimator {
        EstimatorKind::Uniform => {
            |chunk, scratch| with_avx512(Directions::<per_point::Sphere>(chunk, scratch, PhantomData))
        }
        EstimatorKind::Brdf => |chunk, scratch| with_avx512(Directions::<per_point::Lobe>(chunk, scratch, PhantomData)),
        EstimatorKind::Light => {
            |chunk, scratch| with_avx512(Lights::<per_light::ConeOnly>(chunk, scratch, PhantomData))
        }
        EstimatorKind::Mis => |chunk, scratch| with_avx512(Lights::<per_light::Average>(chunk, scratch, PhantomData)),
    }
}

struct Lights<'a, 'c, D>(&'a mut Chunk<'c>, &'a mut Scratch, PhantomData<D>);
struct Directions<'a, 'c, D>(&'a mut Chunk<'c>, &'a mut Scratch, PhantomData<D>);

impl<D: per_light::Density> Work for Lights<'_, '_, D> {
    #[inline(always)]
    fn run(self) {
        lights::<F32x16, D>(self.0, self.1);
    }
}

impl<D: per_point::Density> Work for Directions<'_, '_, D> {
    #[inline(always)]
    fn run(self) {
        directions::<F32x16, D>(self.0, self.1);
    }
}

#[inline(always)]
fn lights<L: TraceLane, D: per_light::Density>(chunk: &mut Chunk, scratch: &mut Scratch) {
    eye::trace::<L>(chunk, scratch);
    shade::lights::<L, D>(chunk, scratch);
}

#[inline(always)]
fn directions<L: TraceLane, D: per_point::Density>(chunk: &mut Chunk, scratch: &mut Scratch) {
    eye::trace::<L>(chunk, scratch);
    shade::directions::<L, D>(chunk, scratch);
}
