//! Decides in `f64` which face a ray hits near an edge, where several are hit at one place.
//!
//! Embree's robust test accepts rays up to 2^-23 of a triangle beyond its edges, so that none slips through. There a ray hits both
//! neighbors, at distances equal up to rounding or exactly. The winner depends on the order of the tests, which differs between
//! single rays and packets. At the silhouette of a body the winner may be the face behind, which is dark. So if a barycentric
//! coordinate is below [`EDGE`], the faces around the point are tested again:
//!
//! 1. The nearest face that the ray hits in `f64` wins. The volumes that say on which side of an edge the ray passes are equal up
//!    to sign for both neighbors, so the ray hits one of them.
//! 2. If the ray hits none of them, as just outside a silhouette, or two at one distance, as exactly on an edge, the ray is moved
//!    towards the centroids of these faces, by as much as rounding can have moved it, and tested again.
//! 3. Among coplanar faces that are all hit, the one that faces the ray wins, then the first in the file.
//!
//! Rays that hit a single face there keep their bits. Faces that intersect elsewhere can still be hit at exactly the same distance:
//! single rays and packets may then choose different ones, for one ray in 10^7 that passes close by.

use glam::DVec3;

use crate::embree::TraceLane;
use crate::lane::{Bits, Mask};
use crate::math::Vec3;
use crate::shape::{EDGE, Hit, Ray};

/// The largest difference between two distances of one place: 32 half-ulps of the `size` that `leave` in `stage/surface.rs`
/// defines.
const ONE_PLACE: f64 = 32.0 * (f32::EPSILON / 2.0) as f64;

/// Relative error bound of a distance in `f64`.
const SAME: f64 = 1e-11;

/// Threshold for coplanar faces: one minus the squared cosine between their normals.
const PARALLEL: f64 = 1e-6;

/// Visits the faces around a point: a function of the point, a radius, and a callback that takes the name and the corners of a
/// face.
pub trait Nearby: Fn([f32; 3], f32, &mut dyn FnMut([u32; 2], [[f32; 3]; 3])) {}
impl<F: Fn([f32; 3], f32, &mut dyn FnMut([u32; 2], [[f32; 3]; 3]))> Nearby for F {}

/// The hits whose barycentric coordinates are near an edge.
#[inline(always)]
pub fn next_to_edge<L: TraceLane>(hit: &Hit<L>) -> L::Mask {
    let least = hit.u.min(hit.v).min(L::one() - hit.u - hit.v);
    least.le(L::splat(EDGE))
}

/// Retests the faces around hits near an `edge`; `doubtful` adds further lanes.
#[inline(always)]
pub fn resolve<L: TraceLane>(
    hit: &mut Hit<L>,
    ray: &Ray<L>,
    sphere_geometry: u32,
    edge: L::Mask,
    doubtful: Option<L::Mask>,
    nearby: impl Nearby,
) {
    let triangles = hit.found & !hit.geometry.eq(L::Bits::splat(sphere_geometry));
    let again = triangles & doubtful.map_or(edge, |doubtful| edge | doubtful);
    if again.none() {
        return;
    }
    let (mut numbers, mut names, mut changed) = ([[0.0_f32; 16]; 6], [[0_u32; 16]; 2], 0);
    for lane in again.lanes() {
        let met = Met {
            name: [hit.geometry.lane(lane), hit.primitive.lane(lane)],
            t: hit.t.lane(lane),
        };
        let Some(won) = decide(ray.origin.lane(lane), ray.direction.lane(lane), met, &nearby) else {
            continue;
        };
        let [x, y, z] = won.normal;
        for (column, value) in numbers.iter_mut().zip([won.t, won.u, won.v, x, y, z]) {
            column[lane] = value;
        }
        (names[0][lane], names[1][lane]) = (won.name[0], won.name[1]);
        changed |= 1 << lane;
    }
    if changed == 0 {
        return;
    }
    let changed = L::Mask::from_bitmask(changed);
    let [t, u, v, x, y, z] = numbers.each_ref().map(|column| L::load(column));
    hit.t = L::select(changed, t, hit.t);
    hit.u = L::select(changed, u, hit.u);
    hit.v = L::select(changed, v, hit.v);
    hit.ng = Vec3::select(changed, Vec3::new(x, y, z), hit.ng);
    hit.geometry = L::Bits::select(changed, L::Bits::load(&names[0]), hit.geometry);
    hit.primitive = L::Bits::select(changed, L::Bits::load(&names[1]), hit.primitive);
}

/// The reported hit of a ray.
#[derive(Clone, Copy, Debug)]
struct Met {
    name: [u32; 2],
    t: f32,
}

/// The resolved hit.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Won {
    name: [u32; 2],
    t: f32,
    u: f32,
    v: f32,
    /// Unit normal.
    normal: [f32; 3],
}

