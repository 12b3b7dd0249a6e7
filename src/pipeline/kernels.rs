//! Tables of compiled stages: camera stages by set of effects, shading stages by estimator and BRDF model. A chunk runs one row of
//! the camera table, and the rows of the shading table for each BRDF model present. An effect therefore adds rows to one table
//! only; the tables do not multiply.

use std::marker::PhantomData;

use super::lists::{Draws, Probed};
use super::model::{self, Model};
use super::stage::{Chunk, Directions, Penumbra, Scratch, Stage, camera, each, listed, meshes, shade, walked};
use super::tracer::{BruteForce, ByEmbree};
use crate::embree::{LaneWork, TraceLane, in_eight_of_avx512, in_sixteen};
use crate::estimator::density::{Average, ConeOnly, DiskOrCone, LobeInCap, Mix, Projected};
use crate::estimator::{per_light, per_point};
use crate::lane::{F32x8, has_avx512};
use crate::scene::{Effect, Effects};
use crate::settings::{AccelKind, EstimatorKind, Lanes};

/// A compiled stage.
pub type Run = fn(&mut Chunk, &mut Scratch);

/// A stage compiled for every packet width.
#[derive(Clone, Copy, Debug)]
pub struct Kernel([Run; 4]);

/// A camera stage traces packet by packet, so it is also compiled per intersector.
#[derive(Clone, Copy, Debug)]
pub struct CameraKernel {
    embree: Kernel,
    line: Kernel,
}

/// The rows of the camera table. Each row has the effects of the row before it and those that are listed.
macro_rules! camera_kernels {
    ($([$($effect:ident),*],)*) => { camera_kernels!(@ [] [] $([$($effect)*])*) };
    (@ [$($before:ident)*] [$($rows:expr,)*] [$($effect:ident)*] $($more:tt)*) => {
        camera_kernels!(@ [$($before)* $($effect)*] [$($rows,)* {
            const COMPILED_IN: Effects = Effects::of(&[$(Effect::$before,)* $(Effect::$effect),*]);
            const ROW: CameraKernel = CameraKernel {
                embree: Kernel::of::<camera::CameraStage<ByEmbree, { COMPILED_IN.bits() }>>(),
                line: Kernel::of::<camera::CameraStage<BruteForce, { COMPILED_IN.bits() }>>(),
            };
            (COMPILED_IN, ROW)
        },] $($more)*)
    };
    (@ [$($all:ident)*] [$($rows:expr,)*]) => { &[$($rows),*] };
}

/// The camera stages, from fewest effects to most; the last row has all. Effects share a row if compiling one in without using it
/// costs less than 1 % of a sample's instructions (`docs/effects/README.md` has the figures).
const CAMERA_KERNELS: &[(Effects, CameraKernel)] = camera_kernels![
    [Diffuse],
    [Phong],
    [SmoothNormals],
    [Blend, OneSided, Textures, SmoothTerminator],
    [Environment, Ggx, Conductor, Suns],
    [Lens],
];

/// The BRDF models, in the order in which their points are shaded.
pub const MODELS: [Effect; 4] = [Effect::Diffuse, Effect::Phong, Effect::Ggx, Effect::Conductor];

/// The smallest row of the camera table that covers the camera effects among `needs`, and the effects compiled in.
pub fn camera(needs: Effects) -> &'static (Effects, CameraKernel) {
    let concern = CAMERA_KERNELS[CAMERA_KERNELS.len() - 1].0;
    let row = CAMERA_KERNELS
        .iter()
        .find(|(held, _)| held.contains(needs.intersection(concern)));
    row.unwrap_or(&CAMERA_KERNELS[CAMERA_KERNELS.len() - 1])
}

/// The stage for views that contain no geometry or environment.
pub const fn blank() -> Kernel {
    Kernel::of::<camera::Blank>()
}

/// The stages that shade points of one BRDF model with an estimator. An estimator with one direction per point has a single stage.
/// The others have one for each kind of light among `needs`; lists have one for all kinds that are in them. Delta lights that are in no
/// list have their own stage in all estimators, because no sampled direction can hit them.
pub fn shade(estimator: EstimatorKind, needs: Effects, draws: Draws, model: Effect) -> Vec<Kernel> {
    match model {
        Effect::Phong => shade_model::<model::Phong>(estimator, (needs, draws)),
        Effect::Ggx => shade_model::<model::Ggx>(estimator, (needs, draws)),
        Effect::Conductor => shade_model::<model::Conductor>(estimator, (needs, draws)),
        _ => shade_model::<model::Diffuse>(estimator, (needs, draws)),
    }
}

/// The stage that finds partially visible lights, for the estimator that traces more rays there.
pub fn find_penumbrae(estimator: EstimatorKind, needs: Effects) -> Option<Kernel> {
    let calls = estimator == EstimatorKind::Product && needs.has(Effect::Diffuse) && needs.has(Effect::SphereLights);
    calls.then(Kernel::of::<Penumbra>)
}

