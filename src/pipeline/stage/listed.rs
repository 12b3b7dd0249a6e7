//! Shading under many lights, for estimators that sample every light: here every light of a short list, which differs per pass and
//! color of a tile ([`lists`](crate::pipeline::lists)).
//!
//! A light with an expected count of `n` in a list is weighted by `1 / n` for each occurrence. If BRDF sampling is combined, the
//! MIS weights assume that the light occurs `m` times, an estimate that needs no tree traversal: `f m / (n (m p + q))` for a light
//! sample and `f / (m p + q)` for a BRDF sample, in the notation of [`density`](crate::estimator::density). The weights sum to one
//! for any `m`; only `n` must be exact. A BRDF ray is traced to the light that it hits, which need not be on any list.

use std::marker::PhantomData;

use super::directions::Directions;
use super::shade::{Light, Sink, may_meet, prepare, sample_light};
use super::{Ask, Chunk, Scratch, Stage, pairs, shadow};
use crate::bsdf::{Brdf, Tint};
use crate::embree::TraceLane;
use crate::estimator::density::{Listed, Mix, Warp};
use crate::estimator::per_triangle;
use crate::lane::Mask;
use crate::light::tree::Pick;
use crate::light::{SphereLight, TriangleLight};
use crate::linear::Candidates;
use crate::linear::cull::Points;
use crate::math::Vec3;
use crate::pipeline::lists::{ListAddress, Probed, colour};
use crate::pipeline::queue::{QueuedRays, RayQueue, WideQueue};
use crate::pipeline::stream::{HitStream, ModelStream};
use crate::shape::Ball;

/// One or two directions for every light of a list.
pub struct PerListed<D, M>(PhantomData<(D, M)>);

impl<D: Directions<M>, M: Probed> Stage for PerListed<D, M> {
    #[inline(always)]
    fn run<L: TraceLane>(chunk: &mut Chunk, scratch: &mut Scratch) {
        let Scratch {
            hits,
            parts,
            list,
            queue,
            looks,
            points,
            set,
            rings,
            ..
        } = scratch;
        let (Some(lists), Some(stream)) = (&chunk.world.lists, M::stream_mut(hits)) else {
            return;
        };
        let part = M::filled(parts);
        let of_spheres = D::of(chunk.mix);
        // Triangles may use MIS where spheres do not.
        let mix = if lists.has_triangles() {
            chunk.mix
        } else {
            of_spheres.mix()
        };
        prepare::<L, Mix, M>(mix, chunk, stream, 0..stream.len());
        let tossed = mix == Mix::Average && of_spheres.mix() == Mix::Average;
        let mut at = 0;
        while at < stream.len() {
            let (shared, end) = segment(chunk, stream, at);
            part.copy(stream, at..end);
            at = end;
            let pass = chunk.numbers.first() + shared.pass;
            if lists.table(chunk.tile, M::KIND, pass).is_none() {
                chunk.ask(Ask::Tabulate {
                    lists,
                    kind: M::KIND,
                    pass,
                });
            }
            let Some(table) = lists.table(chunk.tile, M::KIND, pass) else {
                return;
            };
            if !(tossed && all_heads(part)) {
                let address = ListAddress::new(chunk.numbers, chunk.tile, shared.colour, pass, tossed);
                lists.draw(table, &address, list);
                chunk.ask(Ask::Survey { stream: part, points });
                for (i, pick) in list.iter().enumerate() {
                    match lists.kind(pick.light) {
                        (true, number) => {
                            let light = &chunk.world.lights[number];
                            let of_light = (light, i, pick);
                            toward_sphere::<L, D, M>(of_spheres, chunk, part, points, set, queue, rings, of_light);
                        }
                        (false, number) => {
                            let light = &chunk.world.triangle_lights[number];
                            toward_triangle::<L, M>(mix, chunk, part, points, set, queue, (light, i, pick));
                        }
                    }
                }
            }
            if mix.mixed() {
                sample_brdf::<L, M>(mix, chunk, part, looks);
                if looks.len() > 0 {
                    chunk.ask(Ask::All { set });
                    let spheres = of_spheres.mix().mixed();
                    chunk.ask(Ask::Met {
                        queue: looks,
                        set,
                        lists,
                        table,
                        spheres,
                    });
                }
            }
            shadow::splat_stream::<L>(chunk, part, 0..part.len());
        }
    }
}

