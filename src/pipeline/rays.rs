//! Ray queries on arrays: closest hits and occlusion of arbitrary rays in a prepared scene.
//!
//! ```
//! use octolux::rays::{RayQueries, Rays};
//! # use octolux::pipeline::{Prepared, Settings};
//! # use octolux::scene::{Camera, FilmSize, Fov, Scene, Sphere, Surface};
//! # let camera = Camera::new([0.0, 0.0, 9.0], [0.0; 3], Fov::X(40.0));
//! # let mut scene = Scene::builder(camera, FilmSize { width: 96, height: 64 });
//! # scene.sphere(Sphere::new([0.0; 3], 1.0, Surface::emission([1.0; 3])));
//! # let scene = scene.build()?;
//! let queries = RayQueries::new(&Prepared::new(&scene, Settings::of(&scene))?);
//!
//! // Two rays in rows; the first one hits a sphere of radius 1 around 0. Columns are accepted too, and nothing is copied.
//! let origins = [[0.0, 0.0, 5.0], [0.0, 3.0, 5.0]];
//! let directions = [[0.0, 0.0, -1.0], [0.0, 0.0, -1.0]];
//! let rays = Rays::new(&origins, &directions);
//! let hits = queries.intersect(rays)?;
//! assert!((hits.t[0] - 4.0).abs() < 1e-5 && hits.t[1].is_infinite());
//! assert_eq!((hits.objects[0], hits.normals[1]), (0, [0.0; 3]));
//!
//! // The first ray hits the sphere at 4: it is unoccluded up to 3.9 and occluded up to 4.1.
//! assert_eq!(queries.occluded(rays.within(&[3.9, 3.9]))?, [false, false]);
//! assert_eq!(queries.occluded(rays.within(&[4.1, 4.1]))?, [true, false]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod arrays;

use std::marker::PhantomData;
use std::ops::Range;

use glam::DVec3;
use rayon::prelude::*;

use super::prepared::Prepared;
use super::tracer::{BruteForce, ByEmbree, Tracer};
use super::world::World;
use crate::embree::{Coherence, LaneWork, NO_SKIP_ID, TraceLane, in_eight_of_avx512, in_sixteen};
use crate::lane::{Bits, F32x8, Lane, Mask, has_avx512};
use crate::linear::Candidates;
use crate::math::Vec3;
use crate::settings::{AccelKind, Lanes};
use crate::shape::{Hit, Ray};

pub use arrays::{Hits, HitsMut, NOTHING, Rays, RaysError, Vectors};

/// Rays per task of a thread.
const CHUNK: usize = 2048;

/// Traces rays in packets on all threads of a [`Prepared`] scene, with its planned intersector and packet width.
#[derive(Clone, Debug)]
pub struct RayQueries {
    prepared: Prepared,
}

impl RayQueries {
    /// Shares the tables of `prepared`.
    pub fn new(prepared: &Prepared) -> Self {
        Self {
            prepared: prepared.clone(),
        }
    }

    /// Closest hits of the rays.
    ///
    /// # Errors
    /// [`RaysError`] if the arrays differ in length.
    pub fn intersect(&self, rays: Rays) -> Result<Hits, RaysError> {
        let n = rays.len();
        let mut hits = Hits {
            t: vec![f32::INFINITY; n],
            normals: vec![[0.0; 3]; n],
            uv: vec![[0.0; 2]; n],
            objects: vec![NOTHING; n],
            primitives: vec![NOTHING; n],
        };
        let into = HitsMut {
            t: &mut hits.t,
            normals: &mut hits.normals,
            uv: &mut hits.uv,
            objects: &mut hits.objects,
            primitives: &mut hits.primitives,
        };
        self.intersect_into(rays, into)?;
        Ok(hits)
    }

