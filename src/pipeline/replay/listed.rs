//! What a sample asks of a list of lights.

use super::{Asked, Found, ray};
use crate::embree::{Coherence, NO_SPHERE};
use crate::estimator::density::{ConeOrCap, Listed, Mix, Projected, Warp};
use crate::estimator::{ShadingPoint, per_light};
use crate::lane::{Lane, Word};
use crate::light::SphereLight;
use crate::math::Vec3;
use crate::pipeline::lists::{ListAddress, colour};
use crate::pipeline::stage::{Ask, Chunk, pairs};
use crate::pipeline::stream::Address;
use crate::pipeline::tracer::Tracer;
use crate::sampling::Toss;

/// How spheres are asked: the mix, and how directions are drawn.
pub(super) type How = (Mix, Warp);

/// The spheres of the list of a pixel in the pass of `chunk`, and the direction of the BRDF where it is asked, by the stage's own
/// functions.
pub(super) fn directions<T: Tracer>(
    chunk: &mut Chunk,
    (mix, warp): How,
    pixel: [u32; 2],
    (point, address): (&ShadingPoint<f32>, &Address<f32>),
) -> Vec<Asked> {
    let (world, numbers) = (chunk.world, chunk.numbers);
    let (phong, pass) = (point.bsdf.phong, numbers.first());
    let Some(lists) = &world.lists else { return Vec::new() };
    chunk.ask(Ask::Tabulate { lists, phong, pass });
    let Some(table) = lists.table(chunk.tile, phong, pass) else {
        return Vec::new();
    };
    let triangles_mix = if lists.has_triangles() { chunk.mix } else { mix };
    let tossed = triangles_mix == Mix::Average && mix == Mix::Average;
    let heads = tossed && numbers.heads(address.key, address.pass, pairs::DIRECTION, chunk.tile.number());
    let mut list = Vec::new();
    if !heads {
        let colour = colour(pixel);
        lists.draw(
            table,
            &ListAddress::new(numbers, chunk.tile, colour, pass, tossed),
            &mut list,
        );
    }
    let mut set = Default::default();
    T::face_all(world, &mut set);
    let found = |wi: Vec3<f32>, distance: f32, ld: Vec3<f32>, occluded: bool| {
        Found::new(world, point, wi, distance, ld, occluded)
    };
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
        let of = if tossed {
            numbers.after_toss(address.key, address.pass, pairs::light(i))
        } else {
            numbers.pair(address.key, address.pass, pairs::light(i))
        };
        let toss: Toss<Word> = Toss { heads: false, pair: of };
        let drawn = match warp {
            Warp::Cone => per_light::sample(Listed::new(mix, guess), point, &light, toss, true),
            Warp::ConeOrCap => per_light::sample(ConeOrCap, point, &light, toss, true),
            Warp::ProjectedCap => per_light::sample(Projected, point, &light, toss, true),
            Warp::LobeInCap => per_light::sample(crate::estimator::density::LobeInCap, point, &light, toss, true),
        };
        let cone = light.cone(point.p);
        asked.push(Asked {
            light: Some(number),
            sphere: Some(light.sphere),
            omc: Some(cone.omc),
            cone_pdf: Some(cone.pdf()),
            technique: super::technique(warp, point, &light),
            found: drawn.filter(|drawn| drawn.active).map(|drawn| {
                let shadow = ray(point.p, drawn.wi, drawn.distance, light.sphere);
                found(
                    drawn.wi,
                    drawn.distance,
                    drawn.ld,
                    T::occluded::<f32>(world, &set, true, &shadow),
                )
            }),
        });
    }
    if heads || triangles_mix.both() {
        let draw = |toss: bool| {
            if toss {
                numbers.after_toss(address.key, address.pass, pairs::DIRECTION)
            } else {
                numbers.pair(address.key, address.pass, pairs::DIRECTION)
            }
        };
        let wi = per_light::along_lobe(point, draw(heads));
        let (cos_theta, above) = point.above(wi);
        let lobe = point.bsdf.eval(wi, cos_theta);
        asked.push(Asked {
            light: None,
            sphere: None,
            omc: None,
            cone_pdf: None,
            technique: "brdf",
            found: (above && lobe.shape > 0.0).then(|| {
                let towards = ray(point.p, wi, f32::INFINITY, NO_SPHERE);
                let hit = T::nearest::<f32>(world, &set, true, &towards, Coherence::Incoherent);
                let index = || world.surface_index(hit.geometry.0, hit.primitive.0) as usize;
                let lit = hit.found && world.surfaces[index()].le.is_some();
                found(wi, hit.t, point.bsdf.rho * (lobe.shape / lobe.pdf), !lit)
            }),
        });
    }
    asked
}

impl Found {
    /// Of a direction from a point.
    pub(super) fn new(
        world: &crate::pipeline::world::World,
        point: &ShadingPoint<f32>,
        wi: Vec3<f32>,
        distance: f32,
        ld: Vec3<f32>,
        occluded: bool,
    ) -> Self {
        let cos_theta = point.bsdf.n.dot(wi);
        let lobe = point.bsdf.eval(wi, cos_theta);
        Self {
            wi: wi.lane(0),
            cos_theta: cos_theta.lane(0),
            shape: lobe.shape,
            brdf_pdf: lobe.pdf,
            distance: world.space.in_scene(distance),
            ld: ld.lane(0),
            occluded,
        }
    }
}
