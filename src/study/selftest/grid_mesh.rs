//! A grid mesh without gaps, and rays that try to pass through it.

use rand::RngExt;
use rand_pcg::Pcg64;

use super::bench::SelftestError;
use crate::embree::{Accel, Device, SceneBuilder};
use crate::lane::{Bits, F32x8, Lane, U32x8};
use crate::math::Vec3;
use crate::shape::{NO_SKIP_ID, Ray};

/// Where rays are aimed.
#[derive(Clone, Copy)]
pub enum Aim {
    Vertex,
    Edge,
    Anywhere,
}

/// A wavy grid mesh of `n x n` squares around (0, 0, 5), two triangles each.
pub struct Sheet {
    n: u32,
    pub vertices: Vec<[f32; 3]>,
    pub faces: Vec<[u32; 3]>,
}

impl Sheet {
    pub fn new(n: u32, rng: &mut Pcg64) -> Self {
        let at = |i: u32| (f64::from(i) / f64::from(n) * 4.0 - 2.0) as f32;
        let vertices = (0..(n + 1) * (n + 1))
            .map(|k| [at(k % (n + 1)), at(k / (n + 1)), 5.0 + rng.random_range(-0.05..0.05)])
            .collect();
        let faces = (0..n * n).flat_map(|k| {
            let corner = k / n * (n + 1) + k % n;
            [
                [corner, corner + 1, corner + n + 1],
                [corner + 1, corner + n + 2, corner + n + 1],
            ]
        });
        let faces = faces.collect();
        Self { n, vertices, faces }
    }

    /// Its Embree acceleration structure.
    ///
    /// # Errors
    /// Errors from Embree.
    pub fn accel(&self, robust: bool) -> Result<Accel, SelftestError> {
        let mut builder = SceneBuilder::new(&Device::new(1)?, robust)?;
        builder.add_mesh(&self.vertices, &self.faces)?;
        Ok(builder.commit()?)
    }

    /// Eight rays from 0 that must hit the mesh.
    pub fn rays(&self, aim: Aim, rng: &mut Pcg64) -> Ray<F32x8> {
        let targets: [[f32; 3]; 8] = std::array::from_fn(|_| self.target(aim, rng));
        Ray {
            origin: Vec3::zero(),
            direction: Vec3::new(
                F32x8::from_fn(|i| targets[i][0]),
                F32x8::from_fn(|i| targets[i][1]),
                F32x8::from_fn(|i| targets[i][2]),
            ),
            tfar: F32x8::splat(f32::INFINITY),
            skip_id: U32x8::splat(NO_SKIP_ID),
        }
    }

    fn target(&self, aim: Aim, rng: &mut Pcg64) -> [f32; 3] {
        // Not the boundary of the mesh: a ray may pass beside it.
        let [x, y]: [u32; 2] = [rng.random_range(1..self.n), rng.random_range(1..self.n)];
        let corner = self.vertices[(y * (self.n + 1) + x) as usize];
        let toward = match aim {
            Aim::Vertex => corner,
            Aim::Edge => self.vertices[(y * (self.n + 1) + x - 1) as usize],
            Aim::Anywhere => return [rng.random_range(-1.6..1.6), rng.random_range(-1.6..1.6), 5.0],
        };
        let s: f32 = rng.random();
        std::array::from_fn(|k| corner[k] + s * (toward[k] - corner[k]))
    }
}
