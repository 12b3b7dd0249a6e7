//! Surfaces and shading points at the hits of camera rays.

use crate::embree::{Hit, Ray, TraceLane};
use crate::estimator::ShadingPoint;
use crate::lane::{Bits, Lane, Mask};
use crate::math::Vec3;
use crate::pipeline::texture::Fetched;
use crate::pipeline::tracer::Tracer;
use crate::pipeline::world::{SurfaceRecord, World};
use crate::scene::{Effect, Effects};

/// Whether a stage with these effects compiled in has this one.
pub const fn has(held: u32, effect: Effect) -> bool {
    Effects::from_bits(held).has(effect)
}

/// The surface of each lane, and the packet's summary.
pub struct Surfaces<L: Lane> {
    index: L::Bits,
    /// Lanes that hit a sphere.
    spheres: L::Mask,
    /// Lanes that hit an emitter.
    pub emits: L::Mask,
    /// Union of the effects of all surfaces in the packet.
    effects: Effects,
    rho: Vec3<L>,
    alpha: L,
    reach: L,
    extent: Vec3<L>,
}

impl<L: Lane> Surfaces<L> {
    /// Looks up the surfaces of hits.
    #[inline(always)]
    pub fn of(world: &World, hit: &Hit<L>) -> Self {
        let spheres = hit.geometry.eq(L::Bits::splat(world.sphere_geometry)) & hit.found;
        let index = L::Bits::select(spheres, hit.geometry + hit.primitive, hit.geometry);
        let first = index.lane(hit.found.lanes().next().unwrap_or(0));
        if (hit.found & !index.eq(L::Bits::splat(first))).none() {
            // Most packets hit a single surface.
            let one = &world.surfaces[first as usize];
            let index = L::Bits::splat(first);
            let emits = L::Mask::splat(one.le.is_some());
            return Self {
                index,
                spheres,
                emits,
                effects: one.effects,
                rho: Vec3::splat(one.rho),
                alpha: L::splat(one.alpha),
                reach: L::splat(one.reach),
                extent: Vec3::splat(one.extent),
            };
        }
        // A plain loop without closures: closures would become calls, compiled without the lanes' instruction set.
        let (mut indices, mut columns) = ([0; 16], [[0.0; 16]; 8]);
        let (mut emits, mut effects) = (0, Effects::default());
        L::Bits::select(hit.found, index, L::Bits::splat(first)).store(&mut indices);
        for lane in 0..L::N {
            let one = &world.surfaces[indices[lane] as usize];
            emits |= u32::from(one.le.is_some()) << lane;
            effects = effects.union(one.effects);
            for k in 0..3 {
                columns[k][lane] = one.rho[k];
                columns[3 + k][lane] = one.extent[k];
            }
            columns[6][lane] = one.alpha;
            columns[7][lane] = one.reach;
        }
        let [red, green, blue, x, y, z, alpha, reach] = columns;
        Self {
            index: L::Bits::load(&indices),
            spheres,
            emits: L::Mask::from_bitmask(emits),
            effects,
            rho: Vec3::new(L::load(&red), L::load(&green), L::load(&blue)),
            alpha: L::load(&alpha),
            reach: L::load(&reach),
            extent: Vec3::new(L::load(&x), L::load(&y), L::load(&z)),
        }
    }

    /// Whether any surface of the packet requires an effect that is compiled in. A compiled-in effect that is not used then costs
    /// one test per packet.
    #[inline(always)]
    pub fn call<const COMPILED_IN: u32>(&self, effect: Effect) -> bool {
        has(COMPILED_IN, effect) && self.effects.has(effect)
    }

    /// Lanes whose surface satisfies the predicate.
    #[inline(always)]
    pub fn those(&self, world: &World, which: impl Fn(&SurfaceRecord) -> bool) -> L::Mask {
        let bits = (0..L::N).filter(|&lane| which(self.record(world, lane)));
        L::Mask::from_bitmask(bits.fold(0, |bits, lane| bits | 1 << lane))
    }

    /// The surface record of a lane.
    pub fn record<'w>(&self, world: &'w World, lane: usize) -> &'w SurfaceRecord {
        &world.surfaces[self.index.lane(lane) as usize]
    }
}

/// The inputs of a BRDF model, in each lane that hit a surface.
#[derive(Clone, Copy, Debug)]
pub struct SurfacePoint<L: Lane> {
    /// The hit point, offset from its surface.
    pub p: Vec3<L>,
    /// Unit geometric normal on the side of `wo`.
    pub ng: Vec3<L>,
    /// Unit shading normal on the side of `ng`.
    pub n: Vec3<L>,
    /// Unit direction to the ray's origin.
    pub wo: Vec3<L>,
    /// Reflectance.
    pub rho: Vec3<L>,
    /// Phong's exponent; 1 for other models.
    pub alpha: L,
    /// Reach of the Phong lobe with this exponent.
    pub reach: L,
}

