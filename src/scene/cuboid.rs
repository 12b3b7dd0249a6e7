//! Boxes: meshes of six faces.

use glam::{DMat3, DVec2, DVec3};

use super::{Mesh, Surface};

impl Mesh {
    /// An axis-aligned box with positive sides `size` around `center`, rotated about it by `turn`. Faces are wound
    /// counter-clockwise seen from outside. Each has the whole unit square as texture coordinates, upright on the four faces
    /// around y.
    pub fn cuboid(center: impl Into<DVec3>, size: impl Into<DVec3>, turn: DMat3, surface: impl Into<Surface>) -> Self {
        let (center, half) = (center.into(), size.into() / 2.0);
        // For each face its normal, and the right and up directions seen from outside.
        let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
        let faces = [(z, x, y), (x, -z, y), (-z, -x, y), (-x, z, y), (y, x, -z), (-y, x, z)];
        let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
        let corner = |(normal, right, up): (DVec3, DVec3, DVec3)| {
            corners.map(|(u, v)| center + turn * (half * (normal + u * right + v * up)))
        };
        let triangles = (0..6).flat_map(|face| [[0, 1, 2], [0, 2, 3]].map(|t| t.map(|i| 4 * face + i)));
        let unit = corners.map(|(u, v)| DVec2::new((u + 1.0) / 2.0, (v + 1.0) / 2.0));
        let mut mesh = Self::new(faces.into_iter().flat_map(corner), triangles.collect(), surface);
        mesh.uvs = Some(faces.iter().flat_map(|_| unit).collect());
        mesh
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By the divergence theorem the volume of a closed surface is the sum of `a.(b x c) / 6` over its triangles, positive for
    /// outward winding. The area of this box is 2 (6 + 8 + 12).
    #[test]
    fn a_box_is_closed_outward_and_of_its_size_however_it_is_turned() {
        for turn in [DMat3::IDENTITY, DMat3::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 0.7)] {
            let mesh = Mesh::cuboid([5.0, -1.0, 2.0], [2.0, 3.0, 4.0], turn, Surface::emission([1.0; 3]));
            let (mut volume, mut area) = (0.0, 0.0);
            for triangle in &mesh.triangles {
                let [a, b, c] = triangle.map(|corner| mesh.vertices[corner as usize]);
                volume += a.dot(b.cross(c)) / 6.0;
                area += (b - a).cross(c - a).length() / 2.0;
            }
            assert!(
                (volume - 24.0).abs() < 1e-12 && (area - 52.0).abs() < 1e-12,
                "{volume} {area}"
            );
        }
    }
}
