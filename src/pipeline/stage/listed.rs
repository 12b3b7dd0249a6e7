//! Shading under many lights, for estimators that sample every light: here every light of a short list, which differs per pass and
//! color of a tile ([`lists`](crate::pipeline::lists)).
//!
//! A light with an expected count of `n` in a list is weighted by `1 / n` for each occurrence. If BRDF sampling is combined, the
//! MIS weights assume that the light occurs `m` times, an estimate that needs no tree traversal: `f m / (n (m p + q))` for a light
//! sample and `f / (m p + q)` for a BRDF sample, in the notation of [`density`](crate::estimator::density). The weights sum to one
//! for any `m`; only `n` must be exact. A BRDF ray is traced to the light that it hits, which need not be on any list.

use std::marker::PhantomData;
use std::ops::Range;

use super::directions::Directions;
use super::shade::{Light, Sink, may_meet, prepare, sample_light};
use super::{Chunk, Request, Scratch, Stage, pairs, shadow};
use crate::bsdf::{Brdf, Tint};
use crate::embree::TraceLane;
use crate::estimator::density::{Listed, Mix, Warp};
use crate::estimator::{per_delta, per_triangle};
use crate::lane::Mask;
use crate::light::tree::Pick;
use crate::light::{DeltaLight, SphereLight, TriangleLight};
use crate::linear::Candidates;
use crate::linear::cull::Points;
use crate::math::Vec3;
use crate::pipeline::lists::{Member, Probed};
use crate::pipeline::queue::{QueuedRays, RayQueue, WideQueue};
use crate::pipeline::stream::{HitStream, ModelStream};
use crate::shape::{BoundingSphere, NO_SKIP_ID};

/// One or two directions for every light of a list.
pub struct PerListed<D, M>(PhantomData<(D, M)>);

impl<D: Directions<M>, M: Probed> Stage for PerListed<D, M> {
    /// Lights are the outer loop, for coherent shadow rays: a light is sampled for all groups of pixels and all passes of the chunk
    /// that have it.
    #[inline(always)]
    fn run<L: TraceLane>(chunk: &mut Chunk, scratch: &mut Scratch) {
        let Scratch {
            hits,
            picks,
            queue,
            looks,
            points,
            set,
            bundles,
            rings,
            ..
        } = scratch;
        let world = chunk.world;
        let (Some(lists), Some(stream)) = (chunk.lists, M::stream_mut(hits)) else {
            return;
        };
        let all = 0..stream.len();
        if all.is_empty() {
            return;
        }
        let of_spheres = D::of(chunk.mix);
        let mix = lists.mix(of_spheres.mix(), chunk.mix);
        let tossed = mix == Mix::Average && of_spheres.mix() == Mix::Average;
        picks.divide(chunk, stream);
        chunk.request(Request::Survey { stream, points });
        for pass in picks.levels() {
            // Points may walk instead: see `walked`.
            let Some(table) = lists
                .tabulated(chunk, M::KIND, pass)
                .filter(|table| table.starts().is_none())
            else {
                continue;
            };
            for part in picks.neighbors(pass) {
                stream.end_at(part.end);
                prepare::<L, Mix, M>(mix, chunk, stream, part);
                stream.end_at(all.end);
            }
            picks.draw(chunk, (lists, table), (pass, tossed), |part| {
                tossed && all_heads(stream, part)
            });
            for run in 0..picks.lights() {
                bundles.begin(chunk, stream, points, (picks, run));
                let wide = bundles.wide(chunk);
                let mut way = Way { points, wide, set };
                let (i, pick) = picks.light(run);
                let parts = picks.parts(run);
                match lists.kind(pick.light) {
                    Member::Sphere(number) => {
                        let of_light = (&world.lights[number], i, &pick);
                        toward_sphere::<L, D, M>(of_spheres, chunk, stream, parts, &mut way, queue, rings, of_light);
                    }
                    Member::Triangle(number) => {
                        let of_light = (&world.triangle_lights[number], i, &pick);
                        toward_triangle::<L, M>(mix, chunk, stream, parts, &mut way, queue, of_light);
                    }
                    Member::Delta(number) => {
                        let light = counted_delta(&world.delta_lights[number], mix, &pick);
                        toward_delta::<L, M>(mix, chunk, stream, parts, &mut way, queue, &light);
                    }
                }
            }
            if mix.mixed() {
                for part in picks.points(pass) {
                    stream.end_at(part.end);
                    sample_brdf::<L, M>(mix, chunk, stream, part, looks);
                    stream.end_at(all.end);
                }
                if looks.len() > 0 {
                    chunk.request(Request::All { set });
                    let spheres = of_spheres.mix().mixed();
                    chunk.request(Request::Met {
                        queue: looks,
                        set,
                        lists,
                        table,
                        spheres,
                    });
                }
            }
        }
    }
}

