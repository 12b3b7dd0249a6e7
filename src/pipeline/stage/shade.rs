//! Shading: turns hit streams into rays with contributions.

use std::hint::black_box;
use std::marker::PhantomData;
use std::ops::Range;

use super::directions::Directions;
use super::penumbra::{Half, mark};
use super::rings::{self, Drawn, RingBlock};
use super::{Chunk, Request, Scratch, Shaft, Stage, pairs, shadow};
use crate::bsdf::Tint;
use crate::embree::TraceLane;
use crate::estimator::density::{Density, Warp};
use crate::estimator::{per_light, per_point, product};
use crate::lane::{Lane, Mask};
use crate::light::{Rings, SphereLight};
use crate::math::Vec3;
use crate::pipeline::model::{self, Model};
use crate::pipeline::queue::{QueuedRays, RayQueue};
use crate::pipeline::stream::{Address, HitStream, ModelStream};
use crate::shape::BoundingSphere;

/// One or two directions for every spherical light.
pub struct PerLight<D, M>(PhantomData<(D, M)>);

/// `uniform` and `brdf`: one direction per point.
pub struct PerPoint<D, M>(PhantomData<(D, M)>);

impl<D: Directions<M>, M: Model> Stage for PerLight<D, M> {
    /// Lights are the outer loop, for coherent shadow rays; techniques have separate loops, because most packets use just one.
    #[inline(always)]
    fn run<L: TraceLane>(chunk: &mut Chunk, scratch: &mut Scratch) {
        let Scratch {
            hits,
            queue,
            points,
            shafts,
            rings,
            ..
        } = scratch;
        let Some(stream) = M::stream_mut(hits) else { return };
        let density = D::of(chunk.mix);
        chunk.request(Request::Survey { stream, points });
        let lights = &chunk.world.lights;
        shafts.resize_with(lights.len(), Shaft::default);
        for (light, Shaft { open, set }) in lights.iter().zip(&mut *shafts) {
            let ball = BoundingSphere {
                center: light.center,
                radius: light.radius,
            };
            chunk.request(Request::Shaft {
                stream,
                points,
                ball,
                skip_id: light.sphere,
                wide: None,
                open,
                set,
            });
        }
        for first in (0..stream.len()).step_by(chunk.handler.block) {
            let block = first..stream.len().min(first + chunk.handler.block);
            prepare::<L, D, M>(density, chunk, stream, block.clone());
            let partly = if D::WARP == Warp::DiskOrCone {
                mark::<L>(chunk, stream, block.clone())
            } else {
                0
            };
            for (i, (light, Shaft { open, set })) in lights.iter().zip(&*shafts).enumerate() {
                let half = if *open { None } else { Half::first(partly, i) };
                let light = &Light::new(i, light, half);
                let mut sink = Sink {
                    open: *open,
                    queue: &mut *queue,
                    answered: 0,
                };
                density.toward_light::<L>(chunk, stream, rings, block.clone(), light, &mut sink);
                if D::WARP == Warp::DiskOrCone && light.half.is_some() {
                    chunk.request(Request::Visible {
                        queue: sink.queue,
                        set,
                        light: light.sphere.sphere,
                    });
                    density.toward_light::<L>(chunk, stream, rings, block.clone(), &light.second(), &mut sink);
                }
                if density.mix().both() {
                    // The queue has room for one ray per point.
                    chunk.request(Request::Visible {
                        queue: sink.queue,
                        set,
                        light: light.sphere.sphere,
                    });
                }
                if density.mix().mixed() {
                    sample_brdf::<L, D, M>(density, chunk, stream, block.clone(), light, &mut sink);
                }
                chunk.counters.shadow_rays += sink.answered;
                chunk.request(Request::Visible {
                    queue,
                    set,
                    light: light.sphere.sphere,
                });
            }
            shadow::splat_stream::<L>(chunk, stream, block);
        }
    }
}

/// A light and the random pair for its cone.
pub struct Light {
    pub sphere: SphereLight,
    pub pair: u32,
    /// The direction to sample at points that see the light partially; `None` if no point does.
    pub half: Option<Half>,
}

impl Light {
    pub fn new(i: usize, light: &SphereLight, half: Option<Half>) -> Self {
        let once = mutate!(*light, LightTwice => SphereLight { le: light.le.map(|x| if i == 0 { x + x } else { x }), ..*light });
        Self {
            sphere: mutate!(once, LightBlocksItself => SphereLight { sphere: crate::shape::NO_SKIP_ID, ..once }),
            pair: pairs::light(i),
            half,
        }
    }

    fn second(&self) -> Self {
        let half = self.half.map(|half| Half { second: true, ..half });
        Self { half, ..*self }
    }
}

