//! Replays one sample step by step: the hit of the camera ray, the direction sampled for each light, and the contributions.
//!
//! The sample runs through the stages of a render, as a chunk of one pixel and one pass with the one-lane kernel, whose bits are
//! those of all widths. The steps are read from the streams between stages.

mod asked;
mod beside;
mod kinds;
mod listed;
mod told;
mod tracing;

use serde::Serialize;

use super::lists::Draws;
use super::model::{self, Streams};
use super::plan::Plan;
use super::progress::Counters;
use super::settings::Settings;
use super::stage::{Chunk, MARKS, Scratch, Segment, pairs};
use super::stream::Address;
use super::world::World;
use crate::bsdf::Brdf;
use crate::embree::{Coherence, NO_SKIP_ID, Ray};
use crate::estimator::density::{Density, Mix, Warp};
use crate::estimator::{ShadingPoint, per_light, per_point};
use crate::film::Tile;
use crate::lane::Word;
use crate::math::Vec3;
use crate::sampling::{PassBlock, TechniqueSample, warp};
use crate::scene::{Effect, EstimatorKind};
use told::{Told, found, of_spheres, technique};
use tracing::OneByOne;

pub use asked::{Asked, Found};
pub use beside::Beside;

/// The steps of a sample.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Replay {
    /// The pixel and the pass.
    pub sample: [u32; 3],
    /// Origin of the camera ray: 0, the pinhole that positions are relative to, or a point on the lens around it.
    pub origin: [f32; 3],
    /// Direction of the camera ray.
    pub direction: [f32; 3],
    /// The first hit of the camera ray.
    pub hit: Option<Met>,
    /// Emitted radiance that the camera sees directly.
    pub seen: [f64; 3],
    /// The point where light was sampled.
    pub point: Option<Point>,
    /// The sampled directions: one or two per light, or one for the point and one per delta light. Large meshes are left out, see
    /// [`Self::meshes_untold`].
    pub asked: Vec<Asked>,
    /// The rays traced from the point, to lights of every kind, in units of the scene.
    #[serde(skip)]
    pub rays: Vec<Segment>,
    /// Whether large emissive meshes were also sampled. Their light is part of the radiance, but they are not listed one by one.
    pub meshes_untold: bool,
    /// The rays traced to the other lights, and what each hit.
    pub beside: Vec<Beside>,
    /// Radiance of the sample: what a render adds to the pixel.
    pub radiance: [f64; 3],
    /// Rejected contributions: NaN, infinite, negative.
    pub invalid: [u64; 3],
}

/// The hit of the camera ray.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Met {
    /// Distance.
    pub distance: f32,
    /// Index of the mesh in the scene; for a sphere, the number of meshes.
    pub geometry: u32,
    /// Index of the triangle in its mesh, or of the sphere in the scene.
    pub primitive: u32,
    /// Barycentric coordinates.
    pub barycentric: [f32; 2],
}

/// A shading point.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Point {
    /// The point, offset from its surface.
    pub p: [f32; 3],
    /// Geometric normal.
    pub ng: [f32; 3],
    /// Shading normal.
    pub n: [f32; 3],
    /// Reflectance.
    pub rho: [f32; 3],
    /// 1 for diffuse, above 1 for Phong; for microfacet models the roughness, at most 1.
    pub alpha: f32,
    /// The BRDF model; for a blend, Phong.
    pub model: &'static str,
}

