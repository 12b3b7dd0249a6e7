//! Shading: from hit streams to rays that carry what they are worth.

use std::marker::PhantomData;

use super::{Chunk, Scratch, Stage, pairs, shadow};
use crate::embree::TraceLane;
use crate::estimator::{ShadingPoint, per_light, per_point};
use crate::lane::{Lane, Mask};
use crate::light::SphereLight;
use crate::math::Vec3;
use crate::pipeline::stream::{Address, HitStream, QueuedRays, RayQueue};
use crate::pipeline::tracer::Tracer;

/// `light` and `mis`: a direction for every light.
pub struct PerLight<D>(PhantomData<D>);

/// `uniform` and `brdf`: one direction for the point.
pub struct PerPoint<D>(PhantomData<D>);

impl<D: per_light::Density> Stage for PerLight<D> {
    /// The light is the outer loop: it is the same for a whole stream, and its shadow rays are as alike as they can be. Each
    /// technique has a loop of its own, for whole packets mostly follow one.
    #[inline(always)]
    fn run<L: TraceLane, T: Tracer>(chunk: &mut Chunk, scratch: &mut Scratch) {
        let Scratch {
            hits,
            queue,
            points,
            set,
            ..
        } = scratch;
        for stream in hits.iter_mut().filter(|stream| stream.len() > 0) {
            T::survey::<L>(chunk.world, stream, points);
            if D::MIXED {
                draw::<L>(chunk, stream);
            }
            for (i, light) in chunk.world.lights.iter().enumerate() {
                let light =
                    &mutate!(*light, LightBlocksItself => SphereLight { sphere: crate::shape::NO_SPHERE, ..*light });
                let light = &mutate!(*light, LightTwice => SphereLight { le: light.le.map(|x| if i == 0 { x + x } else { x }), ..*light });
                queue.clear();
                toward::<L, D>(chunk, stream, i, light, queue);
                if D::MIXED {
                    along::<L, D>(chunk, stream, i, light, queue);
                }
                if queue.len() > 0 {
                    T::face_light::<L>(chunk.world, stream, points, light, set);
                    shadow::visible::<L, T>(chunk, queue, set, light.sphere);
                }
            }
        }
    }
}

/// Draws for each point of a stream the direction of its BRDF.
#[inline(always)]
fn draw<L: TraceLane>(chunk: &Chunk, stream: &mut HitStream) {
    for at in (0..stream.len()).step_by(L::N) {
        let (_, point, address) = stream.packet::<L>(at);
        let toss = chunk
            .numbers
            .toss(address.key, address.pass, pairs::DIRECTION, chunk.tile.number());
        if toss.shared && toss.heads.none() {
            continue;
        }
        stream.set_drawn(at, per_light::along_lobe(&point, toss.pair));
    }
}

/// Directions in the cone of a light, for the points that follow it.
#[inline(always)]
fn toward<L: TraceLane, D: per_light::Density>(
    chunk: &Chunk,
    stream: &HitStream,
    i: usize,
    light: &SphereLight,
    queue: &mut RayQueue,
) {
    for at in (0..stream.len()).step_by(L::N) {
        let (mut active, point, address) = stream.packet::<L>(at);
        let toss = chunk
            .numbers
            .toss(address.key, address.pass, pairs::light(i), chunk.tile.number());
        if D::MIXED {
            active = active & !toss.heads;
            if active.none() {
                continue;
            }
        }
        if let Some(found) = per_light::by_cone::<L, D>(&point, light, || toss.pair, active) {
            push(queue, &point, &address, &found);
        }
    }
}

/// Directions of the BRDF, for the points that follow it and as far as they meet a light.
#[inline(always)]
fn along<L: TraceLane, D: per_light::Density>(
    chunk: &Chunk,
    stream: &HitStream,
    i: usize,
    light: &SphereLight,
    queue: &mut RayQueue,
) {
    for at in (0..stream.len()).step_by(L::N) {
        let (mask, point, address) = stream.packet::<L>(at);
        let toss = chunk
            .numbers
            .toss(address.key, address.pass, pairs::light(i), chunk.tile.number());
        if toss.shared && (mask & toss.heads).none() {
            continue;
        }
        let wi = stream.drawn(at);
        let active = mask & light.may_meet(point.p, wi);
        if active.none() || (active & toss.heads).none() {
            continue;
        }
        let active = active & toss.heads;
        if let Some(found) = per_light::by_brdf::<L, D>(&point, light, wi, active) {
            push(queue, &point, &address, &found);
        }
    }
}

#[inline(always)]
fn push<L: Lane>(
    queue: &mut RayQueue,
    point: &ShadingPoint<L>,
    address: &Address<L>,
    found: &per_light::Contribution<L>,
) {
    let rays = QueuedRays {
        origin: point.p,
        direction: found.wi,
        tfar: found.distance,
        value: found.ld,
        index: address.index,
    };
    queue.push(found.active, &rays);
}

impl<D: per_point::Density> Stage for PerPoint<D> {
    /// Where only spheres emit, a direction that misses them all is dropped before it costs a ray.
    #[inline(always)]
    fn run<L: TraceLane, T: Tracer>(chunk: &mut Chunk, scratch: &mut Scratch) {
        let Scratch { hits, queue, set, .. } = scratch;
        queue.clear();
        for stream in hits.iter() {
            for at in (0..stream.len()).step_by(L::N) {
                let (active, point, address) = stream.packet::<L>(at);
                let numbers = chunk.numbers.pair(address.key, address.pass, pairs::DIRECTION);
                let Some(found) = per_point::sample::<L, D>(&point, numbers, active) else {
                    continue;
                };
                let mut wanted = found.active;
                if !chunk.world.mesh_lights {
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
        }
        T::face_all(chunk.world, set);
        shadow::emitted::<L, T>(chunk, queue, set);
    }
}

/// Lanes whose direction may meet any of the lights. The accelerator decides; this only must never say no too early.
#[inline(always)]
fn may_meet<L: Lane>(lights: &[SphereLight], p: Vec3<L>, wi: Vec3<L>) -> L::Mask {
    let mut meets = L::Mask::splat(false);
    for light in lights {
        let cone = light.cone(p);
        // The chord to the rim, widened by more than unit vectors can be off: |w - wi| is true to 3e-7.
        let rim = (cone.omc + cone.omc).sqrt() + L::splat(1e-6);
        let chord = (cone.axis - wi).length();
        meets = mutate!(meets, LastLightOnly => L::Mask::splat(false)) | chord.le(rim);
    }
    meets
}
