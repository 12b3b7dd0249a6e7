//! Eye rays: through the film, to the first hit, into the hit streams.

use super::{Chunk, Scratch, pairs};
use crate::bsdf::Bsdf;
use crate::embree::{Coherence, Hit, NO_SPHERE, Ray, TraceLane};
use crate::estimator::ShadingPoint;
use crate::film::Tile;
use crate::lane::{Bits, Lane, Mask};
use crate::math::Vec3;
use crate::pipeline::stream::Address;
use crate::pipeline::world::{SurfaceRecord, World};
use crate::scene::FilmSize;

/// Traces `passes` samples of every pixel of a tile, from pass `first` of the block on. Emitters that are seen go onto
/// the film, surfaces into the streams.
pub fn trace<L: TraceLane>(
    chunk: &mut Chunk,
    scratch: &mut Scratch,
    tile: &Tile,
    film: FilmSize,
    first: u32,
    passes: u32,
) {
    scratch.hits.iter_mut().for_each(|h| h.clear());
    let pixels = tile.pixels.len();
    let samples = pixels * passes as usize;
    let mut at = 0;
    while at < samples {
        // Pass by pass, pixels in tile order. A tile whose size is no multiple of the packet's lets packets straddle
        // two passes, so that only the last packet of a chunk has idle lanes.
        let active = L::Mask::first(samples - at);
        let sample = |lane: usize| (at + lane).min(samples - 1);
        let index = L::Bits::from_fn(|lane| (sample(lane) % pixels) as u32);
        let pass = L::Bits::from_fn(|lane| first + (sample(lane) / pixels) as u32);
        let column = L::from_fn(|lane| tile.pixels[sample(lane) % pixels][0] as f32);
        let row = L::from_fn(|lane| tile.pixels[sample(lane) % pixels][1] as f32);
        let pixel = L::Bits::from_fn(|lane| {
            let [x, y] = tile.pixels[sample(lane) % pixels];
            y.wrapping_mul(film.width).wrapping_add(x)
        });
        at += L::N;

        let (u, v) = chunk.numbers.pair(pixel, pass, pairs::PIXEL).unit::<L>();
        let direction = chunk.world.camera.direction(column + u, row + v);
        let ray = Ray {
            origin: Vec3::zero(),
            direction,
            tfar: L::splat(f32::INFINITY),
            aims_at: L::Bits::splat(NO_SPHERE),
        };
        let hit = chunk.world.accel.intersect(active, &ray, Coherence::Coherent);
        chunk.counters.eye_rays += active.count() as u64;
        if hit.found.none() {
            continue;
        }
        settle(chunk, scratch, &hit, direction, &Address { index, pixel, pass });
    }
    chunk.counters.samples += samples as u64;
}

/// Puts each hit where it belongs.
#[inline(always)]
fn settle<L: TraceLane>(
    chunk: &mut Chunk,
    scratch: &mut Scratch,
    hit: &Hit<L>,
    direction: Vec3<L>,
    address: &Address<L>,
) {
    let surfaces = Surfaces::of(chunk.world, hit);
    let reflects = hit.found & !surfaces.emits;
    for lane in (hit.found & surfaces.emits).lanes() {
        let surface = surfaces.record(chunk.world, lane);
        chunk
            .sum
            .add(address.index.lane(lane) as usize, surface.le.unwrap_or_default());
    }
    if reflects.none() {
        return;
    }
    let point = shading_point(chunk.world, hit, direction, &surfaces);
    let phong = point.bsdf.phong & reflects;
    scratch.hits[0].push(reflects & !phong, &point, address);
    scratch.hits[1].push(phong, &point, address);
}

/// The surface of each lane, and what a packet needs of it.
struct Surfaces<L: Lane> {
    index: L::Bits,
    /// Lanes that met a sphere.
    spheres: L::Mask,
    emits: L::Mask,
    rho: Vec3<L>,
    alpha: L,
    offset: L,
}

