//! Which shapes rays from a tile can meet at all, decided once for thousands of rays. Every test here is one-sided: a
//! shape that could be met is never left out.

use super::{Candidates, Line, Member};
use crate::math::Vec3;
use crate::shape::{Ball, FromOrigin, NO_SPHERE, Triangle};

/// A plane's share of rounding: what is nearer to it than this part of the largest number involved counts as both sides.
const MARGIN: f32 = 1e-5;

fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// In `f64`: the normal of a triangle is as long as an area, and the square of that leaves `f32` where scenes are 2^28 units
/// large or 2^-36 small.
fn length(a: [f32; 3]) -> f32 {
    let [x, y, z] = a.map(f64::from);
    (x * x + y * y + z * z).sqrt() as f32
}

/// At least the length, without a root: for margins, which may be too large.
fn norm1(a: [f32; 3]) -> f32 {
    a[0].abs() + a[1].abs() + a[2].abs()
}

fn cross(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// A half space `dot(normal, x) >= offset` that holds every ray.
#[derive(Clone, Copy, Debug)]
struct Plane {
    normal: [f32; 3],
    offset: f32,
    /// The [`norm1`] of the normal; more where the normal itself is rounded by more than its [`MARGIN`].
    size: f32,
}

/// Half-ulps by which the product of two unit directions is off, over [`MARGIN`]. The directions to the corners of a tile are
/// rounded by two each, and in a narrow view hardly differ: at 1000 sizes from a body this was 0.3 of its size.
const ROUNDED: f32 = 8.0 * f32::EPSILON / 2.0 / MARGIN;

impl Plane {
    /// Whether the shape lies wholly on the other side.
    fn excludes(&self, member: &Member) -> bool {
        let limit = self.offset - MARGIN * (self.size * member.reach + self.offset.abs());
        let behind = |&c: &[f32; 3]| dot(self.normal, c) < limit;
        let mut corners = member.triangle.corners.iter();
        mutate!(corners.all(behind), OneCornerBehind => corners.any(behind))
    }

    fn excludes_ball(&self, ball: &Ball) -> bool {
        let reach = length(self.normal) * mutate!(ball.radius, BallsAsPoints => 0.0) * (1.0 + MARGIN);
        let margin = MARGIN * (self.size * norm1(ball.center) + self.offset.abs());
        dot(self.normal, ball.center) + reach < self.offset - margin
    }
}

impl Line {
    /// The shapes that rays from the origin between four unit directions may meet; `corners` go round the tile. Of a triangle, no
    /// plane through the origin and a side of the tile may part it from the tile, nor one through a side of its own: where there is
    /// neither, they overlap.
    pub fn in_frustum(&self, corners: [[f32; 3]; 4], set: &mut Candidates) {
        let middle: [f32; 3] = std::array::from_fn(|k| corners.iter().map(|c| c[k]).sum());
        let planes: [Plane; 4] = std::array::from_fn(|i| {
            let normal = cross(corners[i], corners[(i + 1) % 4]);
            let inward = if dot(normal, middle) < 0.0 {
                normal.map(|x| -x)
            } else {
                normal
            };
            Plane {
                normal: inward,
                offset: 0.0,
                size: norm1(inward) + ROUNDED,
            }
        });
        self.select(
            set,
            |member| !planes.iter().any(|p| p.excludes(member)) && !member.apart(&corners),
            |ball| !planes.iter().any(|p| p.excludes_ball(ball)),
        );
    }

    /// The shapes that may stand between points and the ball `light`; the sphere or the triangles that `aimed_at` names block none
    /// of the rays there.
    ///
    /// The segments lie in the convex hull of both. It is bounded by planes along one axis through a corner of one box
    /// and the same corner of the other, wherever both boxes lie on one side (the shafts of Haines and Wallace 1994), and
    /// by the box around both. A triangle with points and light strictly on one side of its plane stands between none:
    /// where only its plane could tell and [`Points::sides`] does not know yet, it is kept for [`Self::beside`].
    pub fn in_shaft(&self, points: &mut Points, light: &Ball, aimed_at: u32, set: &mut Candidates) {
        let target = Bounds::of_ball(light);
        let around = points.bounds.around(&target);
        // Most shapes are ruled out without the planes.
        let mut planes = None;
        let mut planes = || *planes.get_or_insert_with(|| shaft(&points.bounds, &target));
        points.sides.resize(self.triangles.len(), None);
        set.clear();
        for (i, member) in (0..).zip(&self.triangles) {
            let aimed = aimed_at != NO_SPHERE && member.aim == aimed_at;
            let excluded = aimed
                || around.apart(&member.bounds)
                || member.beside(light, points.bounds.sides(member))
                || planes().iter().flatten().any(|plane| plane.excludes(member));
            if !excluded {
                self.take(i, set);
            }
        }
        for (i, ball) in (0..).zip(&self.balls) {
            let excluded = i == aimed_at
                || around.apart(&Bounds::of_ball(ball))
                || planes().iter().flatten().any(|plane| plane.excludes_ball(ball));
            if !excluded {
                set.balls.push(i);
            }
        }
    }

    /// Leaves out the triangles that have all points, as measured, and the light on one side.
    pub fn beside(&self, points: &Points, light: &Ball, set: &mut Candidates) {
        set.triangles.retain(|&i| {
            let known = points.sides[i as usize];
            !known.is_some_and(|sides| self.triangles[i as usize].beside(light, sides))
        });
    }

    /// The plane of a triangle, normal and offset: what [`Points::sides`] is measured against.
    pub fn plane(&self, triangle: u32) -> ([f32; 3], f32) {
        let member = &self.triangles[triangle as usize];
        (member.triangle.normal, member.offset)
    }
}

impl Member {
    pub fn new(corners: [[f32; 3]; 3], name: [u32; 2], aim: u32) -> Self {
        let triangle = Triangle::new(corners);
        Self {
            bounds: Bounds::of_triangle(&triangle),
            offset: dot(triangle.normal, corners[0]),
            length: length(triangle.normal),
            reach: corners.map(norm1).into_iter().fold(0.0, f32::max),
            from_origin: triangle.from_origin(),
            unit: Vec3::<f32>::splat(triangle.normal).unit().lane(0),
            triangle,
            name,
            aim,
        }
    }

    /// Whether all rays from the origin between these unit directions pass outside of one and the same edge.
    fn apart(&self, corners: &[[f32; 3]; 4]) -> bool {
        let FromOrigin { sides, offset, .. } = self.from_origin;
        // Of a triangle that is seen edge-on one side is short, and rounding is that of the others.
        let limit = -MARGIN * sides.iter().copied().map(norm1).fold(0.0, f32::max);
        let outside = |&side: &[f32; 3]| {
            let passes = |&corner: &[f32; 3]| offset.signum() * dot(side, corner) < limit;
            let mut corners = corners.iter();
            mutate!(corners.all(passes), OneCornerOutside => corners.any(passes))
        };
        offset != 0.0 && sides.iter().any(outside)
    }

    /// Whether points between `low` and `high` from the plane and a light are all strictly on one side of it.
    fn beside(&self, light: &Ball, [low, high]: [f32; 2]) -> bool {
        if low <= 0.0 && high >= 0.0 {
            return false;
        }
        let center = dot(self.triangle.normal, light.center) - self.offset;
        let radius = mutate!(light.radius, LightAsPoint => 0.0);
        let reach =
            self.length * radius * (1.0 + MARGIN) + MARGIN * (self.length * norm1(light.center) + self.offset.abs());
        (low > 0.0 && center > reach) || (high < 0.0 && center < -reach)
    }
}

/// What is known of a set of points.
#[derive(Clone, Debug, Default)]
pub struct Points {
    /// A box around them.
    pub bounds: Bounds,
    /// For each triangle of the line, once it was measured: the lowest and highest of `dot(normal, p) - offset`.
    pub sides: Vec<Option<[f32; 2]>>,
}

/// A box along the axes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Bounds {
    /// Smallest coordinates.
    pub low: [f32; 3],
    /// Largest coordinates.
    pub high: [f32; 3],
}

