//! Triangulates polygons. If a fan from the first corner covers the polygon, as for every convex one, the fan is used;
//! otherwise the crate `earcut` clips ears in the best-fitting plane.

use earcut::Earcut;
use glam::DVec3;

/// Relative rounding error allowed for areas.
const ROUNDING: f64 = 1e-9;

/// Maximum number of corners for ear clipping, whose time is quadratic.
const MOST: usize = 1 << 16;

/// Triangulates polygons, and counts those whose edges intersect.
pub struct Polygons {
    earcut: Earcut<f64>,
    /// Corners relative to the first, in units of the polygon's extent.
    points: Vec<DVec3>,
    flat: Vec<[f64; 2]>,
    indices: Vec<u32>,
    /// Number of self-intersecting polygons, and the place of the first.
    crossing: Option<(usize, usize)>,
}

impl Default for Polygons {
    fn default() -> Self {
        Self {
            earcut: Earcut::new(),
            points: Vec::new(),
            flat: Vec::new(),
            indices: Vec::new(),
            crossing: None,
        }
    }
}

impl Polygons {
    /// The triangles of the polygon with these corners, in the same winding: three corner indices each, from 0. `place` is its
    /// line or number, for [`note`](Self::note).
    pub fn triangles(
        &mut self,
        corners: impl ExactSizeIterator<Item = DVec3>,
        place: usize,
    ) -> impl Iterator<Item = [u32; 3]> {
        let count = corners.len() as u32;
        if count == 3 || self.fan_covers(corners) || !self.cut_ears(place) {
            self.indices.clear();
            self.indices.extend((2..count).flat_map(|i| [0, i - 1, i]));
        }
        self.indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]])
    }

    /// Fills `points`. Returns whether the fan from the first corner covers the polygon exactly once: no triangle of it faces
    /// away from the normal of the whole, and together they go round at most once.
    fn fan_covers(&mut self, corners: impl Iterator<Item = DVec3>) -> bool {
        self.points.clear();
        self.points.extend(corners);
        let Some(&first) = self.points.first() else { return true };
        let points = self.points.iter_mut();
        points.for_each(|point| *point -= first);
        let extent = self.points.iter().map(|p| p.abs().max_element()).fold(0.0, f64::max);
        // Non-finite values are reported elsewhere, and a point has no triangles.
        if !extent.is_finite() || extent == 0.0 {
            return true;
        }
        let points = self.points.iter_mut();
        points.for_each(|point| *point /= extent);

        // Twice the area vector of the polygon (Newell), as the sum over the fan.
        let fan = || self.points[1..].windows(2).map(|pair| (pair[0], pair[1]));
        let normal: DVec3 = fan().map(|(a, b)| a.cross(b)).sum();
        let least = -ROUNDING * normal.length_squared();
        if fan().any(|(a, b)| a.cross(b).dot(normal) < least) {
            return false;
        }
        // Two triangles cannot go round the full circle.
        let sweep = || fan().map(|(a, b)| a.angle_between(b)).filter(|angle| angle.is_finite());
        normal != DVec3::ZERO && (self.points.len() < 5 || sweep().sum::<f64>() <= std::f64::consts::TAU + 1e-6)
    }

    /// Clips ears into `indices`. Returns `false` if there are no ears, or too many corners.
    fn cut_ears(&mut self, place: usize) -> bool {
        if self.points.len() > MOST {
            self.guessed(place);
            return false;
        }
        let fan = || self.points[1..].windows(2).map(|pair| pair[0].cross(pair[1]));
        let mut normal: DVec3 = fan().sum();
        if normal.length() < ROUNDING {
            // The halves of a bow tie cancel, but any of its triangles has its plane.
            normal = fan()
                .max_by(|a, b| a.length_squared().total_cmp(&b.length_squared()))
                .unwrap_or_default();
        }
        let Some(normal) = normal.try_normalize() else {
            return false;
        };
        let (u, v) = normal.any_orthonormal_pair();
        self.flat.clear();
        self.flat.extend(self.points.iter().map(|p| [p.dot(u), p.dot(v)]));
        self.earcut.earcut_slice::<u32>(&self.flat, &[], &mut self.indices);

        let twice = |[a, b, c]: [[f64; 2]; 3]| (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        let mut covered = 0.0;
        for t in self.indices.chunks_exact_mut(3) {
            let area = twice([t[0], t[1], t[2]].map(|i| self.flat[i as usize]));
            if area < 0.0 {
                t.swap(1, 2);
            }
            covered += area.abs();
        }
        let whole = self
            .flat
            .windows(2)
            .map(|pair| twice([self.flat[0], pair[0], pair[1]]))
            .sum::<f64>();
        // The triangles of a simple polygon sum to its area.
        if (covered - whole).abs() > 1e-6 {
            self.guessed(place);
        }
        !self.indices.is_empty()
    }

    fn guessed(&mut self, place: usize) {
        let (count, first) = self.crossing.unwrap_or((0, place));
        self.crossing = Some((count + 1, first));
    }

    /// A note for the user if polygons intersect themselves; `places` is the kind of their places: lines or faces.
    pub fn note(&self, places: &str) -> Option<String> {
        let (count, first) = self.crossing?;
        let (faces, verb, their) = match count {
            1 => ("face", "crosses itself or has", "its"),
            _ => ("faces", "cross themselves or have", "their"),
        };
        Some(format!(
            "{count} {faces} {verb} more than {MOST} corners (the first is {places} {first}): {their} triangles are a guess"
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Areas of the triangles along `normal`, and whether there was a note.
    fn areas(points: &[DVec3], normal: DVec3) -> (Vec<f64>, bool) {
        let mut polygons = Polygons::default();
        let triangles: Vec<_> = polygons.triangles(points.iter().copied(), 7).collect();
        let area = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|i| points[i as usize]);
            0.5 * (b - a).cross(c - a).dot(normal)
        };
        (triangles.iter().map(area).collect(), polygons.note("line").is_some())
    }

    fn plane(points: &[[f64; 2]]) -> Vec<DVec3> {
        points.iter().map(|p| DVec3::new(p[0], p[1], 0.0)).collect()
    }

    /// From each corner in turn, in both directions: all triangles have the winding of the polygon and sum to its area.
    fn covers(points: &[[f64; 2]], area: f64) {
        let points = plane(points);
        for start in 0..points.len() {
            let mut turned = points.clone();
            turned.rotate_left(start);
            for side in [1.0, -1.0] {
                let (areas, noted) = areas(&turned, DVec3::Z * side);
                assert!(areas.iter().all(|&area| area > -1e-12), "{turned:?}: {areas:?}");
                assert!(
                    (areas.iter().sum::<f64>() - area).abs() < 1e-9 * area,
                    "{turned:?}: {areas:?}"
                );
                assert!(!noted, "{turned:?}");
                turned.reverse();
            }
        }
    }

    #[test]
    fn polygons_are_covered_once_from_whichever_corner_they_begin() {
        covers(
            &[
                [0., 0.],
                [3., 0.],
                [3., 3.],
                [2., 3.],
                [2., 1.],
                [1., 1.],
                [1., 3.],
                [0., 3.],
            ],
            7.0,
        ); // U
        covers(&[[0., 0.], [4., -1.], [1., 0.], [4., 1.]], 1.0); // dart
        covers(&[[0., 0.], [2., 0.], [2., 1.], [1., 1.], [1., 2.], [0., 2.]], 3.0); // L
        covers(
            &[
                [0., 0.],
                [1., 0.],
                [2., 0.],
                [2., 2.],
                [2., 2.],
                [1., 2.],
                [0., 2.],
                [0., 1.],
            ],
            4.0,
        ); // collinear, repeated
        covers(
            &[
                [0., 0.],
                [4., 0.],
                [4., 1.],
                [1., 1.],
                [1., 1.],
                [1., 2.],
                [4., 2.],
                [4., 3.],
                [0., 3.],
            ],
            9.0,
        );
        // A square with a square hole, connected to the outside by a bridge.
        covers(
            &[
                [0., 0.],
                [4., 0.],
                [4., 4.],
                [0., 4.],
                [0., 0.],
                [1., 1.],
                [1., 3.],
                [3., 3.],
                [3., 1.],
                [1., 1.],
            ],
            12.0,
        );
    }

    #[test]
    fn a_convex_polygon_is_a_fan_from_its_first_corner() {
        for n in 4..40_u32 {
            let corner = |i: u32| f64::from(i) * std::f64::consts::TAU / f64::from(n);
            let points: Vec<_> = (0..n)
                .map(|i| DVec3::new(corner(i).cos(), corner(i).sin(), 2.0 * corner(i).cos()))
                .collect();
            let mut polygons = Polygons::default();
            let fan: Vec<_> = (2..n).map(|i| [0, i - 1, i]).collect();
            assert!(polygons.triangles(points.into_iter(), 0).eq(fan), "{n}");
        }
    }

    #[test]
    fn any_plane_and_any_size_will_do() {
        let dart = plane(&[[4., -1.], [1., 0.], [4., 1.], [0., 0.]]);
        for scale in [1e-30, 1e-6, 1.0, 1e30] {
            for axis in [DVec3::X, DVec3::Y, DVec3::new(0.3, -0.8, 0.2).normalize(), DVec3::NEG_Z] {
                let turn = glam::DQuat::from_rotation_arc(DVec3::Z, axis);
                let moved: Vec<_> = dart
                    .iter()
                    .map(|&p| turn * p * scale + DVec3::splat(3.0 * scale))
                    .collect();
                let (areas, noted) = areas(&moved, axis);
                let wrong = areas.iter().map(|area| area / scale / scale).sum::<f64>() - 1.0;
                assert!(wrong.abs() < 1e-9 && !noted, "{scale} {axis}: {areas:?}");
            }
        }
    }

    #[test]
    fn polygons_that_cross_themselves_are_noted() {
        let bow_tie = plane(&[[0., 0.], [1., 1.], [1., 0.], [0., 1.]]);
        let uneven = plane(&[[0., 0.], [1., 1.], [1., 0.], [0., 2.]]);
        let star: Vec<_> = [0, 2, 4, 1, 3]
            .map(|i| f64::from(i) * std::f64::consts::TAU / 5.0)
            .map(|angle| [angle.cos(), angle.sin()])
            .to_vec();
        for points in [bow_tie, uneven, plane(&star)] {
            assert!(areas(&points, DVec3::Z).1, "{points:?}");
        }
    }

    #[test]
    fn nonsense_gives_triangles_all_the_same() {
        let nan = vec![DVec3::ZERO, DVec3::X, DVec3::NAN, DVec3::Y, DVec3::Z];
        let line = plane(&[[0., 0.], [2., 0.], [1., 0.], [3., 0.], [0.5, 0.]]);
        for points in [
            nan,
            line,
            vec![DVec3::ONE; 6],
            vec![],
            vec![DVec3::X],
            vec![DVec3::X, DVec3::Y],
        ] {
            let mut polygons = Polygons::default();
            let count = polygons.triangles(points.iter().copied(), 0).count();
            assert!(count <= points.len().saturating_sub(2), "{points:?}");
        }
    }
}
