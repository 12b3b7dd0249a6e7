//! Lights that are no shapes: a point, a spot, and light from one direction.

use glam::DVec3;

use super::{Effect, Effects};

/// Angular radius in radians below which a directional light is a delta light. Directions in single precision are 6e-8 apart: a
/// smaller disk could be drawn, but neither seen nor met. What is lost is the square of it, 1e-12 of the light.
const SMALLEST_DISK: f64 = 1e-6;

/// A light that nothing of the scene is the surface of. It blocks no light. Radiometric quantities are finite and not negative.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Light {
    /// The same radiant intensity in all directions: the irradiance at distance `d` is `I cos / d²`.
    Point {
        /// Where it is; finite.
        position: DVec3,
        /// W sr⁻¹.
        intensity: DVec3,
    },
    /// A point that shines in a cone. With `c` the cosine of the angle from the axis, the intensity is multiplied by `x² (3 - 2 x)`,
    /// where `x = (c - cos outer) / (cos inner - cos outer)`, clamped to [0, 1] (pbrt-v4, `SpotLight`; Pharr, Jakob, Humphreys,
    /// "Physically Based Rendering", 4th edition, section 12.2.1).
    Spot {
        /// Where it is; finite.
        position: DVec3,
        /// The axis, from the light; of any length but 0.
        direction: DVec3,
        /// On the axis, W sr⁻¹.
        intensity: DVec3,
        /// Angle from the axis up to which the intensity is that of the axis: degrees, 0 to `outer_angle`.
        inner_angle: f64,
        /// Angle from the axis from which on there is no light: degrees, above 0, at most 180.
        outer_angle: f64,
    },
    /// Light from infinitely far away.
    Directional {
        /// Where the light goes; of any length but 0.
        direction: DVec3,
        /// On a surface that faces the light, W m⁻².
        irradiance: DVec3,
        /// Degrees, 0 to 90. Above 1e-6 radians the light is a disk of the sky, uniform of radiance `E / (pi sin²)`: the camera sees it
        /// where no shape is. Else it is a delta light.
        angular_radius: f64,
    },
}

/// What a light is for an estimator.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LightClass {
    /// Its light comes from one direction, which no other technique can find.
    Delta,
    /// A disk of the sky.
    Disk,
}

impl Light {
    /// A point of this intensity (W sr⁻¹).
    pub fn point(position: impl Into<DVec3>, intensity: impl Into<DVec3>) -> Self {
        Self::Point {
            position: position.into(),
            intensity: intensity.into(),
        }
    }

    /// A spot of this intensity (W sr⁻¹) at `position` that shines at `target`, fully up to `inner_angle` from its axis and not at all
    /// from `outer_angle` on, both in degrees.
    pub fn spot(
        position: impl Into<DVec3>,
        target: impl Into<DVec3>,
        intensity: impl Into<DVec3>,
        [inner_angle, outer_angle]: [f64; 2],
    ) -> Self {
        let position = position.into();
        Self::Spot {
            position,
            direction: target.into() - position,
            intensity: intensity.into(),
            inner_angle,
            outer_angle,
        }
    }

    /// Light that goes along `direction` from a disk of `angular_radius` degrees, or from one direction where that is 0; `irradiance` in
    /// W m⁻² is that of a surface that faces it.
    pub fn directional(direction: impl Into<DVec3>, irradiance: impl Into<DVec3>, angular_radius: f64) -> Self {
        Self::Directional {
            direction: direction.into(),
            irradiance: irradiance.into(),
            angular_radius,
        }
    }

    /// Whether an estimator can meet it.
    pub fn class(&self) -> LightClass {
        match self {
            Self::Directional { angular_radius, .. } if angular_radius.to_radians() >= SMALLEST_DISK => {
                LightClass::Disk
            }
            _ => LightClass::Delta,
        }
    }

    /// What it emits, as it is written: intensity or irradiance.
    pub fn power(&self) -> DVec3 {
        match *self {
            Self::Point { intensity, .. } | Self::Spot { intensity, .. } => intensity,
            Self::Directional { irradiance, .. } => irradiance,
        }
    }

    /// As [`Self::power`], to be changed.
    pub fn power_mut(&mut self) -> &mut DVec3 {
        match self {
            Self::Point { intensity, .. } | Self::Spot { intensity, .. } => intensity,
            Self::Directional { irradiance, .. } => irradiance,
        }
    }

    /// Whether any light comes from it.
    pub fn emits(&self) -> bool {
        self.power().max_element() > 0.0
    }

    /// Where it is, if it is anywhere.
    pub fn position(&self) -> Option<DVec3> {
        match *self {
            Self::Point { position, .. } | Self::Spot { position, .. } => Some(position),
            Self::Directional { .. } => None,
        }
    }

    /// What it requires.
    pub fn effects(&self) -> Effects {
        let effect = match self.class() {
            LightClass::Delta => Effect::DeltaLights,
            LightClass::Disk => Effect::Suns,
        };
        Effects::default().with(effect, self.emits())
    }
}
