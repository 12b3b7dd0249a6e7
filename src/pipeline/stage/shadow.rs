//! Visibility: traces queued rays and adds their contributions to the film. Each function leaves its queue empty.

use std::ops::Range;

use super::Chunk;
use crate::embree::{Coherence, NO_SKIP_ID, Ray, TraceLane};
use crate::estimator::per_triangle;
use crate::film::ChunkSum;
use crate::lane::{Bits, Lane, Mask};
use crate::light::MeshLight;
use crate::linear::Candidates;
use crate::math::Vec3;
use crate::pipeline::Counters;
use crate::pipeline::queue::{QueuedRays, RayQueue, WideQueue};
use crate::pipeline::stream::HitStream;
use crate::pipeline::tracer::Tracer;

/// Adds the contribution of every ray that hits nothing except the sphere `light` before its end.
#[inline(always)]
pub fn splat_unoccluded<L: TraceLane, T: Tracer>(
    chunk: &mut Chunk,
    queue: &mut RayQueue,
    set: &Candidates,
    light: u32,
) {
    chunk.keep(queue);
    let all = 0..queue.len();
    if chunk.world.by_shaft && set.is_crowded() {
        let mut near = set.without_balls();
        for first in all.step_by(NEIGHBORS) {
            let some = first..queue.len().min(first + NEIGHBORS);
            set.narrow(&queue.origins(some.clone()), &mut near);
            trace::<L, T>(chunk, queue, some, &near, light);
        }
    } else {
        trace::<L, T>(chunk, queue, all, set, light);
    }
    chunk.counters.shadow_rays += queue.len() as u64;
    queue.clear();
}

/// Number of consecutive rays that share a selection of many candidates; a multiple of all lane widths.
const NEIGHBORS: usize = 16;

#[inline(always)]
fn trace<L: TraceLane, T: Tracer>(
    chunk: &mut Chunk,
    queue: &RayQueue,
    some: Range<usize>,
    set: &Candidates,
    light: u32,
) {
    // With lists, the rays of a packet go from one tile to one light.
    let coherence = if chunk.world.lists.is_some() {
        Coherence::Coherent
    } else {
        Coherence::Incoherent
    };
    for at in some.step_by(L::N) {
        let (active, rays) = queue.packet::<L>(at);
        let ray = segment(&rays, L::Bits::splat(light));
        let occluded = T::occluded(chunk.world, set, active, &ray, coherence);
        let splat_unoccluded = mutate!(active & !occluded, ShadowsSkipped => active);
        splat(chunk.sum, chunk.counters, splat_unoccluded, rays.value, rays.index);
    }
}

/// Adds the contribution of every ray, because nothing can block them.
#[inline(always)]
pub fn unoccluded<L: Lane>(chunk: &mut Chunk, queue: &mut RayQueue) {
    chunk.keep(queue);
    for at in (0..queue.len()).step_by(L::N) {
        let (active, rays) = queue.packet::<L>(at);
        splat(chunk.sum, chunk.counters, active, rays.value, rays.index);
    }
    chunk.counters.shadow_rays += queue.len() as u64;
    queue.clear();
}

/// Adds the light that the points of a stream received without tracing.
#[inline(always)]
pub fn splat_stream<L: Lane>(chunk: &mut Chunk, stream: &HitStream, block: Range<usize>) {
    for at in block.step_by(L::N) {
        let light = stream.light::<L>(at);
        let total = light.x + light.y + light.z;
        let dark = total.ge(L::zero()) & total.le(L::zero());
        let index = stream.index::<L>(at);
        splat(chunk.sum, chunk.counters, stream.lanes::<L>(at) & !dark, light, index);
    }
}

/// Adds the contribution of every ray that hits nothing before its end, except the shape with the ray's number as skip id.
#[inline(always)]
pub fn visible_each<L: TraceLane, T: Tracer>(chunk: &mut Chunk, queue: &mut WideQueue, set: &Candidates) {
    chunk.keep(queue);
    for at in (0..queue.len()).step_by(L::N) {
        let (active, rays, skip_id) = queue.packet::<L>(at);
        let ray = segment(&rays, skip_id.to_bits());
        let occluded = T::occluded(chunk.world, set, active, &ray, Coherence::Incoherent);
        splat(chunk.sum, chunk.counters, active & !occluded, rays.value, rays.index);
    }
    chunk.counters.shadow_rays += queue.len() as u64;
    queue.clear();
}