/// How an estimator combines light sampling and BRDF sampling. `product` uses this where it has no technique in proportion to the
/// product: for spheres that is told by [`Suited::Product`], for other lights by
/// [`LightKind::product`](crate::estimator::kind::LightKind::product). Against the one-sample model of `mis` two directions have 3.4
/// times less error in 1.7 times the time on `mesh-light`, 3.3 and 1.7 on `ggx`. The balance heuristic has 14 % more error on
/// `mesh-light`, 4 % less on `ggx`, and the same on `lamps` and `still-life` (192 x 128, 64 samples a pixel, 6 to 10 seeds).
pub const fn mix(estimator: EstimatorKind) -> Mix {
    match estimator {
        EstimatorKind::Mis => Mix::Average,
        EstimatorKind::Mis2Balance => Mix::Balance,
        EstimatorKind::Mis2Power | EstimatorKind::Product => Mix::Power,
        _ => Mix::Light,
    }
}

/// The sampling densities of a BRDF model, for estimators whose density depends on the model. Common models have stages of their own
/// for `light` and `mis`; for the others one stage reads the mix at run time, which saves compile time.
pub(super) trait Suited: Model {
    /// The density of `light`.
    type Light: Directions<Self>;
    /// The density of `mis`.
    type Mis: Directions<Self>;
    /// The density of `projected`. Lobes not proportional to the cosine fall back to cone sampling.
    type Projected: Directions<Self> + per_light::Directions<f32, Self::Of<f32>>;
    /// The density of `product`. Lobes that cannot be sampled in part fall back to both techniques.
    type Product: Directions<Self> + per_light::Directions<f32, Self::Of<f32>>;
    /// With lists, the stage of points that walk down the tree of lights by themselves. It reads the mix at run time.
    const WALKED: Option<Kernel> = None;
}

impl Suited for model::Diffuse {
    type Light = ConeOnly;
    type Mis = Average;
    type Projected = Projected;
    type Product = DiskOrCone;
}

impl Suited for model::Phong {
    type Light = ConeOnly;
    type Mis = Average;
    type Projected = ConeOnly;
    type Product = LobeInCap;
    const WALKED: Option<Kernel> = Some(Kernel::of::<walked::PerWalked<Self>>());
}

impl Suited for model::Ggx {
    type Light = Mix;
    type Mis = Mix;
    type Projected = Mix;
    type Product = Mix;
}

impl Suited for model::Conductor {
    type Light = Mix;
    type Mis = Mix;
    type Projected = Mix;
    type Product = Mix;
    const WALKED: Option<Kernel> = Some(Kernel::of::<walked::PerWalked<Self>>());
}

fn shade_model<M: Suited + Probed>(estimator: EstimatorKind, needs: (Effects, Draws)) -> Vec<Kernel> {
    let mut rows = match estimator {
        EstimatorKind::Uniform => vec![Kernel::of::<shade::PerPoint<per_point::Sphere, M>>()],
        EstimatorKind::Brdf => vec![Kernel::of::<shade::PerPoint<per_point::Lobe, M>>()],
        EstimatorKind::Light => kinds::<M::Light, M>(needs),
        EstimatorKind::Mis => kinds::<M::Mis, M>(needs),
        EstimatorKind::Mis2Balance | EstimatorKind::Mis2Power => kinds::<Mix, M>(needs),
        EstimatorKind::Projected => kinds::<M::Projected, M>(needs),
        EstimatorKind::Product => kinds::<M::Product, M>(needs),
    };
    if needs.1 == Draws::Deltas {
        rows.extend(many::<Mix, M>());
    }
    if needs.0.has(Effect::DeltaLights) {
        rows.push(Kernel::of::<each::PerDelta<M>>());
    }
    rows
}

/// The stages that draw from lists of lights.
fn many<D: Directions<M>, M: Suited + Probed>() -> impl Iterator<Item = Kernel> {
    #[cfg(feature = "rival")]
    if std::env::var_os("OCTOLUX_RIVAL").is_some() {
        return Some(Kernel::of::<super::stage::rival::PerRival<M>>())
            .into_iter()
            .chain(None);
    }
    Some(Kernel::of::<listed::PerListed<D, M>>())
        .into_iter()
        .chain(M::WALKED)
}

/// One stage per kind of light; with lists, one for spheres, triangles and delta lights together. Only the sphere and list stages are
/// specialized for the density; the others read the mix at run time.
fn kinds<D: Directions<M>, M: Suited + Probed>((needs, draws): (Effects, Draws)) -> Vec<Kernel> {
    let lists = draws == Draws::All;
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
    let many = lists.then(many::<D::Listed, M>).into_iter().flatten();
    many.chain(there.map(|(_, row)| row)).collect()
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

    /// The stage for packets of 1, 8 or 16 lanes. Eight lanes use AVX-512 if the processor has it.
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
    /// The stage for an intersector and a packet width.
    pub fn run(&self, accel: AccelKind, lanes: Lanes) -> Run {
        match accel {
            AccelKind::Embree => self.embree.run(lanes),
            AccelKind::Linear => self.line.run(lanes),
        }
    }
}

/// A stage and the chunk it runs on.
struct OfChunk<'a, 'c, S>(&'a mut Chunk<'c>, &'a mut Scratch, PhantomData<S>);

impl<S: Stage> LaneWork for OfChunk<'_, '_, S> {
    #[inline(always)]
    fn run<L: TraceLane>(self) {
        S::run::<L>(self.0, self.1);
    }
}
