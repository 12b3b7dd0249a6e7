//! The tables of compiled stages: the eye stage for sets of effects, the shade stage for each estimator and each model of
//! reflection. A chunk runs one row of the first table and one for each model that there is of the second, so an effect adds rows
//! to its own table and multiplies nothing in the other.

use std::marker::PhantomData;

use super::lists::Probed;
use super::model::{self, Model};
use super::stage::{Chunk, Directions, Penumbra, Scratch, Stage, camera, each, listed, meshes, shade};
use super::tracer::{BruteForce, ByEmbree};
use crate::embree::{LaneWork, TraceLane, in_eight_of_avx512, in_sixteen};
use crate::estimator::density::{Average, ConeOnly, ConeOrCap, LobeInCap, Mix, Projected};
use crate::estimator::{per_light, per_point};
use crate::lane::{F32x8, has_avx512};
use crate::scene::{Effect, Effects};
use crate::settings::{AccelKind, EstimatorKind, Lanes};

/// A stage, compiled.
pub type Run = fn(&mut Chunk, &mut Scratch);

/// A stage, compiled for every width of packets.
#[derive(Clone, Copy, Debug)]
pub struct Kernel([Run; 4]);

/// An eye stage traces packet by packet, so it is compiled for every intersector too.
#[derive(Clone, Copy, Debug)]
pub struct CameraKernel {
    embree: Kernel,
    line: Kernel,
}

/// The rows of the eye stage with the effects that each holds.
macro_rules! camera_kernels {
    ($([$($effect:ident),*],)*) => {
        &[$({
            const COMPILED_IN: Effects = Effects::of(&[$(Effect::$effect),*]);
            const ROW: CameraKernel = CameraKernel {
                embree: Kernel::of::<camera::CameraStage<ByEmbree, { COMPILED_IN.bits() }>>(),
                line: Kernel::of::<camera::CameraStage<BruteForce, { COMPILED_IN.bits() }>>(),
            };
            (COMPILED_IN, ROW)
        },)*]
    };
}

/// The eye stage, from the fewest effects to the most; the last row holds them all. Effects share a row where one that is held but
/// not called for costs less than 1 % of a sample's instructions (`docs/effects/README.md` has the figures).
const CAMERA_KERNELS: &[(Effects, CameraKernel)] = camera_kernels![
    [Diffuse],
    [Diffuse, Phong],
    [Diffuse, Phong, SmoothNormals],
    [Diffuse, Phong, SmoothNormals, Blend, OneSided, Textures],
    [
        Diffuse,
        Phong,
        SmoothNormals,
        Blend,
        OneSided,
        Textures,
        Environment,
        Ggx,
        Conductor,
        Suns
    ],
    [
        Diffuse,
        Phong,
        SmoothNormals,
        Blend,
        OneSided,
        Textures,
        Environment,
        Ggx,
        Conductor,
        Suns,
        SmoothTerminator
    ],
    [
        Diffuse,
        Phong,
        SmoothNormals,
        Blend,
        OneSided,
        Textures,
        Environment,
        Ggx,
        Conductor,
        Suns,
        SmoothTerminator,
        Lens
    ],
];

/// The models of reflection, in the order in which their points are shaded.
pub const MODELS: [Effect; 4] = [Effect::Diffuse, Effect::Phong, Effect::Ggx, Effect::Conductor];

/// The row of the eye stage with the fewest effects that holds `needs`, as far as they concern it, and what it holds.
pub fn camera(needs: Effects) -> &'static (Effects, CameraKernel) {
    let concern = CAMERA_KERNELS[CAMERA_KERNELS.len() - 1].0;
    let row = CAMERA_KERNELS
        .iter()
        .find(|(held, _)| held.contains(needs.intersection(concern)));
    row.unwrap_or(&CAMERA_KERNELS[CAMERA_KERNELS.len() - 1])
}

/// The row for films on which nothing is in sight.
pub const fn blank() -> Kernel {
    Kernel::of::<camera::Blank>()
}

/// The rows that shade the points of a model by an estimator: one where a direction serves all lights, else those of the kinds of
/// light among `needs`, or with `lists` one for spheres and triangles together; and that of delta lights, which no direction of the
/// other rows can meet.
pub fn shade(estimator: EstimatorKind, needs: Effects, lists: bool, model: Effect) -> Vec<Kernel> {
    match model {
        Effect::Phong => shade_model::<model::Phong>(estimator, (needs, lists)),
        Effect::Ggx => shade_model::<model::Ggx>(estimator, (needs, lists)),
        Effect::Conductor => shade_model::<model::Conductor>(estimator, (needs, lists)),
        _ => shade_model::<model::Diffuse>(estimator, (needs, lists)),
    }
}

/// The row that finds where lights are seen in part, for the estimator that sends more rays there.
pub fn find_penumbrae(estimator: EstimatorKind, needs: Effects) -> Option<Kernel> {
    let calls = estimator == EstimatorKind::Product && needs.has(Effect::Diffuse) && needs.has(Effect::SphereLights);
    calls.then(Kernel::of::<Penumbra>)
}