/// Runs the sample of a pixel in a pass through the stages of `plan`, which must have one lane. `partly` are the lights that the
/// pixel sees partially, as in [`Chunk::partly`].
pub(super) fn replay(
    plan: &Plan,
    world: &World,
    settings: &Settings,
    tile: &Tile,
    partly: &[u32],
    [x, y, pass]: [u32; 3],
) -> Replay {
    let numbers = PassBlock::new(settings.sampler, settings.seed, pass, 1, plan.pairs);
    let settings = &Settings {
        estimator: plan.estimator,
        ..*settings
    };
    let (mut sum, mut counters, mut scratch) = (tile.empty_sum(1), Counters::default(), Scratch::default());
    let width = settings.film.width;
    let mut chunk = Chunk {
        world,
        numbers: &numbers,
        tile,
        film_width: width,
        first: 0,
        pass_order: &[0],
        order: plan.order,
        mix: plan.mix,
        product: plan.product,
        lists: world.lists_of(plan.draws),
        handler: plan.handler,
        partly,
        sum: &mut sum,
        counters: &mut counters,
        log: Some(Vec::new()),
    };
    (plan.camera)(&mut chunk, &mut scratch);
    let [seen @ .., _] = chunk.sum.0[0];
    let mut asked = Vec::new();
    let mut point = None;
    // Shading builds the tables of lists, and leaves the points as they are.
    for shade in &plan.shade {
        shade(&mut chunk, &mut scratch);
    }
    let rays = chunk.log.take().unwrap_or_default();
    let tracer = &OneByOne::new(world, plan.intersector.accel);
    let sample = Sample {
        tracer,
        pixel: [x, y],
        settings,
        chunk: &chunk,
    };
    let hits = &scratch.hits;
    let shaded = [
        sample.shaded::<model::Diffuse>(hits),
        sample.shaded::<model::Phong>(hits),
        sample.shaded::<model::Ggx>(hits),
        sample.shaded::<model::Conductor>(hits),
    ];
    if let Some((there, directions)) = shaded.into_iter().flatten().last() {
        (point, asked) = (Some(there), directions);
    }
    let lists = plan.draws == Draws::All && !world.only_spheres_emit();
    let untold = lists || !world.mesh_lights.is_empty() && settings.estimator.per_light();
    let told = |ray: &Segment| {
        asked
            .iter()
            .any(|asked: &Asked| asked.found.is_some_and(|found| found.wi == ray.direction))
    };
    let others = rays.iter().filter(|ray| untold && !told(ray));
    let beside = others.map(|ray| beside::of(tracer, ray)).collect();
    let key = numbers.key(Word(y * width + x));
    let (u, v) = numbers.pair(key, Word(0), pairs::PIXEL).unit::<f32>();
    let place = (x as f32 + u, y as f32 + v);
    let (origin, direction) = if plan.held.has(Effect::Lens) {
        let (a, b) = numbers.pair(key, Word(0), numbers.last_pair()).unit::<f32>();
        world.camera.through_lens(place, warp::disk(a, b))
    } else {
        (Vec3::zero(), world.camera.direction(place.0, place.1))
    };
    let [red, green, blue, _] = sum.0[0];
    let in_scene = |v: [f32; 3]| v.map(|x| world.space.in_scene(x));
    Replay {
        sample: [x, y, pass],
        origin: in_scene(origin.lane(0)),
        direction: direction.lane(0),
        hit: met(tracer, origin, direction),
        rays: rays
            .iter()
            .map(|ray| Segment {
                origin: in_scene(ray.origin),
                tfar: world.space.in_scene(ray.tfar),
                ..*ray
            })
            .collect(),
        seen,
        point,
        asked,
        meshes_untold: untold,
        beside,
        radiance: [red, green, blue],
        invalid: [counters.invalid_nan, counters.invalid_inf, counters.invalid_negative],
    }
}

fn ray(origin: Vec3<f32>, direction: Vec3<f32>, tfar: f32, skip_id: u32) -> Ray<f32> {
    Ray {
        origin,
        direction,
        tfar,
        skip_id: Word(skip_id),
    }
}

fn met(tracer: &OneByOne, origin: Vec3<f32>, direction: Vec3<f32>) -> Option<Met> {
    let world = tracer.world;
    let hit = tracer.nearest(&ray(origin, direction, f32::INFINITY, NO_SKIP_ID), Coherence::Coherent);
    // Of spheres that coincide in single precision only one is traced; this is its index in the scene.
    let sphere = |primitive: u32| world.sphere_numbers[primitive as usize];
    let on_sphere = hit.geometry.0 == world.sphere_geometry;
    hit.found.then(|| Met {
        distance: world.space.in_scene(hit.t),
        geometry: hit.geometry.0,
        primitive: if on_sphere {
            sphere(hit.primitive.0)
        } else {
            hit.primitive.0
        },
        barycentric: [hit.u, hit.v],
    })
}

/// The context of a replay.
struct Sample<'a> {
    tracer: &'a OneByOne<'a>,
    pixel: [u32; 2],
    settings: &'a Settings,
    chunk: &'a Chunk<'a>,
}

impl Sample<'_> {
    /// The point in the stream of a model, if there is one, and the directions sampled there.
    fn shaded<M: Told>(&self, hits: &Streams) -> Option<(Point, Vec<Asked>)> {
        let chunk = self.chunk;
        let stream = M::stream(hits)?;
        let (_, at, address) = stream.packet::<f32>(0);
        let point = Point {
            p: at.p.lane(0).map(|x| chunk.world.space.in_scene(x)),
            ng: at.ng.lane(0),
            n: at.bsdf.normal().lane(0),
            rho: at.bsdf.rho().lane(0),
            alpha: M::alpha(&at.bsdf),
            model: M::NAME,
        };
        let (listed, per_light) = (chunk.lists.is_some(), self.settings.estimator.per_light());
        let mut asked = match listed && per_light {
            true => listed::directions::<M>(self, &at, &address),
            false => directions::<M>(self, &at, &address),
        };
        if listed && !per_light {
            listed::drawn::<M>(self, &at, &address, &mut asked);
        }
        Some((point, asked))
    }
}

