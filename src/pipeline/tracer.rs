//! The intersectors: Embree's BVH, or brute force over all shapes. Kernels are compiled for each.

use super::columns::CAPACITY;
use super::stream::HitStream;
use super::ties;
use super::world::World;
use crate::embree::{Coherence, TraceLane};
use crate::film::Tile;
use crate::lane::{Lane, Mask};
use crate::linear::Candidates;
use crate::linear::cull::{Bounds, Points};
use crate::math::Vec3;
use crate::shape::{BoundingSphere, Hit, NO_SKIP_ID, Ray};

/// Traces the rays of a chunk.
pub trait Tracer {
    /// Whether normals of triangle hits have unit length: brute force has them precomputed.
    const UNIT_NORMALS: bool;
    /// Number of packets of camera rays whose hits wait while the next packet is traced; their data is prefetched meanwhile.
    const PREFETCH_DISTANCE: usize;
    /// Points per block; a block is shaded for all lights before the next one.
    const BLOCK: usize;
    /// Culls shapes for the camera rays of a tile.
    fn cull_for_tile<L: Lane>(world: &World, tile: &Tile, set: &mut Candidates);
    /// Computes bounds of the points of a stream, which must not be empty.
    #[inline(always)]
    fn bound_points<L: Lane>(world: &World, stream: &HitStream, points: &mut Points) {
        if world.culls {
            bound_points::<L>(world, stream, points);
        }
    }
    /// Culls occluders for rays from the points of a bounded stream into a sphere; the shape `skip_id` never occludes them. `wide` is
    /// what [`Self::face_box`] left for a box around the sphere. Returns true if nothing can block the rays, so that none needs tracing.
    #[inline(always)]
    fn face_ball<L: Lane>(
        world: &World,
        stream: &HitStream,
        points: &mut Points,
        (ball, skip_id): (&BoundingSphere, u32),
        wide: Option<&Candidates>,
        set: &mut Candidates,
    ) -> bool {
        // With few shapes the brute-force list exists whichever intersector traces.
        if !world.culls {
            Self::keep_all(world, set);
            return false;
        }
        match wide {
            Some(wide) => {
                let bounds = Bounds::of_ball(ball);
                world
                    .line
                    .in_shaft_of::<L::Plain>(points, &bounds, (ball, skip_id), wide, set);
            }
            None => world.line.in_shaft::<L::Plain>(points, ball, skip_id, set),
        }
        separate::<L>(world, stream, points, ball, set);
        set.is_empty()
    }
    /// Culls occluders for rays from the points of a bounded stream into a box, among those that were kept for a larger box if there
    /// was one.
    #[inline(always)]
    fn face_box<L: Lane>(
        world: &World,
        stream: &HitStream,
        points: &mut Points,
        bounds: &Bounds,
        wide: Option<&Candidates>,
        set: &mut Candidates,
    ) {
        let ball = BoundingSphere::around(&[bounds.low, bounds.high]);
        let target = (&ball, NO_SKIP_ID);
        match wide {
            Some(wide) => world.line.in_shaft_of::<L::Plain>(points, bounds, target, wide, set),
            None => world.line.in_shaft_to::<L::Plain>(points, bounds, target, set),
        }
        separate::<L>(world, stream, points, &ball, set);
    }
    /// Keeps all shapes, for arbitrary rays.
    fn keep_all(world: &World, set: &mut Candidates);
    /// Closest hits of active rays.
    fn nearest<L: TraceLane>(
        world: &World,
        set: &Candidates,
        active: L::Mask,
        ray: &Ray<L>,
        coherence: Coherence,
    ) -> Hit<L>;
    /// Like [`Self::nearest`], for coherent rays from the origin.
    fn nearest_from_origin<L: TraceLane>(world: &World, set: &Candidates, active: L::Mask, ray: &Ray<L>) -> Hit<L>;
    /// Which active rays hit anything but the shape with their skip id.
    fn occluded<L: TraceLane>(
        world: &World,
        set: &Candidates,
        active: L::Mask,
        ray: &Ray<L>,
        coherence: Coherence,
    ) -> L::Mask;
}

/// Traces with Embree.
pub struct ByEmbree;

/// Tests one shape after the other.
pub struct BruteForce;

impl Tracer for ByEmbree {
    const UNIT_NORMALS: bool = false;
    const PREFETCH_DISTANCE: usize = 1;
    // The rays of a whole stream to one light fill the most packets.
    const BLOCK: usize = CAPACITY;

    #[inline(always)]
    fn cull_for_tile<L: Lane>(_: &World, _: &Tile, _: &mut Candidates) {}
    /// Marks the set as not culled.
    #[inline(always)]
    fn keep_all(_: &World, set: &mut Candidates) {
        set.clear();
    }

    #[inline(always)]
    fn nearest<L: TraceLane>(
        world: &World,
        _: &Candidates,
        active: L::Mask,
        ray: &Ray<L>,
        coherence: Coherence,
    ) -> Hit<L> {
        let hit = world.accel.intersect(active, ray, coherence);
        let mut hit = mutate!(hit, BarycentricsLost => Hit { u: L::zero(), v: L::zero(), ..hit });
        let covered = world.covered(&hit);
        let edge = ties::next_to_edge(&hit);
        ties::resolve(
            &mut hit,
            ray,
            world.sphere_geometry,
            edge,
            covered,
            |place, radius, visit| {
                world.accel.nearby(place, radius, visit);
            },
        );
        hit
    }

