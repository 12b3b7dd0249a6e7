//! Lights whose light comes from one direction at each point: a point, a spot, and light from infinitely far away.
//!
//! No direction is drawn, so no density weighs them: `L_o = f_cos E / cos`, with `E / cos` the irradiance on a surface that faces the
//! light. At distance `d` of a point with the intensity `I` that is `I / d²`.

use super::falloff::Falloff;
use super::reach::Reach;
use crate::lane::{Lane, Mask};
use crate::math::Vec3;
use crate::shape::Ball;

/// How much before a light its shadow rays end, of their length: a surface that a light lies in does not block it. Rounding in the
/// distance of a surface is 1e-6 of the camera's; pbrt-v4 takes 1e-4 (`ShadowEpsilon`).
pub const SHADOW_GAP: f32 = 1.0 / 65536.0;

/// A light, the same for all lanes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeltaLight {
    /// Where it is.
    pub place: Place,
    /// Irradiance on a surface that faces it, at the distance `unit` where it is somewhere; W m⁻².
    pub le: [f32; 3],
}

/// Where a light is.
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

/// The light that arrives at points.
#[derive(Clone, Copy, Debug)]
pub struct Arriving<L: Lane> {
    /// Lanes with any light.
    pub active: L::Mask,
    /// To the light; unit.
    pub wi: Vec3<L>,
    /// Where shadow rays to it end.
    pub distance: L,
    /// What [`DeltaLight::le`] is multiplied by, without the cosine.
    pub strength: L,
}

impl DeltaLight {
    /// Where its shadow rays go.
    pub fn reach(&self) -> Reach {
        match self.place {
            Place::At { position, .. } => Reach::Ball(Ball {
                center: position,
                radius: 0.0,
            }),
            Place::Toward(axis) => Reach::Cone { axis, tangent: 0.0 },
        }
    }

    /// The light that arrives at `p` where nothing is in its way.
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
        let to_light = Vec3::splat(position) - p;
        let squared = to_light.length_squared();
        let distance = squared.sqrt();
        let inverse = L::one() / distance;
        let wi = to_light * inverse;
        let near = L::splat(unit) * inverse;
        // Not a closure: it would be a call, compiled without the lanes' instructions.
        let falloff = match spot {
            Some(spot) => mutate!(spot.at(wi), FalloffForgotten => L::one()),
            None => L::one(),
        };
        Arriving {
            // At the light itself nothing has a direction.
            active: squared.gt(L::zero()) & falloff.gt(L::zero()),
            wi,
            distance: distance * L::splat(1.0 - SHADOW_GAP),
            strength: mutate!(near * near, SquareForgotten => L::one()) * falloff,
        }
    }
}