impl<L: Lane> SurfacePoint<L> {
    /// The point with a BRDF.
    #[inline(always)]
    pub fn with<B>(&self, bsdf: B) -> ShadingPoint<L, B> {
        ShadingPoint {
            p: self.p,
            ng: self.ng,
            bsdf,
        }
    }
}

/// Computes point, normals and parameters of each lane that hit a surface.
#[inline(always)]
pub fn shading_point<L: TraceLane, T: Tracer, const COMPILED_IN: u32>(
    world: &World,
    hit: &Hit<L>,
    ray: &Ray<L>,
    surfaces: &Surfaces<L>,
) -> SurfacePoint<L> {
    let wo = -ray.direction;
    let mut p = ray.direction * hit.t;
    if has(COMPILED_IN, Effect::Lens) {
        p = p + ray.origin;
    }
    // The normal of a triangle is twice its area long; for small triangles its square would be denormal.
    let mut ng = if T::UNIT_NORMALS { hit.ng } else { hit.ng.unit() };
    if surfaces.spheres.any() {
        // A sphere smaller than the spacing of floats can be hit at its exact center.
        let outward = Vec3::select(hit.ng.max_abs().gt(L::zero()), hit.ng.unit(), wo);
        ng = Vec3::select(surfaces.spheres, outward, ng);
        // Projected back onto the sphere, because the error of the distance grows as distance over radius.
        let ball = |lane: usize| &surfaces.record(world, lane).ball;
        let center = Vec3::new(
            L::from_fn(|lane| ball(lane).center[0]),
            L::from_fn(|lane| ball(lane).center[1]),
            L::from_fn(|lane| ball(lane).center[2]),
        );
        let radius = L::from_fn(|lane| ball(lane).radius);
        let put_back = surfaces.spheres & radius.gt(L::zero());
        p = Vec3::select(put_back, ng.mul_add(radius, center), p);
    }
    ng = face(ng, wo);
    let n = if surfaces.call::<COMPILED_IN>(Effect::SmoothNormals) {
        smooth_normal(world, hit, surfaces, ng)
    } else {
        ng
    };
    let mut point = SurfacePoint {
        p: leave(p, ng, surfaces.extent),
        ng,
        n,
        wo,
        rho: surfaces.rho,
        alpha: surfaces.alpha,
        reach: surfaces.reach,
    };
    if surfaces.call::<COMPILED_IN>(Effect::SmoothTerminator) {
        let (lifted, by) = lift(world, hit, surfaces, p, n);
        point.p = Vec3::select(lifted, point.p + by, point.p);
        point.ng = Vec3::select(lifted, n, ng);
    }
    point
}

/// Offset of a shading point from its surface, in the unit defined at [`leave`].
///
/// Rounding error in half-ulps `u` of `size` (see below): the distance `n·a / n·d` loses 3 u in each product and 1 u in the
/// quotient, `t d` another, and the shadow ray's `n·(a - p)` 4 u more; Embree recomputes `n` for it. The worst case of all together
/// is about 20 u. Measured on 12 scales x 12 offsets of a plane, a sphere, a mesh and a floor a thousand times as large as its
/// distance (`selftest --case 24`), with Embree 4.4.0 and brute force: acne up to 3 u, none from 4 u on.
const OFFSET: f32 = 8.0 * f32::EPSILON / 2.0;

/// The point `p` of a surface, offset along its normal by as much as rounding can have moved it to the other side.
///
/// Rounding acts on coordinates, of the point and of the corners of its triangle, and counts by its component along the normal:
/// `size = |n|·(|p| + extent)`. For a floor this is its depth below the camera, however large the floor is.
#[inline(always)]
fn leave<L: Lane>(p: Vec3<L>, ng: Vec3<L>, extent: Vec3<L>) -> Vec3<L> {
    let size =
        ng.x.abs() * (p.x.abs() + extent.x) + ng.y.abs() * (p.y.abs() + extent.y) + ng.z.abs() * (p.z.abs() + extent.z);
    ng.mul_add(
        size * L::splat(mutate!(mutate!(OFFSET, OffsetDropped => 0.0), OffsetTooShort => OFFSET / 4.0)),
        p,
    )
}

