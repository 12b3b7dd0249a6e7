//! Rays, spheres and triangles in `f64`, and their intersections.

use glam::DVec3;

/// A ray. Distances along it are lengths, because `direction` is unit.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    /// Its start.
    pub origin: DVec3,
    /// Unit.
    pub direction: DVec3,
}

/// What can be hit.
#[derive(Clone, Copy, Debug)]
pub enum Shape {
    /// All points `radius` away from `center`.
    Sphere {
        /// Centre.
        center: DVec3,
        /// Above 0.
        radius: f64,
    },
    /// A triangle given by its corners.
    Triangle([DVec3; 3]),
}

/// A ray's hit on a shape.
#[derive(Clone, Copy, Debug)]
pub struct Meeting {
    /// Distance from the ray's origin, above 0.
    pub distance: f64,
    /// Barycentric weights of the second and third corner; 0 on spheres.
    pub weights: [f64; 2],
}

/// An axis-aligned box, empty when `min > max`.
#[derive(Clone, Copy, Debug)]
pub struct Bounds {
    /// Smallest coordinates.
    pub min: DVec3,
    /// Largest coordinates.
    pub max: DVec3,
}

impl Shape {
    /// The first hit at a distance in `(0, far)`, if any.
    pub fn meet(&self, ray: &Ray, far: f64) -> Option<Meeting> {
        let (distance, weights) = match *self {
            Shape::Sphere { center, radius } => (meet_sphere(center, radius, ray)?, [0.0; 2]),
            Shape::Triangle(corners) => meet_triangle(&corners, ray)?,
        };
        (distance > 0.0 && distance < far).then_some(Meeting { distance, weights })
    }

    /// The smallest box around the shape.
    pub fn bounds(&self) -> Bounds {
        match *self {
            Shape::Sphere { center, radius } => Bounds {
                min: center - DVec3::splat(radius),
                max: center + DVec3::splat(radius),
            },
            Shape::Triangle([a, b, c]) => Bounds {
                min: a.min(b).min(c),
                max: a.max(b).max(c),
            },
        }
    }

    /// The point of a hit, recomputed on the surface itself: its error does not grow with the length of the ray.
    pub fn point(&self, ray: &Ray, meeting: &Meeting) -> DVec3 {
        match *self {
            Shape::Sphere { center, radius } => {
                center + radius * (ray.origin + meeting.distance * ray.direction - center).normalize()
            }
            Shape::Triangle([a, b, c]) => {
                let [v, w] = meeting.weights;
                (1.0 - v - w) * a + v * b + w * c
            }
        }
    }

    /// The unit geometric normal at a point of the surface: outwards on spheres, by the right-hand rule on triangles.
    pub fn normal(&self, point: DVec3) -> DVec3 {
        match *self {
            Shape::Sphere { center, .. } => (point - center).normalize(),
            Shape::Triangle([a, b, c]) => (b - a).cross(c - a).normalize(),
        }
    }

    /// How far from the surface, on the chosen side, a ray must start to be certainly off it.
    ///
    /// With coordinates up to M, [`point`](Self::point) and the intersection of a ray with a surface through that point take a
    /// dozen roundings of 2⁻⁵³ M, about 1e-15 M. A thousand times that also covers thin triangles, and shifts a picture by no
    /// more than 1e-12 of the scene's size.
    pub fn offset(&self) -> f64 {
        let Bounds { min, max } = self.bounds();
        1e-12 * min.abs().max(max.abs()).max_element()
    }

    /// Area of a triangle or of a sphere's surface.
    pub fn area(&self) -> f64 {
        match *self {
            Shape::Sphere { radius, .. } => 4.0 * std::f64::consts::PI * radius * radius,
            Shape::Triangle([a, b, c]) => 0.5 * (b - a).cross(c - a).length(),
        }
    }
}

/// The nearest root above 0. The discriminant uses the distance between centre and line, not a difference of two large squares
/// (Hearn and Baker; Haines et al., "Precision Improvements for Ray/Sphere Intersection", 2019).
fn meet_sphere(center: DVec3, radius: f64, ray: &Ray) -> Option<f64> {
    let to_center = center - ray.origin;
    let along = to_center.dot(ray.direction);
    let beside = (to_center - along * ray.direction).length();
    if beside > radius {
        return None;
    }
    let half_chord = ((radius - beside) * (radius + beside)).sqrt();
    // One of the two roots `along -+ half_chord` is a sum without cancellation; their product gives the other.
    let apart = to_center.length();
    let product = (apart - radius) * (apart + radius);
    let (near, far) = if along >= 0.0 {
        let far = along + half_chord;
        (product / far, far)
    } else {
        let near = along - half_chord;
        (near, product / near)
    };
    [near, far].into_iter().find(|&root| root > 0.0)
}

/// Möller and Trumbore, "Fast, Minimum Storage Ray/Triangle Intersection", 1997. In `f64` a ray passes between two adjacent
/// triangles with a probability near 1e-16, which is invisible. Degenerate triangles are never hit.
fn meet_triangle(corners: &[DVec3; 3], ray: &Ray) -> Option<(f64, [f64; 2])> {
    let (edge1, edge2) = (corners[1] - corners[0], corners[2] - corners[0]);
    let p = ray.direction.cross(edge2);
    let determinant = edge1.dot(p);
    if determinant == 0.0 {
        return None;
    }
    let from_corner = ray.origin - corners[0];
    let v = from_corner.dot(p) / determinant;
    if !(0.0..=1.0).contains(&v) {
        return None;
    }
    let q = from_corner.cross(edge1);
    let w = ray.direction.dot(q) / determinant;
    if !(w >= 0.0 && v + w <= 1.0) {
        return None;
    }
    Some((edge2.dot(q) / determinant, [v, w]))
}

impl Bounds {
    /// The empty box.
    pub const EMPTY: Self = Self {
        min: DVec3::INFINITY,
        max: DVec3::NEG_INFINITY,
    };

    /// The smallest box around both.
    pub fn union(self, other: Self) -> Self {
        Self {
            min: self.min.min(other.min),
            max: self.max.max(other.max),
        }
    }

    /// The centre of the box.
    pub fn center(&self) -> DVec3 {
        0.5 * (self.min + self.max)
    }

    /// The distance at which a ray enters the box, if before `far`. `inverse` is 1 / direction.
    pub fn enter(&self, origin: DVec3, inverse: DVec3, far: f64) -> Option<f64> {
        let (mut enter, mut leave) = (0.0_f64, far);
        for axis in 0..3 {
            let a = (self.min[axis] - origin[axis]) * inverse[axis];
            let b = (self.max[axis] - origin[axis]) * inverse[axis];
            // `f64::min` and `max` drop the NaN of 0 * inf, from a ray within the plane of a face: such a face does not limit.
            enter = enter.max(a.min(b));
            // A slab distance has three roundings: 1 + 2 gamma(3) (pbrt, 4th ed., eq. 6.41).
            leave = leave.min(a.max(b) * (1.0 + 8.0 * f64::EPSILON));
        }
        (enter <= leave).then_some(enter)
    }
}
