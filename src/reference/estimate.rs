//! The oracle's estimator: two samples with the balance heuristic.
//!
//! Every pass samples one direction from the BRDF and one point of every emitter, or in studies of some that are picked by intensity
//! where there are many ([`super::pick`]). Both kinds of sample are divided by the sum of the densities that are expected, the balance
//! heuristic of Veach and Guibas, "Optimally Combining Sampling Techniques for Monte Carlo Rendering", 1995: with every emitter no
//! contribution exceeds that of the better technique, so standard errors from moderate numbers of samples are reliable. The renderer's own `mis` takes
//! one sample from the average of the densities; the two only share an expectation.
//!
//! Each contribution comes with its [`Way`]: pictures sum them, probes tell from them what other estimators may miss.

use glam::DVec3;
use rand::Rng;

use super::brdf::Shading;
use super::geometry::Ray;
use super::shapeless::{ShapelessLight, arrival};
use super::world::{Sight, World};

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
        /// Density of the direction under light sampling, sr⁻¹: of a sphere, uniform in its cone.
        light: f64,
        /// Density of the direction under BRDF sampling, sr⁻¹.
        brdf: f64,
        /// Expected number of the oracle's samples of the direction, sr⁻¹: its own density of light sampling, which differs
        /// for spheres that the horizon cuts, and `brdf`.
        oracle: f64,
    },
}

/// A point seen by the camera, with the state of its sample.
struct Sample<'a, 'w, R, F> {
    world: &'a World<'w>,
    shading: Shading,
    point: DVec3,
    rng: &'a mut R,
    found: F,
}

/// Estimates the radiance along a camera ray: the sum of what `found` receives, with the way of each contribution.
pub fn contributions(world: &World<'_>, camera_ray: &Ray, rng: &mut impl Rng, mut found: impl FnMut(DVec3, Way)) {
    match world.look(camera_ray) {
        None => found(world.beyond(camera_ray.direction), Way::Seen),
        Some(Sight::Back) => {}
        Some(Sight::Emitter { emitter, .. }) => found(world.emitters()[emitter].le, Way::Seen),
        Some(Sight::Reflector { shading, point }) => {
            let mut sample = Sample {
                world,
                shading,
                point,
                rng,
                found,
            };
            let shapeless = || world.shapeless_lights().iter().zip(world.first_shapeless()..);
            if let Some(picks) = world.picks() {
                for light in picks.draw(sample.rng) {
                    match light.checked_sub(world.emitters().len()) {
                        None => sample.by_light(light),
                        Some(i) => sample.by_shapeless_light(&world.shapeless_lights()[i], world.first_shapeless() + i),
                    }
                }
            } else {
                for emitter in 0..world.emitters().len() {
                    sample.by_light(emitter);
                }
            }
            for (light, number) in shapeless() {
                if world.picks().is_none() || light.intensity().is_none() {
                    sample.by_shapeless_light(light, number);
                }
            }
            sample.by_sky();
            sample.by_brdf();
        }
    }
}

/// One estimate of the radiance along a camera ray.
pub fn radiance(world: &World<'_>, camera_ray: &Ray, rng: &mut impl Rng) -> DVec3 {
    let mut sum = DVec3::ZERO;
    contributions(world, camera_ray, rng, |radiance, _| sum += radiance);
    sum
}

impl<R: Rng, F: FnMut(DVec3, Way)> Sample<'_, '_, R, F> {
    fn ray(&self, direction: DVec3) -> Ray {
        Ray {
            origin: self.point,
            direction,
        }
    }

    /// Adds the light `value` of a direction that light sampling has with density `light`, in the oracle `own`.
    fn reflected(&mut self, value: DVec3, emitter: usize, wi: DVec3, light: f64, own: f64) {
        let brdf = self.shading.density(wi);
        let oracle = self.expected(emitter) * own + brdf;
        let way = Way::Reflected {
            emitter,
            light,
            brdf,
            oracle,
        };
        (self.found)(value / oracle, way);
    }

