//! Ray queries on arrays: what any rays meet first in a prepared scene, and whether anything is in their way.
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
//! // Two rays in rows, one of them to a sphere of radius 1 around 0. Columns are taken as well, and nothing is copied.
//! let origins = [[0.0, 0.0, 5.0], [0.0, 3.0, 5.0]];
//! let directions = [[0.0, 0.0, -1.0], [0.0, 0.0, -1.0]];
//! let rays = Rays::new(&origins, &directions);
//! let hits = queries.intersect(rays)?;
//! assert!((hits.t[0] - 4.0).abs() < 1e-5 && hits.t[1].is_infinite());
//! assert_eq!((hits.objects[0], hits.normals[1]), (0, [0.0; 3]));
//!
//! // Nothing is in the way up to 3.9, and something is up to 4.1.
//! assert_eq!(queries.occluded(rays.within(&[3.9, 3.9]))?, [false, false]);
//! assert_eq!(queries.occluded(rays.within(&[4.1, 4.1]))?, [true, false]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use std::marker::PhantomData;

use glam::DVec3;
use rayon::prelude::*;

use super::prepared::Prepared;
use super::tracer::{ByEmbree, InLine, Tracer};
use super::world::World;
use crate::embree::{Coherence, LaneWork, NO_SPHERE, TraceLane, in_eight_of_avx512, in_sixteen};
use crate::lane::{Bits, F32x8, Lane, Mask, has_avx512};
use crate::linear::Candidates;
use crate::math::Vec3;
use crate::settings::{AccelKind, Lanes};
use crate::shape::{Hit, Ray};

/// Rays that a thread takes at a time.
const CHUNK: usize = 2048;

/// What stands for the object and the primitive where a ray meets nothing.
pub const NOTHING: u32 = u32::MAX;

/// Vectors of three numbers as they lie in memory.
#[derive(Clone, Copy, Debug)]
pub enum Vectors<'a> {
    /// One after the other: an array of shape `(n, 3)`.
    Rows(&'a [[f32; 3]]),
    /// All `x`, all `y`, all `z`: columns of one length.
    Columns([&'a [f32]; 3]),
}

impl<'a> From<&'a [[f32; 3]]> for Vectors<'a> {
    fn from(rows: &'a [[f32; 3]]) -> Self {
        Self::Rows(rows)
    }
}

impl<'a, const N: usize> From<&'a [[f32; 3]; N]> for Vectors<'a> {
    fn from(rows: &'a [[f32; 3]; N]) -> Self {
        Self::Rows(rows)
    }
}

impl<'a> From<&'a Vec<[f32; 3]>> for Vectors<'a> {
    fn from(rows: &'a Vec<[f32; 3]>) -> Self {
        Self::Rows(rows)
    }
}

impl<'a> From<[&'a [f32]; 3]> for Vectors<'a> {
    fn from(columns: [&'a [f32]; 3]) -> Self {
        Self::Columns(columns)
    }
}

impl Vectors<'_> {
    /// How many vectors there are; of columns, the fewest.
    pub fn len(&self) -> usize {
        match self {
            Self::Rows(rows) => rows.len(),
            Self::Columns([x, y, z]) => x.len().min(y.len()).min(z.len()),
        }
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    fn is_even(&self) -> bool {
        match self {
            Self::Rows(_) => true,
            Self::Columns(columns) => columns.iter().all(|column| column.len() == self.len()),
        }
    }

    #[inline(always)]
    fn get(&self, at: usize) -> [f32; 3] {
        match self {
            Self::Rows(rows) => rows[at],
            Self::Columns([x, y, z]) => [x[at], y[at], z[at]],
        }
    }
}

/// Rays in the units and the coordinates of the scene. They start at their origins and end after `tmax` lengths of their directions,
/// which need not be unit. A ray meets nothing if its direction is 0, if a number of it is not finite (`tmax` may be infinite), or if
/// it starts farther from the camera than 2^98 times the farthest shape: single precision cannot hold that.
#[derive(Clone, Copy, Debug)]
pub struct Rays<'a> {
    origins: Vectors<'a>,
    directions: Vectors<'a>,
    tmax: Option<&'a [f32]>,
    coherence: Coherence,
}

