//! Probe points of a tile: the surface points seen through pixel centers, and their visibility of lights.

use super::{Kind, Lists, Member, UNIT};
use crate::embree::{Coherence, NO_SKIP_ID, Ray};
use crate::lane::{Bits, F32x8, Lane, Mask};
use crate::light::tree::{Look, Probes, WIDE};
use crate::linear::Candidates;
use crate::math::Vec3;
use crate::pipeline::stage::Chunk;
use crate::pipeline::stage::surface::{Surfaces, shading_point};
use crate::pipeline::tracer::Tracer;
use crate::pipeline::world::{Facets, World};
use crate::scene::{Effect, Effects};

/// Packets for probe rays, whatever the plan has.
type L = F32x8;

/// The effects that influence shading points.
const COMPILED_IN: Effects = Effects::of(&[
    Effect::Diffuse,
    Effect::Phong,
    Effect::SmoothNormals,
    Effect::SmoothTerminator,
    Effect::Blend,
]);

/// Traces rays from probe points to lights.
pub struct VisibilityProbe<'a, T> {
    world: &'a World,
    lists: &'a Lists,
    /// Positions of the probes that trace: all of them, or every second.
    places: [[f32; WIDE]; 3],
    /// Number of probes that each tracing probe stands for: itself and the ones after it.
    each: usize,
    set: Candidates,
    tracer: std::marker::PhantomData<T>,
}

/// A point seen through a pixel.
#[derive(Clone, Copy)]
struct Traced {
    place: [f32; 3],
    normal: [f32; 3],
    mirror: [f32; 3],
    exponent: f32,
}

/// Finds up to [`WIDE`] points of a model, spread over the pixel centers of a tile.
pub(super) fn find<T: Tracer>(chunk: &Chunk, lists: &Lists, kind: Kind) -> Probes {
    let seen = points::<T>(chunk.world, &lists.pixels(chunk.tile.number()), kind);
    let mut probes = Probes::new(matches!(kind, Kind::Phong | Kind::Conductor));
    let wanted = seen.len().min(WIDE);
    for i in 0..wanted {
        // One per square of a whole tile, and one in each of its columns and rows of pixels, the outermost as well: what a border sees
        // and no probe does would make it noisier than the pixels inside.
        let place = 4 * (3 - i % 4) + i / 4;
        let at = (WIDE * i + place) * seen.len() / (WIDE * WIDE);
        let point = seen[if wanted < WIDE { i } else { at }];
        probes.push(
            point.place.map(|x| x * UNIT),
            point.normal,
            point.mirror,
            point.exponent,
        );
    }
    probes
}

impl<'a, T: Tracer> VisibilityProbe<'a, T> {
    /// About `looks` of the probes will trace rays to lights.
    pub(super) fn new(world: &'a World, lists: &'a Lists, probes: &Probes, looks: usize) -> Self {
        let mut places = [[0.0; WIDE]; 3];
        let each = if looks < WIDE { 2 } else { 1 };
        for i in 0..probes.len() {
            for (column, place) in places.iter_mut().zip(probes.place(i)) {
                column[i / each..].fill(place / UNIT);
            }
        }
        let mut set = Candidates::default();
        T::keep_all(world, &mut set);
        Self {
            world,
            lists,
            places,
            each,
            set,
            tracer: std::marker::PhantomData,
        }
    }
}

