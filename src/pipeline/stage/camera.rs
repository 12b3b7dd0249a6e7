//! Camera rays: from the film to the first hit, into the hit streams.

use std::marker::PhantomData;

use super::facets;
use super::surface::{SurfacePoint, Surfaces, has, shading_point, texels};
use super::{Chunk, Scratch, Stage, pairs};
use crate::bsdf::{Diffuse, Phong};
use crate::embree::{Coherence, Hit, NO_SKIP_ID, Ray, TraceLane, prefetch};
use crate::lane::{Bits, Mask};
use crate::math::Vec3;
use crate::pipeline::model::{self, Model, Streams};
use crate::pipeline::stream::Address;
use crate::pipeline::tracer::Tracer;
use crate::pipeline::world::World;
use crate::sampling::warp;
use crate::scene::Effect;

/// Traces every sample of a chunk. Visible emitters go to the film, surfaces into the streams. `COMPILED_IN` are the bits of the
/// compiled [`Effects`](crate::scene::Effects).
pub struct CameraStage<T, const COMPILED_IN: u32>(PhantomData<T>);

/// Counts the samples of views that contain nothing.
pub struct Blank;

impl<T: Tracer, const COMPILED_IN: u32> Stage for CameraStage<T, COMPILED_IN> {
    #[inline(always)]
    fn run<L: TraceLane>(chunk: &mut Chunk, scratch: &mut Scratch) {
        trace::<L, T, COMPILED_IN>(chunk, scratch);
    }
}

impl Stage for Blank {
    fn run<L: TraceLane>(chunk: &mut Chunk, scratch: &mut Scratch) {
        let Scratch { grid, hits, .. } = scratch;
        hits.clear();
        chunk.counters.samples += grid.fill::<L>(chunk) as u64;
    }
}

#[inline(always)]
fn trace<L: TraceLane, T: Tracer, const COMPILED_IN: u32>(chunk: &mut Chunk, scratch: &mut Scratch) {
    let Scratch { grid, hits, set, .. } = scratch;
    if has(COMPILED_IN, Effect::Lens) {
        // Rays through a lens can leave the tile's frustum.
        T::keep_all(chunk.world, set);
    } else {
        T::cull_for_tile::<L>(chunk.world, chunk.tile, set);
    }
    hits.clear();
    let samples = grid.fill::<L>(chunk);
    // If only pixels are listed and the tile size is no multiple of the packet size, packets straddle passes, so that only the last
    // packet of a chunk has idle lanes. Past the last sample, lanes stay in its pass, because their addresses must be valid too.
    let (length, listed) = (grid.len(), grid.lists_passes());
    let [[left, top], _] = chunk.tile.corners();
    let pairs_apart = !listed && chunk.tile.measures_noise();
    let area = L::Bits::splat(chunk.tile.area() as u32);
    if !grid.has_keys() {
        let first_pixel = L::Bits::splat(top.wrapping_mul(chunk.film_width).wrapping_add(left));
        for at in (0..length).step_by(L::N) {
            let pixel = first_pixel + L::Bits::load(&grid.pixel[at..]);
            chunk.numbers.key(pixel).store(&mut grid.key[at..]);
        }
        grid.repeat_keys();
    }
    let (left, top) = (L::splat(left as f32), L::splat(top as f32));
    let (mut at, mut turn) = (0, 0);
    let mut waiting = None;
    for done in (0..samples + T::PREFETCH_DISTANCE * L::N).step_by(L::N) {
        let mut seen = None;
        if done < samples {
            let active = L::Mask::first(samples - done);
            let mut index = L::Bits::load(&grid.index[at..]);
            let key = L::Bits::load(&grid.key[at..]);
            let x = left + L::load(&grid.x[at..]);
            let y = top + L::load(&grid.y[at..]);
            let passes = if listed {
                L::Bits::load(&grid.pass[at..])
            } else if at + L::N <= length {
                L::Bits::splat(chunk.pass_order[turn])
            } else {
                let last = chunk.pass_order.len() - 1;
                L::Bits::from_fn(|lane| chunk.pass_order[(turn + (at + lane) / length).min(last)])
            };
            if pairs_apart {
                // Chunks start with the first pass of a pair.
                index = index + (passes + L::Bits::splat(chunk.first.wrapping_neg())).shr(1) * area;
            }
            at += L::N;
            while at >= length {
                at -= length;
                turn += 1;
            }

            let (u, v) = chunk.numbers.pair(key, passes, pairs::PIXEL).unit::<L>();
            let (origin, direction) = if has(COMPILED_IN, Effect::Lens) {
                let (a, b) = chunk.numbers.pair(key, passes, chunk.numbers.last_pair()).unit::<L>();
                chunk.world.camera.through_lens((x + u, y + v), warp::disk(a, b))
            } else {
                (Vec3::zero(), chunk.world.camera.direction(x + u, y + v))
            };
            let ray = Ray {
                origin,
                direction,
                tfar: L::splat(f32::INFINITY),
                skip_id: L::Bits::splat(NO_SKIP_ID),
            };
            let hit = if has(COMPILED_IN, Effect::Lens) {
                T::nearest(chunk.world, set, active, &ray, Coherence::Coherent)
            } else {
                T::nearest_from_origin(chunk.world, set, active, &ray)
            };
            let address = Address {
                index,
                key,
                pass: passes,
            };
            seen = Some(Traced {
                active,
                ray,
                hit,
                address,
            });
        }
        if T::PREFETCH_DISTANCE > 0 {
            if has(COMPILED_IN, Effect::SmoothNormals)
                && let Some(seen) = &seen
            {
                fetch_normals(chunk.world, &seen.hit);
            }
            seen = std::mem::replace(&mut waiting, seen);
        }
        if let Some(seen) = seen {
            resolve::<L, T, COMPILED_IN>(chunk, hits, &seen);
        }
    }
    hits.pad();
    chunk.counters.eye_rays += samples as u64;
    chunk.counters.samples += samples as u64;
}

