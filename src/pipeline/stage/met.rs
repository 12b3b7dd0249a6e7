//! Resolves BRDF rays if lights come from lists: any light counts, on a list or not.

use super::{Chunk, shadow};
use crate::bsdf::Lobe;
use crate::embree::{Coherence, NO_SKIP_ID, TraceLane};
use crate::lane::{Bits, Mask};
use crate::light::tree::Table;
use crate::linear::Candidates;
use crate::math::Vec3;
use crate::pipeline::lists::{Lists, Member};
use crate::pipeline::queue::WideQueue;
use crate::pipeline::tracer::Tracer;
use crate::sampling::warp;

/// For every ray whose first hit is a light, adds `f_cos` times the radiance, divided by its density and MIS-weighted as in the
/// chunk. The ray's number is the density of the BRDF. Spheres count only if `spheres`.
#[inline(always)]
pub fn met<L: TraceLane, T: Tracer>(
    chunk: &mut Chunk,
    queue: &mut WideQueue,
    set: &Candidates,
    of: (&Lists, &Table),
    spheres: bool,
) {
    chunk.keep(queue);
    for at in (0..queue.len()).step_by(L::N) {
        let (active, rays, pdf) = queue.packet::<L>(at);
        let ray = shadow::segment(&rays, L::Bits::splat(NO_SKIP_ID));
        let hit = T::nearest(chunk.world, set, active, &ray, Coherence::Incoherent);
        let mut value = [[0.0_f32; 3]; 16];
        let mut counts = 0;
        // Few rays hit lights, so they are processed one by one; the operations are the same for any number of lanes.
        for lane in hit.found.lanes() {
            let met = (hit.geometry.lane(lane), hit.primitive.lane(lane), hit.t.lane(lane));
            let from = (rays.origin.lane(lane), rays.direction.lane(lane), pdf.lane(lane));
            if let Some(radiance) = weighed(chunk, of, spheres, met, from) {
                value[lane] = radiance;
                counts |= 1 << lane;
            }
        }
        if counts == 0 {
            continue;
        }
        let radiance = Vec3::new(
            L::from_fn(|i| value[i][0]),
            L::from_fn(|i| value[i][1]),
            L::from_fn(|i| value[i][2]),
        );
        let counts = L::Mask::from_bitmask(counts);
        let value = rays.value.times(radiance).or_zero(counts);
        shadow::splat(chunk.sum, chunk.counters, counts, value, rays.index);
    }
    chunk.counters.shadow_rays += queue.len() as u64;
    queue.clear();
}

/// Radiance over density at a first hit; `None` if that is no light that counts.
fn weighed(
    chunk: &Chunk,
    (lists, table): (&Lists, &Table),
    spheres: bool,
    (geometry, primitive, distance): (u32, u32, f32),
    (origin, direction, pdf): ([f32; 3], [f32; 3], f32),
) -> Option<[f32; 3]> {
    let world = chunk.world;
    let is_sphere = geometry == world.sphere_geometry;
    let light = if is_sphere {
        lists.of_sphere(primitive).filter(|_| spheres)?
    } else {
        lists.of_triangle(geometry, primitive)?
    };
    let origin: Vec3<f32> = Vec3::splat(origin);
    let (le, omega) = match lists.kind(light) {
        Member::Sphere(number) => {
            let light = &world.lights[number];
            (light.le, warp::cone_solid_angle(light.cone(origin).one_minus_cos_max))
        }
        Member::Triangle(number) => {
            let light = &world.triangle_lights[number];
            let view = light.triangle.splat::<f32>().seen_from(origin);
            (light.le, view.inverse_density(Vec3::splat(direction), distance))
        }
        Member::Delta(_) => return None,
    };
    let omega = omega * (1.0 / lists.guess(table, light)?);
    let lobe = Lobe { shape: 1.0, pdf };
    let weight = chunk.mix.weight(omega, lobe, true);
    Some(le.map(|x| x * weight))
}