    /// Like [`Self::intersect`], into existing arrays.
    ///
    /// # Errors
    /// [`RaysError`] if the arrays differ in length; nothing is written then.
    pub fn intersect_into(&self, rays: Rays, hits: HitsMut) -> Result<(), RaysError> {
        rays.check(&[
            ("t", hits.t.len()),
            ("normals", hits.normals.len()),
            ("uv", hits.uv.len()),
            ("objects", hits.objects.len()),
            ("primitives", hits.primitives.len()),
        ])?;
        let t = hits.t.par_chunks_mut(CHUNK);
        let normals = hits.normals.par_chunks_mut(CHUNK);
        let uv = hits.uv.par_chunks_mut(CHUNK);
        let objects = hits.objects.par_chunks_mut(CHUNK);
        let primitives = hits.primitives.par_chunks_mut(CHUNK);
        let chunks = (t, normals, uv, objects, primitives).into_par_iter().enumerate();
        self.prepared.pool.install(|| {
            chunks.for_each(|(chunk, (t, normals, uv, objects, primitives))| {
                let hits = HitsMut {
                    t,
                    normals,
                    uv,
                    objects,
                    primitives,
                };
                self.answer(rays, chunk * CHUNK, Answers::Hits(hits));
            });
        });
        Ok(())
    }

    /// Whether anything is hit before the end of each ray.
    ///
    /// # Errors
    /// [`RaysError`] if the arrays differ in length.
    pub fn occluded(&self, rays: Rays) -> Result<Vec<bool>, RaysError> {
        let mut occluded = vec![false; rays.len()];
        self.occluded_into(rays, &mut occluded)?;
        Ok(occluded)
    }

    /// Like [`Self::occluded`], into an existing array.
    ///
    /// # Errors
    /// [`RaysError`] if the arrays differ in length; nothing is written then.
    pub fn occluded_into(&self, rays: Rays, occluded: &mut [bool]) -> Result<(), RaysError> {
        rays.check(&[("occluded", occluded.len())])?;
        self.prepared.pool.install(|| {
            let chunks = occluded.par_chunks_mut(CHUNK).enumerate();
            chunks.for_each(|(chunk, occluded)| self.answer(rays, chunk * CHUNK, Answers::Occluded(occluded)));
        });
        Ok(())
    }

    fn answer(&self, rays: Rays, first: usize, answers: Answers) {
        let mut task = Task {
            world: &self.prepared.world,
            rays,
            first,
            answers,
        };
        let [one, eight, eight_of_avx512, sixteen] = match self.prepared.plan.intersector.accel {
            AccelKind::Embree => kernels::<ByEmbree>(),
            AccelKind::Linear => kernels::<BruteForce>(),
        };
        match self.prepared.plan.lanes {
            Lanes::One => one(&mut task),
            Lanes::Eight if has_avx512() => eight_of_avx512(&mut task),
            Lanes::Eight => eight(&mut task),
            Lanes::Sixteen => sixteen(&mut task),
        }
    }
}

/// Destination of the results of a chunk.
enum Answers<'a> {
    Hits(HitsMut<'a>),
    Occluded(&'a mut [bool]),
}

/// A range of the rays.
struct Task<'a> {
    world: &'a World,
    rays: Rays<'a>,
    first: usize,
    answers: Answers<'a>,
}

type Kernel = fn(&mut Task);

const fn kernels<T: Tracer>() -> [Kernel; 4] {
    [
        run::<f32, T>,
        run::<F32x8, T>,
        |task| in_eight_of_avx512(OfTask::<T>(task, PhantomData)),
        |task| in_sixteen(OfTask::<T>(task, PhantomData)),
    ]
}

/// A task, generic over the packet width.
struct OfTask<'a, 't, T>(&'a mut Task<'t>, PhantomData<T>);

impl<T: Tracer> LaneWork for OfTask<'_, '_, T> {
    #[inline(always)]
    fn run<L: TraceLane>(self) {
        run::<L, T>(self.0);
    }
}

#[inline(always)]
fn run<L: TraceLane, T: Tracer>(task: &mut Task) {
    let (world, coherence) = (task.world, task.rays.coherence);
    let mut set = Candidates::default();
    T::keep_all(world, &mut set);
    let length = match &task.answers {
        Answers::Hits(hits) => hits.t.len(),
        Answers::Occluded(occluded) => occluded.len(),
    };
    for at in (0..length).step_by(L::N) {
        let count = L::N.min(length - at);
        let (active, ray) = packet::<L>(task, task.first + at, count);
        match &mut task.answers {
            Answers::Hits(hits) => {
                let hit = T::nearest::<L>(world, &set, active, &ray, coherence);
                write(world, &hit, &ray, hits, at..at + count);
            }
            Answers::Occluded(occluded) => {
                let met = T::occluded::<L>(world, &set, active, &ray, Coherence::Incoherent).to_bitmask();
                for (lane, occluded) in occluded[at..at + count].iter_mut().enumerate() {
                    *occluded = met >> lane & 1 == 1;
                }
            }
        }
    }
}