/// What shadow rays need.
struct Way<'a> {
    points: &'a mut Points,
    /// What may lie between the points and some lights near this one.
    wide: Option<&'a Candidates>,
    set: &'a mut Candidates,
}

impl Way<'_> {
    /// Culls occluders on the way to one of the lights. Returns whether nothing can block the rays.
    #[inline(always)]
    fn cull(&mut self, chunk: &mut Chunk, stream: &HitStream, ball: BoundingSphere, skip_id: u32) -> bool {
        let mut open = false;
        chunk.request(Request::Shaft {
            stream,
            points: self.points,
            ball,
            skip_id,
            wide: self.wide,
            open: &mut open,
            set: self.set,
        });
        open
    }

    /// Adds what the queued rays bring that nothing blocks, on the way to a light for which occluders were culled.
    #[inline(always)]
    fn trace<L: TraceLane>(&self, chunk: &mut Chunk, queue: &mut RayQueue, open: bool, light: u32) {
        if open {
            shadow::unoccluded::<L>(chunk, queue);
        } else {
            chunk.request(Request::Visible {
                queue,
                set: self.set,
                light,
            });
        }
    }
}

/// Whether all points sample their BRDF.
fn all_heads(stream: &HitStream, part: Range<usize>) -> bool {
    part.into_iter().all(|at| stream.by_brdf_lanes::<f32>(at))
}

/// Weights of a listed light: a factor for its radiance, and a factor for the density of its light sampling.
pub fn worth(mix: Mix, pick: &Pick) -> (f32, f32) {
    let expected = mutate!(pick.expected, ExpectedOnceEach => pick.expected.max(1.0));
    let guess = if mix.mixed() { pick.guess } else { 1.0 };
    ((f64::from(guess) / expected) as f32, guess)
}

/// A listed sphere with the radiance that it counts for, and a factor for the density of its light sampling.
#[inline(always)]
pub fn counted(light: &SphereLight, mix: Mix, pick: &Pick) -> (SphereLight, f32) {
    let (times, guess) = worth(mix, pick);
    let le = light.le.map(|x| x * times);
    (SphereLight { le, ..*light }, guess)
}

/// A listed delta light with the irradiance that it counts for.
#[inline(always)]
pub fn counted_delta(light: &DeltaLight, mix: Mix, pick: &Pick) -> DeltaLight {
    let expected = mutate!(pick.expected, DeltaInEveryList => 1.0);
    let times = (f64::from(mix.alone()) / expected) as f32;
    let le = light.le.map(|x| x * times);
    DeltaLight { le, ..*light }
}

#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "parts of one scratch pad")]
fn toward_sphere<L: TraceLane, D: Directions<M>, M: Probed>(
    density: D,
    chunk: &mut Chunk,
    stream: &mut ModelStream<M>,
    parts: impl Iterator<Item = Range<usize>>,
    way: &mut Way,
    queue: &mut RayQueue,
    rings: &mut super::rings::RingBlock,
    (light, i, pick): (&SphereLight, usize, &Pick),
) {
    let (counted, guess) = counted(light, density.mix(), pick);
    let lamp = Light::new(i, &counted, None);
    let ball = BoundingSphere {
        center: light.center,
        radius: light.radius,
    };
    let open = way.cull(chunk, stream, ball, light.sphere);
    let mut sink = Sink {
        // Which shafts are empty depends on the points of a chunk, and sums in the stream are rounded in another order: a replay of one
        // pixel would differ in its last digit.
        open: false,
        queue,
        answered: 0,
    };
    let end = stream.len();
    for part in parts {
        stream.end_at(part.end);
        if D::WARP == Warp::Cone {
            let listed = Listed::new(density.mix(), guess);
            sample_light::<L, Listed, M>(listed, chunk, stream, part, &lamp, &mut sink);
        } else {
            density.toward_light::<L>(chunk, stream, rings, part, &lamp, &mut sink);
        }
        stream.end_at(end);
    }
    way.trace::<L>(chunk, queue, open, lamp.sphere.sphere);
}