/// How an estimator combines directions of lights with those of the BRDF. `product` does so for all lights but spheres, whose
/// directions are those of [`Suited::Product`].
pub const fn mix(estimator: EstimatorKind) -> Mix {
    match estimator {
        EstimatorKind::Mis | EstimatorKind::Product => Mix::Average,
        EstimatorKind::Mis2Balance => Mix::Balance,
        EstimatorKind::Mis2Power => Mix::Power,
        _ => Mix::Light,
    }
}

/// The densities that suit a model where an estimator leaves them to it.
pub(super) trait Suited: Model {
    /// The density of `projected`: a lobe that is not in proportion to the cosine has to do with cones.
    type Projected: Directions<Self> + per_light::Directions<f32, Self::Of<f32>>;
    /// The density of `product`: lobes of which no part can be drawn have to do with the mixture of `mis`.
    type Product: Directions<Self> + per_light::Directions<f32, Self::Of<f32>>;
}

impl Suited for model::Diffuse {
    type Projected = Projected;
    type Product = ConeOrCap;
}

impl Suited for model::Phong {
    type Projected = ConeOnly;
    type Product = LobeInCap;
}

impl Suited for model::Ggx {
    type Projected = ConeOnly;
    type Product = Average;
}

impl Suited for model::Conductor {
    type Projected = ConeOnly;
    type Product = Average;
}

fn shade_model<M: Suited + Probed>(estimator: EstimatorKind, needs: (Effects, bool)) -> Vec<Kernel> {
    let mut rows = match estimator {
        EstimatorKind::Uniform => vec![Kernel::of::<shade::PerPoint<per_point::Sphere, M>>()],
        EstimatorKind::Brdf => vec![Kernel::of::<shade::PerPoint<per_point::Lobe, M>>()],
        EstimatorKind::Light => kinds::<ConeOnly, M>(needs),
        EstimatorKind::Mis => kinds::<Average, M>(needs),
        EstimatorKind::Mis2Balance | EstimatorKind::Mis2Power => kinds::<Mix, M>(needs),
        EstimatorKind::Projected => kinds::<M::Projected, M>(needs),
        EstimatorKind::Product => kinds::<M::Product, M>(needs),
    };
    if needs.0.has(Effect::DeltaLights) {
        rows.push(Kernel::of::<each::PerDelta<M>>());
    }
    rows
}

/// A stage for each kind of light; with `lists` one for spheres and triangles together. Only those for spheres are compiled for the
/// density; the others look the mix up when they run.
fn kinds<D: Directions<M>, M: Probed>((needs, lists): (Effects, bool)) -> Vec<Kernel> {
    let kinds = [
        (Effect::SphereLights, Kernel::of::<shade::PerLight<D, M>>()),
        (Effect::MeshLights, Kernel::of::<each::PerTriangle<M>>()),
        (Effect::MeshLights, Kernel::of::<meshes::PerMesh<M>>()),
        (Effect::Environment, Kernel::of::<each::PerEnvironment<M>>()),
        (Effect::Suns, Kernel::of::<each::PerSun<M>>()),
    ];
    let in_lists = |kind: Effect| lists && matches!(kind, Effect::SphereLights | Effect::MeshLights);
    let there = kinds
        .into_iter()
        .filter(|(kind, _)| needs.has(*kind) && !in_lists(*kind));
    let listed = lists.then(Kernel::of::<listed::PerListed<D, M>>);
    listed.into_iter().chain(there.map(|(_, row)| row)).collect()
}

impl Kernel {
    const fn of<S: Stage>() -> Self {
        Self([
            S::run::<f32>,
            S::run::<F32x8>,
            |chunk, scratch| in_eight_of_avx512(OfChunk::<S>(chunk, scratch, PhantomData)),
            |chunk, scratch| in_sixteen(OfChunk::<S>(chunk, scratch, PhantomData)),
        ])
    }

    /// The stage for packets of 1, 8 or 16 lanes; eight have AVX-512 where it is there.
    pub fn run(&self, lanes: Lanes) -> Run {
        let [one, eight, eight_of_avx512, sixteen] = self.0;
        match lanes {
            Lanes::Sixteen => sixteen,
            Lanes::Eight if has_avx512() => eight_of_avx512,
            Lanes::Eight => eight,
            Lanes::One => one,
        }
    }
}

impl CameraKernel {
    /// The stage for an intersector and a width.
    pub fn run(&self, accel: AccelKind, lanes: Lanes) -> Run {
        match accel {
            AccelKind::Embree => self.embree.run(lanes),
            AccelKind::Linear => self.line.run(lanes),
        }
    }
}

/// A stage with its chunk.
struct OfChunk<'a, 'c, S>(&'a mut Chunk<'c>, &'a mut Scratch, PhantomData<S>);

impl<S: Stage> LaneWork for OfChunk<'_, '_, S> {
    #[inline(always)]
    fn run<L: TraceLane>(self) {
        S::run::<L>(self.0, self.1);
    }
}
