//! Probes: directions that bring light, with their density under each technique.
//!
//! An estimator that samples `wi` with density `p` contributes `F / p` for the integrand `F`. The oracle's samples contribute
//! `F / (p_light + p_brdf)`, so they tell which events any other estimator has, and how rare these are: so `study::verify`
//! knows the tails of an estimator that its own few samples never reached.

use glam::DVec3;
use rand_pcg::Pcg64;
use rayon::prelude::*;

use super::brdf::Shading;
use super::camera::Pinhole;
use super::geometry::Ray;
use super::lamp::{Lamp, arrival};
use super::stream;
use super::world::{Sight, World};
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

/// A light path to the camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Way {
    /// The emitter is seen directly.
    Seen,
    /// One reflection of a delta light, which every estimator finds.
    Certain {
        /// Index of the emitter, as below.
        emitter: usize,
    },
    /// One reflection.
    Reflected {
        /// Index of the emitter: emitting spheres in scene order, then emitting meshes, then the environment, then lights
        /// without shape.
        emitter: usize,
        /// Density of the direction under light sampling, sr⁻¹.
        light: f64,
        /// Density of the direction under BRDF sampling, sr⁻¹.
        brdf: f64,
    },
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

    /// Number of emitters, including dark ones.
    pub fn emitters(&self) -> usize {
        self.first_lamp() + self.world.lamps().len()
    }

    fn first_lamp(&self) -> usize {
        self.world.emitters().len() + usize::from(self.world.sky().is_some())
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
        let eye = self.camera.eye(x, y, &mut rng);
        let mut found = Vec::new();
        let mut add = |radiance: DVec3, way| {
            if radiance.max_element() > 0.0 {
                let radiance = radiance.to_array();
                found.push(Found {
                    pixel: pixel as u32,
                    radiance,
                    way,
                });
            }
        };
        match self.world.look(&eye) {
            None => add(self.world.beyond(eye.direction), Way::Seen),
            Some(Sight::Back) => {}
            Some(Sight::Emitter { emitter, .. }) => add(emitter.le, Way::Seen),
            Some(Sight::Reflector { shading, point }) => {
                for emitter in 0..self.world.emitters().len() {
                    if let Some((radiance, way)) = self.by_light(emitter, &shading, point, &mut rng) {
                        add(radiance, way);
                    }
                }
                if let Some((radiance, way)) = self.by_sky(&shading, point, &mut rng) {
                    add(radiance, way);
                }
                for lamp in 0..self.world.lamps().len() {
                    if let Some((radiance, way)) = self.by_lamp(lamp, &shading, point, &mut rng) {
                        add(radiance, way);
                    }
                }
                for (radiance, way) in self.by_brdf(&shading, point, &mut rng) {
                    add(radiance, way);
                }
            }
        }
        found
    }

    fn by_light(&self, emitter: usize, shading: &Shading, point: DVec3, rng: &mut Pcg64) -> Option<(DVec3, Way)> {
        let source = &self.world.emitters()[emitter];
        let sample = source.sample(point, self.world.shapes(), rng)?;
        let value = source.le * shading.value_cos(sample.wi);
        let ray = Ray {
            origin: point,
            direction: sample.wi,
        };
        if value == DVec3::ZERO || self.world.blocked(&ray, sample.distance, sample.index) {
            return None;
        }
        Some(weighed(value, reflected(emitter, sample.density, shading, sample.wi)))
    }

    fn by_sky(&self, shading: &Shading, point: DVec3, rng: &mut Pcg64) -> Option<(DVec3, Way)> {
        let sky = self.world.sky()?;
        let direction = sky.sample(rng)?;
        let value = sky.radiance(direction) * shading.value_cos(direction);
        let ray = Ray {
            origin: point,
            direction,
        };
        if value == DVec3::ZERO || self.world.look(&ray).is_some() {
            return None;
        }
        Some(self.of_sky(value, sky.density(direction), shading, direction))
    }

    fn by_lamp(&self, number: usize, shading: &Shading, point: DVec3, rng: &mut Pcg64) -> Option<(DVec3, Way)> {
        let emitter = self.first_lamp() + number;
        let (direction, distance, found) = match &self.world.lamps()[number] {
            Lamp::Delta(light) => {
                let arrival = arrival(light, point)?;
                let value = arrival.irradiance * shading.value_cos(arrival.wi);
                (arrival.wi, arrival.distance, (value, Way::Certain { emitter }))
            }
            Lamp::Disk(disk) => {
                let direction = disk.sample(rng);
                let way = reflected(emitter, disk.density_inside(), shading, direction);
                (
                    direction,
                    f64::INFINITY,
                    weighed(disk.le * shading.value_cos(direction), way),
                )
            }
        };
        let ray = Ray {
            origin: point,
            direction,
        };
        let dark = found.0 == DVec3::ZERO || self.world.nearer(&ray, distance);
        (!dark).then_some(found)
    }

    fn of_sky(&self, value: DVec3, light: f64, shading: &Shading, wi: DVec3) -> (DVec3, Way) {
        weighed(value, reflected(self.world.emitters().len(), light, shading, wi))
    }

    fn by_brdf(&self, shading: &Shading, point: DVec3, rng: &mut Pcg64) -> Vec<(DVec3, Way)> {
        let wi = shading.sample(rng);
        let value = shading.value_cos(wi);
        let ray = Ray {
            origin: point,
            direction: wi,
        };
        if value == DVec3::ZERO {
            return Vec::new();
        }
        match self.world.look(&ray) {
            Some(Sight::Emitter {
                emitter,
                shape,
                distance,
            }) => {
                let light = emitter.density(&ray, shape, distance);
                let mut all = self.world.emitters().iter();
                let number = all.position(|other| std::ptr::eq(other, emitter));
                let way = number.map(|emitter| reflected(emitter, light, shading, wi));
                way.map(|way| weighed(emitter.le * value, way)).into_iter().collect()
            }
            Some(Sight::Reflector { .. } | Sight::Back) => Vec::new(),
            None => self.beyond(wi, value, shading),
        }
    }

    /// Light from beyond all shapes along a BRDF direction.
    fn beyond(&self, wi: DVec3, value: DVec3, shading: &Shading) -> Vec<(DVec3, Way)> {
        let of_sky = self
            .world
            .sky()
            .map(|sky| self.of_sky(sky.radiance(wi) * value, sky.density(wi), shading, wi));
        let lamps = (self.first_lamp()..).zip(self.world.lamps());
        let of_disks = lamps.filter_map(|(emitter, lamp)| match lamp {
            Lamp::Disk(disk) if disk.density(wi) > 0.0 => {
                let way = reflected(emitter, disk.density(wi), shading, wi);
                Some(weighed(disk.le * value, way))
            }
            _ => None,
        });
        of_sky.into_iter().chain(of_disks).collect()
    }
}

/// A reflection in a direction of density `light` under light sampling.
fn reflected(emitter: usize, light: f64, shading: &Shading, wi: DVec3) -> Way {
    Way::Reflected {
        emitter,
        light,
        brdf: shading.density(wi),
    }
}

/// The oracle's contribution of a light path, by the balance heuristic.
fn weighed(value: DVec3, way: Way) -> (DVec3, Way) {
    match way {
        Way::Reflected { light, brdf, .. } => (value / (light + brdf), way),
        _ => (value, way),
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
