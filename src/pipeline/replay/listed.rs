//! What a sample asks of a list of lights.

use super::told::{Told, found, of_spheres, technique};
use super::{Asked, Sample, kinds, ray};
use crate::bsdf::{Brdf, Tint};
use crate::embree::{Coherence, NO_SPHERE};
use crate::estimator::density::{Density, Listed, Mix};
use crate::estimator::{ShadingPoint, per_light};
use crate::lane::Word;
use crate::light::SphereLight;
use crate::math::Vec3;
use crate::pipeline::lists::{ListAddress, colour};
use crate::pipeline::rows;
use crate::pipeline::stage::pairs;
use crate::pipeline::stream::Address;
use crate::pipeline::tracer::Tracer;
use crate::sampling::Toss;
use crate::scene::EstimatorKind;

/// The spheres of the list of a pixel, and the direction of the BRDF where it is asked, by the stage's own functions.
pub(super) fn directions<T: Tracer, M: Told>(
    sample: &Sample,
    point: &ShadingPoint<f32, M::Of<f32>>,
    address: &Address<f32>,
) -> Vec<Asked> {
    let Sample { settings, chunk, .. } = *sample;
    let (world, numbers, tile) = (chunk.world, chunk.numbers, chunk.tile);
    let pass = numbers.first();
    let Some(lists) = &world.lists else { return Vec::new() };
    let Some(table) = lists.table(tile, M::KIND, pass) else {
        return Vec::new();
    };
    let (mix, warp) = of_spheres::<M>(settings.estimator);
    let triangles_mix = if lists.has_triangles() {
        rows::mix(settings.estimator)
    } else {
        mix
    };
    let tossed = triangles_mix == Mix::Average && mix == Mix::Average;
    let toss = |pair: u32, toss: bool| {
        if toss {
            numbers.after_toss(address.key, address.pass, pair)
        } else {
            numbers.pair(address.key, address.pass, pair)
        }
    };
    let heads =
        triangles_mix == Mix::Average && numbers.heads(address.key, address.pass, pairs::DIRECTION, tile.number());
    let mut list = Vec::new();
    if !(heads && tossed) {
        let address = ListAddress::new(numbers, tile, colour(sample.pixel), pass, tossed);
        lists.draw(table, &address, &mut list);
    }
    let mut set = Default::default();
    T::face_all(world, &mut set);
    let mut asked = Vec::new();
    for (i, pick) in list.iter().enumerate() {
        let (true, number) = lists.kind(pick.light) else {
            continue;
        };
        let guess = if mix.mixed() { pick.guess } else { 1.0 };
        let times = (f64::from(guess) / pick.expected) as f32;
        let light = SphereLight {
            le: world.lights[number].le.map(|x| x * times),
            ..world.lights[number]
        };
        let toss: Toss<Word> = Toss {
            heads: false,
            pair: toss(pairs::light(i), tossed),
        };
        let drawn = match settings.estimator {
            _ if mix.mixed() => per_light::sample(Listed::new(mix, guess), point, &light, toss, true),
            EstimatorKind::Projected => per_light::sample(M::Projected::of(mix), point, &light, toss, true),
            EstimatorKind::Product => per_light::sample(M::Product::of(mix), point, &light, toss, true),
            _ => per_light::sample(mix, point, &light, toss, true),
        };
        let cone = light.cone(point.p);
        asked.push(Asked {
            light: Some(number),
            kind: Some("sphere"),
            sphere: Some(light.sphere),
            omc: Some(cone.omc),
            cone_pdf: Some(cone.pdf()),
            technique: technique(warp, point, &light),
            lobe: None,
            found: drawn.filter(|drawn| drawn.active).map(|drawn| {
                let shadow = ray(point.p, drawn.wi, drawn.distance, light.sphere);
                let occluded = T::occluded::<f32>(world, &set, true, &shadow);
                found(world, point, (drawn.wi, drawn.distance), drawn.ld, occluded)
            }),
        });
    }
    if heads || triangles_mix.both() {
        let wi = per_light::along_lobe(point, toss(pairs::DIRECTION, heads));
        let (cos_theta, above) = point.above(wi);
        let lobe = point.bsdf.eval(wi, cos_theta);
        asked.push(Asked {
            light: None,
            kind: None,
            sphere: None,
            omc: None,
            cone_pdf: None,
            technique: "brdf",
            lobe: Some(wi.lane(0)),
            found: (above && lobe.shape.lit()).then(|| {
                let towards = ray(point.p, wi, f32::INFINITY, NO_SPHERE);
                let hit = T::nearest::<f32>(world, &set, true, &towards, Coherence::Incoherent);
                let index = || world.surface_index(hit.geometry.0, hit.primitive.0) as usize;
                let lit = hit.found && world.surfaces[index()].le.is_some();
                let throughput = lobe
                    .shape
                    .over(lobe.pdf)
                    .colour(point.bsdf.rho(), Vec3::splat([1.0; 3]));
                found(world, point, (wi, hit.t), throughput, !lit)
            }),
        });
    }
    asked.extend(kinds::deltas::<T, _>(chunk, point, address));
    asked
}