/// The points of a model seen through pixel centers, in pixel order.
fn points<T: Tracer>(world: &World, pixels: &[[u32; 2]], kind: Kind) -> Vec<Traced> {
    let mut set = Candidates::default();
    T::keep_all(world, &mut set);
    let mut found = Vec::new();
    for pixels in pixels.chunks(L::N) {
        let middle = |k: usize| L::from_fn(|lane| pixels.get(lane).map_or(0.0, |pixel| pixel[k] as f32 + 0.5));
        let ray = Ray {
            origin: Vec3::zero(),
            direction: world.camera.direction(middle(0), middle(1)),
            tfar: L::splat(f32::INFINITY),
            skip_id: Bits::splat(NO_SKIP_ID),
        };
        let active = Mask::first(pixels.len());
        let hit = T::nearest_from_origin::<L>(world, &set, active, &ray);
        if hit.found.none() {
            continue;
        }
        let surfaces = Surfaces::of(world, &hit);
        let reflects = hit.found & !surfaces.emits;
        if reflects.none() {
            continue;
        }
        let point = shading_point::<L, T, { COMPILED_IN.bits() }>(world, &hit, &ray, &surfaces);
        for lane in reflects.lanes() {
            let (record, alpha) = (surfaces.record(world, lane), point.alpha.lane(lane));
            let (wanted, exponent) = match (kind, record.facets) {
                (Kind::Diffuse, None) => (alpha <= 1.0 || record.specular.is_some(), 1.0),
                (Kind::Phong, None) => (alpha > 1.0, alpha),
                (Kind::Ggx, Some(Facets::Ggx { .. })) => (true, 1.0),
                // Wider than the mirrored lobe of these facets, because that lobe has long tails.
                (Kind::Conductor, Some(Facets::Conductor { alpha, .. })) => {
                    (true, (0.25 / (alpha * alpha)).clamp(1.1, 1000.0))
                }
                _ => (false, 1.0),
            };
            if wanted {
                let normal = point.n.lane(lane);
                found.push(Traced {
                    place: point.p.lane(lane),
                    normal,
                    mirror: mirrored(normal, point.wo.lane(lane)),
                    exponent,
                });
            }
        }
    }
    found
}

/// The mirror direction of `wo` about the unit vector `n`.
fn mirrored(n: [f32; 3], wo: [f32; 3]) -> [f32; 3] {
    let cosine: f32 = n.iter().zip(wo).map(|(n, wo)| n * wo).sum();
    std::array::from_fn(|k| 2.0 * cosine * n[k] - wo[k])
}

impl<T: Tracer> Look for VisibilityProbe<'_, T> {
    /// Traces rays to the center of the light, which does not occlude itself; to a delta light from the points that it shines on.
    fn reaches(&mut self, light: u32, probes: &Probes) -> u32 {
        let mut delta = None;
        let (middle, skip_id) = match self.lists.kind(light) {
            Member::Sphere(i) => (self.world.lights[i].center, self.world.lights[i].sphere),
            Member::Triangle(i) => {
                let light = &self.world.triangle_lights[i];
                let [a, b, c] = light.triangle.corners;
                (std::array::from_fn(|k| (a[k] + b[k] + c[k]) / 3.0), light.skip_id)
            }
            Member::Delta(i) => {
                delta = Some(&self.world.delta_lights[i]);
                ([0.0; 3], NO_SKIP_ID)
            }
        };
        let mut reached = 0;
        let looking = probes.len().div_ceil(self.each);
        for at in (0..looking).step_by(L::N) {
            let [x, y, z] = &self.places;
            let origin = Vec3::new(L::load(&x[at..]), L::load(&y[at..]), L::load(&z[at..]));
            let mut active = <L as Lane>::Mask::first(looking - at);
            let (direction, tfar) = if let Some(delta) = delta {
                let arriving = delta.seen_from(origin);
                active = active & arriving.active;
                (arriving.wi.or_zero(active), arriving.distance)
            } else {
                let to = Vec3::splat(middle) - origin;
                let distance = to.length().max(L::splat(f32::MIN_POSITIVE));
                (to * (L::one() / distance), distance)
            };
            if active.none() {
                continue;
            }
            let ray = Ray {
                origin,
                direction,
                tfar,
                skip_id: Bits::splat(skip_id),
            };
            let occluded = T::occluded::<L>(self.world, &self.set, active, &ray, Coherence::Coherent);
            for lane in (active & !occluded).lanes() {
                reached |= ((1 << self.each) - 1) << ((at + lane) * self.each);
            }
        }
        reached
    }
}
