//! Culls the shapes that rays from a tile cannot hit, once for thousands of rays. All tests are conservative: a shape that could be
//! hit is never culled. Each test processes one shape per lane: one by one, branch mispredictions cost more than the tests. The
//! lane count does not change the results. Nothing here is inlined into kernels, so lanes that need AVX-512 use [`Lane::Plain`].

use super::balls::Packet;
use super::crowd::Cone;
use super::shapes::{balls_behind, balls_outside};
use super::{Candidates, LinearScene};
use crate::lane::{Bits, Lane, Mask};
use crate::math::Vec3;
use crate::shape::{BoundingSphere, NO_SKIP_ID};

/// Relative rounding margin of a plane: points nearer than this fraction of the largest number involved count for both sides.
pub(super) const MARGIN: f32 = 1e-5;

/// Up to this many spheres are tested against rays sooner than against planes.
const WORTH_PLANES: usize = 3;

pub(super) fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Computed in `f64`: the normal of a triangle is as long as an area, and its square leaves the range of `f32` if scenes are 2^28
/// units large or 2^-36 small.
pub(super) fn length(a: [f32; 3]) -> f32 {
    let [x, y, z] = a.map(f64::from);
    (x * x + y * y + z * z).sqrt() as f32
}

/// An upper bound on the length, without a root; used for margins, which may be too large.
pub(super) fn norm1(a: [f32; 3]) -> f32 {
    a[0].abs() + a[1].abs() + a[2].abs()
}

fn cross(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// A half space `dot(normal, x) >= offset` that contains all rays.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Plane {
    pub normal: [f32; 3],
    offset: f32,
    /// The [`norm1`] of the normal, or more if the rounding error of the normal exceeds its [`MARGIN`].
    size: f32,
    /// Length of the normal.
    pub length: f32,
}

/// Rounding error of the cross product of two unit directions: 8 half-ulps, in units of [`MARGIN`]. The directions to the corners
/// of a tile have an error of two half-ulps each. In a narrow view they are nearly equal, so the product is short and its relative
/// error large: at a distance of 1000 sizes from a body, the error was 0.3 of its size.
const ROUNDED: f32 = 8.0 * f32::EPSILON / 2.0 / MARGIN;

impl Plane {
    /// Points with `dot(normal, p)` below this are outside of the half space, if they are at most `reach` from the origin.
    pub fn limit<L: Lane>(&self, reach: L) -> L {
        let margin = L::splat(self.size).mul_add(reach, L::splat(self.offset.abs()));
        L::splat(self.offset) - L::splat(MARGIN) * margin
    }
}

