//! The coordinates of packets: camera at 0, lengths in units that suit `f32` and Embree.
//!
//! Lengths are multiplied by a power of two, so that the farthest shape is 2^28 to 2^29 away. This changes only exponents, so no
//! digit of a picture depends on the scene's unit. Embree 4.4.0 needs it: its triangle test sets barycentric coordinates to 0 if
//! twice the projected area is below 1e-18, i.e. for edges of 1e-9 units, whatever the size of the scene. With this scale it
//! happens for edges of 2^-58 of the farthest distance. Fourth powers of lengths still fit into `f32`.

use glam::DVec3;

use super::narrow::narrow;
use crate::scene::Scene;

/// Distance of the farthest shape, as an exponent of two.
const FARTHEST: i32 = 28;

/// Bound on the exponent of the scale; products still fit into `f64`.
const EXPONENTS: i32 = 500;

/// Transforms scene coordinates to packet coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Space {
    origin: DVec3,
    /// A power of two.
    scale: f64,
}

impl Space {
    /// Camera at the origin, no scaling.
    #[cfg(test)]
    pub const UNIT: Self = Self {
        origin: DVec3::ZERO,
        scale: 1.0,
    };

    /// The transform for a scene.
    pub fn of(scene: &Scene) -> Self {
        let origin = scene.camera().origin;
        let of_spheres = scene
            .spheres()
            .iter()
            .map(|s| (s.center - origin).abs().max_element() + s.radius);
        let corners = scene
            .meshes()
            .iter()
            .flat_map(|mesh| mesh.triangles.iter().flatten().map(|&i| mesh.vertices[i as usize]));
        let of_corners = corners.map(|corner| (corner - origin).abs().max_element());
        let of_lights = scene.lights().iter().filter_map(|light| light.position());
        let of_lights = of_lights.map(|position| (position - origin).abs().max_element());
        let reach = of_spheres.chain(of_corners).chain(of_lights).fold(0.0, f64::max);
        let scale = if reach > 0.0 {
            let exponent = reach.log2().floor() as i32;
            2.0_f64.powi((FARTHEST - exponent).clamp(-EXPONENTS, EXPONENTS))
        } else {
            1.0
        };
        Self { origin, scale }
    }

    /// Transforms a point.
    pub fn point(&self, p: DVec3) -> [f32; 3] {
        narrow(self.vector(p - self.origin))
    }

    /// Transforms a vector, or a position relative to the camera.
    pub fn vector(&self, v: DVec3) -> DVec3 {
        v * self.scale
    }

    /// Vector from the camera to a point, in double precision.
    pub fn relative(&self, p: DVec3) -> DVec3 {
        self.vector(p - self.origin)
    }

    /// Transforms a length.
    pub fn length(&self, x: f64) -> f64 {
        x * self.scale
    }

    /// Transforms an area.
    pub fn area(&self, x: f64) -> f64 {
        x * self.scale * self.scale
    }

    /// No two shapes are this far apart: coordinates are below 2^29, so a diagonal is below 2^31.
    pub const BEYOND: f32 = (1_u64 << (FARTHEST + 3)) as f32;

    /// The reference distance of [`Self::at_unit`].
    pub const UNIT_DISTANCE: f32 = (1_u64 << FARTHEST) as f32;

    /// Irradiance from a light of this intensity at the distance [`Self::UNIT_DISTANCE`], on a facing surface. Its digits do not
    /// depend on the unit of length. If the irradiance leaves the range of `f32`, so does the light in the picture.
    pub fn at_unit(&self, intensity: DVec3) -> DVec3 {
        let distance = f64::from(Self::UNIT_DISTANCE) / self.scale;
        intensity / (distance * distance)
    }

    /// Transforms a length back to the units of the scene.
    pub fn in_scene(&self, x: f32) -> f32 {
        (f64::from(x) / self.scale) as f32
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    fn scene(scale: f64) -> Scene {
        let text = format!(
            "[camera]\norigin = [{}, 0, 0]\ntarget = [0, 0, 0]\nup = [0, 1, 0]\nfov_x = 40\n[film]\nwidth = 4\nheight = 4\n\
             [[spheres]]\ncenter = [0, {}, 0]\nradius = {}\nemission = [1, 1, 1]\n",
            3.0 * scale,
            5.0 * scale,
            0.1 * scale
        );
        Scene::parse(&text, Path::new("s.toml")).unwrap()
    }

    /// The transform changes no digits, and every unit of length gives the same numbers.
    #[test]
    fn units_of_length_leave_no_trace() {
        let base = Space::of(&scene(1.0));
        assert_eq!(base.scale.log2().fract(), 0.0);
        let p = DVec3::new(0.3, -0.7, 1.1);
        for exponent in [-100, -30, -1, 1, 30, 60] {
            let unit = 2.0_f64.powi(exponent);
            let other = Space::of(&scene(unit));
            assert_eq!(other.point(p * unit), base.point(p), "2^{exponent}");
            assert_eq!(other.area(0.3 * unit * unit), base.area(0.3));
            assert_eq!(other.in_scene(7.0), base.in_scene(7.0) * unit as f32);
        }
    }
}