/// A face near the hit point.
#[derive(Clone, Copy, Debug)]
struct Face {
    name: [u32; 2],
    /// Corners relative to the ray's origin.
    corners: [DVec3; 3],
    normal: DVec3,
    /// Distance at which the ray hits the plane.
    t: f64,
    /// Rounding error of the barycentric coordinates.
    slack: f64,
}

fn wide(v: [f32; 3]) -> DVec3 {
    DVec3::from_array(v.map(f64::from))
}

/// The winning face; `None` if no other face is hit there. A few rays in a million are retested.
#[cold]
#[inline(never)]
fn decide(origin: [f32; 3], direction: [f32; 3], met: Met, nearby: &dyn Nearby) -> Option<Won> {
    let (origin, d, t) = (wide(origin), wide(direction), f64::from(met.t));
    let place = origin + t * d;
    let radius = 2.0_f64.powi(-18) * (place.abs().max_element() + origin.abs().max_element());
    let (mut own, mut faces) = (None, Vec::new());
    nearby(
        place.to_array().map(|x| x as f32),
        radius as f32,
        &mut |name, corners| {
            if name == met.name {
                own = Face::new(name, corners, origin, d);
            } else if let Some(face) = Face::new(name, corners, origin, d)
                && (face.t - t).abs() <= face.one_place(place, d)
                && face.inside(d) >= -face.slack
                && !faces.iter().any(|other: &Face| other.name == name)
            {
                faces.push(face);
            }
        },
    );
    let own = own?;
    if faces.is_empty() {
        return None;
    }
    faces.push(own);
    let first = match nearest(&faces, d) {
        Some((first, true)) => Some(first),
        at_an_edge => nearest(&faces, inward(&faces, d, t))
            .or(at_an_edge)
            .or_else(|| nearest(&faces, inward(&[own], d, t)))
            .map(|(first, _)| first),
    };
    let won = first.unwrap_or(own);
    let [u, v, w] = won.sides(d);
    let (u, v) = ((u / (u + v + w)).clamp(0.0, 1.0), (v / (u + v + w)).clamp(0.0, 1.0));
    let normal = won.normal.normalize();
    Some(Won {
        name: won.name,
        // A face coplanar with the reported one is equally far away.
        t: if won.parallel(&own) { met.t } else { won.t as f32 },
        u: u as f32,
        v: v.min(1.0 - u) as f32,
        normal: normal.to_array().map(|x| x as f32),
    })
}

/// The direction of a ray moved towards the centroids of faces, by the rounding error of the smallest face.
fn inward(faces: &[Face], d: DVec3, t: f64) -> DVec3 {
    let to_middle = |face: &Face| (face.corners[0] + face.corners[1] + face.corners[2]) / 3.0 - t * d;
    let toward: DVec3 = faces.iter().map(|face| to_middle(face).normalize_or_zero()).sum();
    let steps = faces.iter().map(|face| 4.0 * face.slack * to_middle(face).length());
    let step = steps.fold(f64::INFINITY, f64::min);
    d + step / t * toward.normalize_or_zero()
}

/// The nearest face that a ray hits, and whether no other is as near. Among coplanar faces the one that faces the ray wins, then
/// the first in the file.
fn nearest(faces: &[Face], d: DVec3) -> Option<(Face, bool)> {
    let strictly = || faces.iter().filter(|face| face.inside(d) >= 0.0);
    let first = strictly().min_by(|a, b| a.along(d).total_cmp(&b.along(d)))?;
    let as_near = |face: &&Face| face.along(d) <= first.along(d) * (1.0 + SAME);
    let looks_away = |face: &Face| face.normal.dot(d) > 0.0;
    let alone = strictly().filter(as_near).all(|face| face.parallel(first));
    let won = strictly()
        .filter(|face| face.parallel(first))
        .min_by_key(|face| (looks_away(face), face.name))?;
    Some((*won, alone))
}

impl Face {
    /// `None` if the ray lies in the plane of the face.
    fn new(name: [u32; 2], corners: [[f32; 3]; 3], origin: DVec3, d: DVec3) -> Option<Self> {
        let corners = corners.map(|corner| wide(corner) - origin);
        let [a, b, c] = corners;
        let mut face = Self {
            name,
            corners,
            normal: (b - a).cross(c - a),
            t: 0.0,
            slack: 0.0,
        };
        face.t = face.along(d);
        let total = face.sides(d).iter().sum::<f64>().abs();
        let terms = |from: DVec3, to: DVec3| (from + to).length() * (to - from).length();
        let largest = terms(a, b).max(terms(b, c)).max(terms(c, a)) * d.length();
        face.slack = (f64::from(EDGE) + f64::from(f32::EPSILON) * largest / total).min(0.1);
        (face.t.is_finite() && total > 0.0).then_some(face)
    }

    /// Whether two faces are parallel.
    fn parallel(&self, other: &Self) -> bool {
        self.normal.cross(other.normal).length_squared()
            <= PARALLEL * self.normal.length_squared() * other.normal.length_squared()
    }

