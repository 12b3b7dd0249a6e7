//! Normals at the vertices.

use glam::DVec3;

use super::{NO_NORMAL, RawMesh, has_area};

/// A unit normal for each vertex: from the file, or an area-weighted average of the surrounding triangles.
///
/// Triangles whose winding disagrees with the normals of their corners are flipped. Surfaces are two-sided, so winding only
/// defines the side of the shading normals. This corrects files with wrong winding, and mirrored meshes.
pub fn smooth(raw: &mut RawMesh) -> Vec<DVec3> {
    let RawMesh {
        vertices,
        triangles,
        normals,
        ..
    } = raw;
    let points = |corners: &[u32; 3]| corners.map(|corner| vertices[corner as usize]);
    let twice_area = |corners: &[u32; 3]| {
        let [a, b, c] = points(corners);
        (b - a).cross(c - a)
    };

    // Vertices with their own normal do not need the sum, so it is accumulated in place.
    let mut normals = normals.take().unwrap_or_else(|| vec![NO_NORMAL; vertices.len()]);
    let given: Vec<bool> = normals.iter().map(|&given| unit(given).is_some()).collect();
    for corners in triangles.iter().filter(|corners| has_area(points(corners))) {
        let area = twice_area(corners);
        for &corner in corners.iter().filter(|&&corner| !given[corner as usize]) {
            normals[corner as usize] += area;
        }
    }
    let mut opposed = false;
    for normal in &mut normals {
        *normal = unit(*normal).unwrap_or(NO_NORMAL);
        opposed |= *normal == NO_NORMAL;
    }
    // A vertex between two opposite faces has no average: use the last of its faces.
    if opposed {
        for corners in triangles.iter().rev().filter(|corners| has_area(points(corners))) {
            for &corner in corners.iter() {
                let normal = &mut normals[corner as usize];
                if *normal == NO_NORMAL {
                    *normal = unit(twice_area(corners)).unwrap_or(NO_NORMAL);
                }
            }
        }
        normals
            .iter_mut()
            .filter(|n| **n == NO_NORMAL)
            .for_each(|n| *n = DVec3::Z);
    }

    for corners in triangles.iter_mut() {
        let around: DVec3 = corners.iter().map(|&corner| normals[corner as usize]).sum();
        if twice_area(corners).dot(around) < 0.0 {
            corners.swap(1, 2);
        }
    }
    normals
}

/// `v` normalized, unless it is zero. Scaled to about 1 first: squares of small areas would underflow.
fn unit(v: DVec3) -> Option<DVec3> {
    let largest = v.abs().max_element();
    (largest > 0.0 && largest.is_finite()).then(|| (v / largest).normalize())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two triangles on the ground and a wall of twice the area, all at vertex 0.
    fn corner() -> RawMesh {
        let vertices = [[0, 0, 0], [1, 0, 0], [0, 0, -1], [0, 4, -1]].map(|v| DVec3::from_array(v.map(f64::from)));
        RawMesh {
            vertices: vertices.to_vec(),
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            ..Default::default()
        }
    }

    #[test]
    fn the_mean_is_weighted_by_area() {
        let normals = smooth(&mut corner());
        // Areas 1/2 and 2, looking up and along x.
        assert!(
            (normals[0] - DVec3::new(4.0, 1.0, 0.0).normalize()).length() < 1e-15,
            "{}",
            normals[0]
        );
        assert_eq!(normals[1], DVec3::Y);
        assert_eq!(normals[3], DVec3::X);
    }

    #[test]
    fn given_normals_win_and_turn_the_winding() {
        let mut raw = corner();
        raw.normals = Some(vec![DVec3::NEG_Y * 3.0, DVec3::NEG_Y, DVec3::NEG_Y, DVec3::ZERO]);
        let normals = smooth(&mut raw);
        assert_eq!(normals[0], DVec3::NEG_Y);
        assert_eq!(normals[3], DVec3::X, "a zero normal is made good");
        assert_eq!(raw.triangles, [[0, 2, 1], [0, 2, 3]]);
    }

    #[test]
    fn a_vertex_without_triangles_has_some_unit_normal() {
        let mut raw = corner();
        raw.vertices.push(DVec3::ONE);
        assert_eq!(smooth(&mut raw)[4].length(), 1.0);
    }
}