impl<L: Lane> Surfaces<L> {
    #[inline(always)]
    fn of(world: &World, hit: &Hit<L>) -> Self {
        let spheres = hit.geometry.eq(L::Bits::splat(world.sphere_geometry)) & hit.found;
        let index = L::Bits::select(spheres, hit.geometry + hit.primitive, hit.geometry);
        let first = index.lane(hit.found.lanes().next().unwrap_or(0));
        if (hit.found & !index.eq(L::Bits::splat(first))).none() {
            // Most packets meet one surface.
            let one = &world.surfaces[first as usize];
            let index = L::Bits::splat(first);
            let emits = L::Mask::splat(one.le.is_some());
            let (alpha, offset) = (L::splat(one.alpha), L::splat(one.offset));
            return Self {
                index,
                spheres,
                emits,
                rho: Vec3::splat(one.rho),
                alpha,
                offset,
            };
        }
        let index = L::Bits::select(hit.found, index, L::Bits::splat(first));
        let record = |lane: usize| &world.surfaces[index.lane(lane) as usize];
        let emits = (0..L::N)
            .filter(|&lane| record(lane).le.is_some())
            .fold(0, |bits, lane| bits | 1 << lane);
        Self {
            index,
            spheres,
            emits: L::Mask::from_bitmask(emits),
            rho: Vec3::new(
                L::from_fn(|lane| record(lane).rho[0]),
                L::from_fn(|lane| record(lane).rho[1]),
                L::from_fn(|lane| record(lane).rho[2]),
            ),
            alpha: L::from_fn(|lane| record(lane).alpha),
            offset: L::from_fn(|lane| record(lane).offset),
        }
    }

    fn record<'w>(&self, world: &'w World, lane: usize) -> &'w SurfaceRecord {
        &world.surfaces[self.index.lane(lane) as usize]
    }
}

/// Point, normals and model of each lane that met a surface.
#[inline(always)]
fn shading_point<L: Lane>(world: &World, hit: &Hit<L>, direction: Vec3<L>, surfaces: &Surfaces<L>) -> ShadingPoint<L> {
    let wo = -direction;
    let mut p = direction * hit.t;
    let mut ng = hit.ng.normalize();
    if surfaces.spheres.any() {
        // Back onto the sphere: the error of a distance grows as distance over radius.
        let ball = |lane: usize| &world.balls[(surfaces.index.lane(lane) - world.sphere_geometry) as usize];
        let number = |f: &dyn Fn(usize) -> f32| {
            L::from_fn(|lane| {
                if surfaces.spheres.to_bitmask() >> lane & 1 == 1 {
                    f(lane)
                } else {
                    0.0
                }
            })
        };
        let center = Vec3::new(
            number(&|lane| ball(lane).center[0]),
            number(&|lane| ball(lane).center[1]),
            number(&|lane| ball(lane).center[2]),
        );
        let outward = (p - center).normalize();
        ng = Vec3::select(surfaces.spheres, outward, ng);
        p = Vec3::select(
            surfaces.spheres,
            outward.mul_add(number(&|lane| ball(lane).radius), center),
            p,
        );
    }
    ng = face(ng, wo);
    let n = smooth_normal(world, hit, surfaces, ng);
    let p = ng.mul_add(surfaces.offset, p);
    ShadingPoint {
        p,
        ng,
        bsdf: Bsdf::new(n, wo, surfaces.rho, surfaces.alpha),
    }
}

/// `v` or its opposite, whichever is on the side of `towards`.
#[inline(always)]
fn face<L: Lane>(v: Vec3<L>, towards: Vec3<L>) -> Vec3<L> {
    Vec3::select(v.dot(towards).lt(L::zero()), -v, v)
}

/// The interpolated normal where the mesh has one, on the side of `ng`; else `ng`.
#[inline(always)]
fn smooth_normal<L: Lane>(world: &World, hit: &Hit<L>, surfaces: &Surfaces<L>, ng: Vec3<L>) -> Vec3<L> {
    let mut normals = [[0.0_f32; 3]; 16];
    let mut smooth = 0_u32;
    for lane in (hit.found & !surfaces.spheres).lanes() {
        let Some(mesh) = &world.normals[surfaces.index.lane(lane) as usize] else {
            continue;
        };
        let (u, v) = (hit.u.lane(lane), hit.v.lane(lane));
        let [a, b, c] = mesh.triangles[hit.primitive.lane(lane) as usize].map(|i| mesh.normals[i as usize]);
        let w = 1.0 - u - v;
        normals[lane] = std::array::from_fn(|k| w * a[k] + u * b[k] + v * c[k]);
        smooth |= 1 << lane;
    }
    if smooth == 0 {
        return ng;
    }
    let sum = Vec3::new(
        L::from_fn(|i| normals[i][0]),
        L::from_fn(|i| normals[i][1]),
        L::from_fn(|i| normals[i][2]),
    );
    // Opposite normals can cancel; then the triangle's own has to do.
    let usable = L::Mask::from_bitmask(smooth) & sum.length_squared().gt(L::splat(1e-12));
    Vec3::select(usable, face(sum.normalize(), ng), ng)
}
