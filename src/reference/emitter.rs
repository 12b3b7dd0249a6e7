//! Emitters: light sampling and its density.

use std::f64::consts::PI;

use glam::DVec3;
use rand::{Rng, RngExt};

use super::brdf::around;
use super::crest::Crest;
use super::geometry::{Ray, Shape};

/// An emitting sphere or mesh; both sides emit.
#[derive(Debug)]
pub struct Emitter {
    /// Radiance, the same in every direction.
    pub le: DVec3,
    extent: Extent,
}

#[derive(Debug)]
enum Extent {
    Sphere {
        index: u32,
        center: DVec3,
        radius: f64,
    },
    /// Triangles from index `first`, with cumulative areas.
    Mesh {
        first: u32,
        area_sums: Vec<f64>,
    },
}

/// A point on an emitter, sampled for a shading point. It is visible if no shape except `index` is nearer.
#[derive(Clone, Copy, Debug)]
pub struct LightSample {
    /// Unit, from the shading point.
    pub wi: DVec3,
    /// To the emitter, along `wi`.
    pub distance: f64,
    /// Density of `wi`, sr⁻¹.
    pub density: f64,
    /// The shape that the point lies on.
    pub index: u32,
}

impl Emitter {
    /// The emitter made of the given shapes, whose indices start at `first`: one sphere, or triangles.
    pub fn new(le: DVec3, first: u32, shapes: &[Shape]) -> Self {
        let extent = match *shapes {
            [Shape::Sphere { center, radius }] => Extent::Sphere {
                index: first,
                center,
                radius,
            },
            _ => {
                let area_sums = shapes.iter().scan(0.0, |sum, shape| {
                    *sum += shape.area();
                    Some(*sum)
                });
                Extent::Mesh {
                    first,
                    area_sums: area_sums.collect(),
                }
            }
        };
        Self { le, extent }
    }

    /// The largest component of its intensity along a normal.
    pub fn intensity(&self) -> f64 {
        let area = match &self.extent {
            Extent::Sphere { radius, .. } => PI * radius * radius,
            Extent::Mesh { area_sums, .. } => area_sums.last().copied().unwrap_or(0.0),
        };
        area * self.le.max_element()
    }

    /// Samples a direction to the emitter from `point` on a surface of normal `n`: uniform in the cone that a sphere subtends, or
    /// in its [`Crest`] where the horizon cuts it; uniform over the area of a mesh. `None` where the direction misses, a mesh is
    /// seen edge-on or has no area.
    pub fn sample(&self, point: DVec3, n: DVec3, shapes: &[Shape], rng: &mut impl Rng) -> Option<LightSample> {
        match self.extent {
            Extent::Sphere { index, center, radius } => {
                let to_center = center - point;
                let apart = to_center.length();
                // The sphere is not intersected again, because rounding would make rays to its silhouette miss. `beside` is the
                // distance of its centre from the ray.
                let (wi, density, along, beside) = match Crest::new(to_center, radius, n) {
                    Some(crest) => {
                        let wi = crest.sample(rng);
                        let along = to_center.dot(wi);
                        let beside = (to_center - along * wi).length();
                        if apart >= radius && (along <= 0.0 || beside > radius) {
                            return None;
                        }
                        (wi, crest.density(wi), along, beside)
                    }
                    None => {
                        let spread = spread(apart, radius);
                        let below = rng.random::<f64>() * spread; // 1 - cos of the polar angle
                        let (cos, sin) = (1.0 - below, (below * (2.0 - below)).sqrt());
                        let wi = around(to_center.normalize(), cos, sin, rng.random());
                        (wi, 1.0 / (2.0 * PI * spread), apart * cos, apart * sin)
                    }
                };
                let half_chord = ((radius - beside).max(0.0) * (radius + beside)).sqrt();
                // Seen from outside this is the nearer root, from inside the only one.
                let distance = if apart < radius {
                    along + half_chord
                } else {
                    (apart - radius) * (apart + radius) / (along + half_chord)
                };
                Some(LightSample {
                    wi,
                    distance,
                    density,
                    index,
                })
            }
            Extent::Mesh { first, ref area_sums } => {
                let total = *area_sums.last()?;
                let chosen = rng.random::<f64>() * total;
                let number = area_sums.partition_point(|&sum| sum <= chosen).min(area_sums.len() - 1) as u32;
                let index = first + number;
                let Shape::Triangle([a, b, c]) = shapes[index as usize] else {
                    return None;
                };
                // Uniform in a triangle: Osada et al., "Shape Distributions", 2002, section 4.2.
                let (root, across): (f64, f64) = (rng.random::<f64>().sqrt(), rng.random());
                let towards = a * (1.0 - root) + root * ((1.0 - across) * b + across * c) - point;
                let distance = towards.length();
                let wi = towards.try_normalize()?;
                let density = area_to_solid_angle(1.0 / total, distance, (b - a).cross(c - a), wi);
                density.is_finite().then_some(LightSample {
                    wi,
                    distance,
                    density,
                    index,
                })
            }
        }
    }

    /// Density of [`sample`](Self::sample) on a surface of normal `n`, sr⁻¹, at the point where a ray first hits the emitter: on
    /// its shape `shape`, at `distance`.
    pub fn density(&self, ray: &Ray, n: DVec3, shape: &Shape, distance: f64) -> f64 {
        let crest = match self.extent {
            Extent::Sphere { center, radius, .. } => Crest::new(center - ray.origin, radius, n),
            Extent::Mesh { .. } => None,
        };
        match crest {
            Some(crest) => crest.density(ray.direction),
            None => self.even(ray, shape, distance),
        }
    }