    #[inline(always)]
    fn nearest_from_origin<L: TraceLane>(world: &World, set: &Candidates, active: L::Mask, ray: &Ray<L>) -> Hit<L> {
        Self::nearest(world, set, active, ray, Coherence::Coherent)
    }

    #[inline(always)]
    fn occluded<L: TraceLane>(
        world: &World,
        set: &Candidates,
        active: L::Mask,
        ray: &Ray<L>,
        coherence: Coherence,
    ) -> L::Mask {
        if world.by_shaft && set.is_culled() {
            return world.line.occluded(set, active, ray);
        }
        world.accel.occluded(active, ray, coherence)
    }
}

impl Tracer for BruteForce {
    const UNIT_NORMALS: bool = true;
    const PREFETCH_DISTANCE: usize = 0;
    // 256 points and their rays take 38 kB, which fits the L1 cache.
    const BLOCK: usize = 256;

    fn cull_for_tile<L: Lane>(world: &World, tile: &Tile, set: &mut Candidates) {
        if !world.culls {
            return world.line.all(set);
        }
        let [first, last] = tile.corners();
        // The far side of a pixel, and a margin for rounding.
        let [left, top] = first.map(|low| low as f32 - 0.01);
        let [right, bottom] = last.map(|high| high as f32 + 1.01);
        let corners = [(left, top), (right, top), (right, bottom), (left, bottom)];
        let corners = corners.map(|(x, y)| world.camera.direction::<f32>(x, y).lane(0));
        world.line.in_frustum::<L::Plain>(corners, set);
    }

    fn keep_all(world: &World, set: &mut Candidates) {
        world.line.all(set);
    }

    #[inline(always)]
    fn nearest<L: TraceLane>(world: &World, set: &Candidates, active: L::Mask, ray: &Ray<L>, _: Coherence) -> Hit<L> {
        let (mut hit, edge) = world.line.intersect(set, active, ray);
        let covered = world.covered(&hit);
        ties::resolve(&mut hit, ray, world.sphere_geometry, edge, covered, |_, _, visit| {
            world.line.visit(set, visit)
        });
        hit
    }

    #[inline(always)]
    fn nearest_from_origin<L: TraceLane>(world: &World, set: &Candidates, active: L::Mask, ray: &Ray<L>) -> Hit<L> {
        let (mut hit, edge) = world.line.intersect_from_origin(set, active, ray);
        let covered = world.covered(&hit);
        ties::resolve(&mut hit, ray, world.sphere_geometry, edge, covered, |_, _, visit| {
            world.line.visit(set, visit)
        });
        hit
    }

    #[inline(always)]
    fn occluded<L: TraceLane>(world: &World, set: &Candidates, active: L::Mask, ray: &Ray<L>, _: Coherence) -> L::Mask {
        world.line.occluded(set, active, ray)
    }
}

/// Minimum over all lanes, per component.
#[inline(always)]
fn least<L: Lane>(v: Vec3<L>) -> [f32; 3] {
    let mut least = [f32::INFINITY; 3];
    for lane in L::Mask::splat(true).lanes() {
        let v = v.lane(lane);
        least = [least[0].min(v[0]), least[1].min(v[1]), least[2].min(v[2])];
    }
    least
}

/// Computes the bounding box of the points of a stream.
#[inline(always)]
fn bound_points<L: Lane>(world: &World, stream: &HitStream, points: &mut Points) {
    let far: Vec3<L> = Vec3::splat([f32::INFINITY; 3]);
    let (mut low, mut high) = (far, -far);
    for at in (0..stream.len()).step_by(L::N) {
        let p = stream.position::<L>(at);
        low = Vec3::new(low.x.min(p.x), low.y.min(p.y), low.z.min(p.z));
        high = Vec3::new(high.x.max(p.x), high.y.max(p.y), high.z.max(p.z));
    }
    let bounds = Bounds {
        low: least(low),
        high: least(-high).map(|x| -x),
    };
    world.line.look::<L::Plain>(bounds, points);
}

/// Removes the triangles that have all points of a stream and a sphere on one side.
#[inline(always)]
fn separate<L: Lane>(
    world: &World,
    stream: &HitStream,
    points: &mut Points,
    ball: &BoundingSphere,
    set: &mut Candidates,
) {
    for &triangle in set.triangles() {
        if !points.measured(triangle) {
            let (normal, offset) = world.line.plane(triangle);
            points.measure(triangle, sides::<L>(stream, normal, offset));
        }
    }
    world.line.separated_by_plane(points, ball, set);
}

/// Minimum and maximum of `dot(normal, p) - offset` over the points of a stream.
#[inline(always)]
fn sides<L: Lane>(stream: &HitStream, normal: [f32; 3], offset: f32) -> [f32; 2] {
    let (normal, offset) = (Vec3::splat(normal), L::splat(offset));
    let (mut low, mut high) = (L::splat(f32::INFINITY), L::splat(f32::NEG_INFINITY));
    for at in (0..stream.len()).step_by(L::N) {
        let side = stream.position::<L>(at).dot(normal) - offset;
        low = low.min(side);
        high = high.max(side);
    }
    let [low, high, _] = least(Vec3::new(low, -high, low));
    [low, -high]
}
