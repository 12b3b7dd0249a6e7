//! Lights that illuminate each point from a single direction: point, spot and directional lights.
//!
//! No direction is sampled, so there is no density: `L_o = f_cos E / cos`, where `E / cos` is the irradiance on a surface that
//! faces the light. At distance `d` from a point light with intensity `I` it is `I / d²`.

use super::falloff::{Cones, Falloff};
use super::reach::Reach;
use crate::lane::{Lane, Mask};
use crate::math::Vec3;
use crate::shape::BoundingSphere;

/// Shadow rays end this fraction of their length before the light, so that a surface containing the light does not block it. The
/// rounding error of a surface's distance is 1e-6 of its distance from the camera; pbrt-v4 uses 1e-4 (`ShadowEpsilon`).
pub const SHADOW_GAP: f32 = 1.0 / 65536.0;

/// A delta light, the same for all lanes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeltaLight {
    /// Position or direction.
    pub place: Place,
    /// Irradiance on a surface that faces the light, at the distance `unit` if the light has a position; W m⁻².
    pub le: [f32; 3],
}

/// Position or direction of a light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Place {
    /// At a point.
    At {
        /// The point.
        position: [f32; 3],
        /// The distance at which the irradiance is `le`.
        unit: f32,
        /// The cone of a spot.
        spot: Option<Falloff>,
    },
    /// Infinitely far away, in this unit direction.
    Toward([f32; 3]),
}

/// Incident light at points.
#[derive(Clone, Copy, Debug)]
pub struct Arriving<L: Lane> {
    /// Lanes that receive light.
    pub active: L::Mask,
    /// Unit direction to the light.
    pub wi: Vec3<L>,
    /// Length of shadow rays to the light.
    pub distance: L,
    /// Factor for [`DeltaLight::le`], without the cosine.
    pub strength: L,
}

/// Lights with a position, one in each lane.
#[derive(Clone, Copy, Debug)]
pub struct Placed<L: Lane> {
    /// Positions.
    pub position: Vec3<L>,
    /// The distances at which the irradiance is [`DeltaLight::le`].
    pub unit: L,
    /// Cones; those of point lights are [`Falloff::NONE`].
    pub cones: Cones<L>,
}

impl<L: Lane> Placed<L> {
    /// Unoccluded incident light at `p`.
    #[inline(always)]
    pub fn seen_from(&self, p: Vec3<L>) -> Arriving<L> {
        let arriving = Arriving::from(self.position, self.unit, p);
        let falloff = self.cones.at(arriving.wi);
        arriving.times(falloff)
    }
}

impl<L: Lane> Arriving<L> {
    /// From positions that emit in all directions.
    #[inline(always)]
    fn from(position: Vec3<L>, unit: L, p: Vec3<L>) -> Self {
        let to_light = position - p;
        let squared = to_light.length_squared();
        let distance = squared.sqrt();
        let inverse = L::one() / distance;
        let near = unit * inverse;
        Self {
            // At the light's position no direction is defined.
            active: squared.gt(L::zero()),
            wi: to_light * inverse,
            distance: distance * L::splat(1.0 - SHADOW_GAP),
            strength: mutate!(near * near, SquareForgotten => L::one()),
        }
    }

    /// A fraction of this light.
    #[inline(always)]
    fn times(self, fraction: L) -> Self {
        Self {
            active: self.active & fraction.gt(L::zero()),
            strength: self.strength * fraction,
            ..self
        }
    }
}

impl DeltaLight {
    /// Its position, if it has one, and the distance at which the irradiance is [`Self::le`].
    pub fn position(&self) -> Option<([f32; 3], f32)> {
        match self.place {
            Place::At { position, unit, .. } => Some((position, unit)),
            Place::Toward(_) => None,
        }
    }

    /// Where its shadow rays end, if it has a position.
    pub fn ball(&self) -> BoundingSphere {
        let (center, _) = self.position().unwrap_or_default();
        BoundingSphere { center, radius: 0.0 }
    }

    /// Bounds of its shadow rays.
    pub fn reach(&self) -> Reach {
        match self.place {
            Place::At { .. } => Reach::Within(self.ball()),
            Place::Toward(axis) => Reach::Cone { axis, tangent: 0.0 },
        }
    }

    /// Unoccluded incident light at `p`.
    #[inline(always)]
    pub fn seen_from<L: Lane>(&self, p: Vec3<L>) -> Arriving<L> {
        let (position, unit, spot) = match self.place {
            Place::Toward(wi) => {
                return Arriving {
                    active: L::Mask::splat(true),
                    wi: Vec3::splat(wi),
                    distance: L::splat(f32::INFINITY),
                    strength: L::one(),
                };
            }
            Place::At { position, unit, spot } => (position, unit, spot),
        };
        let arriving = Arriving::from(Vec3::splat(position), L::splat(unit), p);
        // Not a closure: it would become a call, compiled without the lanes' instruction set.
        match spot {
            Some(spot) => {
                let falloff = spot.at(arriving.wi);
                arriving.times(mutate!(falloff, FalloffForgotten => L::one()))
            }
            None => arriving,
        }
    }
}