impl Bounds {
    fn of_ball(ball: &Ball) -> Self {
        let reach = ball.radius * (1.0 + MARGIN);
        Self {
            low: ball.center.map(|c| c - reach),
            high: ball.center.map(|c| c + reach),
        }
    }

    fn of_triangle(triangle: &Triangle) -> Self {
        let [a, b, c] = triangle.corners;
        Self {
            low: std::array::from_fn(|k| a[k].min(b[k]).min(c[k])),
            high: std::array::from_fn(|k| a[k].max(b[k]).max(c[k])),
        }
    }

    /// The lowest and highest of `dot(normal, p) - offset` over the box, with room for rounding.
    fn sides(&self, member: &Member) -> [f32; 2] {
        let (mut low, mut high, mut slack) = (-member.offset, -member.offset, member.offset.abs());
        for (k, n) in member.triangle.normal.into_iter().enumerate() {
            let (a, b) = (n * self.low[k], n * self.high[k]);
            low += a.min(b);
            high += a.max(b);
            slack += a.abs().max(b.abs());
        }
        [low - MARGIN * slack, high + MARGIN * slack]
    }

    fn around(self, other: &Self) -> Self {
        Self {
            low: std::array::from_fn(|k| self.low[k].min(other.low[k])),
            high: std::array::from_fn(|k| self.high[k].max(other.high[k])),
        }
    }

