//! Camera rays: from a point of the film to a ray, in the coordinates of the packets.

use super::narrow::narrow;
use super::space::Space;
use crate::lane::Lane;
use crate::math::Vec3;
use crate::scene::{Camera, FilmSize, Fov};

/// Camera rays start at 0, or on a lens around 0. The direction through the point `(x, y)` of the film, in pixels, is
/// `corner + x right + y down`.
#[derive(Clone, Copy, Debug)]
pub struct CameraRays {
    /// Direction to the top left corner.
    pub corner: [f32; 3],
    /// One pixel to the right.
    pub right: [f32; 3],
    /// One pixel down.
    pub down: [f32; 3],
    /// Vectors from the lens center to its right and lower rim; 0 for a pinhole.
    pub lens: [[f32; 3]; 2],
    /// Distance of the focal plane; 1 for a pinhole.
    pub focus: f32,
}

impl CameraRays {
    /// Unit directions through points of the film, in pixels from the top left corner.
    #[inline(always)]
    pub fn direction<L: Lane>(&self, x: L, y: L) -> Vec3<L> {
        let along_row = Vec3::splat(self.right).mul_add(x, Vec3::splat(self.corner));
        Vec3::splat(self.down).mul_add(y, along_row).normalize()
    }

    /// Origins on the lens, at the point `(a, b)` of its unit disk, and unit directions through the point `(x, y)` of the film.
    ///
    /// A ray through any lens point crosses the focal plane where the ray through the lens center does. For a pinhole the origin
    /// is 0 and the direction has the same bits as [`Self::direction`].
    #[inline(always)]
    pub fn through_lens<L: Lane>(&self, (x, y): (L, L), (a, b): (L, L)) -> (Vec3<L>, Vec3<L>) {
        let along_row = Vec3::splat(self.right).mul_add(x, Vec3::splat(self.corner));
        let film = Vec3::splat(self.down).mul_add(y, along_row);
        let origin = Vec3::splat(self.lens[1]).mul_add(b, Vec3::splat(self.lens[0]) * a);
        (origin, (film * L::splat(self.focus) - origin).normalize())
    }

    pub fn of(camera: &Camera, FilmSize { width, height }: FilmSize, space: &Space) -> Self {
        let (w, h) = (f64::from(width), f64::from(height));
        let forward = (camera.target - camera.origin).normalize();
        let right = forward.cross(camera.up).normalize();
        let down = forward.cross(right);
        // Pixels are square, so one side length is enough.
        let pixel = match camera.fov {
            Fov::X(degrees) => 2.0 * (degrees.to_radians() / 2.0).tan() / w,
            Fov::Y(degrees) => 2.0 * (degrees.to_radians() / 2.0).tan() / h,
        };
        let corner = forward - (right * w + down * h) * (pixel / 2.0);
        Self {
            corner: narrow(corner),
            right: narrow(right * pixel),
            down: narrow(down * pixel),
            lens: camera.lens.map_or([[0.0; 3]; 2], |lens| {
                [right * lens.radius, down * lens.radius].map(|axis| narrow(space.vector(axis)))
            }),
            focus: camera.lens.map_or(1.0, |lens| space.length(lens.focus) as f32),
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::sampling::warp;
    use crate::scene::Lens;

    /// Rays through all points of the lens cross the focal plane where the ray through its center does.
    #[test]
    fn rays_through_a_lens_meet_in_the_plane_in_focus() {
        let camera = Camera {
            origin: DVec3::new(1.0, 2.0, 3.0),
            target: DVec3::new(-1.0, 1.5, -4.0),
            up: DVec3::Y,
            fov: Fov::X(50.0),
            lens: Some(Lens {
                radius: 0.3,
                focus: 5.0,
            }),
        };
        let film = FilmSize { width: 30, height: 20 };
        let rays = CameraRays::of(&camera, film, &Space::UNIT);
        let forward = (camera.target - camera.origin).normalize();
        let wide = |v: Vec3<f32>| DVec3::new(v.x.into(), v.y.into(), v.z.into());
        for (x, y) in [(0.0, 0.0), (15.0, 10.0), (29.5, 3.0)] {
            let middle = wide(rays.direction::<f32>(x, y));
            let sharp = middle * (5.0 / middle.dot(forward));
            for (u, v) in [(0.0, 0.0), (0.99, 0.3), (0.2, 0.8), (0.5, 0.5)] {
                let (origin, direction) = rays.through_lens((x, y), warp::disk(u, v));
                let (origin, direction) = (wide(origin), wide(direction));
                assert!(origin.length() < 0.3 + 1e-6 && origin.dot(forward).abs() < 1e-6);
                let along = (5.0 - origin.dot(forward)) / direction.dot(forward);
                assert!((origin + along * direction - sharp).length() < 1e-5, "{x} {y} {u} {v}");
            }
        }
    }
}