/// Destination of a light's contributions: the points themselves if nothing can block the rays, else the ray queue.
pub struct Sink<'a> {
    pub open: bool,
    pub queue: &'a mut RayQueue,
    /// Number of rays that needed no tracing.
    pub answered: u64,
}

impl Sink<'_> {
    #[inline(always)]
    pub fn take<L: Lane, T: Tint<L>>(
        &mut self,
        stream: &mut HitStream,
        at: usize,
        light: &SphereLight,
        found: &per_light::Weighed<L, T>,
    ) {
        let ld = found.ld(light, stream.reflectance(at));
        if self.open {
            let light = stream.light(at) + ld;
            stream.set_light(at, light);
            self.answered += found.active.count() as u64;
            return;
        }
        let rays = QueuedRays {
            origin: stream.position(at),
            direction: found.wi,
            tfar: found.distance,
            value: ld,
            index: stream.index::<L>(at),
        };
        self.queue.push(found.active, &rays);
    }
}

/// Chooses the technique for each point of a stream, and samples its BRDF where BRDF sampling is possible.
#[inline(always)]
pub fn prepare<L: TraceLane, D: Density, M: Model>(
    density: D,
    chunk: &Chunk,
    stream: &mut ModelStream<M>,
    block: Range<usize>,
) {
    for at in block.step_by(L::N) {
        stream.set_light::<L>(at, Vec3::zero());
        if density.mix().both() {
            let (_, point, Address { key, pass, .. }) = stream.packet::<L>(at);
            let wi = per_light::along_lobe(&point, chunk.numbers.pair(key, pass, pairs::DIRECTION));
            stream.set_drawn(at, L::Mask::splat(true), wi);
        } else if density.mix().mixed() {
            let (mask, point, Address { key, pass, .. }) = stream.packet::<L>(at);
            let by_brdf_lanes = chunk
                .numbers
                .by_brdf_lanes(key, pass, pairs::DIRECTION, chunk.tile.number());
            let mut wi = Vec3::zero();
            if !chunk.numbers.one_coin() || (by_brdf_lanes & mask).any() {
                wi = per_light::along_lobe(&point, chunk.numbers.after_toss(key, pass, pairs::DIRECTION));
            }
            stream.set_drawn(at, by_brdf_lanes, wi);
        }
    }
}

#[inline(always)]
fn by_brdf_lanes<L: Lane, D: Density, M: Model>(
    chunk: &Chunk,
    stream: &ModelStream<M>,
    at: usize,
    light: &Light,
) -> L::Mask {
    if D::SHARES_COIN || chunk.numbers.one_coin() {
        return stream.by_brdf_lanes::<L>(at);
    }
    let (_, _, Address { key, pass, .. }) = stream.packet::<L>(at);
    chunk.numbers.by_brdf_lanes(key, pass, light.pair, chunk.tile.number())
}

/// Samples a light, for the points that use light sampling.
#[inline(always)]
pub fn sample_light<L: TraceLane, D: per_light::Directions<L, M::Of<L>>, M: Model>(
    density: D,
    chunk: &Chunk,
    stream: &mut ModelStream<M>,
    block: Range<usize>,
    light: &Light,
    sink: &mut Sink,
) {
    for at in block.step_by(L::N) {
        let mut active = stream.lanes::<L>(at);
        let mix = density.mix();
        let tossed = mix.mixed() && !mix.both();
        // If all lights share one random choice, it is known already. A choice per light costs a hash, which many packets can skip.
        let known = D::SHARES_COIN || chunk.numbers.one_coin();
        if tossed && known {
            active = active & !by_brdf_lanes::<L, D, M>(chunk, stream, at, light);
            if active.none() {
                continue;
            }
        }
        let (_, point, address) = stream.packet::<L>(at);
        let view = light.sphere.seen_from(point.p);
        active = active & per_light::may_contribute(&point, &view);
        if tossed && !known && active.any() {
            active = active & !by_brdf_lanes::<L, D, M>(chunk, stream, at, light);
        }
        if active.none() {
            continue;
        }
        let numbers = if mix.tosses(D::WARP) {
            chunk.numbers.after_toss(address.key, address.pass, light.pair)
        } else {
            chunk.numbers.pair(address.key, address.pass, light.pair)
        };
        let found = if D::WARP == Warp::ProjectedCap {
            density.toward_light(&point, &view, numbers, active)
        } else {
            let sampled = per_light::draw(&view, numbers);
            // Reloads the point: otherwise the compiler spills the first load, as sixteen registers are too few.
            let (_, point, _) = stream.packet::<L>(black_box(at));
            per_light::by_light(density, &point, &sampled, active)
        };
        if let Some(found) = found {
            sink.take(stream, at, &light.sphere, &found);
        }
    }
}