    /// Distance at which a ray hits the plane.
    fn along(&self, d: DVec3) -> f64 {
        self.normal.dot(self.corners[0]) / self.normal.dot(d)
    }

    /// Twice the volumes between the ray and the three edges: opposite the second corner, the third and the first. They use the sum
    /// and the difference of the edge's ends, so that reversing an edge only flips the sign.
    fn sides(&self, d: DVec3) -> [f64; 3] {
        let side = |from: DVec3, to: DVec3| (from + to).cross(to - from).dot(d);
        let [a, b, c] = self.corners;
        [side(c, a), side(a, b), side(b, c)]
    }

    /// The smallest barycentric coordinate of a ray. The ray hits the face if it is at least 0.
    fn inside(&self, d: DVec3) -> f64 {
        let [u, v, w] = self.sides(d);
        (u / (u + v + w)).min(v / (u + v + w)).min(w / (u + v + w))
    }

    /// Tolerance between two distances of one place.
    fn one_place(&self, place: DVec3, d: DVec3) -> f64 {
        let [a, b, c] = self.corners;
        let extent = a.max(b).max(c) - a.min(b).min(c);
        ONE_PLACE * self.normal.abs().dot(place.abs() + extent) / self.normal.dot(d).abs()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The callback: takes the name and the corners of a face.
    type Visit<'a> = &'a mut dyn FnMut([u32; 2], [[f32; 3]; 3]);

    /// Visits all faces, whatever the point.
    fn around(faces: &[[[f32; 3]; 3]]) -> impl Fn([f32; 3], f32, Visit<'_>) {
        let faces = faces.to_vec();
        move |_, _, visit| {
            for (i, &corners) in (0..).zip(&faces) {
                visit([i, 0], corners);
            }
        }
    }

    fn winner(faces: &[[[f32; 3]; 3]], direction: [f32; 3], met: u32, t: f32) -> Option<[u32; 2]> {
        let met = Met { name: [met, 0], t };
        decide([0.0; 3], direction, met, &around(faces)).map(|won| won.name)
    }

    /// At the far upper edge of a box the top wins, never the side behind it: whichever was reported, and just beyond the edge too.
    #[test]
    fn at_an_outline_the_face_in_front_wins() {
        let (left, right) = ([-1.0, -1.0, -5.0], [1.0, -1.0, -5.0]);
        for turned in [false, true] {
            let top = [left, right, [0.0, -1.0, -3.0]];
            let back = if turned {
                [left, right, [0.0, -4.0, -5.0]]
            } else {
                [right, left, [0.0, -4.0, -5.0]]
            };
            for step in 0..200 {
                let x = -0.9 + 0.009 * step as f32;
                for up in [-3e-7_f32, -1e-7, 0.0, 1e-7, 2e-7] {
                    let direction = [x, -1.0 + up, -5.0];
                    for met in [0, 1] {
                        let won = winner(&[top, back], direction, met, 1.0);
                        assert!(matches!(won, Some([0, 0]) | None), "{x}, {up}, {met}: {won:?}");
                        assert!(met == 0 || won.is_some(), "{x}, {up}: the back is left");
                    }
                }
            }
        }
    }

    /// The reported face does not matter where two faces share an edge.
    #[test]
    fn neighbours_agree_about_the_edge_between_them() {
        let (p, q) = ([0.1, 0.7, 3.0], [0.9, -0.3, 3.3]);
        let faces = [[p, q, [-1.0, -0.5, 3.1]], [q, p, [1.5, 1.0, 2.9]]];
        for i in 1..2000 {
            let s = i as f32 / 2000.0;
            let skip_id: [f32; 3] = std::array::from_fn(|k| p[k] + s * (q[k] - p[k]));
            let won = [0, 1].map(|met| winner(&faces, skip_id, met, 1.0));
            assert!(won[0].is_some());
            assert_eq!(won[0], won[1], "at {s}");
        }
    }

    /// Among coplanar faces the one that faces the ray wins, then the first.
    #[test]
    fn what_coincides_is_decided_by_side_and_order() {
        let up = [[-9.0, -2.0, 9.0], [9.0, -2.0, 9.0], [0.0, -2.0, -9.0]];
        let down = [up[1], up[0], up[2]];
        let rug = [[-1.0, -2.0, 1.0], [1.0, -2.0, 1.0], [0.0, -2.0, -1.0]];
        let direction = [0.01, -1.0, 0.02];
        for met in [0, 1] {
            assert_eq!(winner(&[up, rug], direction, met, 2.0), Some([0, 0]));
            assert_eq!(winner(&[rug, up], direction, met, 2.0), Some([0, 0]));
            assert_eq!(winner(&[down, rug], direction, met, 2.0), Some([1, 0]));
            assert_eq!(winner(&[rug, down], direction, met, 2.0), Some([0, 0]));
        }
        assert_eq!(winner(&[up], direction, 0, 2.0), None);
    }
}