/// For every ray whose first hit is the mesh, adds `f_cos` times the radiance, divided by its density and MIS-weighted as in the
/// chunk. The ray's number is the density of the BRDF.
#[inline(always)]
pub fn resolve_mesh_hits<L: TraceLane, T: Tracer>(
    chunk: &mut Chunk,
    queue: &mut WideQueue,
    set: &Candidates,
    light: &MeshLight,
) {
    chunk.keep(queue);
    for at in (0..queue.len()).step_by(L::N) {
        let (active, rays, pdf) = queue.packet::<L>(at);
        let ray = segment(&rays, L::Bits::splat(NO_SKIP_ID));
        let hit = T::nearest(chunk.world, set, active, &ray, Coherence::Incoherent);
        let met = hit.found & hit.geometry.eq(L::Bits::splat(light.geometry));
        if met.none() {
            continue;
        }
        let mut index = [0; 16];
        L::Bits::select(met, hit.primitive, L::Bits::splat(0)).store(&mut index);
        let (triangles, share) = light.gather::<L>(&index);
        let view = triangles.seen_from(rays.origin);
        let weight = per_triangle::weigh(chunk.mix, &view, share, rays.direction, hit.t, pdf);
        let value = rays.value.times(Vec3::splat(light.le)) * weight.or_zero(met);
        splat(chunk.sum, chunk.counters, met, value, rays.index);
    }
    chunk.counters.shadow_rays += queue.len() as u64;
    queue.clear();
}

/// For every ray whose first hit is an emitter, adds its throughput times the radiance. With an environment or a sun, does so for
/// rays that hit nothing, too.
#[inline(always)]
pub fn resolve_emitter_hits<L: TraceLane, T: Tracer>(chunk: &mut Chunk, queue: &mut RayQueue, set: &Candidates) {
    chunk.keep(queue);
    for at in (0..queue.len()).step_by(L::N) {
        let (active, rays) = queue.packet::<L>(at);
        let ray = segment(&rays, L::Bits::splat(NO_SKIP_ID));
        let hit = T::nearest(chunk.world, set, active, &ray, Coherence::Incoherent);
        let mut le = [[0.0_f32; 3]; 16];
        let mut emits = 0_u32;
        for lane in hit.found.lanes() {
            let surface = chunk
                .world
                .surface_index(hit.geometry.lane(lane), hit.primitive.lane(lane));
            if let Some(radiance) = chunk.world.surfaces[surface as usize].le {
                le[lane] = radiance;
                emits |= 1 << lane;
            }
        }
        let radiance = Vec3::new(
            L::from_fn(|i| le[i][0]),
            L::from_fn(|i| le[i][1]),
            L::from_fn(|i| le[i][2]),
        );
        let (mut emits, mut radiance) = (L::Mask::from_bitmask(emits), radiance);
        let misses = active & !hit.found;
        if misses.any() {
            if let Some(environment) = &chunk.world.environment {
                radiance = Vec3::select(misses, environment.radiance(rays.direction, misses), radiance);
                emits = emits | misses;
            }
            for sun in &chunk.world.suns {
                let more = radiance.or_zero(emits) + sun.radiance(rays.direction, misses);
                radiance = Vec3::select(misses, more, radiance);
                emits = emits | misses;
            }
        }
        let value = rays.value.times(radiance);
        splat(chunk.sum, chunk.counters, emits, value, rays.index);
    }
    chunk.counters.shadow_rays += queue.len() as u64;
    queue.clear();
}

#[inline(always)]
pub(super) fn segment<L: Lane>(rays: &QueuedRays<L>, skip_id: L::Bits) -> Ray<L> {
    Ray {
        origin: rays.origin,
        direction: rays.direction,
        tfar: rays.tfar,
        skip_id,
    }
}

/// Adds finite, nonnegative values to the film, lane by lane in order, and counts the others by cause. Idle lanes need a valid
/// index too: they add 0. A data-dependent number of lanes mispredicts and is slower.
#[inline(always)]
pub(super) fn splat<L: Lane>(
    sum: &mut ChunkSum,
    counters: &mut Counters,
    lanes: L::Mask,
    value: Vec3<L>,
    index: L::Bits,
) {
    let infinity = L::splat(f32::INFINITY);
    let low = value.x.min(value.y).min(value.z);
    let high = value.x.max(value.y).max(value.z);
    // A NaN component makes the sum NaN, which fails every comparison.
    let total = value.x + value.y + value.z;
    let sound = low.ge(L::zero()) & high.lt(infinity) & total.ge(L::zero());
    for lane in (lanes & !sound).lanes() {
        counters.reject(value.lane(lane));
    }
    let counts = lanes & sound;
    if counts.none() {
        return;
    }
    let Vec3 { x, y, z } = value.or_zero(counts);
    let rows = L::rows(x, y, z);
    let mut at = [0_u32; 16];
    index.store(&mut at);
    for (&pixel, row) in at.iter().zip(rows.as_ref()) {
        sum.add(pixel as usize, row);
    }
}