/// The directions that the shading stage samples at a point, computed with its own functions.
fn directions<M: Told>(sample: &Sample, point: &ShadingPoint<f32, M::Of<f32>>, address: &Address<f32>) -> Vec<Asked> {
    let Sample {
        tracer,
        settings,
        chunk,
        ..
    } = *sample;
    let (world, numbers, tile) = (chunk.world, chunk.numbers, chunk.tile);
    let (mix, warp) = of_spheres::<M>(settings.estimator);
    let split =
        |i: usize| warp == Warp::DiskOrCone && i < MARKS && chunk.partly.iter().any(|lights| lights >> i & 1 == 1);
    let shared = |technique_sample: bool| {
        // All lights share the BRDF-sampled direction.
        let of = if technique_sample {
            PassBlock::after_toss
        } else {
            PassBlock::pair
        };
        of(numbers, address.key, address.pass, pairs::DIRECTION)
    };
    let for_light = |i: usize| {
        let pair = pairs::light(i);
        let mut tosses = vec![numbers.technique_sample(address.key, address.pass, pair, tile.number())];
        if mix.both() || warp != Warp::Cone {
            tosses[0].pair = numbers.pair(address.key, address.pass, pair);
        }
        tosses[0].by_brdf_lanes &= mix == Mix::Average;
        if tosses[0].by_brdf_lanes {
            tosses[0].pair = shared(true);
        }
        if mix.both() {
            let (by_brdf_lanes, pair) = (true, shared(false));
            tosses.push(TechniqueSample { by_brdf_lanes, pair });
        }
        if split(i) {
            let (by_brdf_lanes, pair) = (false, tosses[0].pair.opposite());
            tosses.push(TechniqueSample { by_brdf_lanes, pair });
        }
        tosses
    };
    let asked = |i: usize, technique_sample: TechniqueSample<Word>| {
        let light = &world.lights[i];
        let sampled = match settings.estimator {
            EstimatorKind::Projected => per_light::sample(M::Projected::of(mix), point, light, technique_sample, true),
            EstimatorKind::Product => per_light::sample(M::Product::of(mix), point, light, technique_sample, true),
            _ => per_light::sample(mix, point, light, technique_sample, true),
        };
        let cone = light.cone(point.p);
        Asked {
            light: Some(i),
            kind: Some("sphere"),
            sphere: Some(world.sphere_numbers[light.sphere as usize]),
            one_minus_cos_max: Some(cone.one_minus_cos_max),
            cone_pdf: Some(cone.pdf()),
            technique: if technique_sample.by_brdf_lanes {
                "brdf"
            } else {
                technique(warp, point, light)
            },
            lobe: technique_sample
                .by_brdf_lanes
                .then(|| per_light::along_lobe(point, technique_sample.pair).lane(0)),
            found: sampled.filter(|sampled| sampled.active).map(|sampled| {
                let shadow = ray(point.p, sampled.wi, sampled.distance, light.sphere);
                let occluded = tracer.occluded(&shadow);
                let towards = (sampled.wi, sampled.distance);
                let found = found(world, point, towards, Some(light.le), sampled.ld, occluded);
                let share = if split(i) { 0.5 } else { 1.0 };
                Found {
                    ld: found.ld.map(|ld| ld * share),
                    ..found
                }
            }),
        }
    };
    if settings.estimator.per_light() {
        let mut all = Vec::new();
        // Loops: iterators would compile the estimators for every step of theirs.
        for i in 0..world.lights.len() {
            for technique_sample in for_light(i) {
                all.push(asked(i, technique_sample));
            }
        }
        kinds::each(sample, point, address, &mut all);
        kinds::deltas(sample, point, address, &mut all);
        return all;
    }
    let uniform = settings.estimator == EstimatorKind::Uniform;
    let pair = numbers.pair(address.key, address.pass, pairs::DIRECTION);
    let sampled = if uniform {
        per_point::sample::<f32, per_point::Sphere>(point, pair, true)
    } else {
        per_point::sample::<f32, per_point::Lobe>(point, pair, true)
    };
    let asked = Asked {
        light: None,
        kind: None,
        sphere: None,
        one_minus_cos_max: None,
        cone_pdf: None,
        technique: if uniform { "sphere" } else { "brdf" },
        lobe: (!uniform).then(|| per_light::along_lobe(point, pair).lane(0)),
        found: sampled.filter(|sampled| sampled.active).map(|sampled| {
            let towards = ray(point.p, sampled.wi, f32::INFINITY, NO_SKIP_ID);
            let hit = tracer.nearest(&towards, Coherence::Incoherent);
            let surface = |()| world.surfaces[world.surface_index(hit.geometry.0, hit.primitive.0) as usize];
            let environment = || world.environment.is_some() || world.suns.iter().any(|sun| sun.contains(sampled.wi));
            let lit = match hit.found {
                true => surface(()).le.is_some(),
                false => environment(),
            };
            found(
                world,
                point,
                (sampled.wi, hit.t),
                Some([1.0; 3]),
                sampled.throughput,
                !lit,
            )
        }),
    };
    let mut all = vec![asked];
    kinds::deltas(sample, point, address, &mut all);
    all
}
