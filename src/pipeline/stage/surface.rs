//! What an eye ray meets: the surface of each lane, and the shading point there.

use crate::embree::{Hit, Ray, TraceLane};
use crate::estimator::ShadingPoint;
use crate::lane::{Bits, Lane, Mask};
use crate::math::Vec3;
use crate::pipeline::texture::Fetched;
use crate::pipeline::tracer::Tracer;
use crate::pipeline::world::{SurfaceRecord, World};
use crate::scene::{Effect, Effects};

/// Whether a stage that holds these effects holds this one.
pub const fn has(held: u32, effect: Effect) -> bool {
    Effects::from_bits(held).has(effect)
}

/// The surface of each lane, and what a packet needs of it.
pub struct Surfaces<L: Lane> {
    index: L::Bits,
    /// Lanes that met a sphere.
    spheres: L::Mask,
    /// Lanes that met an emitter.
    pub emits: L::Mask,
    /// What any of them calls for.
    effects: Effects,
    rho: Vec3<L>,
    alpha: L,
    reach: L,
    extent: Vec3<L>,
}

impl<L: Lane> Surfaces<L> {
    /// Looks up what was met.
    #[inline(always)]
    pub fn of(world: &World, hit: &Hit<L>) -> Self {
        let spheres = hit.geometry.eq(L::Bits::splat(world.sphere_geometry)) & hit.found;
        let index = L::Bits::select(spheres, hit.geometry + hit.primitive, hit.geometry);
        let first = index.lane(hit.found.lanes().next().unwrap_or(0));
        if (hit.found & !index.eq(L::Bits::splat(first))).none() {
            // Most packets meet one surface.
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
        // One loop, and no closures: these would be calls, compiled without the lanes' instructions.
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

    /// Whether any surface of the packet calls for an effect, of those that the stage holds. An effect that is held for other
    /// scenes then costs a look at one number a packet.
    #[inline(always)]
    pub fn call<const COMPILED_IN: u32>(&self, effect: Effect) -> bool {
        has(COMPILED_IN, effect) && self.effects.has(effect)
    }

    /// Lanes whose surface is one of those.
    #[inline(always)]
    pub fn those(&self, world: &World, which: impl Fn(&SurfaceRecord) -> bool) -> L::Mask {
        let bits = (0..L::N).filter(|&lane| which(self.record(world, lane)));
        L::Mask::from_bitmask(bits.fold(0, |bits, lane| bits | 1 << lane))
    }

    /// The surface of a lane.
    pub fn record<'w>(&self, world: &'w World, lane: usize) -> &'w SurfaceRecord {
        &world.surfaces[self.index.lane(lane) as usize]
    }
}

/// What a model of reflection is made from, in each lane that met a surface.
#[derive(Clone, Copy, Debug)]
pub struct SurfacePoint<L: Lane> {
    /// The point, moved off its surface.
    pub p: Vec3<L>,
    /// Geometric normal on the side of `wo`; unit.
    pub ng: Vec3<L>,
    /// Shading normal on the side of `ng`; unit.
    pub n: Vec3<L>,
    /// To where the ray came from; unit.
    pub wo: Vec3<L>,
    /// Reflectance.
    pub rho: Vec3<L>,
    /// Phong's exponent; 1 for other models.
    pub alpha: L,
    /// How far the lobe of this exponent reaches.
    pub reach: L,
}

impl<L: Lane> SurfacePoint<L> {
    /// The point with a model.
    #[inline(always)]
    pub fn with<B>(&self, bsdf: B) -> ShadingPoint<L, B> {
        ShadingPoint {
            p: self.p,
            ng: self.ng,
            bsdf,
        }
    }
}

/// Point, normals and parameters of each lane that met a surface.
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
    // The normal of a triangle is as long as its area: of small ones the square of that would be denormal.
    let mut ng = if T::UNIT_NORMALS { hit.ng } else { hit.ng.unit() };
    if surfaces.spheres.any() {
        // A sphere smaller than the spacing of numbers can be met at its very centre.
        let outward = Vec3::select(hit.ng.max_abs().gt(L::zero()), hit.ng.unit(), wo);
        ng = Vec3::select(surfaces.spheres, outward, ng);
        // Back onto the sphere: the error of a distance grows as distance over radius.
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

/// How far a shading point leaves its surface, in the unit that [`leave`] says.
///
/// What rounding can do, in half-ulps `u` of `size` below: the distance `n·a / n·d` loses 3 u in each product and 1 u in the
/// quotient, `t d` another, and the shadow ray's `n·(a - p)` 4 u more; Embree forms `n` anew for it. All at their worst
/// together that is about 20 u. Counted on 12 scales x 12 offsets of a plane, a sphere, a mesh and a floor a thousand times
/// as far as it is seen from (`selftest --case 24`), by Embree 4.4.0 and in a line: acne up to 3 u, none from 4 u on.
const OFFSET: f32 = 8.0 * f32::EPSILON / 2.0;

/// The point `p` of a surface, moved to the side of its normal as far as rounding can have put it on the other.
///
/// Rounding works on coordinates, of the point and of the corners of its triangle, and it counts as far as it is along the
/// normal: `size = |n|·(|p| + extent)`. For a floor that is its depth below the eye, however far it reaches.
#[inline(always)]
fn leave<L: Lane>(p: Vec3<L>, ng: Vec3<L>, extent: Vec3<L>) -> Vec3<L> {
    let size =
        ng.x.abs() * (p.x.abs() + extent.x) + ng.y.abs() * (p.y.abs() + extent.y) + ng.z.abs() * (p.z.abs() + extent.z);
    ng.mul_add(
        size * L::splat(mutate!(mutate!(OFFSET, OffsetDropped => 0.0), OffsetTooShort => OFFSET / 4.0)),
        p,
    )
}

/// What the texture of each lane shows; 1 where there is none.
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

/// The interpolated normal where the mesh has one, on the side of `ng`; else `ng`.
#[inline(always)]
fn smooth_normal<L: Lane>(world: &World, hit: &Hit<L>, surfaces: &Surfaces<L>, ng: Vec3<L>) -> Vec3<L> {
    // Loaded first, weighed after: the loads of all lanes wait for memory together.
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
    // Opposite normals can cancel; then the triangle's own has to do.
    let usable = L::Mask::from_bitmask(smooth) & sum.length_squared().gt(L::splat(1e-12));
    let normal = sum.normalize();
    Vec3::select(usable, mutate!(face(normal, ng), NormalNotFaced => normal), ng)
}

/// Lanes whose mesh has a smooth terminator, and how far the shading point moves there: see
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
        let [x, y, z] = [0, 1, 2].map(|k: usize| L::load(&columns[3 * i + k]));
        Vec3::new(x, y, z)
    };
    let weights = [L::one() - hit.u - hit.v, hit.u, hit.v];
    let (mut sum, mut by) = (Vec3::zero(), Vec3::zero());
    for (i, weight) in weights.into_iter().enumerate() {
        sum = sum + column(&normals, i) * weight;
    }
    // The interpolated normal may have been turned to the side of the eye: then those of the corners are too.
    let turned = sum.dot(n).lt(L::zero());
    for (i, weight) in weights.into_iter().enumerate() {
        let normal = column(&normals, i).negated(turned);
        let below = normal.dot(column(&corners, i) - p).max(L::zero());
        by = by + normal * (below * weight);
    }
    // As in `smooth_normal`: where normals cancel, the triangle is flat.
    let usable = L::Mask::from_bitmask(smooth) & sum.length_squared().gt(L::splat(1e-12));
    (usable, by)
}
