//! The tables of compiled stages: a row for the eye stage, one for each way to shade. A chunk calls one row of each table, so an
//! effect of one stage adds rows to its own table and multiplies nothing in the other.

use std::marker::PhantomData;

use super::stage::{Chunk, Scratch, Stage, eye, shade};
use super::tracer::{ByEmbree, InLine, Tracer};
use crate::estimator::{per_light, per_point};
use crate::lane::{F32x8, F32x16, Work, with_avx512};
use crate::settings::{AccelKind, EstimatorKind};

/// A stage, compiled.
pub type Run = fn(&mut Chunk, &mut Scratch);

/// A stage, compiled for every width of packets and whoever answers rays.
#[derive(Clone, Copy, Debug)]
pub struct Row {
    embree: [Run; 3],
    line: [Run; 3],
}

/// The row of the eye stage.
pub const fn eye() -> Row {
    Row::of::<eye::Eye>()
}

/// The row that shades by an estimator.
pub const fn shade(estimator: EstimatorKind) -> Row {
    match estimator {
        EstimatorKind::Uniform => Row::of::<shade::PerPoint<per_point::Sphere>>(),
        EstimatorKind::Brdf => Row::of::<shade::PerPoint<per_point::Lobe>>(),
        EstimatorKind::Light => Row::of::<shade::PerLight<per_light::ConeOnly>>(),
        EstimatorKind::Mis => Row::of::<shade::PerLight<per_light::Average>>(),
    }
}

impl Row {
    const fn of<S: Stage>() -> Self {
        Self {
            embree: widths::<S, ByEmbree>(),
            line: widths::<S, InLine>(),
        }
    }

    /// The stage for packets of 1, 8 or 16 lanes.
    pub const fn run(&self, accel: AccelKind, lanes: usize) -> Run {
        let [one, eight, sixteen] = match accel {
            AccelKind::Embree => self.embree,
            AccelKind::Linear => self.line,
        };
        match lanes {
            16 => sixteen,
            8 => eight,
            _ => one,
        }
    }
}

const fn widths<S: Stage, T: Tracer>() -> [Run; 3] {
    [S::run::<f32, T>, S::run::<F32x8, T>, |chunk, scratch| {
        with_avx512(Sixteen::<S, T>(chunk, scratch, PhantomData));
    }]
}

/// A stage of sixteen lanes, compiled as a whole for AVX-512.
struct Sixteen<'a, 'c, S, T>(&'a mut Chunk<'c>, &'a mut Scratch, PhantomData<(S, T)>);

impl<S: Stage, T: Tracer> Work for Sixteen<'_, '_, S, T> {
    #[inline(always)]
    fn run(self) {
        S::run::<F32x16, T>(self.0, self.1);
    }
}