impl<'a> Rays<'a> {
    /// Rays without an end.
    pub fn new(origins: impl Into<Vectors<'a>>, directions: impl Into<Vectors<'a>>) -> Self {
        Self {
            origins: origins.into(),
            directions: directions.into(),
            tmax: None,
            coherence: Coherence::Incoherent,
        }
    }

    /// The same, with the end of each ray in lengths of its direction.
    #[must_use]
    pub fn within(self, tmax: &'a [f32]) -> Self {
        Self {
            tmax: Some(tmax),
            ..self
        }
    }

    /// The same, where neighbours in the array go the same way, as those of neighbouring pixels. It changes the speed alone.
    #[must_use]
    pub fn coherent(self) -> Self {
        Self {
            coherence: Coherence::Coherent,
            ..self
        }
    }

    /// How many rays there are.
    pub fn len(&self) -> usize {
        self.origins.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Fails unless all arrays have the length of `answers`.
    fn check(&self, answers: &[(&'static str, usize)]) -> Result<(), RaysError> {
        let rays = self.len();
        if !self.origins.is_even() || !self.directions.is_even() {
            return Err(RaysError(
                "the columns of origins or directions differ in length".to_owned(),
            ));
        }
        let asked = [
            ("directions", self.directions.len()),
            ("tmax", self.tmax.map_or(rays, <[f32]>::len)),
        ];
        match asked.iter().chain(answers).find(|(_, length)| *length != rays) {
            Some((name, length)) => Err(RaysError(format!("there are {rays} origins, and {name} has {length}"))),
            None => Ok(()),
        }
    }
}

/// Arrays whose lengths do not fit together; the message says which.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct RaysError(String);

/// What rays meet first, ray by ray.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Hits {
    /// Distance in lengths of the direction; infinite where nothing is met.
    pub t: Vec<f32>,
    /// Unit geometric normal on the side of the ray's origin; 0 where nothing is met.
    pub normals: Vec<[f32; 3]>,
    /// Barycentric coordinates of the second and third corner of a triangle; 0 on spheres.
    pub uv: Vec<[f32; 2]>,
    /// The object: meshes are counted from 0 in the scene's order, spheres from the number of meshes on; [`NOTHING`] where none is met.
    pub objects: Vec<u32>,
    /// The triangle of a mesh, 0 for a sphere; [`NOTHING`] where none is met.
    pub primitives: Vec<u32>,
}

/// Where [`Hits`] go: arrays of a caller, each as long as there are rays.
#[derive(Debug)]
pub struct HitsMut<'a> {
    /// As [`Hits::t`].
    pub t: &'a mut [f32],
    /// As [`Hits::normals`].
    pub normals: &'a mut [[f32; 3]],
    /// As [`Hits::uv`].
    pub uv: &'a mut [[f32; 2]],
    /// As [`Hits::objects`].
    pub objects: &'a mut [u32],
    /// As [`Hits::primitives`].
    pub primitives: &'a mut [u32],
}

/// Answers rays in packets on all threads of a [`Prepared`] scene, with the accelerator and the lanes that were planned for it.
#[derive(Clone, Debug)]
pub struct RayQueries {
    prepared: Prepared,
}

impl RayQueries {
    /// Shares what was built.
    pub fn new(prepared: &Prepared) -> Self {
        Self {
            prepared: prepared.clone(),
        }
    }

    /// What the rays meet first.
    ///
    /// # Errors
    /// [`RaysError`] where arrays differ in length.
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

    /// As [`Self::intersect`], into arrays that are there already.
    ///
    /// # Errors
    /// [`RaysError`] where arrays differ in length; nothing is written then.
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