/// The texture value of each lane; 1 without a texture.
#[inline(always)]
pub fn texels<L: Lane>(world: &World, hit: &Hit<L>, surfaces: &Surfaces<L>) -> Vec3<L> {
    let mut fetched = Fetched::default();
    for lane in (hit.found & !surfaces.spheres).lanes() {
        if let Some(textured) = &world.textured[surfaces.index.lane(lane) as usize] {
            let weights = (hit.u.lane(lane), hit.v.lane(lane));
            fetched.fetch(lane, textured, hit.primitive.lane(lane), weights);
        }
    }
    if !world.sphere_textures.is_empty() {
        for lane in (hit.found & surfaces.spheres).lanes() {
            if let Some(texture) = &world.sphere_textures[hit.primitive.lane(lane) as usize] {
                fetched.fetch_on_sphere(lane, texture, hit.ng.lane(lane));
            }
        }
    }
    fetched.mean()
}

/// `v` or its opposite, whichever is on the side of `towards`.
#[inline(always)]
fn face<L: Lane>(v: Vec3<L>, towards: Vec3<L>) -> Vec3<L> {
    v.negated(v.dot(towards).lt(L::zero()))
}

/// The interpolated normal on the side of `ng`, if the mesh has smooth normals; else `ng`.
#[inline(always)]
fn smooth_normal<L: Lane>(world: &World, hit: &Hit<L>, surfaces: &Surfaces<L>, ng: Vec3<L>) -> Vec3<L> {
    // Loads come first and interpolation after, so that the memory latencies of all lanes overlap.
    let mut corners = [[0.0_f32; 16]; 9];
    let mut smooth = 0_u32;
    let (mut indices, mut primitives) = ([0; 16], [0; 16]);
    surfaces.index.store(&mut indices);
    hit.primitive.store(&mut primitives);
    for lane in (hit.found & !surfaces.spheres).lanes() {
        if let Some(normals) = &world.normals[indices[lane] as usize] {
            let triangle = normals[primitives[lane] as usize].as_flattened();
            for k in 0..9 {
                corners[k][lane] = triangle[k];
            }
            smooth |= 1 << lane;
        }
    }
    if smooth == 0 {
        return ng;
    }
    let (u, v) = mutate!((hit.u, hit.v), CornersSwapped => (hit.v, hit.u));
    let w = L::one() - u - v;
    let mean = |k: usize| w * L::load(&corners[k]) + u * L::load(&corners[3 + k]) + v * L::load(&corners[6 + k]);
    let sum = Vec3::new(mean(0), mean(1), mean(2));
    // Opposite normals can cancel; then the geometric normal is used.
    let usable = L::Mask::from_bitmask(smooth) & sum.length_squared().gt(L::splat(1e-12));
    let normal = sum.normalize();
    Vec3::select(usable, mutate!(face(normal, ng), NormalNotFaced => normal), ng)
}

/// Lanes whose mesh has a smooth terminator, and the displacement of the shading point there: see
/// [`Mesh::smooth_terminator`](crate::scene::Mesh::smooth_terminator).
#[inline(always)]
fn lift<L: Lane>(world: &World, hit: &Hit<L>, surfaces: &Surfaces<L>, p: Vec3<L>, n: Vec3<L>) -> (L::Mask, Vec3<L>) {
    let (mut normals, mut corners) = ([[0.0_f32; 16]; 9], [[0.0_f32; 16]; 9]);
    let mut smooth = 0_u32;
    for lane in (hit.found & !surfaces.spheres).lanes() {
        let (mesh, triangle) = (surfaces.index.lane(lane) as usize, hit.primitive.lane(lane) as usize);
        if let (Some(of_normals), Some(of_corners)) = (&world.normals[mesh], &world.corners[mesh]) {
            for k in 0..9 {
                normals[k][lane] = of_normals[triangle].as_flattened()[k];
                corners[k][lane] = of_corners[triangle].as_flattened()[k];
            }
            smooth |= 1 << lane;
        }
    }
    let column = |columns: &[[f32; 16]; 9], i: usize| {
        let load = |k: usize| L::load(&columns[3 * i + k]);
        Vec3::new(load(0), load(1), load(2))
    };
    let weights = [L::one() - hit.u - hit.v, hit.u, hit.v];
    let (mut sum, mut by) = (Vec3::zero(), Vec3::zero());
    for (i, weight) in weights.into_iter().enumerate() {
        sum = sum + column(&normals, i) * weight;
    }
    // If the interpolated normal was flipped towards the camera, the vertex normals are flipped too.
    let turned = sum.dot(n).lt(L::zero());
    for (i, weight) in weights.into_iter().enumerate() {
        let normal = column(&normals, i).negated(turned);
        let below = normal.dot(column(&corners, i) - p).max(L::zero());
        by = by + normal * (below * weight);
    }
    // As in `smooth_normal`: if the normals cancel, the triangle counts as flat.
    let usable = L::Mask::from_bitmask(smooth) & sum.length_squared().gt(L::splat(1e-12));
    (usable, by)
}
