//! One sample again, step by step: what the eye ray met, which direction each light got, and what came of it.
//!
//! The sample goes through the very stages of a render, as a chunk of one pixel and one pass by the kernel of one lane, whose bits are
//! those of all widths; the steps are read from the streams in between.

mod asked;
mod beside;
mod kinds;
mod told;

use serde::Serialize;

use super::model::{self, Streams};
use super::plan::Plan;
use super::progress::Counters;
use super::rows;
use super::settings::Settings;
use super::stage::{Chunk, MARKS, Scratch, Segment, pairs};
use super::stream::Address;
use super::tracer::{ByEmbree, InLine, Tracer};
use super::world::World;
use crate::bsdf::{Brdf, Tint};
use crate::embree::{Coherence, NO_SPHERE, Ray};
use crate::estimator::density::{Density, Mix, Warp};
use crate::estimator::{ShadingPoint, per_light, per_point};
use crate::film::Tile;
use crate::lane::Word;
use crate::math::Vec3;
use crate::sampling::{PassBlock, Toss, warp};
use crate::scene::{Effect, EstimatorKind};
use crate::settings::AccelKind;
use told::Told;

pub use asked::{Asked, Found};
pub use beside::Beside;

/// What a sample did.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Replay {
    /// The pixel and the pass.
    pub sample: [u32; 3],
    /// Where the eye ray starts: at 0, the pinhole that positions here are relative to, or on the lens around it.
    pub origin: [f32; 3],
    /// Direction of the eye ray.
    pub direction: [f32; 3],
    /// What it met first.
    pub hit: Option<Met>,
    /// Radiance that the eye sees there itself.
    pub seen: [f64; 3],
    /// Where light was asked for.
    pub point: Option<Point>,
    /// The directions in which it was asked for: one or two for each sphere that emits, or one for the point.
    pub asked: Vec<Asked>,
    /// The rays from the point that were traced, to lights of every kind.
    #[serde(skip)]
    pub rays: Vec<Segment>,
    /// Whether estimators with a direction for every light also asked for large meshes that emit, which are in the radiance but not told
    /// one by one.
    pub meshes_untold: bool,
    /// The rays to these that were traced, and what each met.
    pub beside: Vec<Beside>,
    /// Radiance of the sample: what a render adds to the pixel.
    pub radiance: [f64; 3],
    /// Contributions that were thrown away: NaN, infinite, below 0.
    pub invalid: [u64; 3],
}

/// A hit of the eye ray.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Met {
    /// Distance.
    pub distance: f32,
    /// Number of the mesh in the scene, or of all meshes for a sphere.
    pub geometry: u32,
    /// Number of the triangle or sphere.
    pub primitive: u32,
    /// Barycentric coordinates.
    pub barycentric: [f32; 2],
}

/// A shading point.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Point {
    /// The point, moved off its surface.
    pub p: [f32; 3],
    /// Geometric normal.
    pub ng: [f32; 3],
    /// Shading normal.
    pub n: [f32; 3],
    /// Reflectance.
    pub rho: [f32; 3],
    /// 1 for diffuse, above 1 for Phong; for models with microfacets the roughness of their distribution, at most 1.
    pub alpha: f32,
    /// The model of reflection; of a blend, Phong's.
    pub model: &'static str,
}