impl LinearScene {
    /// Finds the shapes that rays from the origin between four unit directions may hit; `corners` go around the tile. A triangle is
    /// culled if a plane through the origin and a side of the tile separates it from the tile, or a plane through the origin and
    /// one of its own sides. If there is neither, triangle and tile overlap.
    #[inline(never)]
    pub fn in_frustum<L: Lane>(&self, corners: [[f32; 3]; 4], set: &mut Candidates) {
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
                length: length(inward),
            }
        });
        set.clear();
        for (at, mut kept) in self.shapes.triangles.packets::<L>() {
            for plane in &planes {
                kept = kept & !self.shapes.behind::<L>(at, plane);
            }
            if kept.any() {
                kept = kept & !self.shapes.apart::<L>(at, &corners);
            }
            self.take::<L>(at, kept, set);
        }
        if let Some(tree) = &self.tree {
            tree.visit(&Bounds::EVERYWHERE, &planes, &mut |kept, packet| {
                set.balls.append(kept, packet);
            });
            return;
        }
        for (at, mut kept) in self.shapes.balls.packets::<L>() {
            for plane in &planes {
                kept = kept & !balls_behind(self.shapes.ball::<L>(at), plane);
            }
            set.balls.extend(kept.lanes().map(|lane| (at + lane) as u32));
        }
    }

    /// Starts `points` with the bounding box of the points: it bounds `dot(normal, p) - offset` for each triangle until that is
    /// measured.
    #[inline(never)]
    pub fn look<L: Lane>(&self, bounds: Bounds, points: &mut Points) {
        points.bounds = bounds;
        let triangles = &self.shapes.triangles;
        points.measured.clear();
        points.measured.resize(triangles.len(), false);
        points.low.resize(triangles.room(), 0.0);
        points.high.resize(triangles.room(), 0.0);
        for (at, _) in triangles.packets::<L>() {
            let [low, high] = self.shapes.sides::<L>(at, &bounds);
            low.store(&mut points.low[at..]);
            high.store(&mut points.high[at..]);
        }
    }

    /// Finds the shapes that may lie between points and the sphere `light`. The sphere or the triangles with the id `skip_id` block
    /// none of the rays there.
    ///
    /// The segments from points to light lie in the convex hull of both. It is bounded by planes parallel to one axis, through a
    /// corner of one box and the same corner of the other, if both boxes lie on one side (the shafts of Haines and Wallace 1994),
    /// and by the box around both. A triangle with points and light strictly on one side of its plane is no occluder. If only its
    /// plane could tell and [`Points`] has no measurement for it yet, the triangle is kept for [`Self::separated_by_plane`].
    #[inline(never)]
    pub fn in_shaft<L: Lane>(&self, points: &Points, light: &BoundingSphere, skip_id: u32, set: &mut Candidates) {
        self.in_shaft_to::<L>(points, &Bounds::of_ball(light), (light, skip_id), set);
    }

    /// Like [`Self::in_shaft`], to a box inside of the sphere `light`.
    #[inline(never)]
    pub fn in_shaft_to<L: Lane>(
        &self,
        points: &Points,
        target: &Bounds,
        (light, skip_id): (&BoundingSphere, u32),
        set: &mut Candidates,
    ) {
        let shapes = &self.shapes;
        let around = points.bounds.around(target);
        let mut hull = [Plane::default(); 12];
        let planes = hull_of(&points.bounds, target, &mut hull);
        set.clear();
        set.culled = true;
        for (at, lanes) in shapes.triangles.packets::<L>() {
            let kept = self.triangles_between::<L>(at, lanes, points, (light, skip_id), (&around, planes));
            self.take::<L>(at, kept, set);
        }
        if let Some(tree) = &self.tree {
            set.target = *light;
            tree.visit(&around, planes, &mut |kept, packet| {
                set.balls
                    .append(kept & !packet.numbers.eq(Bits::splat(skip_id)), packet);
            });
            return;
        }
        for (at, lanes) in shapes.balls.packets::<L>() {
            let kept = balls_between(shapes.ball::<L>(at), lanes, (&around, planes));
            let kept = kept.lanes().map(|lane| (at + lane) as u32);
            set.balls.extend(kept.filter(|&ball| ball != skip_id));
        }
    }

    /// Like [`Self::in_shaft_to`], among the shapes of `wide` alone: what was found between the same points and a larger box, with a
    /// hierarchy.
    #[inline(never)]
    pub fn in_shaft_of<L: Lane>(
        &self,
        points: &Points,
        target: &Bounds,
        (light, skip_id): (&BoundingSphere, u32),
        wide: &Candidates,
        set: &mut Candidates,
    ) {
        set.clear();
        set.culled = true;
        set.target = *light;
        // Most spheres on the way to the larger box are outside of a cone to the light, which takes one test instead of twelve.
        let other = |packet: &Packet| !packet.numbers.eq(Bits::splat(skip_id));
        match Cone::between(&points.around(), light) {
            Some(cone) => set
                .balls
                .select(&wide.balls, |packet| cone.meets(packet) & other(packet)),
            None => set.balls.select(&wide.balls, other),
        }
        let mut hull = [Plane::default(); 12];
        let around = points.bounds.around(target);
        let exactly = set.balls.len() > WORTH_PLANES || wide.triangles.len() + wide.lights.len() > 0;
        let planes = if exactly {
            hull_of(&points.bounds, target, &mut hull)
        } else {
            &[]
        };
        let all = Mask::splat(true);
        (set.balls).retain(|packet| balls_between(packet.ball(), all, (&around, planes)));
        for list in [&wide.triangles, &wide.lights] {
            for packet in list.chunk_by(|a, b| *a as usize / L::N == *b as usize / L::N) {
                let at = packet[0] as usize / L::N * L::N;
                let members = packet.iter().fold(0, |bits, &i| bits | 1 << (i as usize - at));
                let lanes = L::Mask::from_bitmask(members);
                let kept = self.triangles_between::<L>(at, lanes, points, (light, skip_id), (&around, planes));
                self.take::<L>(at, kept, set);
            }
        }
    }

    /// The triangles of a packet that may lie between points and a light: none that is outside a box, behind a plane, or named by the
    /// skip id.
    #[inline(always)]
    fn triangles_between<L: Lane>(
        &self,
        at: usize,
        lanes: L::Mask,
        points: &Points,
        (light, skip_id): (&BoundingSphere, u32),
        (around, planes): (&Bounds, &[Plane]),
    ) -> L::Mask {
        let shapes = &self.shapes;
        let mut kept = lanes & !shapes.outside::<L>(at, around);
        if skip_id != NO_SKIP_ID {
            kept = kept & !shapes.skip_id::<L>(at, skip_id);
        }
        let (low, high) = (L::load(&points.low[at..]), L::load(&points.high[at..]));
        kept = kept & !shapes.separated_by_plane(at, light, low, high);
        for plane in planes {
            if kept.none() {
                break;
            }
            kept = kept & !shapes.behind::<L>(at, plane);
        }
        kept
    }

    /// Removes the triangles that have all points, as measured, and the light on one side.
    pub fn separated_by_plane(&self, points: &Points, light: &BoundingSphere, set: &mut Candidates) {
        set.triangles.retain(|&i| {
            let i = i as usize;
            !self
                .shapes
                .separated_by_plane::<f32>(i, light, points.low[i], points.high[i])
        });
    }

    /// The plane of a triangle, normal and offset: the input of [`Points::measure`].
    pub fn plane(&self, triangle: u32) -> ([f32; 3], f32) {
        self.shapes.plane(triangle as usize)
    }
}

