//! Shading: from hit streams to rays that carry what they are worth.

use std::marker::PhantomData;

use super::{Chunk, Scratch, Stage, pairs, shadow};
use crate::embree::TraceLane;
use crate::estimator::{per_light, per_point};
use crate::lane::{Lane, Mask};
use crate::light::SphereLight;
use crate::math::Vec3;
use crate::pipeline::stream::{Model, QueuedRays};
use crate::pipeline::tracer::Tracer;

/// `light` and `mis`: a direction for every light.
pub struct PerLight<D, M>(PhantomData<(D, M)>);

/// `uniform` and `brdf`: one direction for the point.
pub struct PerPoint<D, M>(PhantomData<(D, M)>);

impl<D: per_light::Density, M: Model> Stage for PerLight<D, M> {
    /// The light is the outer loop: it is the same for a whole stream, and its shadow rays are as alike as they can be.
    #[inline(always)]
    fn run<L: TraceLane, T: Tracer>(chunk: &mut Chunk, scratch: &mut Scratch) {
        let Scratch {
            hits,
            queue,
            points,
            set,
            ..
        } = scratch;
        let group = chunk.tile.number();
        let stream = &hits[M::STREAM];
        if stream.len() == 0 {
            return;
        }
        T::survey::<L>(chunk.world, stream, points);
        for (i, light) in chunk.world.lights.iter().enumerate() {
            let light =
                &mutate!(*light, LightBlocksItself => SphereLight { sphere: crate::shape::NO_SPHERE, ..*light });
            queue.clear();
            for at in (0..stream.len()).step_by(L::N) {
                let (active, point, address) = stream.packet::<L, M>(at);
                let toss = || chunk.numbers.toss(address.key, address.pass, pairs::light(i), group);
                let Some(found) = per_light::sample::<L, D>(&point, light, toss, active) else {
                    continue;
                };
                let rays = QueuedRays {
                    origin: point.p,
                    direction: found.wi,
                    tfar: found.distance,
                    value: mutate!(found.ld, LightTwice => if i == 0 { found.ld + found.ld } else { found.ld }),
                    index: address.index,
                };
                queue.push(found.active, &rays);
            }
            if queue.len() > 0 {
                T::face_light::<L>(chunk.world, stream, points, light, set);
                shadow::visible::<L, T>(chunk, queue, set, light.sphere);
            }
        }
    }
}

impl<D: per_point::Density, M: Model> Stage for PerPoint<D, M> {
    /// Where only spheres emit, a direction that misses them all is dropped before it costs a ray.
    #[inline(always)]
    fn run<L: TraceLane, T: Tracer>(chunk: &mut Chunk, scratch: &mut Scratch) {
        let Scratch { hits, queue, set, .. } = scratch;
        queue.clear();
        let stream = &hits[M::STREAM];
        for at in (0..stream.len()).step_by(L::N) {
            let (active, point, address) = stream.packet::<L, M>(at);
            let numbers = chunk.numbers.pair(address.key, address.pass, pairs::DIRECTION);
            let Some(found) = per_point::sample::<L, D>(&point, numbers, active) else {
                continue;
            };
            let mut wanted = found.active;
            if chunk.world.only_spheres_emit() {
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
