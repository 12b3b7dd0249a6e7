//! Probes: directions that bring light, with their density under each technique.
//!
//! An estimator that samples `wi` with density `p` contributes `F / p` for the integrand `F`. The oracle's samples contribute
//! `F` over the sum of its densities, so they tell which events any other estimator has, and how rare these are: so
//! `study::verify` knows the tails of an estimator that its own few samples never reached.

use glam::DVec3;
use rayon::prelude::*;

use super::camera::Pinhole;
pub use super::estimate::Way;
use super::estimate::contributions;
use super::stream;
use super::world::World;
use crate::scene::{FilmSize, Scene};

/// Light that one sample of the oracle found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Found {
    /// The pixel, row by row from the top.
    pub pixel: u32,
    /// The oracle's contribution: its mean over samples is the pixel's radiance.
    pub radiance: [f64; 3],
    /// The light path.
    pub way: Way,
}

/// A scene prepared for probes.
#[derive(Debug)]
pub struct Probe<'s> {
    world: World<'s>,
    camera: Pinhole,
    film: FilmSize,
}

impl<'s> Probe<'s> {
    /// Prepares the scene.
    pub fn new(scene: &'s Scene, film: FilmSize) -> Self {
        Self {
            world: World::new(scene),
            camera: Pinhole::new(scene.camera(), film),
            film,
        }
    }

    /// With samples of some lights, by intensity, where there are many.
    pub fn picking(self) -> Self {
        Self {
            world: self.world.picking(),
            ..self
        }
    }

    /// Number of emitters, including dark ones.
    pub fn emitters(&self) -> usize {
        self.world.first_shapeless() + self.world.shapeless_lights().len()
    }

    /// The position of a scene point on the film, in pixels; `None` behind the camera.
    pub fn project(&self, point: DVec3) -> Option<[f64; 2]> {
        self.camera.project(point)
    }

    /// One sample of every pixel, on the threads of the current rayon pool. Seeds give independent passes.
    pub fn pass(&self, seed: u64) -> Vec<Found> {
        let pixels = self.film.width as usize * self.film.height as usize;
        (0..pixels)
            .into_par_iter()
            .flat_map_iter(|pixel| self.sample(pixel, seed))
            .collect()
    }

    fn sample(&self, pixel: usize, seed: u64) -> Vec<Found> {
        // Separate random numbers: the oracle's pictures use the streams of plain seeds.
        let mut rng = stream(seed ^ 0x5bd1_e995_0000_0000, pixel as u64);
        let width = self.film.width as usize;
        let (x, y) = ((pixel % width) as f64, (pixel / width) as f64);
        let camera_ray = self.camera.sampled_ray(x, y, &mut rng);
        let mut found = Vec::new();
        contributions(&self.world, &camera_ray, &mut rng, |radiance, way| {
            if radiance.max_element() > 0.0 {
                found.push(Found {
                    pixel: pixel as u32,
                    radiance: radiance.to_array(),
                    way,
                });
            }
        });
        found
    }
}

#[cfg(test)]
mod tests {
    use super::super::render;
    use super::*;
    use std::path::Path;

    /// The probe finds the same light as the oracle.
    #[test]
    fn its_mean_is_the_oracles() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/tests/two-lights.toml");
        let scene = Scene::load(&path).unwrap();
        let film = FilmSize { width: 1, height: 1 };
        let probe = Probe::new(&scene, film);
        let passes = 20_000;
        let sum: f64 = (0..passes)
            .flat_map(|seed| probe.pass(seed))
            .map(|found| found.radiance[1])
            .sum();
        let oracle = render(&scene, film, passes as u32, 3, &|_| {});
        let noise = 6.0 * 2.0_f64.sqrt() * oracle.stderr[0][1];
        assert!((sum / passes as f64 - oracle.picture[0][1]).abs() < noise + 1e-12);
    }
}
