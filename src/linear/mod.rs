//! The brute-force intersector for small scenes: tests all shapes, or per tile and light only those that [`cull`] keeps.
//!
//! A handful of shapes tested against eight or sixteen rays at a time is faster than any tree, above all if most of them are culled
//! for a whole tile. The plan decides by the number of shapes.

mod balls;
mod columns;
mod crowd;
pub mod cull;
mod shapes;
mod tree;

use balls::Balls;
use shapes::Shapes;
use tree::SphereTree;

use crate::lane::{Bits, Lane, Mask};
use crate::math::Vec3;
use crate::shape::{BoundingSphere, FromOrigin, Hit, NO_SKIP_ID, Ray, SkipIds, Sphere, Triangle};

/// Up to this many shapes, occluders are culled before tracing, whichever intersector is used.
pub const FEW: usize = 32;

/// A triangle of the list.
#[derive(Clone, Debug)]
struct Member {
    triangle: Triangle,
    from_origin: FromOrigin,
    /// The unit normal, with the same bits as lanes compute.
    unit: [f32; 3],
    /// Mesh index and triangle index.
    name: [u32; 2],
    /// Its skip id, or [`NO_SKIP_ID`].
    skip_id: u32,
}

/// All shapes of a scene.
#[derive(Clone, Debug, Default)]
pub struct LinearScene {
    triangles: Vec<Member>,
    spheres: Vec<Sphere>,
    /// The same shapes in the layout for [`cull`].
    shapes: Shapes,
    /// A hierarchy over the spheres, which are then not in [`Self::shapes`].
    tree: Option<SphereTree>,
    /// The geometry index of spheres in hits.
    sphere_geometry: u32,
}

/// The shapes that a set of rays may hit.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Candidates {
    triangles: Vec<u32>,
    /// Triangles with a skip id; separate, so that the skip test is needed only for these.
    lights: Vec<u32>,
    /// With a hierarchy, center and radius of each are known too.
    balls: Balls,
    /// With a hierarchy, the light that the rays end at.
    target: BoundingSphere,
    /// Whether shapes were left out: the set is for rays between some points and a light alone.
    culled: bool,
}

impl Candidates {
    /// Number of shapes.
    pub fn len(&self) -> usize {
        self.triangles.len() + self.lights.len() + self.balls.len()
    }

    /// Whether there are no shapes.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Removes all shapes.
    pub fn clear(&mut self) {
        self.triangles.clear();
        self.lights.clear();
        self.balls.clear();
        self.culled = false;
    }

    /// Whether the set is for rays between some points and a light alone.
    pub fn is_culled(&self) -> bool {
        self.culled
    }

    /// Indices of the triangles without a skip id.
    pub fn triangles(&self) -> &[u32] {
        &self.triangles
    }
}

impl LinearScene {
    /// Sets the spheres; hits report them as primitives of `sphere_geometry`.
    pub fn set_spheres(&mut self, spheres: Vec<impl Into<Sphere>>, sphere_geometry: u32) {
        self.spheres = spheres.into_iter().map(Into::into).collect();
        let balls: Vec<BoundingSphere> = self.spheres.iter().map(|sphere| sphere.ball).collect();
        self.shapes.set_balls(&balls);
        self.sphere_geometry = sphere_geometry;
    }

    /// Sorts the spheres into a hierarchy.
    pub fn sort_spheres(&mut self) {
        let balls: Vec<BoundingSphere> = self.spheres.iter().map(|sphere| sphere.ball).collect();
        self.tree = Some(SphereTree::new(&balls));
        self.shapes.set_balls(&[]);
    }

    /// Adds the triangles of a mesh; `skip_ids` are their skip ids, if any.
    pub fn add_mesh(
        &mut self,
        geometry: u32,
        vertices: &[[f32; 3]],
        triangles: &[[u32; 3]],
        skip_ids: Option<SkipIds>,
    ) {
        for (primitive, corners) in (0..).zip(triangles) {
            let triangle = Triangle::new(corners.map(|i| vertices[i as usize]));
            let from_origin = triangle.from_origin();
            let skip_id = skip_ids.map_or(NO_SKIP_ID, |skip_ids| skip_ids.of(primitive));
            self.shapes.add(&triangle, &from_origin, skip_id);
            self.triangles.push(Member {
                unit: Vec3::<f32>::splat(triangle.normal).unit().lane(0),
                triangle,
                from_origin,
                name: [geometry, primitive],
                skip_id,
            });
        }
    }

    /// Number of shapes.
    pub fn len(&self) -> usize {
        self.triangles.len() + self.spheres.len()
    }

    /// Whether there are no shapes.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Adds triangles of a packet to the candidates.
    fn take<L: Lane>(&self, at: usize, kept: L::Mask, set: &mut Candidates) {
        for i in kept.lanes().map(|lane| at + lane) {
            let list = if self.triangles[i].skip_id == NO_SKIP_ID {
                &mut set.triangles
            } else {
                &mut set.lights
            };
            list.push(i as u32);
        }
    }

    /// Makes every shape a candidate.
    pub fn all(&self, set: &mut Candidates) {
        set.clear();
        for i in 0..self.triangles.len() {
            self.take::<f32>(i, true, set);
        }
        set.balls.extend(0..self.spheres.len() as u32);
    }