#[inline(always)]
fn toward_triangle<L: TraceLane, M: Probed>(
    mix: Mix,
    chunk: &mut Chunk,
    stream: &mut ModelStream<M>,
    parts: impl Iterator<Item = Range<usize>>,
    way: &mut Way,
    queue: &mut RayQueue,
    (light, i, pick): (&TriangleLight, usize, &Pick),
) {
    let (times, guess) = worth(mix, pick);
    let (triangles, le) = (light.triangle.splat::<L>(), Vec3::splat(light.le.map(|x| x * times)));
    let tossed = mix == Mix::Average;
    let end = stream.len();
    for part in parts {
        stream.end_at(part.end);
        for at in part.step_by(L::N) {
            let (mut active, point, address) = stream.packet::<L>(at);
            if tossed {
                active = active & !stream.by_brdf_lanes::<L>(at);
            }
            let view = triangles.seen_from(point.p);
            let active = active & view.rises_above(point.bsdf.normal());
            if active.none() {
                continue;
            }
            let pair = if tossed {
                chunk.numbers.after_toss(address.key, address.pass, pairs::light(i))
            } else {
                chunk.numbers.pair(address.key, address.pass, pairs::light(i))
            };
            let (u, v) = pair.unit::<L>();
            let by_brdf_lanes = L::Mask::splat(false);
            let numbers = per_triangle::Numbers { by_brdf_lanes, u, v };
            let worth = (le, L::splat(guess));
            if let Some(found) = per_triangle::sample(mix, &point, &view, worth, numbers, active) {
                queue.push(found.active, &QueuedRays::to_light(&point, &address, &found));
            }
        }
        stream.end_at(end);
    }
    if queue.len() > 0 {
        let ball = BoundingSphere::around(&light.triangle.corners);
        let open = way.cull(chunk, stream, ball, light.skip_id);
        way.trace::<L>(chunk, queue, open, light.skip_id);
    }
}

#[inline(always)]
fn toward_delta<L: TraceLane, M: Probed>(
    mix: Mix,
    chunk: &mut Chunk,
    stream: &mut ModelStream<M>,
    parts: impl Iterator<Item = Range<usize>>,
    way: &mut Way,
    queue: &mut RayQueue,
    light: &DeltaLight,
) {
    let end = stream.len();
    for part in parts {
        stream.end_at(part.end);
        for at in part.step_by(L::N) {
            let (mut active, point, address) = stream.packet::<L>(at);
            // Only half of the points, as for the lights that directions of the BRDF find: so two passes share a list of all kinds.
            if mix == Mix::Average {
                active = active & !stream.by_brdf_lanes::<L>(at);
            }
            if active.none() {
                continue;
            }
            let arriving = light.seen_from(point.p);
            if let Some(found) = per_delta::sample(&point, Vec3::splat(light.le), &arriving, active) {
                queue.push(found.active, &QueuedRays::to_light(&point, &address, &found));
            }
        }
        stream.end_at(end);
    }
    if queue.len() == 0 {
        return;
    }
    let open = way.cull(chunk, stream, light.ball(), NO_SKIP_ID);
    way.trace::<L>(chunk, queue, open, NO_SKIP_ID);
}

/// Queues the BRDF rays of the points that sample their BRDF, with their densities.
#[inline(always)]
pub(super) fn sample_brdf<L: TraceLane, M: Probed>(
    mix: Mix,
    chunk: &Chunk,
    stream: &ModelStream<M>,
    part: Range<usize>,
    looks: &mut WideQueue,
) {
    for at in part.step_by(L::N) {
        let (mut active, point, address) = stream.packet::<L>(at);
        if !mix.both() {
            active = active & stream.by_brdf_lanes::<L>(at);
        }
        if active.none() {
            continue;
        }
        let wi = stream.sampled::<L>(at);
        let (cos_theta, above) = point.above(wi);
        let lobe = point.bsdf.eval(wi, cos_theta);
        let mut active = active & above & lobe.shape.lit();
        if chunk.world.drops_misses() {
            active = active & may_meet(&chunk.world.lights, point.p, wi);
        }
        let rays = QueuedRays {
            origin: point.p,
            direction: wi,
            tfar: L::splat(f32::INFINITY),
            value: lobe.shape.kept(active).colour(point.bsdf.rho(), Vec3::splat([1.0; 3])),
            index: address.index,
        };
        looks.push(active, &rays, lobe.pdf);
    }
}
