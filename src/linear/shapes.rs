//! The shapes of the brute-force list in columns, and the tests of [`super::cull`], one shape per lane.

use super::columns::Columns;
use super::cull::{Bounds, MARGIN, Plane, dot, length, norm1};
use crate::lane::{Bits, Lane, Mask};
use crate::math::Vec3;
use crate::shape::{BoundingSphere, FromOrigin, Triangle};

/// Precomputed data of all shapes for culling. An index `at` stands for a packet: as many shapes from there on as there are lanes.
#[derive(Clone, Debug, Default)]
pub struct Shapes {
    pub triangles: Columns<33>,
    pub balls: Columns<4>,
}

// Columns of triangles: a box, the corners, and the plane `dot(normal, p) = offset`.
const LOW: usize = 0;
const HIGH: usize = 3;
const CORNERS: usize = 6;
const NORMAL: usize = 15;
const OFFSET: usize = 18;
// Length of the normal.
const LENGTH: usize = 19;
// Upper bound on the corners' distance from the origin; margins scale with it.
const REACH: usize = 20;
// Skip id, as the bits of an `f32`.
const AIM: usize = 21;
// Data of `FromOrigin`, and the largest `norm1` of its sides.
const SIDES: usize = 22;
const SIGN: usize = 31;
const WIDEST: usize = 32;

// Columns of spheres.
const CENTER: usize = 0;
const RADIUS: usize = 3;

impl Shapes {
    /// Adds a triangle with its skip id.
    pub fn add(&mut self, triangle: &Triangle, from_origin: &FromOrigin, skip_id: u32) {
        let corners = triangle.corners;
        let mut all = [0.0; 33];
        for k in 0..3 {
            let [a, b, c] = corners.map(|corner| corner[k]);
            all[LOW + k] = a.min(b).min(c);
            all[HIGH + k] = a.max(b).max(c);
            all[NORMAL + k] = triangle.normal[k];
            for i in 0..3 {
                all[CORNERS + 3 * i + k] = corners[i][k];
                all[SIDES + 3 * i + k] = from_origin.sides[i][k];
            }
        }
        all[OFFSET] = dot(triangle.normal, corners[0]);
        all[LENGTH] = length(triangle.normal);
        all[REACH] = corners.map(norm1).into_iter().fold(0.0, f32::max);
        all[AIM] = f32::from_bits(skip_id);
        let offset = from_origin.offset;
        all[SIGN] = if offset == 0.0 { 0.0 } else { offset.signum() };
        all[WIDEST] = from_origin.sides.map(norm1).into_iter().fold(0.0, f32::max);
        self.triangles.push(all);
    }

    /// Sets the spheres.
    pub fn set_balls(&mut self, balls: &[BoundingSphere]) {
        self.balls = Columns::default();
        for &BoundingSphere {
            center: [x, y, z],
            radius,
        } in balls
        {
            self.balls.push([x, y, z, radius]);
        }
    }

    /// Centers and radii of a packet of spheres.
    pub fn ball<L: Lane>(&self, at: usize) -> (Vec3<L>, L) {
        (self.balls.get3(CENTER, at), self.balls.get(RADIUS, at))
    }

    /// The plane of a triangle, normal and offset.
    pub fn plane(&self, triangle: usize) -> ([f32; 3], f32) {
        let normal = self.triangles.get3::<f32>(NORMAL, triangle).lane(0);
        (normal, self.triangles.get(OFFSET, triangle))
    }

    /// Triangles with this skip id.
    pub fn skip_id<L: Lane>(&self, at: usize, name: u32) -> L::Mask {
        let skip_id: L = self.triangles.get(AIM, at);
        skip_id.to_bits().eq(L::Bits::splat(name))
    }

    /// Triangles whose bounding boxes are outside a box.
    pub fn outside<L: Lane>(&self, at: usize, bounds: &Bounds) -> L::Mask {
        bounds.apart::<L>(self.triangles.get3(LOW, at), self.triangles.get3(HIGH, at))
    }