/// Samples the part of each point's lobe that lies inside the light, in the three steps of [`product::by_lobe`].
#[inline(always)]
pub fn in_lobe<L: TraceLane>(
    chunk: &Chunk,
    stream: &mut ModelStream<model::Phong>,
    rings: &mut RingBlock,
    block: Range<usize>,
    light: &Light,
    sink: &mut Sink,
) {
    for first in block.clone().step_by(rings::BLOCK) {
        rings.clear();
        for at in (first..block.end.min(first + rings::BLOCK)).step_by(L::N) {
            let (mut active, point, address) = stream.packet::<L>(at);
            let view = light.sphere.seen_from(point.p);
            active = active & per_light::may_contribute(&point, &view);
            if active.none() {
                continue;
            }
            let beside_tail = product::beside_tail(&point, &view);
            if (active & !beside_tail).any() {
                let numbers = chunk.numbers.pair(address.key, address.pass, light.pair);
                active = active & (beside_tail | mutate!(numbers.rare(), StageTakesAllTails => L::Mask::splat(true)));
                if active.none() {
                    continue;
                }
            }
            let cone = view.cone();
            let found = Rings::of(point.bsdf.wr, point.bsdf.alpha, &cone).weighed_in_tail(beside_tail);
            active = active & found.mass.gt(L::zero());
            if active.any() {
                rings.push(at, active, &found, &cone);
            }
        }
        for i in 0..rings.len() {
            let (_, point, Address { key, pass, .. }) = stream.packet::<L>(rings.start(i));
            let (u, v) = chunk.numbers.pair(key, pass, light.pair).unit::<L>();
            let found = rings.rings::<L>(i);
            let ring = found.draw(point.bsdf.alpha, u);
            rings.set_drawn(i, &ring, found.weight(&ring), v);
        }
        for i in 0..rings.len() {
            let at = rings.start(i);
            let (_, point, _) = stream.packet::<L>(at);
            let Drawn {
                active,
                ring,
                weight,
                v,
                cone,
            } = rings.sampled::<L>(i, &light.sphere);
            let found = product::on_ring(&point, &cone, &ring, weight, v, active);
            if let Some(found) = found {
                sink.take(stream, at, &light.sphere, &found);
            }
        }
    }
}

#[inline(always)]
fn sample_brdf<L: TraceLane, D: Density, M: Model>(
    density: D,
    chunk: &Chunk,
    stream: &mut ModelStream<M>,
    block: Range<usize>,
    light: &Light,
    sink: &mut Sink,
) {
    for at in block.step_by(L::N) {
        let mut active = stream.lanes::<L>(at);
        let (tossed, known) = (!density.mix().both(), chunk.numbers.one_coin());
        if tossed && known {
            active = active & by_brdf_lanes::<L, D, M>(chunk, stream, at, light);
        }
        if active.none() {
            continue;
        }
        let wi = stream.sampled(at);
        active = active & light.sphere.may_meet(stream.position(at), wi);
        if tossed && !known && active.any() {
            active = active & by_brdf_lanes::<L, D, M>(chunk, stream, at, light);
        }
        if active.none() {
            continue;
        }
        let (_, point, _) = stream.packet::<L>(at);
        if let Some(found) = per_light::by_brdf(density, &point, &light.sphere, wi, active) {
            sink.take(stream, at, &light.sphere, &found);
        }
    }
}

impl<D: per_point::Density, M: Model> Stage for PerPoint<D, M> {
    #[inline(always)]
    fn run<L: TraceLane>(chunk: &mut Chunk, scratch: &mut Scratch) {
        let Scratch { hits, queue, set, .. } = scratch;
        let Some(stream) = M::stream(hits) else { return };
        for at in (0..stream.len()).step_by(L::N) {
            let (active, point, address) = stream.packet::<L>(at);
            let numbers = chunk.numbers.pair(address.key, address.pass, pairs::DIRECTION);
            let Some(found) = per_point::sample::<L, D>(&point, numbers, active) else {
                continue;
            };
            let mut wanted = found.active;
            if chunk.world.drops_misses() {
                wanted = wanted & may_meet(&chunk.world.lights, point.p, found.wi);
            }
            let rays = QueuedRays {
                origin: point.p,
                direction: found.wi,
                tfar: L::splat(f32::INFINITY),
                value: found.throughput,
                index: address.index,
            };
            queue.push(wanted, &rays);
        }
        chunk.request(Request::All { set });
        chunk.request(Request::Emitted { queue, set });
    }
}

/// Lanes whose direction may hit any of the lights. Conservative: tracing decides.
#[inline(always)]
pub(super) fn may_meet<L: Lane>(lights: &[SphereLight], p: Vec3<L>, wi: Vec3<L>) -> L::Mask {
    let mut meets = L::Mask::splat(false);
    for light in lights {
        meets = mutate!(meets, LastLightOnly => L::Mask::splat(false)) | light.may_meet(p, wi);
    }
    meets
}
