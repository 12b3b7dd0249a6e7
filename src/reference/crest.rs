//! Directions to a sphere that the horizon cuts: only to its part above, in proportion to the cosine.
//!
//! Of a sphere that barely rises above the horizon, uniform directions in its cone find nothing but once in thousands of samples.
//! Here they are uniform in projected solid angle over the patch of azimuths and elevations around the visible part: elevations
//! up to that of the sphere's top, azimuths up to its sides. Of a thin crest the part below the arc is 8/15 of the patch.

use std::f64::consts::PI;

use glam::DVec3;
use rand::{Rng, RngExt};

/// The patch around the part of a sphere above the horizon.
#[derive(Clone, Copy, Debug)]
pub struct Crest {
    /// Unit normal of the surface.
    n: DVec3,
    /// Unit, on the horizon: the azimuth of the sphere's centre.
    toward: DVec3,
    /// Sine of the largest elevation.
    top: f64,
    /// Largest azimuth to either side of `toward`, in radians.
    side: f64,
}

impl Crest {
    /// `None` unless the horizon of a point with normal `n` cuts the sphere, whose centre is at `to_center` from the point. Seen
    /// from inside, it always does.
    pub fn new(to_center: DVec3, radius: f64, n: DVec3) -> Option<Self> {
        let height = to_center.dot(n);
        if height.abs() >= radius {
            return None;
        }
        let level = to_center - height * n;
        let toward = level.try_normalize().unwrap_or_else(|| n.any_orthonormal_vector());
        // Squares of the centre's horizontal distance, and of the length of a tangent to the sphere.
        let (across, tangent) = (level.length_squared(), to_center.length_squared() - radius * radius);
        let whole = Self {
            n,
            toward,
            top: 1.0,
            side: PI,
        };
        if tangent <= 0.0 || (height > 0.0 && across <= radius * radius) {
            return Some(whole);
        }
        // The elevation of the top is the sum of the centre's and of the angular radius. Below the horizon its sine is a
        // difference, which this form computes without cancellation.
        let cut = (radius - height) * (radius + height);
        let (up, down) = (radius * across.sqrt(), height * tangent.sqrt());
        let (top, side) = if height < 0.0 {
            (cut / (up - down), cut.sqrt().atan2(tangent.sqrt()))
        } else {
            let beside = (across - radius * radius).sqrt();
            ((up + down) / to_center.length_squared(), radius.atan2(beside))
        };
        Some(Self { top, side, ..whole })
    }

    /// A direction in the patch; it may miss the sphere.
    pub fn sample(&self, rng: &mut impl Rng) -> DVec3 {
        let sine = self.top * (1.0 - rng.random::<f64>()).sqrt();
        let turn = self.side * (2.0 * rng.random::<f64>() - 1.0);
        let level = turn.cos() * self.toward + turn.sin() * self.n.cross(self.toward);
        ((1.0 - sine * sine).max(0.0).sqrt() * level + sine * self.n).normalize()
    }

    /// Density of a direction to the sphere, sr⁻¹: the cosine over the patch's projected solid angle; 0 below the horizon.
    pub fn density(&self, wi: DVec3) -> f64 {
        self.n.dot(wi).max(0.0) / (self.side * self.top * self.top)
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_pcg::Pcg64;

    use super::*;

    /// The projected solid angle of the visible part of a sphere, whose centre is at this elevation, by quadrature over azimuths:
    /// at each up to `most`, the elevations in the sphere form one interval.
    fn projected(elevation: f64, angular_radius: f64, most: f64) -> f64 {
        let steps = 200_000;
        let of = |k: i32| {
            let azimuth = most * (f64::from(k) + 0.5) / f64::from(steps);
            let (up, level) = (elevation.sin(), elevation.cos() * azimuth.cos());
            let cosine = angular_radius.cos() / up.hypot(level);
            if cosine.abs() > 1.0 {
                return 0.0;
            }
            let (middle, half) = (up.atan2(level), cosine.acos());
            let [low, high] = [middle - half, middle + half].map(|e| e.clamp(0.0, PI / 2.0).sin().powi(2));
            high - low
        };
        // Half of the squares' difference, on both sides of the centre.
        (0..steps).map(of).sum::<f64>() * most / f64::from(steps)
    }

    /// Cosine over density is the patch's projected solid angle, and the directions that meet the sphere are the sphere's share of
    /// it. Thresholds at four standard deviations, 6e-5 each; of thin crests the quadrature is exact to 1e-4.
    #[test]
    fn directions_to_the_visible_part_are_even_in_projected_solid_angle() {
        let n = DVec3::new(0.3, -0.2, 0.9).normalize();
        let level = n.any_orthonormal_vector();
        let mut rng = Pcg64::seed_from_u64(8);
        let count = 40_000;
        for (radius, height) in [
            (1e-3_f64, -1e-3_f64 * (1.0 - 1e-3)),
            (0.2, -0.1),
            (0.2, 0.0),
            (0.2, 0.15),
            (0.9, -0.5),
            (0.9, 0.3),
            (0.9, 0.89),
        ] {
            let to_center = (1.0 - height * height).sqrt() * level + height * n;
            let crest = Crest::new(to_center, radius, n).unwrap();
            let mut met = 0;
            for _ in 0..count {
                let wi = crest.sample(&mut rng);
                let along = to_center.dot(wi);
                met += i32::from(along > 0.0 && (to_center - along * wi).length() <= radius);
                let patch = n.dot(wi) / crest.density(wi);
                assert!((patch / (crest.side * crest.top * crest.top) - 1.0).abs() < 1e-9);
            }
            let share = f64::from(met) / f64::from(count);
            let most = if radius < 0.1 { 1e-3 } else { PI };
            let expected = projected(height.asin(), radius.asin(), most) / (crest.side * crest.top * crest.top);
            let noise = 4.0 * (expected * (1.0 - expected) / f64::from(count)).sqrt();
            assert!(
                (share - expected).abs() < noise + 1e-4,
                "{radius} {height}: {share} {expected}"
            );
            assert!(
                expected > 0.4,
                "{radius} {height}: few directions meet the sphere: {expected}"
            );
        }
    }

    #[test]
    fn a_sphere_that_the_horizon_does_not_cut_has_no_crest_and_from_inside_it_is_the_hemisphere() {
        let of = |height: f64, radius: f64| Crest::new(DVec3::new(3.0, 0.0, height), radius, DVec3::Z);
        assert!(of(1.0, 1.0).is_none() && of(-1.0, 1.0).is_none() && of(0.9, 1.0).is_some());
        let inside = of(-1.0, 4.0).unwrap();
        assert_eq!(inside.density(DVec3::Z), 1.0 / PI);
    }
}
