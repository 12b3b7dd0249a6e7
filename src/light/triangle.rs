//! Emissive triangles, two-sided, sampled uniformly in the solid angle that they subtend.
//!
//! The solid angle uses the half-angle formula of Van Oosterom and Strackee 1983 ("The Solid Angle of a Plane Triangle", equation
//! 8). Directions use the map of Arvo 1995 ("Stratified Sampling of Spherical Triangles") in the form of Peters 2021 ("BRDF
//! Importance Sampling for Polygonal Lights", section 3), which needs no inverse functions. In both, the volume of the three
//! corners is `height * 2 area`, which is accurate however small the triangle appears.
//!
//! Where the map loses precision, another one is used with its own density, so the estimate stays correct:
//!
//! - below [`TINY`] steradians, points are sampled uniformly over the area: unit vectors to the corners differ too little;
//! - above [`HUGE`], directions are sampled uniformly over the hemisphere facing the triangle's plane, and some miss: at close
//!   range all three corners lie at the horizon, and rounding loses the position of a direction between them;
//! - likewise if two corners are nearly opposite ([`OPPOSITE`]), as the ends of an edge are at close range: the map divides the
//!   triangle using the sum of the two, which loses its digits (a plate 200 000 times as large as its distance had half of its
//!   light).

use std::f32::consts::PI;

use crate::lane::{Lane, Mask};
use crate::math::elementary::{angle, sin_cos_turn};
use crate::math::{Frame, Vec3};

/// Solid angle in steradians below which a triangle is sampled by area.
pub const TINY: f32 = 1e-3;

/// Solid angle in steradians above which a triangle is sampled by hemisphere.
pub const HUGE: f32 = 6.0;

/// One plus the cosine between two corners, below which a triangle is sampled by hemisphere: its error in `f32` is 1e-4 there.
pub const OPPOSITE: f32 = 1e-3;

/// Geometry of a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Triangle {
    /// Its corners.
    pub corners: [[f32; 3]; 3],
    /// Unit normal, on either side.
    pub normal: [f32; 3],
    /// Its area.
    pub area: f32,
}

/// A triangle light, the same for all lanes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TriangleLight {
    /// Its geometry.
    pub triangle: Triangle,
    /// Radiance.
    pub le: [f32; 3],
    /// Its skip id: the triangle does not occlude itself.
    pub skip_id: u32,
}

/// One triangle per lane.
#[derive(Clone, Copy, Debug)]
pub struct Triangles<L: Lane> {
    /// Corners.
    pub corners: [Vec3<L>; 3],
    /// Unit normals, on either side.
    pub normal: Vec3<L>,
    /// Areas.
    pub area: L,
}

/// Triangles as seen from points.
#[derive(Clone, Copy, Debug)]
pub struct View<L: Lane> {
    /// Corners relative to the point.
    corners: [Vec3<L>; 3],
    /// Unit directions to the corners.
    units: [Vec3<L>; 3],
    normal: Vec3<L>,
    area: L,
    /// Signed distance from the point to the plane along `normal`.
    height: L,
    /// Solid angle in [0, 2 pi], steradians.
    pub omega: L,
    /// Lanes that sample the whole hemisphere.
    huge: L::Mask,
    /// Volume of `units`, and the other two coefficients of the map (Peters 2021).
    map: [L; 3],
}

impl Triangle {
    /// Broadcasts the triangle to all lanes.
    #[inline(always)]
    pub fn splat<L: Lane>(&self) -> Triangles<L> {
        let [a, b, c] = self.corners;
        Triangles {
            corners: [Vec3::splat(a), Vec3::splat(b), Vec3::splat(c)],
            normal: Vec3::splat(self.normal),
            area: L::splat(self.area),
        }
    }
}

impl<L: Lane> Triangles<L> {
    /// The triangles as seen from `p`.
    #[inline(always)]
    pub fn seen_from(&self, p: Vec3<L>) -> View<L> {
        let [a, b, c] = self.corners;
        let (a, b, c) = (a - p, b - p, c - p);
        // At a corner the solid angle is undefined; the result must still be a number.
        let inverse = |v: Vec3<L>| L::one() / v.length().max(L::splat(1e-18));
        let (ia, ib, ic) = (inverse(a), inverse(b), inverse(c));
        let (ua, ub, uc) = (a * ia, b * ib, c * ic);
        let height = a.dot(self.normal);
        let volume = (self.area + self.area) * height.abs() * ia * ib * ic;
        let (ab, bc, ca) = (ua.dot(ub), ub.dot(uc), ua.dot(uc));
        let (others, pair) = (ca + bc, L::one() + ab);
        let half = angle(volume, pair + others);
        let omega = mutate!(half + half, HalfTheTriangle => half);
        let opposite = (L::one() + ab.min(bc).min(ca)).lt(L::splat(mutate!(OPPOSITE, OppositeForgotten => 0.0)));
        View {
            corners: [a, b, c],
            units: [ua, ub, uc],
            normal: self.normal,
            area: self.area,
            height,
            omega,
            huge: omega.gt(L::splat(HUGE)) | (opposite & !omega.lt(L::splat(TINY))),
            map: [volume, others, pair],
        }
    }
}

