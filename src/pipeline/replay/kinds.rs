//! Directions that the stages of lights other than spheres sample, computed with the stages' own functions.

use std::slice;

use super::{Asked, found, ray};
use crate::bsdf::Brdf;
use crate::estimator::ShadingPoint;
use crate::estimator::kind::LightKind;
use crate::estimator::per_light::along_lobe;
use crate::light::Environment;
use crate::pipeline::lights::Kind;
use crate::pipeline::stage::{Chunk, each};
use crate::pipeline::stream::Address;
use crate::pipeline::tracer::Tracer;

/// One or two directions for every triangle light, the environment and every sun.
pub fn each<T: Tracer, B: Brdf<f32>>(
    chunk: &Chunk,
    point: &ShadingPoint<f32, B>,
    address: &Address<f32>,
) -> Vec<Asked> {
    let world = chunk.world;
    let sky = (Kind::Environment, "environment");
    let mut all = of_kind::<T, _, _>(
        chunk,
        point,
        address,
        (Kind::Triangles, "triangle"),
        &world.triangle_lights,
    );
    all.extend(match &world.environment {
        None => Vec::new(),
        Some(Environment::Constant(constant)) => {
            of_kind::<T, _, _>(chunk, point, address, sky, slice::from_ref(constant))
        }
        Some(Environment::LatLong(picture)) => of_kind::<T, _, _>(chunk, point, address, sky, slice::from_ref(picture)),
    });
    all.extend(of_kind::<T, _, _>(
        chunk,
        point,
        address,
        (Kind::Suns, "sun"),
        &world.suns,
    ));
    all
}

/// The direction of every delta light.
pub fn deltas<T: Tracer, B: Brdf<f32>>(
    chunk: &Chunk,
    point: &ShadingPoint<f32, B>,
    address: &Address<f32>,
) -> Vec<Asked> {
    // Delta lights use no random numbers, so the kind does not matter.
    let kind = (Kind::Suns, "delta light");
    of_kind::<T, _, _>(chunk, point, address, kind, &chunk.world.delta_lights)
}

fn of_kind<T: Tracer, B: Brdf<f32>, K: LightKind>(
    chunk: &Chunk,
    point: &ShadingPoint<f32, B>,
    address: &Address<f32>,
    (kind, name): (Kind, &'static str),
    lights: &[K],
) -> Vec<Asked> {
    let world = chunk.world;
    let mut set = Default::default();
    T::keep_all(world, &mut set);
    let first = if K::DELTA { 0 } else { world.first(kind) };
    let ask = |(i, light): (usize, &K), time: u32| {
        let technique_sample = each::technique_sample::<f32, K>(chunk, address, i, time);
        let view = light.seen_from(&light.spread(), point.p);
        let may = light.may_contribute(point, &view);
        let sampled = light.sample(chunk.mix, point, &view, technique_sample, may);
        Asked {
            light: Some(i),
            kind: Some(name),
            sphere: None,
            one_minus_cos_max: None,
            cone_pdf: None,
            technique: match chunk.mix.by_brdf::<f32>(technique_sample.by_brdf_lanes) {
                true => "brdf",
                false => "light",
            },
            lobe: chunk
                .mix
                .by_brdf::<f32>(technique_sample.by_brdf_lanes)
                .then(|| along_lobe(point, technique_sample.pair).lane(0)),
            found: sampled.filter(|sampled| sampled.active).map(|sampled| {
                let shadow = ray(point.p, sampled.wi, sampled.distance, light.id());
                let occluded = T::occluded::<f32>(world, &set, true, &shadow);
                found(world, point, (sampled.wi, sampled.distance), sampled.ld, occluded)
            }),
        }
    };
    let times = if K::DELTA { 1 } else { chunk.tosses() };
    let lights = (first..).zip(lights);
    lights
        .flat_map(|light| (0..times).map(move |time| ask(light, time)))
        .collect()
}
