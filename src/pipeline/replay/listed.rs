//! Directions that a sample uses for a list of lights.

use super::told::{Told, found, of_spheres, technique};
use super::{Asked, Sample, kinds, ray};
use crate::bsdf::{Brdf, Tint};
use crate::embree::{Coherence, NO_SKIP_ID};
use crate::estimator::density::{Density, Listed, Mix};
use crate::estimator::{ShadingPoint, per_light};
use crate::lane::Word;
use crate::light::tree::{Digits, Starts, Table};
use crate::math::Vec3;
use crate::pipeline::kernels;
use crate::pipeline::lists::{Group, ListAddress, Lists};
use crate::pipeline::queue::WideQueue;
use crate::pipeline::stage::listed::counted;
use crate::pipeline::stage::pairs;
use crate::pipeline::stage::walked::{Way, number, seen_from};
use crate::pipeline::stream::Address;
use crate::sampling::TechniqueSample;
use crate::scene::EstimatorKind;

/// The directions for the spheres of a pixel's list, and the BRDF direction where it is used, computed with the stage's own
/// functions.
pub(super) fn directions<M: Told>(
    sample: &Sample,
    point: &ShadingPoint<f32, M::Of<f32>>,
    address: &Address<f32>,
) -> Vec<Asked> {
    let Sample {
        tracer,
        settings,
        chunk,
        ..
    } = *sample;
    let (world, numbers, tile) = (chunk.world, chunk.numbers, chunk.tile);
    let pass = numbers.first();
    let Some(lists) = &world.lists else { return Vec::new() };
    let Some(table) = lists.table(tile, M::KIND, pass) else {
        return Vec::new();
    };
    let (mix, warp) = of_spheres::<M>(settings.estimator);
    let triangles_mix = if lists.has_triangles() {
        kernels::mix(settings.estimator)
    } else {
        mix
    };
    let tossed = triangles_mix == Mix::Average && mix == Mix::Average;
    let random = |pair: u32, tossed: bool| {
        if tossed {
            numbers.after_toss(address.key, address.pass, pair)
        } else {
            numbers.pair(address.key, address.pass, pair)
        }
    };
    let by_brdf_lanes = triangles_mix == Mix::Average
        && numbers.by_brdf_lanes(address.key, address.pass, pairs::DIRECTION, tile.number());
    let mut list = Vec::new();
    let mut asked = Vec::new();
    if let Some(starts) = table.starts().filter(|_| M::WALKED.is_some()) {
        if !by_brdf_lanes {
            asked = walked::<M>(sample, point, address, (lists, table, starts));
        }
    } else if !(by_brdf_lanes && tossed) {
        let address = ListAddress::new(numbers, tile, Group::of(tile, sample.pixel), pass, tossed);
        lists.draw(table, &address, &mut list);
    }
    for (i, pick) in list.iter().enumerate() {
        let (true, number) = lists.kind(pick.light) else {
            continue;
        };
        let (light, guess) = counted(&world.lights[number], mix, pick);
        let technique_sample: TechniqueSample<Word> = TechniqueSample {
            by_brdf_lanes: false,
            pair: random(pairs::light(i), mix.tosses(warp)),
        };
        let sampled = match settings.estimator {
            _ if mix.mixed() => per_light::sample(Listed::new(mix, guess), point, &light, technique_sample, true),
            EstimatorKind::Projected => per_light::sample(M::Projected::of(mix), point, &light, technique_sample, true),
            _ => per_light::sample(mix, point, &light, technique_sample, true),
        };
        let cone = light.cone(point.p);
        asked.push(Asked {
            light: Some(number),
            kind: Some("sphere"),
            sphere: Some(world.sphere_numbers[light.sphere as usize]),
            one_minus_cos_max: Some(cone.one_minus_cos_max),
            cone_pdf: Some(cone.pdf()),
            technique: technique(warp, point, &light),
            lobe: None,
            found: sampled.filter(|sampled| sampled.active).map(|sampled| {
                let shadow = ray(point.p, sampled.wi, sampled.distance, light.sphere);
                let occluded = tracer.occluded(&shadow);
                found(
                    world,
                    point,
                    (sampled.wi, sampled.distance),
                    Some(light.le),
                    sampled.ld,
                    occluded,
                )
            }),
        });
    }
    if by_brdf_lanes || triangles_mix.both() {
        let wi = per_light::along_lobe(point, random(pairs::DIRECTION, by_brdf_lanes));
        let (cos_theta, above) = point.above(wi);
        let lobe = point.bsdf.eval(wi, cos_theta);
        asked.push(Asked {
            light: None,
            kind: None,
            sphere: None,
            one_minus_cos_max: None,
            cone_pdf: None,
            technique: "brdf",
            lobe: Some(wi.lane(0)),
            found: (above && lobe.shape.lit()).then(|| {
                let towards = ray(point.p, wi, f32::INFINITY, NO_SKIP_ID);
                let hit = tracer.nearest(&towards, Coherence::Incoherent);
                let index = || world.surface_index(hit.geometry.0, hit.primitive.0) as usize;
                let lit = hit.found && world.surfaces[index()].le.is_some();
                let throughput = lobe
                    .shape
                    .over(lobe.pdf)
                    .colour(point.bsdf.rho(), Vec3::splat([1.0; 3]));
                found(world, point, (wi, hit.t), Some([1.0; 3]), throughput, !lit)
            }),
        });
    }
    kinds::deltas(sample, point, address, &mut asked);
    asked
}

/// The directions for the spheres that a point finds by itself, by the stage's own functions.
fn walked<M: Told>(
    Sample { tracer, chunk, .. }: &Sample,
    point: &ShadingPoint<f32, M::Of<f32>>,
    address: &Address<f32>,
    (lists, table, starts): (&Lists, &Table, &Starts),
) -> Vec<Asked> {
    let (world, mix) = (chunk.world, chunk.mix);
    let way = Way {
        lists,
        mix,
        walks: lists.walks(),
        table: mix.mixed().then_some(table),
    };
    let mut queue = WideQueue::new();
    let mut asked = Vec::new();
    let from = seen_from::<f32, M>(point);
    let shares = starts.shares(lists.tree(), from);
    for i in 0..way.walks {
        let pair = |i: u32| number(chunk, mix, address, i);
        let digits = Digits::new(pair(0), i, way.walks);
        let walked = lists.tree().walk(true, (starts, &shares), from, digits);
        let (true, number) = lists.kind(lists.tree().light(walked.leaf[0])) else {
            continue;
        };
        way.toward::<f32, M>(world, (point, address), true, &walked, pair(1 + i), &mut queue);
        let light = &world.lights[number];
        let cone = light.cone(point.p);
        asked.push(Asked {
            light: Some(number),
            kind: Some("sphere"),
            sphere: Some(world.sphere_numbers[light.sphere as usize]),
            one_minus_cos_max: Some(cone.one_minus_cos_max),
            cone_pdf: Some(cone.pdf()),
            technique: "cone",
            lobe: None,
            found: queue.each().next().map(|rays| {
                let shadow = ray(point.p, rays.direction, rays.tfar, light.sphere);
                let towards = (rays.direction, rays.tfar);
                found(
                    world,
                    point,
                    towards,
                    Some(light.le),
                    rays.value,
                    tracer.occluded(&shadow),
                )
            }),
        });
        queue.clear();
    }
    asked
}
