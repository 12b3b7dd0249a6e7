//! Which kernel a scene gets, and why.

use std::marker::PhantomData;

use super::stage::{Chunk, Scratch, eye, shade};
use super::tracer::{ByEmbree, InLine, Tracer};
use crate::embree::TraceLane;
use crate::estimator::{per_light, per_point};
use crate::lane::{F32x8, F32x16, Work, has_avx512, with_avx512};
use crate::scene::{EstimatorKind, Features};
use crate::settings::AccelKind;

/// Renders a chunk: eye, shade and shadow in one.
pub type Kernel = fn(&mut Chunk, &mut Scratch);

/// The most shapes that are tested in a line where the choice is free: a careful bound. With the 17 of Veach's scene the line
/// is 1.34 times as fast as Embree, with the 48 of `large-lights` still 1.24 times (16 lanes, one thread, commit 89698de); where
/// it stops to pay was not looked for yet.
const IN_LINE: usize = 32;

/// The widest packets that this processor has kernels for.
pub fn widest_lanes() -> usize {
    if has_avx512() { 16 } else { 8 }
}

/// A kernel that was chosen.
#[derive(Clone, Debug)]
pub struct Plan {
    /// Its name.
    pub name: String,
    /// Why, in a sentence.
    pub why: String,
    /// Who answers rays.
    pub accel: AccelKind,
    /// Pairs of random numbers that a sample takes.
    pub pairs: u32,
    /// The kernel.
    pub kernel: Kernel,
}

impl Plan {
    /// The kernel for a scene with `features`; `accel` is what the user insists on.
    ///
    /// # Errors
    /// A sentence where no kernel supports what is asked for, and what would do.
    pub fn choose(
        features: &Features,
        estimator: EstimatorKind,
        lanes: usize,
        accel: Option<AccelKind>,
    ) -> Result<Self, (String, &'static str)> {
        let per_light = matches!(estimator, EstimatorKind::Light | EstimatorKind::Mis);
        if per_light && features.mesh_lights > 0 {
            let (name, count) = (estimator.name(), features.mesh_lights);
            let what =
                format!("estimator \"{name}\" cannot sample lights that are meshes yet, and this scene has {count}");
            return Err((what, "use --estimator brdf, or uniform"));
        }
        match lanes {
            1 | 8 => {}
            16 if has_avx512() => {}
            16 => return Err(("16 lanes need a processor with AVX-512".to_owned(), "use --lanes 8")),
            other => return Err((format!("there is no kernel of {other} lanes"), "use --lanes 1, 8 or 16")),
        }
        let few = features.shapes <= IN_LINE;
        let free_choice = if few { AccelKind::Linear } else { AccelKind::Embree };
        let why = match (accel, few) {
            (Some(forced), _) => format!("--accel {} was asked for", forced.name()),
            (None, true) => format!("{} shapes are few enough to be tested in a line", features.shapes),
            (None, false) => format!(
                "{} shapes are more than the {IN_LINE} up to which a line is chosen",
                features.shapes
            ),
        };
        let accel = accel.unwrap_or(free_choice);
        let kernel = match accel {
            AccelKind::Embree => kernel::<ByEmbree>(estimator, lanes),
            AccelKind::Linear => kernel::<InLine>(estimator, lanes),
        };
        let pairs = 1 + if per_light { features.sphere_lights as u32 } else { 1 };
        let name = format!("{}-f32x{lanes}-{}", accel.name(), estimator.name());
        Ok(Self {
            name,
            why,
            accel,
            pairs,
            kernel,
        })
    }
}

fn kernel<T: Tracer>(estimator: EstimatorKind, lanes: usize) -> Kernel {
    match estimator {
        EstimatorKind::Uniform => of_width::<T, shade::PerPoint<per_point::Sphere>>(lanes),
        EstimatorKind::Brdf => of_width::<T, shade::PerPoint<per_point::Lobe>>(lanes),
        EstimatorKind::Light => of_width::<T, shade::PerLight<per_light::ConeOnly>>(lanes),
        EstimatorKind::Mis => of_width::<T, shade::PerLight<per_light::Average>>(lanes),
    }
}

fn of_width<T: Tracer, S: shade::Shade>(lanes: usize) -> Kernel {
    match lanes {
        16 => |chunk, scratch| with_avx512(Sixteen::<T, S>(chunk, scratch, PhantomData)),
        8 => run::<F32x8, T, S>,
        _ => run::<f32, T, S>,
    }
}

#[inline(always)]
fn run<L: TraceLane, T: Tracer, S: shade::Shade>(chunk: &mut Chunk, scratch: &mut Scratch) {
    eye::trace::<L, T>(chunk, scratch);
    S::shade::<L, T>(chunk, scratch);
}

/// A kernel of sixteen lanes, compiled as a whole for AVX-512.
struct Sixteen<'a, 'c, T, S>(&'a mut Chunk<'c>, &'a mut Scratch, PhantomData<(T, S)>);

impl<T: Tracer, S: shade::Shade> Work for Sixteen<'_, '_, T, S> {
    #[inline(always)]
    fn run(self) {
        run::<F32x16, T, S>(self.0, self.1);
    }
}
