//! The oracle's estimator: two samples with the balance heuristic.
//!
//! Every pass samples one direction from the BRDF and one point of every emitter. Both kinds of sample are divided by the sum
//! of the two densities, the balance heuristic of Veach and Guibas, "Optimally Combining Sampling Techniques for Monte Carlo
//! Rendering", 1995: no contribution exceeds that of the better technique, so standard errors from moderate numbers of samples
//! are reliable. The renderer's own `mis` takes one sample from the average of the densities; the two only share an
//! expectation.

use glam::DVec3;
use rand::Rng;

use super::brdf::Shading;
use super::geometry::Ray;
use super::lamp::{Lamp, arrival};
use super::world::{Sight, World};

/// One estimate of the radiance along a camera ray.
pub fn radiance(world: &World, eye: &Ray, rng: &mut impl Rng) -> DVec3 {
    match world.look(eye) {
        None => world.beyond(eye.direction),
        Some(Sight::Back) => DVec3::ZERO,
        Some(Sight::Emitter { emitter, .. }) => emitter.le,
        Some(Sight::Reflector { shading, point }) => {
            let by_lights: DVec3 = (0..world.emitters().len())
                .map(|i| by_light(world, i, &shading, point, rng))
                .sum();
            let by_lamps: DVec3 = world
                .lamps()
                .iter()
                .map(|lamp| by_lamp(world, lamp, &shading, point, rng))
                .sum();
            by_lights + by_lamps + by_sky(world, &shading, point, rng) + by_brdf(world, &shading, point, rng)
        }
    }
}

/// The contribution of a point sampled on emitter `index`.
fn by_light(world: &World, index: usize, shading: &Shading, point: DVec3, rng: &mut impl Rng) -> DVec3 {
    let emitter = &world.emitters()[index];
    let Some(sample) = emitter.sample(point, world.shapes(), rng) else {
        return DVec3::ZERO;
    };
    let value = emitter.le * shading.value_cos(sample.wi);
    let ray = Ray {
        origin: point,
        direction: sample.wi,
    };
    if value == DVec3::ZERO || world.blocked(&ray, sample.distance, sample.index) {
        return DVec3::ZERO;
    }
    value / (sample.density + shading.density(sample.wi))
}

/// The full contribution of a delta light, or that of a direction sampled in a sun's disk.
fn by_lamp(world: &World, lamp: &Lamp, shading: &Shading, point: DVec3, rng: &mut impl Rng) -> DVec3 {
    let (direction, distance, value) = match lamp {
        Lamp::Delta(light) => {
            let Some(arrival) = arrival(light, point) else {
                return DVec3::ZERO;
            };
            let value = arrival.irradiance * shading.value_cos(arrival.wi);
            (arrival.wi, arrival.distance, value)
        }
        Lamp::Disk(disk) => {
            let direction = disk.sample(rng);
            // A direction sampled in the disk counts as inside, even if rounding puts it beyond the edge.
            let density = disk.density_inside() + shading.density(direction);
            (
                direction,
                f64::INFINITY,
                disk.le * shading.value_cos(direction) / density,
            )
        }
    };
    let ray = Ray {
        origin: point,
        direction,
    };
    if value == DVec3::ZERO || world.nearer(&ray, distance) {
        return DVec3::ZERO;
    }
    value
}

/// The contribution of a direction sampled from the environment.
fn by_sky(world: &World, shading: &Shading, point: DVec3, rng: &mut impl Rng) -> DVec3 {
    let Some((sky, direction)) = world.sky().and_then(|sky| Some((sky, sky.sample(rng)?))) else {
        return DVec3::ZERO;
    };
    let value = sky.radiance(direction) * shading.value_cos(direction);
    let ray = Ray {
        origin: point,
        direction,
    };
    if value == DVec3::ZERO || world.look(&ray).is_some() {
        return DVec3::ZERO;
    }
    value / (sky.density(direction) + shading.density(direction))
}

/// The contribution of the emitter that a direction sampled from the BRDF hits first.
fn by_brdf(world: &World, shading: &Shading, point: DVec3, rng: &mut impl Rng) -> DVec3 {
    let wi = shading.sample(rng);
    let value = shading.value_cos(wi);
    if value == DVec3::ZERO {
        return DVec3::ZERO;
    }
    let ray = Ray {
        origin: point,
        direction: wi,
    };
    match world.look(&ray) {
        Some(Sight::Emitter {
            emitter,
            shape,
            distance,
        }) => emitter.le * value / (emitter.density(&ray, shape, distance) + shading.density(wi)),
        None => {
            let of_sky = world.sky().map_or(DVec3::ZERO, |sky| {
                sky.radiance(wi) * value / (sky.density(wi) + shading.density(wi))
            });
            let of_disks = world.lamps().iter().map(|lamp| match lamp {
                Lamp::Disk(disk) => disk.radiance(wi) * value / (disk.density(wi) + shading.density(wi)),
                Lamp::Delta(_) => DVec3::ZERO,
            });
            of_sky + of_disks.sum::<DVec3>()
        }
        _ => DVec3::ZERO,
    }
}