/// Runs the sample of a pixel in a pass through the stages of `plan`, which must be of one lane. `partly` are the lights that the pixel
/// sees in part, as [`Chunk::partly`].
pub(super) fn replay(
    plan: &Plan,
    world: &World,
    settings: &Settings,
    tile: &Tile,
    partly: &[u32],
    [x, y, pass]: [u32; 3],
) -> Replay {
    let numbers = PassBlock::new(settings.sampler, settings.seed, pass, 1, plan.pairs);
    let (mut sum, mut counters, mut scratch) = (tile.empty_sum(1), Counters::default(), Scratch::default());
    let width = settings.film.width;
    let mut chunk = Chunk {
        world,
        numbers: &numbers,
        tile,
        film_width: width,
        first: 0,
        turns: &[0],
        order: plan.order,
        mix: plan.mix,
        answers: plan.answers,
        partly,
        sum: &mut sum,
        counters: &mut counters,
        log: Some(Vec::new()),
    };
    (plan.eye)(&mut chunk, &mut scratch);
    let [seen @ .., _] = chunk.sum.0[0];
    let mut asked = Vec::new();
    let mut point = None;
    let sample = Sample {
        accel: plan.intersector.accel,
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
    for shade in &plan.shade {
        shade(&mut chunk, &mut scratch);
    }
    let rays = chunk.log.take().unwrap_or_default();
    let untold = !world.mesh_lights.is_empty() && settings.estimator.per_light();
    let told = |ray: &Segment| {
        asked
            .iter()
            .any(|asked: &Asked| asked.found.is_some_and(|found| found.wi == ray.direction))
    };
    let others = rays.iter().filter(|ray| untold && !told(ray));
    let beside = others.map(|ray| match plan.intersector.accel {
        AccelKind::Embree => beside::of::<ByEmbree>(world, ray),
        AccelKind::Linear => beside::of::<InLine>(world, ray),
    });
    let beside = beside.collect();
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
    Replay {
        sample: [x, y, pass],
        origin: origin.lane(0),
        direction: direction.lane(0),
        hit: match plan.intersector.accel {
            AccelKind::Embree => met::<ByEmbree>(world, origin, direction),
            AccelKind::Linear => met::<InLine>(world, origin, direction),
        },
        rays,
        seen,
        point,
        asked,
        meshes_untold: untold,
        beside,
        radiance: [red, green, blue],
        invalid: [counters.invalid_nan, counters.invalid_inf, counters.invalid_negative],
    }
}

fn ray(origin: Vec3<f32>, direction: Vec3<f32>, tfar: f32, aims_at: u32) -> Ray<f32> {
    Ray {
        origin,
        direction,
        tfar,
        aims_at: Word(aims_at),
    }
}

fn met<T: Tracer>(world: &World, origin: Vec3<f32>, direction: Vec3<f32>) -> Option<Met> {
    let mut set = Default::default();
    T::face_all(world, &mut set);
    let hit = T::nearest::<f32>(
        world,
        &set,
        true,
        &ray(origin, direction, f32::INFINITY, NO_SPHERE),
        Coherence::Coherent,
    );
    hit.found.then_some(Met {
        distance: world.space.in_scene(hit.t),
        geometry: hit.geometry.0,
        primitive: hit.primitive.0,
        barycentric: [hit.u, hit.v],
    })
}

/// Where a sample is replayed.
struct Sample<'a> {
    accel: AccelKind,
    settings: &'a Settings,
    chunk: &'a Chunk<'a>,
}

impl Sample<'_> {
    /// The point in the stream of a model, if one is there, and the directions that are asked for there.
    fn shaded<M: Told>(&self, hits: &Streams) -> Option<(Point, Vec<Asked>)> {
        let &Self { accel, settings, chunk } = self;
        let stream = M::stream(hits);
        if stream.len() == 0 {
            return None;
        }
        let (_, at, address) = stream.packet::<f32>(0);
        let point = Point {
            p: at.p.lane(0).map(|x| chunk.world.space.in_scene(x)),
            ng: at.ng.lane(0),
            n: at.bsdf.normal().lane(0),
            rho: at.bsdf.rho().lane(0),
            alpha: M::alpha(&at.bsdf),
            model: M::NAME,
        };
        let asked = match accel {
            AccelKind::Embree => directions::<ByEmbree, M>(chunk, settings, &at, &address),
            AccelKind::Linear => directions::<InLine, M>(chunk, settings, &at, &address),
        };
        Some((point, asked))
    }
}

