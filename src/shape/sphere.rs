//! Spheres for ray tracing.

use super::BoundingSphere;
use crate::lane::{Lane, Mask};
use crate::math::Vec3;

/// A sphere whose surface is closer to the origin than this fraction of its radius stores its [power](Sphere::origin_power).
const NEAR: f64 = 1.0 / 16.0;

/// A sphere, relative to the origin. If its surface passes close to the origin compared with its radius, center and radius alone
/// would displace it by `radius · 2^-24`: 0.06 for a ground of radius 10^6.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    /// Center and radius.
    pub ball: BoundingSphere,
    /// The power of the origin, `|center|² - radius²`, rounded once from `f64`, if the surface is close to the origin.
    pub origin_power: Option<f32>,
}

impl From<BoundingSphere> for Sphere {
    fn from(ball: BoundingSphere) -> Self {
        Self {
            ball,
            origin_power: None,
        }
    }
}

impl Sphere {
    /// Rounds a sphere given relative to the origin.
    pub fn new(center: [f64; 3], radius: f64) -> Self {
        let distance = center.iter().map(|x| x * x).sum::<f64>().sqrt();
        let near = (distance - radius).abs() <= NEAR * radius;
        Self {
            ball: BoundingSphere {
                center: center.map(|x| x as f32),
                radius: radius as f32,
            },
            origin_power: near.then_some(((distance - radius) * (distance + radius)) as f32),
        }
    }

    /// Closest intersection in `[tnear, tfar]` of rays with the sphere, from outside or inside. A sphere that passes close to the
    /// origin is hit only beyond `tnear`, so that a camera on its surface sees its surroundings.
    ///
    /// The power of the ray's origin `o` is `o·(o - 2 center) + origin_power`; its error grows with the distance from the origin
    /// instead of the radius.
    #[inline(always)]
    pub fn intersect<L: Lane>(&self, origin: Vec3<L>, direction: Vec3<L>, tnear: L, tfar: L) -> (L::Mask, L) {
        let Some(origin_power) = self.origin_power else {
            return self.ball.intersect(origin, direction, tnear, tfar);
        };
        let center = Vec3::splat(self.ball.center);
        let a = direction.length_squared();
        let b = (center - origin).dot(direction);
        let power = origin.dot(origin - (center + center)) + L::splat(origin_power);
        let discriminant = b.mul_add(b, -(a * power));
        let meets = discriminant.ge(L::zero());
        if meets.none() {
            return (meets, tfar);
        }
        let q = b + discriminant.safe_sqrt().negated(b.lt(L::zero()));
        let (t0, t1) = (power / q, q / a);
        let (near, far) = (t0.min(t1), t0.max(t1));
        let near_counts = near.gt(tnear) & near.le(tfar);
        let far_counts = far.gt(tnear) & far.le(tfar);
        (meets & (near_counts | far_counts), L::select(near_counts, near, far))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lane::F32x8;

    /// The first root beyond 0, in `f64`, as a sum without cancellation.
    fn truth(center: [f64; 3], radius: f64, direction: [f64; 3]) -> Option<f64> {
        let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let distance = dot(center, center).sqrt();
        let (b, power) = (dot(center, direction), (distance - radius) * (distance + radius));
        let discriminant = b * b - power;
        let root = (discriminant >= 0.0).then(|| discriminant.sqrt())?;
        let q = if b < 0.0 { b - root } else { b + root };
        let (t0, t1) = (power / q, q);
        [t0.min(t1), t0.max(t1)].into_iter().find(|&t| t > 0.0)
    }

    /// Grounds of any radius are at their exact distance, within a few ulps, and eight lanes have the same bits as one.
    #[test]
    fn the_ground_is_a_large_sphere_where_it_should_be() {
        for radius in [1e2, 1e3, 1e4, 1e6, 1e9] {
            for height in [2.0, 1e-3, 1e-7, 0.0, -1e-7, -1e-3] {
                let center = [0.1 * height, -(radius + height), 0.2 * height];
                let sphere = Sphere::new(center, radius);
                assert!(sphere.origin_power.is_some());
                for (x, y, z) in [
                    (0.0, -1.0, 0.0),
                    (0.6, -0.8, 0.0),
                    (0.9, -0.3, 0.3),
                    (0.2, 0.9, 0.1),
                    (0.7, 1e-3, 0.7),
                ] {
                    let length = f64::sqrt(x * x + y * y + z * z);
                    let d = [x / length, y / length, z / length].map(|x| x as f32);
                    let exact = truth(center, radius, d.map(f64::from));
                    let (meets, t) = sphere.intersect(Vec3::<f32>::zero(), Vec3::splat(d), 0.0, f32::INFINITY);
                    let case = format!("radius {radius}, height {height}, along {d:?}: {t} for {exact:?}");
                    assert_eq!(meets, exact.is_some(), "{case}");
                    if let Some(exact) = exact {
                        assert!((f64::from(t) / exact - 1.0).abs() < 2e-6, "{case}");
                    }
                    let (eight, wide) = sphere.intersect(
                        Vec3::<F32x8>::zero(),
                        Vec3::splat(d),
                        F32x8::zero(),
                        F32x8::splat(f32::INFINITY),
                    );
                    assert_eq!(eight.any(), meets);
                    assert!(!meets || wide.lane(5).to_bits() == t.to_bits());
                }
            }
        }
    }

    /// Points `gap` above the ground see it below the horizon, and not above.
    #[test]
    fn what_stands_on_the_ground_is_not_inside_of_it() {
        for radius in [1e3, 1e4, 1e6] {
            let sphere = Sphere::new([0.0, -(radius + 2.0), 0.0], radius);
            for x in [0.0_f32, 0.5, 3.0, -7.0] {
                // The height of the sphere there, from the sagitta.
                let sag = f64::from(x).powi(2) / (radius + (radius * radius - f64::from(x).powi(2)).sqrt());
                for (gap, direction, met) in [
                    (1e-5, [0.1, 1.0, 0.2], false),
                    (1e-5, [0.1, -1.0, 0.2], true),
                    (-1e-5, [0.1, 1.0, 0.2], true),
                ] {
                    let origin = Vec3::splat([x, (-2.0 - sag + gap) as f32, 0.0]);
                    let (meets, t) = sphere.intersect(origin, Vec3::<f32>::splat(direction), 0.0, 100.0);
                    assert_eq!(meets, met, "radius {radius}, x {x}, gap {gap}: at {t}");
                }
            }
        }
    }
}