/// What points of a tile that share a list have in common.
#[derive(PartialEq, Eq)]
struct Shared {
    /// Relative to the first of the block.
    pass: u32,
    colour: u32,
}

/// The shared properties of the point at `at`, and the end of the run of points that have them.
fn segment(chunk: &Chunk, stream: &HitStream, at: usize) -> (Shared, usize) {
    let offsets = chunk.tile.offsets();
    let [left, top] = chunk.tile.corners()[0];
    let shared = |at: usize| {
        let (index, pass) = stream.place(at);
        let [x, y] = offsets[index as usize % offsets.len()];
        Shared {
            pass,
            colour: colour([left + x, top + y]),
        }
    };
    let first = shared(at);
    let end = (at + 1..stream.len()).find(|&at| shared(at) != first);
    (first, end.unwrap_or(stream.len()))
}

/// Whether all points sample their BRDF.
fn all_heads(part: &HitStream) -> bool {
    (0..part.len()).all(|at| part.by_brdf_lanes::<f32>(at))
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

#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "parts of one scratch pad")]
fn toward_sphere<L: TraceLane, D: Directions<M>, M: Probed>(
    density: D,
    chunk: &mut Chunk,
    part: &mut ModelStream<M>,
    points: &mut Points,
    set: &mut Candidates,
    queue: &mut RayQueue,
    rings: &mut super::rings::RingBlock,
    (light, i, pick): (&SphereLight, usize, &Pick),
) {
    let (counted, guess) = counted(light, density.mix(), pick);
    let lamp = Light::new(i, &counted, None);
    let mut open = false;
    let ball = Ball {
        center: light.center,
        radius: light.radius,
    };
    chunk.ask(Ask::Shaft {
        stream: part,
        points,
        ball,
        skip_id: light.sphere,
        open: &mut open,
        set,
    });
    let all = 0..part.len();
    let mut sink = Sink {
        // Which shafts are empty depends on the points of a chunk, and sums in the stream are rounded in another order: a replay of one
        // pixel would differ in its last digit.
        open: open && !chunk.world.by_shaft,
        queue,
        answered: 0,
    };
    if D::WARP == Warp::Cone {
        let listed = Listed::new(density.mix(), guess);
        sample_light::<L, Listed, M>(listed, chunk, part, all, &lamp, &mut sink);
    } else {
        density.toward_light::<L>(chunk, part, rings, all, &lamp, &mut sink);
    }
    chunk.counters.shadow_rays += sink.answered;
    let light = lamp.sphere.sphere;
    chunk.ask(Ask::Visible { queue, set, light });
}

#[inline(always)]
fn toward_triangle<L: TraceLane, M: Probed>(
    mix: Mix,
    chunk: &mut Chunk,
    part: &ModelStream<M>,
    points: &mut Points,
    set: &mut Candidates,
    queue: &mut RayQueue,
    (light, i, pick): (&TriangleLight, usize, &Pick),
) {
    let (times, guess) = worth(mix, pick);
    let (triangles, le) = (light.triangle.splat::<L>(), Vec3::splat(light.le.map(|x| x * times)));
    let tossed = mix == Mix::Average;
    for at in (0..part.len()).step_by(L::N) {
        let (mut active, point, address) = part.packet::<L>(at);
        if tossed {
            active = active & !part.by_brdf_lanes::<L>(at);
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
    if queue.len() > 0 {
        let (ball, skip_id) = (Ball::around(&light.triangle.corners), light.skip_id);
        chunk.ask(Ask::Shaft {
            stream: part,
            points,
            ball,
            skip_id,
            open: &mut false,
            set,
        });
        chunk.ask(Ask::Visible {
            queue,
            set,
            light: skip_id,
        });
    }
}

/// Queues the BRDF rays of the points that sample their BRDF, with their densities.
#[inline(always)]
fn sample_brdf<L: TraceLane, M: Probed>(mix: Mix, chunk: &Chunk, part: &ModelStream<M>, looks: &mut WideQueue) {
    for at in (0..part.len()).step_by(L::N) {
        let (mut active, point, address) = part.packet::<L>(at);
        if !mix.both() {
            active = active & part.by_brdf_lanes::<L>(at);
        }
        if active.none() {
            continue;
        }
        let wi = part.sampled::<L>(at);
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