/// A packet of rays and its hits.
struct Traced<L: TraceLane> {
    active: L::Mask,
    ray: Ray<L>,
    hit: Hit<L>,
    address: Address<L>,
}

/// Prefetches the normals of the hit triangles.
#[inline(always)]
fn fetch_normals<L: TraceLane>(world: &World, hit: &Hit<L>) {
    let (mut geometries, mut primitives) = ([0; 16], [0; 16]);
    hit.geometry.store(&mut geometries);
    hit.primitive.store(&mut primitives);
    for lane in hit.found.lanes() {
        if let Some(Some(normals)) = world.normals.get(geometries[lane] as usize) {
            prefetch(&normals[primitives[lane] as usize]);
        }
    }
}

/// Pushes each hit into its stream. Adds emission and environment radiance to the film.
#[inline(always)]
fn resolve<L: TraceLane, T: Tracer, const COMPILED_IN: u32>(chunk: &mut Chunk, hits: &mut Streams, seen: &Traced<L>) {
    let Traced {
        active,
        ray,
        hit,
        address,
    } = seen;
    let misses = *active & !hit.found;
    if has(COMPILED_IN, Effect::Environment)
        && misses.any()
        && let Some(environment) = &chunk.world.environment
    {
        let radiance = environment.radiance(ray.direction, misses);
        for lane in misses.lanes() {
            let [red, green, blue] = radiance.lane(lane);
            chunk
                .sum
                .add(address.index.lane(lane) as usize, &[red, green, blue, 0.0]);
        }
    }
    if has(COMPILED_IN, Effect::Suns) && misses.any() {
        for sun in &chunk.world.suns {
            for lane in (misses & sun.contains(ray.direction)).lanes() {
                let [red, green, blue] = sun.le;
                chunk
                    .sum
                    .add(address.index.lane(lane) as usize, &[red, green, blue, 0.0]);
            }
        }
    }
    if hit.found.none() {
        return;
    }
    let surfaces = Surfaces::of(chunk.world, hit);
    let mut reflects = hit.found & !surfaces.emits;
    for lane in (hit.found & surfaces.emits).lanes() {
        let [red, green, blue] = surfaces.record(chunk.world, lane).le.unwrap_or_default();
        chunk
            .sum
            .add(address.index.lane(lane) as usize, &[red, green, blue, 0.0]);
    }
    if surfaces.call::<COMPILED_IN>(Effect::OneSided) {
        let back = hit.ng.dot(ray.direction).gt(L::zero());
        reflects = reflects & !(back & surfaces.those(chunk.world, |surface| surface.effects.has(Effect::OneSided)));
    }
    if reflects.none() {
        return;
    }
    let mut point = shading_point::<L, T, COMPILED_IN>(chunk.world, hit, ray, &surfaces);
    if surfaces.call::<COMPILED_IN>(Effect::Textures) {
        point.rho = point.rho.times(texels(chunk.world, hit, &surfaces));
    }
    if surfaces.call::<COMPILED_IN>(Effect::Ggx) || surfaces.call::<COMPILED_IN>(Effect::Conductor) {
        reflects = reflects & !facets::push(chunk.world, hits, &surfaces, &point, reflects, address);
    }
    let phong = if has(COMPILED_IN, Effect::Phong) {
        point.alpha.gt(L::one()) & reflects
    } else {
        L::Mask::splat(false)
    };
    let mut diffuse = reflects & !phong;
    let mut specular = point.rho;
    if surfaces.call::<COMPILED_IN>(Effect::Blend) {
        // A blend is two surfaces at one point: it goes into both streams, and each lobe is sampled by its model.
        let blends = surfaces.those(chunk.world, |surface| surface.specular.is_some()) & phong;
        diffuse = diffuse | blends;
        let record = |lane: usize| surfaces.record(chunk.world, lane).specular.unwrap_or_default();
        let of_blends = |k: usize| L::from_fn(|lane| record(lane)[k]);
        specular = Vec3::select(blends, Vec3::new(of_blends(0), of_blends(1), of_blends(2)), specular);
    }
    let SurfacePoint {
        n,
        wo,
        rho,
        alpha,
        reach,
        ..
    } = point;
    if diffuse.any() {
        model::Diffuse::filled(hits).push::<L>(diffuse, &point.with(Diffuse { n, rho }), address);
    }
    if phong.any() {
        let lobe = Phong::new(n, wo, specular, alpha, reach);
        model::Phong::filled(hits).push::<L>(phong, &point.with(lobe), address);
    }
}