/// What the shade stage asks for at a point, by its own functions.
fn directions<T: Tracer, M: Told>(
    chunk: &Chunk,
    settings: &Settings,
    point: &ShadingPoint<f32, M::Of<f32>>,
    address: &Address<f32>,
) -> Vec<Asked> {
    let (world, numbers, tile) = (chunk.world, chunk.numbers, chunk.tile);
    let mut set = Default::default();
    T::face_all(world, &mut set);
    let found =
        |wi: Vec3<f32>, distance: f32, ld: Vec3<f32>, occluded: bool| found(world, point, (wi, distance), ld, occluded);
    let of_estimator = rows::mix(settings.estimator);
    let (mix, warp) = match settings.estimator {
        EstimatorKind::Projected => (M::Projected::of(of_estimator).mix(), M::Projected::WARP),
        EstimatorKind::Product => (M::Product::of(of_estimator).mix(), M::Product::WARP),
        _ => (of_estimator, Warp::Cone),
    };
    let split =
        |i: usize| warp == Warp::ConeOrCap && i < MARKS && chunk.partly.iter().any(|lights| lights >> i & 1 == 1);
    let shared = |toss: bool| {
        // All lights share the direction of the BRDF.
        let of = if toss { PassBlock::after_toss } else { PassBlock::pair };
        of(numbers, address.key, address.pass, pairs::DIRECTION)
    };
    let for_light = |i: usize| {
        let pair = pairs::light(i);
        let mut tosses = vec![numbers.toss(address.key, address.pass, pair, tile.number())];
        if mix.both() || warp != Warp::Cone {
            tosses[0].pair = numbers.pair(address.key, address.pass, pair);
        }
        tosses[0].heads &= mix == Mix::Average;
        if tosses[0].heads {
            tosses[0].pair = shared(true);
        }
        if mix.both() {
            let (heads, pair) = (true, shared(false));
            tosses.push(Toss { heads, pair });
        }
        if split(i) {
            let (heads, pair) = (false, tosses[0].pair.opposite());
            tosses.push(Toss { heads, pair });
        }
        tosses.into_iter().map(move |toss| (i, toss))
    };
    let asked = |(i, toss): (usize, Toss<Word>)| {
        let light = &world.lights[i];
        let drawn = match settings.estimator {
            EstimatorKind::Projected => per_light::sample(M::Projected::of(mix), point, light, toss, true),
            EstimatorKind::Product => per_light::sample(M::Product::of(mix), point, light, toss, true),
            _ => per_light::sample(mix, point, light, toss, true),
        };
        let cone = light.cone(point.p);
        Asked {
            light: Some(i),
            kind: Some("sphere"),
            sphere: Some(light.sphere),
            omc: Some(cone.omc),
            cone_pdf: Some(cone.pdf()),
            technique: match warp {
                _ if toss.heads => "brdf",
                Warp::ProjectedCap => "cap",
                Warp::ConeOrCap if per_light::suits_cap(point, &light.seen_from(point.p)) => "cap",
                Warp::Cone | Warp::ConeOrCap => "cone",
                Warp::LobeInCap => "lobe",
            },
            lobe: toss.heads.then(|| per_light::along_lobe(point, toss.pair).lane(0)),
            found: drawn.filter(|drawn| drawn.active).map(|drawn| {
                let shadow = ray(point.p, drawn.wi, drawn.distance, light.sphere);
                let occluded = T::occluded::<f32>(world, &set, true, &shadow);
                let share = if split(i) { 0.5 } else { 1.0 };
                found(drawn.wi, drawn.distance, drawn.ld * share, occluded)
            }),
        }
    };
    if settings.estimator.per_light() {
        let mut all: Vec<Asked> = (0..world.lights.len()).flat_map(for_light).map(asked).collect();
        all.extend(kinds::each::<T, _>(chunk, point, address));
        all.extend(kinds::deltas::<T, _>(chunk, point, address));
        return all;
    }
    let uniform = settings.estimator == EstimatorKind::Uniform;
    let pair = numbers.pair(address.key, address.pass, pairs::DIRECTION);
    let drawn = if uniform {
        per_point::sample::<f32, per_point::Sphere>(point, pair, true)
    } else {
        per_point::sample::<f32, per_point::Lobe>(point, pair, true)
    };
    let asked = Asked {
        light: None,
        kind: None,
        sphere: None,
        omc: None,
        cone_pdf: None,
        technique: if uniform { "sphere" } else { "brdf" },
        lobe: (!uniform).then(|| per_light::along_lobe(point, pair).lane(0)),
        found: drawn.filter(|drawn| drawn.active).map(|drawn| {
            let towards = ray(point.p, drawn.wi, f32::INFINITY, NO_SPHERE);
            let hit = T::nearest::<f32>(world, &set, true, &towards, Coherence::Incoherent);
            let surface = |()| world.surfaces[world.surface_index(hit.geometry.0, hit.primitive.0) as usize];
            let beyond = || world.environment.is_some() || world.suns.iter().any(|sun| sun.contains(drawn.wi));
            let lit = match hit.found {
                true => surface(()).le.is_some(),
                false => beyond(),
            };
            found(drawn.wi, hit.t, drawn.throughput, !lit)
        }),
    };
    std::iter::once(asked)
        .chain(kinds::deltas::<T, _>(chunk, point, address))
        .collect()
}

fn found<B: Brdf<f32>>(
    world: &World,
    point: &ShadingPoint<f32, B>,
    (wi, distance): (Vec3<f32>, f32),
    ld: Vec3<f32>,
    occluded: bool,
) -> Found {
    let cos_theta = point.bsdf.normal().dot(wi);
    let lobe = point.bsdf.eval(wi, cos_theta);
    Found {
        wi: wi.lane(0),
        cos_theta,
        shape: lobe.shape.colour(Vec3::splat([1.0; 3]), Vec3::splat([1.0; 3])).x,
        brdf_pdf: lobe.pdf,
        distance: world.space.in_scene(distance),
        ld: ld.lane(0),
        occluded,
    }
}