    /// The same without regard to the horizon: uniform in a sphere's cone, or over all directions from inside it.
    pub fn even(&self, ray: &Ray, shape: &Shape, distance: f64) -> f64 {
        match (&self.extent, shape) {
            (&Extent::Sphere { center, radius, .. }, _) => {
                1.0 / (2.0 * PI * spread(center.distance(ray.origin), radius))
            }
            (Extent::Mesh { area_sums, .. }, &Shape::Triangle([a, b, c])) => {
                let total = area_sums.last().copied().unwrap_or(f64::INFINITY);
                area_to_solid_angle(1.0 / total, distance, (b - a).cross(c - a), ray.direction)
            }
            (Extent::Mesh { .. }, Shape::Sphere { .. }) => 0.0,
        }
    }
}

/// `1 - cos` of the half-angle that a sphere of this radius subtends at distance `apart` from its centre, without cancellation
/// for small spheres; 2, the whole sphere of directions, from inside.
fn spread(apart: f64, radius: f64) -> f64 {
    if apart < radius {
        return 2.0;
    }
    let sin = radius / apart;
    let cos = ((apart - radius) * (apart + radius)).sqrt() / apart;
    sin * sin / (1.0 + cos)
}

/// Converts an area density to solid angle: times distance² / |cos| at the emitter. Infinite when seen edge-on.
fn area_to_solid_angle(density: f64, distance: f64, normal: DVec3, wi: DVec3) -> f64 {
    density * distance * distance / normal.normalize().dot(wi).abs()
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_pcg::Pcg64;

    use super::*;

    fn sphere(center: DVec3, radius: f64) -> ([Shape; 1], Emitter) {
        let shapes = [Shape::Sphere { center, radius }];
        (shapes, Emitter::new(DVec3::ONE, 0, &shapes))
    }

    /// A sample's distance equals that of the ray's intersection with the sphere, from far away, from close by and from inside.
    #[test]
    fn samples_of_a_sphere_lie_on_it() {
        let mut rng = Pcg64::seed_from_u64(1);
        let n = DVec3::new(-0.8, 0.0, 0.6);
        for (apart, radius, n) in [
            (1e6, 1.0, DVec3::Z),
            (3.0, 1.0, DVec3::Z),
            (3.0, 1.0, n),
            (1.0001, 1.0, DVec3::Z),
            (0.5, 1.0, n),
            (0.0, 2.0, n),
        ] {
            let center = DVec3::new(0.6, 0.0, 0.8) * apart;
            let (shapes, emitter) = sphere(center, radius);
            for _ in 0..1000 {
                let Some(sample) = emitter.sample(DVec3::ZERO, n, &shapes, &mut rng) else {
                    assert!(n.dot(center).abs() < radius && apart > radius);
                    continue;
                };
                let radial = (sample.distance * sample.wi).distance(center);
                assert!((radial / radius - 1.0).abs() < 1e-8, "{apart} {radius}: {radial}");
                let ray = Ray {
                    origin: DVec3::ZERO,
                    direction: sample.wi,
                };
                assert_eq!(emitter.density(&ray, n, &shapes[0], sample.distance), sample.density);
            }
        }
    }

    #[test]
    fn the_cone_of_a_tiny_sphere_has_the_area_of_its_disc() {
        let (shapes, emitter) = sphere(DVec3::Z * 1e7, 1.0);
        let sample = emitter
            .sample(DVec3::ZERO, DVec3::Z, &shapes, &mut Pcg64::seed_from_u64(2))
            .unwrap();
        assert!((1.0 / sample.density / (PI * 1e-14) - 1.0).abs() < 1e-12);
    }

    /// The mean of 1 / density over samples of a closed surface, each counted once for either side: a cube around the point
    /// covers 4 pi steradians exactly once.
    #[test]
    fn samples_of_a_cube_cover_the_sphere_of_directions() {
        let corner = |i: u32| DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2)) * 2.0 - 1.0;
        let quads = [
            [0, 1, 3, 2],
            [4, 5, 7, 6],
            [0, 1, 5, 4],
            [2, 3, 7, 6],
            [0, 2, 6, 4],
            [1, 3, 7, 5],
        ];
        let shapes: Vec<Shape> = quads
            .iter()
            .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]])
            .map(|corners| Shape::Triangle(corners.map(corner)))
            .collect();
        let emitter = Emitter::new(DVec3::ONE, 0, &shapes);
        let point = DVec3::new(0.2, -0.1, 0.3);
        let mut rng = Pcg64::seed_from_u64(4);
        let (mut sum, mut squares) = (0.0, 0.0);
        let count = 50_000;
        for _ in 0..count {
            let solid_angle = 1.0 / emitter.sample(point, DVec3::Z, &shapes, &mut rng).unwrap().density;
            sum += solid_angle;
            squares += solid_angle * solid_angle;
        }
        let mean = sum / f64::from(count);
        let deviation = ((squares / f64::from(count) - mean * mean) / f64::from(count)).sqrt();
        assert!((mean - 4.0 * PI).abs() < 4.0 * deviation, "{mean} +- {deviation}");
        assert!(deviation < 0.05);
    }
}
