//! Validation of lights without shape.

use glam::DVec3;

use super::{Checked, broken, number, shown, shown_vector, single, vector};
use crate::scene::invalid::Wrong;
use crate::scene::light::{Light, LightClass};
use crate::scene::rule::{ANGULAR_RADIUS, FINITE, INNER_ANGLE, NOT_NEGATIVE, OUTER_ANGLE};

/// Irradiance on a perpendicular surface over the radiance of a sun: `pi sin²` of the angular radius in degrees.
fn facing(angular_radius: f64) -> f64 {
    std::f64::consts::PI * angular_radius.to_radians().sin().powi(2)
}

pub(super) fn light(light: &Light) -> Checked {
    match *light {
        Light::Point { position, intensity } => {
            vector("position", position, &FINITE)?;
            vector("intensity", intensity, &NOT_NEGATIVE)
        }
        Light::Spot {
            position,
            direction: axis,
            intensity,
            inner_angle,
            outer_angle,
        } => {
            vector("position", position, &FINITE)?;
            direction(axis, "write where the spot shines, such as [0, -1, 0] for down")?;
            vector("intensity", intensity, &NOT_NEGATIVE)?;
            number("outer_angle", outer_angle, &OUTER_ANGLE)?;
            number("inner_angle", inner_angle, &INNER_ANGLE)?;
            if inner_angle <= outer_angle {
                return Ok(());
            }
            Err(broken(single("inner_angle"), inner_angle, &INNER_ANGLE))
        }
        Light::Directional {
            direction: axis,
            irradiance,
            angular_radius,
        } => {
            direction(axis, "write where the light goes, such as [0, -1, 0] for down")?;
            vector("irradiance", irradiance, &NOT_NEGATIVE)?;
            number("angular_radius", angular_radius, &ANGULAR_RADIUS)?;
            let disk = light.class() == LightClass::Disk;
            if !disk || irradiance.max_element() / facing(angular_radius) <= f64::from(f32::MAX) {
                return Ok(());
            }
            let remedy = "make the disk larger or its light less, or leave angular_radius out";
            let wrong = Wrong::new("makes a disk whose radiance is beyond single precision", remedy);
            Err(wrong.of(single("angular_radius"), shown(angular_radius)))
        }
    }
}

/// Checks a direction: any finite vector except 0. A target was made a direction from the light before.
fn direction(axis: DVec3, remedy: &'static str) -> Checked {
    vector("direction", axis, &FINITE)?;
    if axis != DVec3::ZERO {
        return Ok(());
    }
    Err(Wrong::new("must not be zero", remedy).of(single("direction"), shown_vector(axis)))
}