    /// How many directions to a light the sample has, as far as chance decides it. Lights are counted as in [`Way`].
    fn expected(&self, number: usize) -> f64 {
        let emitters = self.world.emitters().len();
        let of_shapeless = number.checked_sub(self.world.first_shapeless()).map(|i| emitters + i);
        let light = if number < emitters { Some(number) } else { of_shapeless };
        let picked = |light: usize| self.world.picks()?.expected(light);
        light.and_then(picked).unwrap_or(1.0)
    }

    /// The contribution of a point sampled on an emitter.
    fn by_light(&mut self, number: usize) {
        let emitter = &self.world.emitters()[number];
        let (shapes, n) = (self.world.shapes(), self.shading.n);
        let Some(sample) = emitter.sample(self.point, n, shapes, self.rng) else {
            return;
        };
        let value = emitter.le * self.shading.value_cos(sample.wi);
        let ray = self.ray(sample.wi);
        if value == DVec3::ZERO || self.world.blocked(&ray, sample.distance, sample.index) {
            return;
        }
        let even = emitter.even(&ray, &shapes[sample.index as usize], sample.distance);
        self.reflected(value, number, sample.wi, even, sample.density);
    }

    /// The full contribution of a delta light, or that of a direction sampled in a sun's disk.
    fn by_shapeless_light(&mut self, light: &ShapelessLight, number: usize) {
        let (direction, distance, le) = match light {
            ShapelessLight::Delta(light) => {
                let Some(arrival) = arrival(light, self.point) else {
                    return;
                };
                (arrival.wi, arrival.distance, arrival.irradiance)
            }
            ShapelessLight::Disk(disk) => (disk.sample(self.rng), f64::INFINITY, disk.le),
        };
        let value = le * self.shading.value_cos(direction);
        if value == DVec3::ZERO || self.world.nearer(&self.ray(direction), distance) {
            return;
        }
        match light {
            ShapelessLight::Delta(_) => {
                let value = value / self.expected(number);
                (self.found)(value, Way::Certain { emitter: number });
            }
            ShapelessLight::Disk(disk) => {
                // A direction sampled in the disk counts as inside, even if rounding puts it beyond the edge.
                let density = disk.density_inside();
                self.reflected(value, number, direction, density, density);
            }
        }
    }

    /// The contribution of a direction sampled from the environment.
    fn by_sky(&mut self) {
        let Some(sky) = self.world.sky() else {
            return;
        };
        let Some(direction) = sky.sample(self.rng) else {
            return;
        };
        let value = sky.radiance(direction) * self.shading.value_cos(direction);
        if value == DVec3::ZERO || self.world.look(&self.ray(direction)).is_some() {
            return;
        }
        let density = sky.density(direction);
        self.reflected(value, self.world.emitters().len(), direction, density, density);
    }

    /// The contribution of the emitter that a direction sampled from the BRDF hits first.
    fn by_brdf(&mut self) {
        let wi = self.shading.sample(self.rng);
        let value = self.shading.value_cos(wi);
        if value == DVec3::ZERO {
            return;
        }
        let ray = self.ray(wi);
        match self.world.look(&ray) {
            Some(Sight::Emitter {
                emitter: number,
                shape,
                distance,
            }) => {
                let emitter = &self.world.emitters()[number];
                let own = emitter.density(&ray, self.shading.n, shape, distance);
                let even = emitter.even(&ray, shape, distance);
                self.reflected(emitter.le * value, number, wi, even, own);
            }
            Some(Sight::Reflector { .. } | Sight::Back) => {}
            None => {
                if let Some(sky) = self.world.sky() {
                    let density = sky.density(wi);
                    self.reflected(
                        sky.radiance(wi) * value,
                        self.world.emitters().len(),
                        wi,
                        density,
                        density,
                    );
                }
                for (light, number) in self.world.shapeless_lights().iter().zip(self.world.first_shapeless()..) {
                    if let ShapelessLight::Disk(disk) = light {
                        let density = disk.density(wi);
                        self.reflected(disk.radiance(wi) * value, number, wi, density, density);
                    }
                }
            }
        }
    }
}