    /// Whether anything is met before the end of each ray.
    ///
    /// # Errors
    /// [`RaysError`] where arrays differ in length.
    pub fn occluded(&self, rays: Rays) -> Result<Vec<bool>, RaysError> {
        let mut occluded = vec![false; rays.len()];
        self.occluded_into(rays, &mut occluded)?;
        Ok(occluded)
    }

    /// As [`Self::occluded`], into an array that is there already.
    ///
    /// # Errors
    /// [`RaysError`] where arrays differ in length; nothing is written then.
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
            AccelKind::Linear => kernels::<InLine>(),
        };
        match self.prepared.plan.lanes {
            Lanes::One => one(&mut task),
            Lanes::Eight if has_avx512() => eight_of_avx512(&mut task),
            Lanes::Eight => eight(&mut task),
            Lanes::Sixteen => sixteen(&mut task),
        }
    }
}

/// Where answers of a chunk go.
enum Answers<'a> {
    Hits(HitsMut<'a>),
    Occluded(&'a mut [bool]),
}

/// Some rays of the arrays.
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

/// A task, for all lanes.
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
    T::face_all(world, &mut set);
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
                for lane in 0..count {
                    write(world, &hit, &ray, lane, hits, at + lane);
                }
            }
            Answers::Occluded(occluded) => {
                let met = T::occluded::<L>(world, &set, active, &ray).to_bitmask();
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
    let (mut origin, mut direction, mut tfar) = ([[0.0; 16]; 3], [[0.0; 16]; 3], [0.0; 16]);
    direction[0] = [1.0; 16];
    let mut active = 0;
    for lane in 0..count {
        let (o, d) = (task.rays.origins.get(at + lane), task.rays.directions.get(at + lane));
        let end = task.rays.tmax.map_or(f32::INFINITY, |tmax| tmax[at + lane]);
        let o = space.point(DVec3::from(o.map(f64::from)));
        let sound = o.iter().chain(&d).all(|x| x.is_finite()) && d != [0.0; 3] && end >= 0.0;
        if sound {
            for k in 0..3 {
                (origin[k][lane], direction[k][lane]) = (o[k], d[k]);
            }
            // Directions stay as they are: a distance in lengths of them grows as the space does.
            tfar[lane] = space.length(f64::from(end)) as f32;
            active |= 1 << lane;
        }
    }
    let ray = Ray {
        origin: vector(&origin),
        direction: vector(&direction),
        tfar: L::load(&tfar),
        aims_at: L::Bits::splat(NO_SPHERE),
    };
    (L::Mask::from_bitmask(active), ray)
}

#[inline(always)]
fn write<L: TraceLane>(world: &World, hit: &Hit<L>, ray: &Ray<L>, lane: usize, hits: &mut HitsMut, at: usize) {
    if hit.found.to_bitmask() >> lane & 1 == 0 {
        hits.t[at] = f32::INFINITY;
        hits.normals[at] = [0.0; 3];
        hits.uv[at] = [0.0; 2];
        (hits.objects[at], hits.primitives[at]) = (NOTHING, NOTHING);
        return;
    }
    let (geometry, primitive) = (hit.geometry.lane(lane), hit.primitive.lane(lane));
    let sphere = geometry == world.sphere_geometry;
    let (normal, direction) = (hit.ng.lane(lane), ray.direction.lane(lane));
    // In f64 no normal of a small triangle underflows.
    let normal = DVec3::from(normal.map(f64::from)).normalize_or_zero();
    let facing = normal.dot(DVec3::from(direction.map(f64::from))) > 0.0;
    hits.t[at] = world.space.to_scene(hit.t.lane(lane));
    hits.normals[at] = (if facing { -normal } else { normal }).to_array().map(|x| x as f32);
    hits.uv[at] = if sphere {
        [0.0; 2]
    } else {
        [hit.u.lane(lane), hit.v.lane(lane)]
    };
    (hits.objects[at], hits.primitives[at]) = if sphere {
        (geometry + world.sphere_numbers[primitive as usize], 0)
    } else {
        (geometry, primitive)
    };
}
