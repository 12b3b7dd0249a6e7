//! Lights without shape: point lights, spot lights and directional lights.

use glam::DVec3;

use super::{Effect, Effects};

/// Angular radius in radians below which a directional light is a delta light. Directions in single precision are 6e-8 apart: a
/// smaller disk could be sampled, but not hit. The approximation loses the square of it, 1e-12 of the light.
const SMALLEST_DISK: f64 = 1e-6;

/// A light without shape. It blocks no light. Radiometric quantities are finite and not negative.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Light {
    /// Uniform radiant intensity: the irradiance at distance `d` is `I cos / d²`.
    Point {
        /// Its position; finite.
        position: DVec3,
        /// W sr⁻¹.
        intensity: DVec3,
    },
    /// A spot light. With `c` the cosine of the angle from the axis, the intensity is multiplied by `x² (3 - 2 x)`, where `x =
    /// (c - cos outer) / (cos inner - cos outer)`, clamped to [0, 1] (pbrt-v4, `SpotLight`; Pharr, Jakob, Humphreys,
    /// "Physically Based Rendering", 4th edition, section 12.2.1).
    Spot {
        /// Its position; finite.
        position: DVec3,
        /// The axis, pointing away from the light; any length except 0.
        direction: DVec3,
        /// Intensity on the axis, W sr⁻¹.
        intensity: DVec3,
        /// Angle from the axis within which the intensity is full: degrees, 0 to `outer_angle`.
        inner_angle: f64,
        /// Angle from the axis beyond which there is no light: degrees, above 0, at most 180.
        outer_angle: f64,
    },
    /// Light from infinite distance.
    Directional {
        /// The direction of travel; any length except 0.
        direction: DVec3,
        /// Irradiance on a perpendicular surface, W m⁻².
        irradiance: DVec3,
        /// Angular radius in degrees, 0 to 90. Above 1e-6 radians the light is a disk with uniform radiance `E / (pi sin²)`,
        /// visible to the camera where no shape is. Otherwise it is a delta light.
        angular_radius: f64,
    },
}

/// The class of a light for estimators.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LightClass {
    /// Its light comes from a single direction, which only light sampling can find.
    Delta,
    /// A sun: a disk at infinity.
    Disk,
}

impl Light {
    /// A point light of this intensity (W sr⁻¹).
    pub fn point(position: impl Into<DVec3>, intensity: impl Into<DVec3>) -> Self {
        Self::Point {
            position: position.into(),
            intensity: intensity.into(),
        }
    }

    /// A spot light of this intensity (W sr⁻¹) at `position` aimed at `target`, full up to `inner_angle` from its axis and dark
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

    /// A directional light that travels along `direction`, from a disk of `angular_radius` degrees, or from a single direction
    /// if that is 0; `irradiance` in W m⁻² is for a perpendicular surface.
    pub fn directional(direction: impl Into<DVec3>, irradiance: impl Into<DVec3>, angular_radius: f64) -> Self {
        Self::Directional {
            direction: direction.into(),
            irradiance: irradiance.into(),
            angular_radius,
        }
    }

    /// Its class for estimators.
    pub fn class(&self) -> LightClass {
        match self {
            Self::Directional { angular_radius, .. } if angular_radius.to_radians() >= SMALLEST_DISK => {
                LightClass::Disk
            }
            _ => LightClass::Delta,
        }
    }

    /// Its emission as given: intensity or irradiance.
    pub fn power(&self) -> DVec3 {
        match *self {
            Self::Point { intensity, .. } | Self::Spot { intensity, .. } => intensity,
            Self::Directional { irradiance, .. } => irradiance,
        }
    }

    /// Mutable access to [`Self::power`].
    pub fn power_mut(&mut self) -> &mut DVec3 {
        match self {
            Self::Point { intensity, .. } | Self::Spot { intensity, .. } => intensity,
            Self::Directional { irradiance, .. } => irradiance,
        }
    }

    /// Whether it emits any light.
    pub fn emits(&self) -> bool {
        self.power().max_element() > 0.0
    }

    /// Its position, if it has one.
    pub fn position(&self) -> Option<DVec3> {
        match *self {
            Self::Point { position, .. } | Self::Spot { position, .. } => Some(position),
            Self::Directional { .. } => None,
        }
    }

    /// The effects that it requires.
    pub fn effects(&self) -> Effects {
        let effect = match self.class() {
            LightClass::Delta => Effect::DeltaLights,
            LightClass::Disk => Effect::Suns,
        };
        Effects::default().with(effect, self.emits())
    }
}