#[inline(always)]
fn vector<L: Lane>([x, y, z]: &[[f32; 16]; 3]) -> Vec3<L> {
    Vec3::new(L::load(x), L::load(y), L::load(z))
}

/// Loads rays; idle lanes hold a ray along `x`.
#[inline(always)]
fn packet<L: TraceLane>(task: &Task, at: usize, count: usize) -> (L::Mask, Ray<L>) {
    let space = &task.world.space;
    let (mut origin, mut direction, mut tfar) = ([[0.0; 16]; 3], [[0.0; 16]; 3], [f32::INFINITY; 16]);
    for lane in 0..count {
        let (o, d) = (task.rays.origins.get(at + lane), task.rays.directions.get(at + lane));
        let o = space.point(DVec3::from(o.map(f64::from)));
        for k in 0..3 {
            (origin[k][lane], direction[k][lane]) = (o[k], d[k]);
        }
        if let Some(tmax) = task.rays.tmax {
            // Directions are not scaled: `t` counts multiples of the direction and scales with the space.
            tfar[lane] = space.length(f64::from(tmax[at + lane])) as f32;
        }
    }
    let (origin, direction, tfar) = (vector::<L>(&origin), vector::<L>(&direction), L::load(&tfar));
    let numbers = [origin.x, origin.y, origin.z, direction.x, direction.y, direction.z];
    let finite = numbers.map(|x| x.abs().le(L::splat(f32::MAX)));
    let sound = finite.into_iter().fold(L::Mask::first(count), |all, one| all & one);
    let active = sound & direction.max_abs().gt(L::zero()) & tfar.ge(L::zero());
    let ray = Ray {
        origin: origin.or_zero(active),
        direction: Vec3::select(active, direction, Vec3::splat([1.0, 0.0, 0.0])),
        tfar: tfar.or_zero(active),
        skip_id: L::Bits::splat(NO_SKIP_ID),
    };
    (active, ray)
}

/// Writes the answers of a packet. What can be is computed for all of its lanes at once.
#[inline(always)]
fn write<L: TraceLane>(world: &World, hit: &Hit<L>, ray: &Ray<L>, hits: &mut HitsMut, to: Range<usize>) {
    // A triangle without area has no normal. That of a small one must not underflow, hence `unit`.
    let facing = hit.found & hit.ng.max_abs().gt(L::zero());
    let normal = hit.ng.unit().or_zero(facing);
    let normal = normal.negated(normal.dot(ray.direction).gt(L::zero()));
    let on_mesh = hit.found & !hit.geometry.eq(L::Bits::splat(world.sphere_geometry));
    let numbers = [
        normal.x,
        normal.y,
        normal.z,
        hit.u.or_zero(on_mesh),
        hit.v.or_zero(on_mesh),
        hit.t,
    ];
    let [x, y, z, u, v, t] = numbers.map(|numbers| {
        let mut all = [0.0; 16];
        numbers.store(&mut all);
        all
    });
    let [geometry, primitive] = [hit.geometry, hit.primitive].map(|numbers| {
        let mut all = [0; 16];
        numbers.store(&mut all);
        all
    });
    let (found, on_mesh) = (hit.found.to_bitmask(), on_mesh.to_bitmask());
    let of = |lanes: u32, lane: usize| lanes >> lane & 1 == 1;
    for (lane, normal) in hits.normals[to.clone()].iter_mut().enumerate() {
        *normal = [x[lane], y[lane], z[lane]];
    }
    for (lane, uv) in hits.uv[to.clone()].iter_mut().enumerate() {
        *uv = [u[lane], v[lane]];
    }
    for (lane, distance) in hits.t[to.clone()].iter_mut().enumerate() {
        *distance = if of(found, lane) {
            world.space.in_scene(t[lane])
        } else {
            f32::INFINITY
        };
    }
    let which = hits.objects[to.clone()].iter_mut().zip(&mut hits.primitives[to]);
    for (lane, (object, part)) in which.enumerate() {
        (*object, *part) = if of(on_mesh, lane) {
            (geometry[lane], primitive[lane])
        } else if of(found, lane) {
            (geometry[lane] + world.sphere_numbers[primitive[lane] as usize], 0)
        } else {
            (NOTHING, NOTHING)
        };
    }
}