/// Bounds of a set of points.
#[derive(Clone, Debug, Default)]
pub struct Points {
    bounds: Bounds,
    /// For each triangle of the list, the minimum and maximum of `dot(normal, p) - offset`: over the box until measured.
    low: Vec<f32>,
    high: Vec<f32>,
    measured: Vec<bool>,
}

impl Points {
    /// A slightly enlarged bounding sphere.
    pub fn around(&self) -> BoundingSphere {
        BoundingSphere::around(&[self.bounds.low, self.bounds.high])
    }

    /// Whether the points were measured against the plane of a triangle.
    pub fn measured(&self, triangle: u32) -> bool {
        self.measured[triangle as usize]
    }

    /// Stores the minimum and maximum of `dot(normal, p) - offset` over the points.
    pub fn measure(&mut self, triangle: u32, [low, high]: [f32; 2]) {
        let at = triangle as usize;
        (self.low[at], self.high[at], self.measured[at]) = (low, high, true);
    }
}

/// An axis-aligned box.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Bounds {
    /// Smallest coordinates.
    pub low: [f32; 3],
    /// Largest coordinates.
    pub high: [f32; 3],
}

impl Bounds {
    /// Contains all points.
    const EVERYWHERE: Self = Self {
        low: [f32::NEG_INFINITY; 3],
        high: [f32::INFINITY; 3],
    };

    pub fn of_ball(ball: &BoundingSphere) -> Self {
        let reach = ball.radius * (1.0 + MARGIN);
        Self {
            low: ball.center.map(|c| c - reach),
            high: ball.center.map(|c| c + reach),
        }
    }

    pub fn around(self, other: &Self) -> Self {
        Self {
            low: std::array::from_fn(|k| self.low[k].min(other.low[k])),
            high: std::array::from_fn(|k| self.high[k].max(other.high[k])),
        }
    }

    /// Boxes that do not overlap this one.
    pub(super) fn apart<L: Lane>(&self, low: Vec3<L>, high: Vec3<L>) -> L::Mask {
        let outside = |k: usize, low: L, high: L| {
            let margin = MARGIN * (self.low[k].abs() + self.high[k].abs());
            high.lt(L::splat(self.low[k] - margin)) | low.gt(L::splat(self.high[k] + margin))
        };
        outside(0, low.x, high.x) | outside(1, low.y, high.y) | outside(2, low.z, high.z)
    }
}

/// The spheres of a packet that are neither outside a box nor behind a plane.
#[inline(always)]
pub(super) fn balls_between<L: Lane>(
    balls: (Vec3<L>, L),
    lanes: L::Mask,
    (around, planes): (&Bounds, &[Plane]),
) -> L::Mask {
    let mut kept = lanes & !balls_outside(balls, around);
    for plane in planes {
        if kept.none() {
            break;
        }
        kept = kept & !balls_behind(balls, plane);
    }
    kept
}

/// The known sides of the convex hull of two boxes, at the front of `planes`.
fn hull_of<'a>(a: &Bounds, b: &Bounds, planes: &'a mut [Plane; 12]) -> &'a [Plane] {
    let mut known = 0;
    for axis in 0..3 {
        let (x, y) = ((axis + 1) % 3, (axis + 2) % 3);
        for high in [[false, false], [true, false], [false, true], [true, true]] {
            let (plane, supports) = support(a, b, x, y, high);
            // Writes unconditionally and advances only if the plane supports: a branch would be mispredicted.
            planes[known] = plane;
            known += usize::from(supports);
        }
    }
    // Of the known ones only: it takes a root.
    for plane in &mut planes[..known] {
        plane.length = length(plane.normal);
    }
    &planes[..known]
}

/// The plane parallel to the third axis, through the corners of both boxes at the `high` or low ends of the axes `x` and `y`. Both
/// boxes are on its inner side exactly if one extends farther along `x` and the other along `y`.
fn support(a: &Bounds, b: &Bounds, x: usize, y: usize, high: [bool; 2]) -> (Plane, bool) {
    let end = |bounds: &Bounds, axis: usize, high: bool| if high { bounds.high[axis] } else { bounds.low[axis] };
    let corner = |bounds: &Bounds| [end(bounds, x, high[0]), end(bounds, y, high[1])];
    let ([px, py], [qx, qy]) = (corner(a), corner(b));
    let inward = high.map(|high| if high { -1.0 } else { 1.0 });
    let (dx, dy) = (inward[0] * (qx - px), inward[1] * (qy - py));
    let mut normal = [0.0; 3];
    (normal[x], normal[y]) = (inward[0] * dy.abs(), inward[1] * dx.abs());
    let offset = |u: f32, v: f32| normal[x] * u + normal[y] * v;
    let plane = Plane {
        normal,
        offset: offset(px, py).min(offset(qx, qy)),
        size: norm1(normal),
        length: 0.0,
    };
    (plane, (dx < 0.0) & (dy > 0.0) | (dx > 0.0) & (dy < 0.0))
}