    /// Visits the candidate triangles: geometry and primitive index, then corners.
    pub fn visit(&self, set: &Candidates, visit: &mut dyn FnMut([u32; 2], [[f32; 3]; 3])) {
        for &i in set.triangles.iter().chain(&set.lights) {
            let Member { triangle, name, .. } = &self.triangles[i as usize];
            visit(*name, triangle.corners);
        }
    }

    /// Closest hits of active rays among the candidates; at equal distance the first shape in the list wins. Also returns the rays
    /// whose triangle hit is near an edge, within [`EDGE`](crate::shape::EDGE). This mask is cheaper than the barycentric
    /// coordinates, which only textures and smooth normals require.
    #[inline(always)]
    pub fn intersect<L: Lane>(&self, set: &Candidates, active: L::Mask, ray: &Ray<L>) -> (Hit<L>, L::Mask) {
        self.first::<L, false>(set, active, ray)
    }

    /// Like [`Self::intersect`], for rays from the origin: the same bits in less time.
    #[inline(always)]
    pub fn intersect_from_origin<L: Lane>(&self, set: &Candidates, active: L::Mask, ray: &Ray<L>) -> (Hit<L>, L::Mask) {
        self.first::<L, true>(set, active, ray)
    }

    #[inline(always)]
    fn first<L: Lane, const FROM_ORIGIN: bool>(
        &self,
        set: &Candidates,
        active: L::Mask,
        ray: &Ray<L>,
    ) -> (Hit<L>, L::Mask) {
        let mut ray = *ray;
        let mut next_to_edge = L::Mask::splat(false);
        let mut hit = Hit {
            found: L::Mask::splat(false),
            t: ray.tfar,
            ng: Vec3::zero(),
            u: L::zero(),
            v: L::zero(),
            geometry: L::Bits::splat(u32::MAX),
            primitive: L::Bits::splat(u32::MAX),
        };
        // Two loops instead of a chained iterator, which would test at each step which list is current. Idle lanes are traced with
        // the others, and masked at the end.
        for list in [&set.triangles, &set.lights] {
            for &i in list {
                let Member {
                    triangle,
                    from_origin,
                    unit,
                    name: [geometry, primitive],
                    ..
                } = &self.triangles[i as usize];
                let met = if FROM_ORIGIN {
                    from_origin.intersect(ray.direction, ray.tfar)
                } else {
                    triangle.intersect(&ray)
                };
                let nearer = met.found & met.t.lt(hit.t);
                if nearer.none() {
                    continue;
                }
                hit.found = hit.found | nearer;
                hit.t = L::select(nearer, met.t, hit.t);
                next_to_edge = (nearer & met.next_to_edge()) | (next_to_edge & !nearer);
                let (u, v) = met.barycentrics();
                hit.u = L::select(nearer, u, hit.u);
                hit.v = L::select(nearer, v, hit.v);
                hit.ng = Vec3::select(nearer, Vec3::splat(*unit), hit.ng);
                hit.geometry = L::Bits::select(nearer, L::Bits::splat(*geometry), hit.geometry);
                hit.primitive = L::Bits::select(nearer, L::Bits::splat(*primitive), hit.primitive);
                ray.tfar = hit.t;
            }
        }
        for &i in set.balls.numbers() {
            let sphere = &self.spheres[i as usize];
            let (met, t) = sphere.intersect(ray.origin, ray.direction, L::zero(), ray.tfar);
            let nearer = met & t.lt(hit.t);
            if nearer.none() {
                continue;
            }
            hit.found = hit.found | nearer;
            next_to_edge = next_to_edge & !nearer;
            hit.t = L::select(nearer, t, hit.t);
            let outward = ray.direction.mul_add(t, ray.origin - Vec3::splat(sphere.ball.center));
            hit.ng = Vec3::select(nearer, outward, hit.ng);
            hit.geometry = L::Bits::select(nearer, L::Bits::splat(self.sphere_geometry), hit.geometry);
            hit.primitive = L::Bits::select(nearer, L::Bits::splat(i), hit.primitive);
            ray.tfar = hit.t;
        }
        hit.found = hit.found & active;
        (hit, next_to_edge)
    }

    /// Which active rays hit any candidate except the shape with their skip id.
    #[inline(always)]
    pub fn occluded<L: Lane>(&self, set: &Candidates, active: L::Mask, ray: &Ray<L>) -> L::Mask {
        let mut open = active;
        for &i in &set.triangles {
            open = open & !self.triangles[i as usize].triangle.intersect(ray).found;
            if open.none() {
                return active;
            }
        }
        for &i in &set.lights {
            let Member { triangle, skip_id, .. } = &self.triangles[i as usize];
            let aimed = ray.skip_id.eq(L::Bits::splat(*skip_id));
            open = open & (!triangle.intersect(ray).found | aimed);
            if open.none() {
                return active;
            }
        }
        for &i in set.balls.numbers() {
            let (met, _) = self.spheres[i as usize].intersect(ray.origin, ray.direction, L::zero(), ray.tfar);
            open = open & (!met | ray.skip_id.eq(L::Bits::splat(i)));
            if open.none() {
                return active;
            }
        }
        active & !open
    }
}