    /// Triangles entirely behind a plane.
    pub fn behind<L: Lane>(&self, at: usize, plane: &Plane) -> L::Mask {
        let limit = plane.limit::<L>(self.triangles.get(REACH, at));
        let behind = |i: usize| {
            let corner: Vec3<L> = self.triangles.get3(CORNERS + 3 * i, at);
            corner.dot(Vec3::splat(plane.normal)).lt(limit)
        };
        let [a, b, c] = [behind(0), behind(1), behind(2)];
        mutate!(a & b & c, OneCornerBehind => a | b | c)
    }

    /// Triangles that no ray from the origin between these unit directions hits, because all such rays pass outside the same edge.
    pub fn apart<L: Lane>(&self, at: usize, corners: &[[f32; 3]; 4]) -> L::Mask {
        let sign: L = self.triangles.get(SIGN, at);
        // An edge that points at the origin has a short side, but its rounding error is as large as that of the others: the margin
        // scales with the longest side.
        let limit = L::splat(-MARGIN) * self.triangles.get(WIDEST, at);
        let mut apart = L::Mask::splat(false);
        for i in 0..3 {
            let side: Vec3<L> = self.triangles.get3(SIDES + 3 * i, at);
            let [a, b, c, d] = corners.map(|corner| (sign * side.dot(Vec3::splat(corner))).lt(limit));
            apart = apart | mutate!(a & b & c & d, OneCornerOutside => a | b | c | d);
        }
        apart
    }

    /// Triangles whose plane has the light and the points strictly on one side. `low` and `high` bound `dot(normal, p) - offset`
    /// over the points `p`.
    pub fn separated_by_plane<L: Lane>(&self, at: usize, light: &BoundingSphere, low: L, high: L) -> L::Mask {
        let (length, offset): (L, L) = (self.triangles.get(LENGTH, at), self.triangles.get(OFFSET, at));
        let center = self.triangles.get3::<L>(NORMAL, at).dot(Vec3::splat(light.center)) - offset;
        let radius = mutate!(light.radius, LightAsPoint => 0.0) * (1.0 + MARGIN);
        let size = length * L::splat(norm1(light.center)) + offset.abs();
        let reach = length * L::splat(radius) + L::splat(MARGIN) * size;
        (low.gt(L::zero()) & center.gt(reach)) | (high.lt(L::zero()) & center.lt(-reach))
    }

    /// Bounds of `dot(normal, p) - offset` over a box, with a margin for rounding.
    pub fn sides<L: Lane>(&self, at: usize, bounds: &Bounds) -> [L; 2] {
        let offset: L = self.triangles.get(OFFSET, at);
        let (mut low, mut high, mut slack) = (-offset, -offset, offset.abs());
        for k in 0..3 {
            let n: L = self.triangles.get(NORMAL + k, at);
            let (a, b) = (n * L::splat(bounds.low[k]), n * L::splat(bounds.high[k]));
            low = low + a.min(b);
            high = high + a.max(b);
            slack = slack + a.abs().max(b.abs());
        }
        let slack = L::splat(MARGIN) * slack;
        [low - slack, high + slack]
    }
}

/// Spheres outside a box.
pub fn balls_outside<L: Lane>((center, radius): (Vec3<L>, L), bounds: &Bounds) -> L::Mask {
    let reach = radius * L::splat(1.0 + MARGIN);
    let reach = Vec3::new(reach, reach, reach);
    bounds.apart(center - reach, center + reach)
}

/// Spheres entirely behind a plane.
pub fn balls_behind<L: Lane>((center, radius): (Vec3<L>, L), plane: &Plane) -> L::Mask {
    let reach = L::splat(plane.length * (1.0 + MARGIN)) * mutate!(radius, BallsAsPoints => L::zero());
    let limit = plane.limit(center.x.abs() + center.y.abs() + center.z.abs());
    (center.dot(Vec3::splat(plane.normal)) + reach).lt(limit)
}
