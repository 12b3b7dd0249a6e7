//! Lights without shape: delta lights and suns.

use std::f64::consts::PI;

use glam::DVec3;
use rand::{Rng, RngExt};

use super::brdf::around;
use crate::scene::Light;

/// Surfaces nearer to a light than this part of the distance do not block it, because a light may lie in a surface.
const GAP: f64 = 1.0 / 65536.0;

/// Angular radius in radians below which a sun is a delta light, as the scene format defines.
const SINGLE: f64 = 1e-6;

/// A light of the scene.
#[derive(Debug)]
pub enum ShapelessLight {
    /// At each point, its light comes from a single direction.
    Delta(Light),
    /// A sun.
    Disk(Disk),
}

/// A disk of uniform radiance at infinity.
#[derive(Debug)]
pub struct Disk {
    /// Unit direction to its centre.
    middle: DVec3,
    /// Its angular radius in radians.
    radius: f64,
    /// Radiance.
    pub le: DVec3,
}

/// Light that arrives from a single direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arrival {
    /// To the light; unit.
    pub wi: DVec3,
    /// Shapes nearer than this occlude it.
    pub distance: f64,
    /// Irradiance on a perpendicular surface.
    pub irradiance: DVec3,
}

impl ShapelessLight {
    /// From the scene's light.
    pub fn new(light: &Light) -> Self {
        match *light {
            Light::Directional {
                direction,
                irradiance,
                angular_radius,
            } if angular_radius.to_radians() >= SINGLE => {
                let radius = angular_radius.to_radians();
                Self::Disk(Disk {
                    middle: -unit(direction),
                    radius,
                    // E = L times the integral of cos over the disk, L pi sin².
                    le: irradiance / (PI * radius.sin().powi(2)),
                })
            }
            light => Self::Delta(light),
        }
    }

    /// The largest component of the intensity of a light with a position.
    pub fn intensity(&self) -> Option<f64> {
        match self {
            Self::Delta(Light::Point { intensity, .. } | Light::Spot { intensity, .. }) => {
                Some(intensity.max_element())
            }
            Self::Delta(Light::Directional { .. }) | Self::Disk(_) => None,
        }
    }
}

/// The light of a delta light at `point`; `None` if there is none.
pub fn arrival(light: &Light, point: DVec3) -> Option<Arrival> {
    let (position, intensity) = match *light {
        Light::Directional {
            direction, irradiance, ..
        } => {
            return Some(Arrival {
                wi: -unit(direction),
                distance: f64::INFINITY,
                irradiance,
            });
        }
        Light::Point { position, intensity }
        | Light::Spot {
            position, intensity, ..
        } => (position, intensity),
    };
    let away = position - point;
    let distance = away.length();
    let wi = away.try_normalize()?;
    let share = match *light {
        Light::Spot {
            direction,
            inner_angle,
            outer_angle,
            ..
        } => {
            let axis = unit(direction);
            // The angle from its tangent is accurate near the axis and far from it.
            let angle = axis.cross(-wi).length().atan2(axis.dot(-wi));
            let [inner, outer] = [inner_angle, outer_angle].map(f64::to_radians);
            if angle <= inner {
                1.0
            } else if angle >= outer {
                0.0
            } else {
                // cos a - cos b = 2 sin((a + b) / 2) sin((b - a) / 2), without cancellation.
                let less = |a: f64, b: f64| 2.0 * ((a + b) / 2.0).sin() * ((b - a) / 2.0).sin();
                let x = less(angle, outer) / less(inner, outer);
                x * x * (3.0 - 2.0 * x)
            }
        }
        _ => 1.0,
    };
    Some(Arrival {
        wi,
        distance: distance * (1.0 - GAP),
        irradiance: share * intensity / (distance * distance),
    })
}

impl Disk {
    /// Radiance from a unit direction.
    pub fn radiance(&self, wi: DVec3) -> DVec3 {
        if self.holds(wi) { self.le } else { DVec3::ZERO }
    }

    /// A direction, uniform over the disk.
    pub fn sample(&self, rng: &mut impl Rng) -> DVec3 {
        let below = rng.random::<f64>() * self.spread();
        around(self.middle, 1.0 - below, (below * (2.0 - below)).sqrt(), rng.random())
    }

    /// Density of [`sample`](Self::sample), sr⁻¹.
    pub fn density(&self, wi: DVec3) -> f64 {
        if self.holds(wi) { self.density_inside() } else { 0.0 }
    }

    /// The same for directions known to be in the disk.
    pub fn density_inside(&self) -> f64 {
        1.0 / (2.0 * PI * self.spread())
    }

    /// `1 - cos` of the radius.
    fn spread(&self) -> f64 {
        2.0 * (self.radius / 2.0).sin().powi(2)
    }

    fn holds(&self, wi: DVec3) -> bool {
        self.middle.cross(wi).length().atan2(self.middle.dot(wi)) <= self.radius
    }
}

/// Normalizes a vector of any length except 0.
fn unit(v: DVec3) -> DVec3 {
    (v / v.abs().max_element()).normalize()
}
