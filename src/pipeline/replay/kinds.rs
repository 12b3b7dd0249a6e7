//! Directions that the stages of lights other than spheres sample, computed with the stages' own functions.

use std::slice;

use super::{Asked, Sample, found, ray};
use crate::bsdf::Brdf;
use crate::estimator::ShadingPoint;
use crate::estimator::kind::LightKind;
use crate::estimator::per_light::along_lobe;
use crate::light::Environment;
use crate::pipeline::lights::Kind;
use crate::pipeline::stage::each;
use crate::pipeline::stream::Address;

/// Adds one or two directions for every triangle light, the environment and every sun.
pub fn each<B: Brdf<f32>>(sample: &Sample, point: &ShadingPoint<f32, B>, address: &Address<f32>, all: &mut Vec<Asked>) {
    let world = sample.chunk.world;
    let first = world.first(Kind::Triangles);
    of_kind(sample, point, address, (first, "triangle"), &world.triangle_lights, all);
    let sky = (world.first(Kind::Environment), "environment");
    match &world.environment {
        None => {}
        Some(Environment::Constant(light)) => of_kind(sample, point, address, sky, slice::from_ref(light), all),
        Some(Environment::LatLong(light)) => of_kind(sample, point, address, sky, slice::from_ref(light), all),
    }
    of_kind(
        sample,
        point,
        address,
        (world.first(Kind::Suns), "sun"),
        &world.suns,
        all,
    );
}

/// Name of delta lights.
pub const DELTA: &str = "delta light";

/// Adds the direction of every delta light that is in no list.
pub fn deltas<B: Brdf<f32>>(
    sample: &Sample,
    point: &ShadingPoint<f32, B>,
    address: &Address<f32>,
    all: &mut Vec<Asked>,
) {
    let chunk = sample.chunk;
    for (i, light) in chunk.world.delta_lights.iter().enumerate() {
        if chunk.lists.is_none() || light.position().is_none() {
            of_kind(sample, point, address, (i, DELTA), slice::from_ref(light), all);
        }
    }
}

fn of_kind<B: Brdf<f32>, K: LightKind>(
    sample: &Sample,
    point: &ShadingPoint<f32, B>,
    address: &Address<f32>,
    (first, name): (usize, &'static str),
    lights: &[K],
    all: &mut Vec<Asked>,
) {
    let (tracer, chunk) = (sample.tracer, sample.chunk);
    let world = chunk.world;
    let mix = chunk.mix_of::<f32, K, B>();
    let times = if K::DELTA { 1 } else { mix.times() };
    for (i, light) in (first..).zip(lights) {
        for time in 0..times {
            let technique_sample = each::technique_sample::<f32, K>(chunk, address, mix, i, time);
            let view = light.seen_from(&light.spread(), point.p);
            let may = light.may_contribute(point, &view);
            let sampled = light.sample(mix, point, &view, technique_sample, may);
            let by_brdf = mix.by_brdf::<f32>(technique_sample.by_brdf_lanes);
            all.push(Asked {
                light: Some(i),
                kind: Some(name),
                sphere: None,
                one_minus_cos_max: None,
                cone_pdf: None,
                technique: if by_brdf { "brdf" } else { "light" },
                lobe: by_brdf.then(|| along_lobe(point, technique_sample.pair).lane(0)),
                found: sampled.filter(|sampled| sampled.active).map(|sampled| {
                    let shadow = ray(point.p, sampled.wi, sampled.distance, light.id());
                    let occluded = tracer.occluded(&shadow);
                    found(world, point, (sampled.wi, sampled.distance), None, sampled.ld, occluded)
                }),
            });
        }
    }
}
