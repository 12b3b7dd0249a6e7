//! Directions that a sample uses for a list of lights.

use super::told::{Told, found, of_spheres, technique};
use super::{Asked, Sample, kinds, ray};
use crate::bsdf::{Brdf, Tint};
use crate::embree::{Coherence, NO_SKIP_ID};
use crate::estimator::density::{Density, Listed, Mix};
use crate::estimator::per_light::Contribution;
use crate::estimator::{ShadingPoint, per_delta, per_light};
use crate::lane::Word;
use crate::light::tree::{Digits, Table};
use crate::math::Vec3;
use crate::pipeline::kernels;
use crate::pipeline::lists::{Group, ListAddress, Lists, Member};
use crate::pipeline::queue::WideQueue;
use crate::pipeline::stage::listed::{counted, counted_delta};
use crate::pipeline::stage::pairs;
use crate::pipeline::stage::walked::{Way, number, seen_from};
use crate::pipeline::stream::Address;
use crate::sampling::{Pair, TechniqueSample};
use crate::scene::EstimatorKind;

/// The directions for the spheres and delta lights of a pixel's list, and the BRDF direction where it is used, computed with the stage's
/// own functions.
pub(super) fn directions<M: Told>(
    sample: &Sample,
    point: &ShadingPoint<f32, M::Of<f32>>,
    address: &Address<f32>,
) -> Vec<Asked> {
    let mut asked = Vec::new();
    if let Some((mix, by_brdf_lanes)) = drawn::<M>(sample, point, address, &mut asked) {
        if by_brdf_lanes || mix.both() {
            asked.push(along_lobe(sample, point, address, by_brdf_lanes));
        }
        kinds::deltas(sample, point, address, &mut asked);
    }
    asked
}

/// Adds the directions for the lights of a pixel's list, or for those that its point finds by itself. Returns how light and BRDF sampling
/// are combined, and whether the point samples its BRDF alone.
pub(super) fn drawn<M: Told>(
    sample: &Sample,
    point: &ShadingPoint<f32, M::Of<f32>>,
    address: &Address<f32>,
    asked: &mut Vec<Asked>,
) -> Option<(Mix, bool)> {
    let Sample {
        tracer,
        settings,
        chunk,
        ..
    } = *sample;
    let (world, numbers, tile) = (chunk.world, chunk.numbers, chunk.tile);
    let pass = numbers.first();
    let lists = chunk.lists?;
    let table = lists.table(tile, M::KIND, pass)?;
    let (mix, warp) = of_spheres::<M>(settings.estimator);
    let common_mix = lists.mix(mix, kernels::mix(settings.estimator));
    let tossed = common_mix == Mix::Average && mix == Mix::Average;
    let by_brdf_lanes =
        common_mix == Mix::Average && numbers.by_brdf_lanes(address.key, address.pass, pairs::DIRECTION, tile.number());
    let mut list = Vec::new();
    if M::WALKED.is_some() && table.walked() {
        if !by_brdf_lanes {
            walked::<M>(sample, point, address, (lists, table, common_mix), asked);
        }
    } else if !(by_brdf_lanes && tossed) {
        let address = ListAddress::new(numbers, tile, Group::of(tile, sample.pixel), pass, tossed);
        lists.draw(table, &address, &mut list);
    }
    for (i, pick) in list.iter().enumerate() {
        let number = match lists.kind(pick.light) {
            Member::Sphere(number) => number,
            Member::Triangle(_) => continue,
            Member::Delta(_) if by_brdf_lanes => continue,
            Member::Delta(number) => {
                let light = counted_delta(&world.delta_lights[number], common_mix, pick);
                let arriving = light.seen_from(point.p);
                let sampled = per_delta::sample(point, Vec3::splat(light.le), &arriving, true);
                asked.push(delta(sample, point, number, sampled));
                continue;
            }
        };
        let (light, guess) = counted(&world.lights[number], mix, pick);
        let technique_sample: TechniqueSample<Word> = TechniqueSample {
            by_brdf_lanes: false,
            pair: random(sample, address, pairs::light(i), mix.tosses(warp)),
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
    Some((common_mix, by_brdf_lanes))
}

fn random(sample: &Sample, address: &Address<f32>, pair: u32, tossed: bool) -> Pair<Word> {
    let numbers = sample.chunk.numbers;
    if tossed {
        numbers.after_toss(address.key, address.pass, pair)
    } else {
        numbers.pair(address.key, address.pass, pair)
    }
}

/// The direction of the BRDF, and what it meets.
fn along_lobe<B: Brdf<f32>>(
    sample: &Sample,
    point: &ShadingPoint<f32, B>,
    address: &Address<f32>,
    tossed: bool,
) -> Asked {
    let (tracer, world) = (sample.tracer, sample.chunk.world);
    let wi = per_light::along_lobe(point, random(sample, address, pairs::DIRECTION, tossed));
    let (cos_theta, above) = point.above(wi);
    let lobe = point.bsdf.eval(wi, cos_theta);
    Asked {
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
    }
}

/// The direction to a delta light.
fn delta<B: Brdf<f32>>(
    Sample { tracer, chunk, .. }: &Sample,
    point: &ShadingPoint<f32, B>,
    number: usize,
    sampled: Option<Contribution<f32>>,
) -> Asked {
    Asked {
        light: Some(number),
        kind: Some(kinds::DELTA),
        sphere: None,
        one_minus_cos_max: None,
        cone_pdf: None,
        technique: "light",
        lobe: None,
        found: sampled.filter(|sampled| sampled.active).map(|sampled| {
            let shadow = ray(point.p, sampled.wi, sampled.distance, NO_SKIP_ID);
            let towards = (sampled.wi, sampled.distance);
            found(chunk.world, point, towards, None, sampled.ld, tracer.occluded(&shadow))
        }),
    }
}

/// Adds the directions for the spheres and delta lights that a point finds by itself, by the stage's own functions.
fn walked<M: Told>(
    sample: &Sample,
    point: &ShadingPoint<f32, M::Of<f32>>,
    address: &Address<f32>,
    (lists, table, mix): (&Lists, &Table, Mix),
    asked: &mut Vec<Asked>,
) {
    let Sample { tracer, chunk, .. } = *sample;
    let world = chunk.world;
    let way = Way {
        lists,
        mix,
        walks: lists.walks(),
        table: mix.mixed().then_some(table),
    };
    let mut queue = WideQueue::new();
    for i in 0..way.walks {
        let pair = |i: u32| number(chunk, mix, address, i);
        let digits = Digits::new(pair(0), i, way.walks);
        let walked = lists.tree().walk(true, seen_from::<f32, M>(point), digits);
        let member = lists.kind(lists.tree().light(walked.leaf[0]));
        if matches!(member, Member::Triangle(_)) {
            continue;
        }
        queue.clear();
        way.toward::<f32, M>(world, (point, address), true, &walked, pair(1 + i), &mut queue);
        let Member::Sphere(number) = member else {
            if let Member::Delta(number) = member {
                let sampled = queue.each().next().map(|rays| Contribution {
                    active: true,
                    wi: rays.direction,
                    distance: rays.tfar,
                    ld: rays.value,
                });
                asked.push(delta(sample, point, number, sampled));
            }
            continue;
        };
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
    }
}
