//! The camera: a pinhole, or a thin lens.

use glam::DVec3;
use rand::{Rng, RngExt};

use super::geometry::Ray;
use crate::scene::{Camera, FilmSize, Fov, Lens};

/// A camera for a film of one size.
#[derive(Clone, Copy, Debug)]
pub struct Pinhole {
    origin: DVec3,
    forward: DVec3,
    /// From the centre of the picture to its right and upper edge, on a plane at distance 1.
    right: DVec3,
    up: DVec3,
    width: f64,
    height: f64,
    lens: Option<Lens>,
}

impl Pinhole {
    /// Resolves the field of view for a film: pixels are square, whichever side the angle is for.
    pub fn new(camera: &Camera, film: FilmSize) -> Self {
        let (width, height) = (f64::from(film.width), f64::from(film.height));
        let forward = (camera.target - camera.origin).normalize();
        let right = forward.cross(camera.up).normalize();
        let half = |degrees: f64| (0.5 * degrees.to_radians()).tan();
        let (across, along) = match camera.fov {
            Fov::X(degrees) => (half(degrees), half(degrees) * height / width),
            Fov::Y(degrees) => (half(degrees) * width / height, half(degrees)),
        };
        let up = along * right.cross(forward);
        Self {
            origin: camera.origin,
            forward,
            right: across * right,
            up,
            width,
            height,
            lens: camera.lens,
        }
    }

    /// A ray through a uniform random point of the pixel whose upper left corner is `(x, y)` and, if there is a lens, through a
    /// uniform random point on it (by rejection from its bounding square).
    pub fn sampled_ray(&self, x: f64, y: f64, rng: &mut impl Rng) -> Ray {
        let pinhole = self.ray(x + rng.random::<f64>(), y + rng.random::<f64>());
        let Some(Lens { radius, focus }) = self.lens else {
            return pinhole;
        };
        let sharp = self.origin + focus / pinhole.direction.dot(self.forward) * pinhole.direction;
        let [a, b] = loop {
            let point = [rng.random_range(-1.0..1.0), rng.random_range(-1.0..1.0)];
            if point[0] * point[0] + point[1] * point[1] <= 1.0 {
                break point;
            }
        };
        let origin = self.origin + radius * (a * self.right.normalize() + b * self.up.normalize());
        Ray {
            origin,
            direction: (sharp - origin).normalize(),
        }
    }

    /// The ray through a point of the film in pixels: `x` in `[0, width]` to the right, `y` in `[0, height]` down.
    pub fn ray(&self, x: f64, y: f64) -> Ray {
        let direction =
            self.forward + (2.0 * x / self.width - 1.0) * self.right + (1.0 - 2.0 * y / self.height) * self.up;
        Ray {
            origin: self.origin,
            direction: direction.normalize(),
        }
    }

    /// The position of a scene point on the film, in pixels as for [`ray`](Self::ray), inside or outside; `None` behind the
    /// camera.
    pub fn project(&self, point: DVec3) -> Option<[f64; 2]> {
        let away = point - self.origin;
        let depth = away.dot(self.forward);
        let along = |axis: DVec3| away.dot(axis) / (depth * axis.length_squared());
        let (x, y) = (along(self.right), along(self.up));
        (depth > 0.0).then_some([0.5 * (x + 1.0) * self.width, 0.5 * (1.0 - y) * self.height])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_and_middle_of_the_film() {
        let camera = Camera {
            origin: DVec3::new(1.0, 2.0, 3.0),
            target: DVec3::new(1.0, 2.0, 0.0),
            up: DVec3::Y,
            fov: Fov::X(90.0),
            lens: None,
        };
        let film = FilmSize { width: 4, height: 2 };
        let by_x = Pinhole::new(&camera, film);
        assert!((by_x.ray(2.0, 1.0).direction + DVec3::Z).length() < 1e-15);
        let top_left = DVec3::new(-1.0, 0.5, -1.0).normalize();
        assert!((by_x.ray(0.0, 0.0).direction - top_left).length() < 1e-15);
        let [x, y] = by_x
            .project(camera.origin + 7.0 * by_x.ray(3.5, 0.25).direction)
            .unwrap();
        assert!((x - 3.5).abs() < 1e-12 && (y - 0.25).abs() < 1e-12);
        assert!(by_x.project(camera.origin + DVec3::Z).is_none());
        let by_y = Pinhole::new(
            &Camera {
                fov: Fov::Y(2.0 * 0.5_f64.atan().to_degrees()),
                ..camera
            },
            film,
        );
        assert!((by_y.ray(0.0, 0.0).direction - top_left).length() < 1e-15);
    }
}