impl<L: Lane> View<L> {
    /// Lanes where any part of the triangle is above the plane through the point with the normal `n`.
    #[inline(always)]
    pub fn rises_above(&self, n: Vec3<L>) -> L::Mask {
        let [a, b, c] = self.corners;
        let highest = n.dot(a).max(n.dot(b)).max(n.dot(c));
        highest.gt(L::zero()) & self.omega.gt(L::zero())
    }

    #[inline(always)]
    fn tiny(&self) -> L::Mask {
        self.omega.lt(L::splat(TINY))
    }

    /// Samples unit directions from `u` and `v` in [0, 1). Those of huge triangles may miss: test [`Self::contains`].
    #[inline(always)]
    pub fn draw(&self, u: L, v: L) -> Vec3<L> {
        let (tiny, huge) = (self.tiny(), self.huge);
        if tiny.all() {
            return self.over_area(u, v);
        }
        let mut wi = self.over_solid_angle(u, v);
        if tiny.any() {
            wi = Vec3::select(tiny, self.over_area(u, v), wi);
        }
        if huge.any() {
            wi = Vec3::select(huge, self.over_hemisphere(u, v), wi);
        }
        wi
    }

    /// The first number selects a subtriangle of that fraction of the area, cut off by an arc through the second corner. The second
    /// number selects a point on that arc, uniform in the cosine from the corner.
    #[inline(always)]
    fn over_solid_angle(&self, u: L, v: L) -> Vec3<L> {
        let [a, b, c] = self.units;
        let [volume, others, pair] = self.map;
        let (sine, cosine) = sin_cos_turn(u * self.omega * L::splat(0.25 / PI));
        let (along_a, along_c) = (volume * cosine - others * sine, pair * sine);
        let middle = a * along_a + c * along_c;
        let turn = a.dot(middle) / middle.length_squared();
        let end = middle.mul_add(turn + turn, -a);
        // 1 - cos of the arc, from its chord; then sums of positive terms only.
        let arc = (b - end).length_squared() * L::splat(0.5);
        let t = v * arc;
        let two = L::splat(2.0);
        let across = (mutate!(v, ArcUniformInItsLength => v * v) * (two - t) / (two - arc)).safe_sqrt();
        let along = (L::one() - t) - across * (L::one() - arc);
        end.mul_add(across, b * along).normalize()
    }

    /// Osada et al. 2002, "Shape Distributions", section 4.2.
    #[inline(always)]
    fn over_area(&self, u: L, v: L) -> Vec3<L> {
        let [a, b, c] = self.corners;
        let root = u.sqrt();
        let (of_b, of_c) = (root * (L::one() - v), root * v);
        a.mul_add(L::one() - root, b.mul_add(of_b, c * of_c)).normalize()
    }

    #[inline(always)]
    fn over_hemisphere(&self, u: L, v: L) -> Vec3<L> {
        let axis = Vec3::select(self.height.lt(L::zero()), -self.normal, self.normal);
        let (sine, cosine) = sin_cos_turn(v);
        Frame::about(axis).direction(u, sine, cosine)
    }

    /// Reciprocal density of [`Self::draw`] at `wi`, which hits the triangle at `distance`; in steradians.
    #[inline(always)]
    pub fn inverse_density(&self, wi: Vec3<L>, distance: L) -> L {
        let (tiny, huge) = (self.tiny(), self.huge);
        let mut inverse = L::select(huge, L::splat(2.0 * PI), self.omega);
        if tiny.any() {
            let by_area = self.area * wi.dot(self.normal).abs() / (distance * distance);
            inverse = L::select(tiny, by_area, inverse);
        }
        inverse
    }

    /// Distance to the triangle's plane along `wi`.
    #[inline(always)]
    pub fn distance(&self, wi: Vec3<L>) -> L {
        self.height / wi.dot(self.normal)
    }

    /// Lanes whose direction hits the triangle. A triangle that rounds to a single point is never hit.
    #[inline(always)]
    pub fn contains(&self, wi: Vec3<L>) -> L::Mask {
        let [a, b, c] = self.corners;
        let (u, v, w) = (volume(a, b, wi), volume(b, c, wi), volume(c, a, wi));
        let zero = L::zero();
        let inside = (u.ge(zero) & v.ge(zero) & w.ge(zero)) | (u.le(zero) & v.le(zero) & w.le(zero));
        inside & (u + v + w).abs().gt(zero) & self.distance(wi).gt(zero)
    }

    /// Lanes whose sampled direction counts: all but those of huge triangles that miss.
    #[inline(always)]
    pub fn met(&self, wi: Vec3<L>) -> L::Mask {
        let huge = self.huge;
        let there = self.distance(wi).gt(L::zero());
        if huge.any() {
            there & (!huge | self.contains(wi))
        } else {
            there
        }
    }
}

/// `2 (a x b)·d`, from the sum and the difference of `a` and `b`, so that exchanging them only flips the sign: neighbors agree
/// about their edge.
#[inline(always)]
fn volume<L: Lane>(a: Vec3<L>, b: Vec3<L>, d: Vec3<L>) -> L {
    let (sum, edge) = (a + b, b - a);
    let x = sum.y * edge.z - sum.z * edge.y;
    let y = sum.z * edge.x - sum.x * edge.z;
    let z = sum.x * edge.y - sum.y * edge.x;
    Vec3::new(x, y, z).dot(d)
}