    fn apart(&self, other: &Self) -> bool {
        (0..3).any(|k| {
            let margin = MARGIN * (self.low[k].abs() + self.high[k].abs());
            other.high[k] < self.low[k] - margin || other.low[k] > self.high[k] + margin
        })
    }
}

/// The sides of the hull of two boxes, as far as they are known.
fn shaft(a: &Bounds, b: &Bounds) -> [Option<Plane>; 12] {
    let mut planes = [None; 12];
    for (axis, slots) in planes.chunks_exact_mut(4).enumerate() {
        for (corner, slot) in slots.iter_mut().enumerate() {
            *slot = support(a, b, (axis + 1) % 3, (axis + 2) % 3, [corner & 1 != 0, corner & 2 != 0]);
        }
    }
    planes
}

/// The plane along the third axis through the corners of both boxes at the `high` or low end of the axes `x` and `y`. Both boxes
/// are on its inner side if one of them reaches farther out along `x` and the other along `y`, and only then.
fn support(a: &Bounds, b: &Bounds, x: usize, y: usize, high: [bool; 2]) -> Option<Plane> {
    let end = |bounds: &Bounds, axis: usize, high: bool| if high { bounds.high[axis] } else { bounds.low[axis] };
    let corner = |bounds: &Bounds| [end(bounds, x, high[0]), end(bounds, y, high[1])];
    let ([px, py], [qx, qy]) = (corner(a), corner(b));
    let inward = high.map(|high| if high { -1.0 } else { 1.0 });
    let (dx, dy) = (inward[0] * (qx - px), inward[1] * (qy - py));
    let opposed = (dx < 0.0 && dy > 0.0) || (dx > 0.0 && dy < 0.0);
    if !opposed {
        return None;
    }
    let mut normal = [0.0; 3];
    (normal[x], normal[y]) = (inward[0] * dy.abs(), inward[1] * dx.abs());
    let offset = |u: f32, v: f32| normal[x] * u + normal[y] * v;
    Some(Plane {
        normal,
        offset: offset(px, py).min(offset(qx, qy)),
        size: norm1(normal),
    })
}
