//! Ray-triangle intersection.

use super::Ray;
use crate::lane::{Lane, Mask};
use crate::math::Vec3;

/// Barycentric threshold for hits near an edge: four times Embree's tolerance.
pub const EDGE: f32 = 4.0 * f32::EPSILON;

/// A triangle, the same for all lanes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Triangle {
    /// Its corners.
    pub corners: [[f32; 3]; 3],
    /// `(v1 - v0) x (v2 - v0)`: normal to it, twice its area long.
    pub normal: [f32; 3],
}

fn minus(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn cross(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// Twice the volume spanned by an edge, relative to the ray's origin, and the ray's direction. The sign tells on which side of the
/// edge the ray passes. Reversing the edge flips the sign and changes nothing else, to the last bit, so two triangles with a common
/// edge leave no gap.
#[inline(always)]
fn side<L: Lane>(from: Vec3<L>, to: Vec3<L>, direction: Vec3<L>) -> L {
    edge(from, to).dot(direction)
}

/// Twice `from x to`: a normal of the plane through the origin and an edge. Its length is four times the area of the triangle that
/// they span.
#[inline(always)]
fn edge<L: Lane>(from: Vec3<L>, to: Vec3<L>) -> Vec3<L> {
    let (sum, edge) = (from + to, to - from);
    Vec3::new(
        sum.y * edge.z - sum.z * edge.y,
        sum.z * edge.x - sum.x * edge.z,
        sum.x * edge.y - sum.y * edge.x,
    )
}

/// Intersections of rays with a triangle.
#[derive(Clone, Copy, Debug)]
pub struct Meeting<L: Lane> {
    /// Lanes that hit it, between 0 and `tfar`.
    pub found: L::Mask,
    /// Distance in lengths of the direction.
    pub t: L,
    sides: [L; 3],
}

impl<L: Lane> Meeting<L> {
    /// The barycentric coordinates of the second and the third corner. Separate, because they cost a division that few callers
    /// require.
    #[inline(always)]
    pub fn barycentrics(&self) -> (L, L) {
        let [u, v, w] = self.sides;
        let scale = L::one() / (u + v + w);
        (u * scale, v * scale)
    }

    /// Whether the smallest barycentric coordinate of a hit is at most [`EDGE`]. Needs no division: the sides of a hit have one
    /// sign, so the smallest magnitude is whichever of `min` and `-max` is nonnegative.
    #[inline(always)]
    pub fn next_to_edge(&self) -> L::Mask {
        let [u, v, w] = self.sides;
        let least = u.min(v).min(w).max(-u.max(v).max(w));
        least.le((u + v + w).abs() * L::splat(EDGE))
    }
}

/// A triangle prepared for rays from the origin: everything that depends only on the triangle is precomputed. Results have the same
/// bits as [`Triangle::intersect`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FromOrigin {
    /// Normals of the planes through the origin and an edge.
    pub sides: [[f32; 3]; 3],
    normal: [f32; 3],
    /// `dot(normal, corner)`. For a ray that hits the triangle, no dot product with a side has the opposite sign.
    pub offset: f32,
}

impl FromOrigin {
    /// Intersects rays from the origin, two-sided, edges included.
    #[inline(always)]
    pub fn intersect<L: Lane>(&self, direction: Vec3<L>, tfar: L) -> Meeting<L> {
        let [u, v, w] = self.sides;
        let sides = [
            Vec3::splat(u).dot(direction),
            Vec3::splat(v).dot(direction),
            Vec3::splat(w).dot(direction),
        ];
        meeting(sides, L::splat(self.offset), Vec3::splat(self.normal), direction, tfar)
    }
}

#[inline(always)]
fn meeting<L: Lane>([u, v, w]: [L; 3], offset: L, normal: Vec3<L>, direction: Vec3<L>, tfar: L) -> Meeting<L> {
    let zero = L::zero();
    // All nonnegative, or all nonpositive.
    let inside = u.min(v).min(w).ge(zero) | u.max(v).max(w).le(zero);
    let sides = [u, v, w];
    if inside.none() {
        return Meeting {
            found: inside,
            t: tfar,
            sides,
        };
    }
    let t = offset / normal.dot(direction);
    Meeting {
        found: inside & t.ge(zero) & t.le(tfar),
        t,
        sides,
    }
}

impl Triangle {
    /// Creates a triangle from its corners.
    pub fn new(corners: [[f32; 3]; 3]) -> Self {
        let [a, b, c] = corners;
        Self {
            corners,
            normal: cross(minus(b, a), minus(c, a)),
        }
    }

    /// Intersects rays, two-sided, edges included.
    #[inline(always)]
    pub fn intersect<L: Lane>(&self, ray: &Ray<L>) -> Meeting<L> {
        let [a, b, c] = self.corners;
        let (a, b, c) = (
            Vec3::splat(a) - ray.origin,
            Vec3::splat(b) - ray.origin,
            Vec3::splat(c) - ray.origin,
        );
        let sides = [
            side(c, a, ray.direction),
            side(a, b, ray.direction),
            side(b, c, ray.direction),
        ];
        let normal = Vec3::splat(self.normal);
        meeting(sides, normal.dot(a), normal, ray.direction, ray.tfar)
    }

    /// Prepares the triangle for rays from the origin.
    pub fn from_origin(&self) -> FromOrigin {
        let [a, b, c] = self.corners.map(Vec3::<f32>::splat);
        let normal = Vec3::splat(self.normal);
        FromOrigin {
            sides: [edge(c, a), edge(a, b), edge(b, c)].map(|side| side.lane(0)),
            normal: self.normal,
            offset: normal.dot(a),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lane::Word;
    use crate::shape::NO_SKIP_ID;

    fn ray(origin: [f32; 3], direction: [f32; 3]) -> Ray<f32> {
        Ray {
            origin: Vec3::splat(origin),
            direction: Vec3::splat(direction),
            tfar: f32::INFINITY,
            skip_id: Word(NO_SKIP_ID),
        }
    }

    #[test]
    fn barycentrics_and_distance_are_those_of_the_point_aimed_at() {
        let triangle = Triangle::new([[1.0, 0.0, 5.0], [4.0, 1.0, 6.0], [2.0, 3.0, 4.0]]);
        let [a, b, c] = triangle.corners;
        for (u, v) in [(0.2, 0.3), (0.7, 0.1), (0.05, 0.9)] {
            let skip_id: [f32; 3] = std::array::from_fn(|k| (1.0 - u - v) * a[k] + u * b[k] + v * c[k]);
            let origin = [0.3, -0.2, 0.1];
            let met = triangle.intersect(&ray(origin, minus(skip_id, origin)));
            assert!(met.found && (met.t - 1.0).abs() < 1e-6, "{met:?}");
            let (met_u, met_v) = met.barycentrics();
            assert!(
                (met_u - u).abs() < 1e-5 && (met_v - v).abs() < 1e-5,
                "{met:?}, not {u}, {v}"
            );
        }
        assert!(!triangle.intersect(&ray([0.0; 3], [-1.0, 0.0, 0.0])).found);
    }

    #[test]
    fn an_edge_in_common_leaves_no_gap() {
        let (p, q) = ([0.1, 0.7, 3.0], [0.9, -0.3, 3.3]);
        let left = Triangle::new([p, q, [-1.0, -0.5, 3.1]]);
        let right = Triangle::new([q, p, [1.5, 1.0, 2.9]]);
        for i in 0..200_000 {
            let s = i as f32 / 200_000.0;
            let skip_id: [f32; 3] = std::array::from_fn(|k| p[k] + s * (q[k] - p[k]));
            let ray = ray([0.0; 3], skip_id);
            assert!(
                left.intersect(&ray).found || right.intersect(&ray).found,
                "a ray at {s} of the edge slips through"
            );
        }
    }
}
