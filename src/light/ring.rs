//! Product sampling of a Phong lobe and a spherical light: samples the part of the lobe inside the light's cap, in proportion to
//! the lobe.
//!
//! The lobe is `(a + 1) / (2 pi) cos(theta)^a` about the mirror direction `wr`. The cap is the cone that the light subtends.
//! Circles of constant `theta` about `wr` ("rings") intersect the cap between its nearest and its farthest ring, each in one arc:
//!
//! - the polar angle is sampled from the lobe's mass between those two rings,
//! - the azimuth is sampled uniformly in the arc of that ring inside the cap.
//!
//! The density of a direction is `lobe(wi) pi / (m phi(theta))`, where `m` is the lobe's mass between the rings and `phi` is half
//! the arc. So `f_cos / pdf = rho m phi / pi (n . wi)`, which is smooth and at most `rho`. There is no random choice of technique
//! and no table.
//!
//! All angles are stored as `1 - cos`, and nearly equal numbers are never subtracted. The formulas therefore hold for lights with a
//! sine of 1e-7 and for exponents of 1e6. With `d` the angle between `wr` and the axis of the cap and `tl` the half-angle of the
//! cap, `(1 - cos(d - tl)) (1 - cos(d + tl)) = (cos d - cos tl)^2` gives the nearest ring from the farthest.

use std::f32::consts::{FRAC_1_PI, PI};

use super::Cone;
use crate::lane::{Lane, Mask};
use crate::math::elementary::{angle, exp, expm1, ln_1m, sin_cos_turn};
use crate::math::{Frame, Vec3};
use crate::sampling::sampler::RARE;

/// The largest `t` below 1, so that `ln(1 - t)` is finite.
const BELOW_ONE: f32 = 1.0 - 1.0 / 16_777_216.0;

/// The rings of a lobe that intersect a light's cap. All fields are dimensionless.
#[derive(Clone, Copy, Debug)]
pub struct Rings<L: Lane> {
    /// `1 - cos(d)`, where `d` is the angle between the lobe's axis and the cap's.
    pub apart: L,
    /// `1 - cos` of the nearest ring of the cap's rim. `width` is that of the farthest ring, minus this.
    pub nearest: L,
    /// See [`Self::nearest`]. Nonnegative.
    pub width: L,
    /// `1 - cos` of the cap's half-angle.
    pub one_minus_cos_max: L,
    /// Of the lobe beyond the first ring that intersects the cap, the fraction nearer than the farthest ring; in [0, 1].
    pub share: L,
    /// Fraction of the whole lobe between the rings, in [0, 1].
    pub mass: L,
}

/// A sampled ring.
#[derive(Clone, Copy, Debug)]
pub struct Ring<L: Lane> {
    /// `1 - cos` of the angle from the lobe's axis, in [0, 1].
    pub t: L,
    /// Half the arc of the ring inside the cap, in [0, pi].
    pub half_arc: L,
}

impl<L: Lane> Rings<L> {
    /// The rings of the lobe about the unit vector `wr` with exponent `alpha` that intersect `cone`. Inside a light this is the
    /// whole lobe.
    #[inline(always)]
    pub fn of(wr: Vec3<L>, alpha: L, cone: &Cone<L>) -> Self {
        let (zero, one, two) = (L::zero(), L::one(), L::splat(2.0));
        let one_minus_cos_max = cone.one_minus_cos_max;
        // Computed from the chord: accurate to the last digits if the axes nearly coincide.
        let apart = cone.t(wr);
        // sin(d) sin(tl); a rounded `apart` may exceed 2.
        let sines = (apart * (two - apart) * one_minus_cos_max * (two - one_minus_cos_max)).safe_sqrt();
        let farthest = apart + one_minus_cos_max - apart * one_minus_cos_max + sines;
        let gap = apart - one_minus_cos_max;
        let nearest = (gap * gap).div_or_zero(farthest, farthest.gt(zero));
        let width = sines + sines;
        let outside = gap.gt(zero) & !cone.inside;
        let first = nearest.or_zero(outside);
        let span = L::select(outside, width, farthest);
        let left = one - first;
        let lit = left.gt(zero);
        let part = span.div_or_zero(left, lit);
        // Beyond 90 degrees the lobe is 0, so everything beyond the first ring counts.
        let whole = part.ge(one) | cone.inside;
        let power = alpha + one;
        let share = -expm1(power * ln_1m(part.min(L::splat(BELOW_ONE))));
        let share = L::select(whole, one, mutate!(share, FarRingForgotten => one));
        let beyond_first = exp(power * ln_1m(first.min(L::splat(BELOW_ONE))));
        Self {
            apart,
            nearest,
            width,
            one_minus_cos_max,
            share,
            mass: mutate!(beyond_first * share, MassBetweenRingsForgotten => beyond_first).or_zero(lit),
        }
    }

    /// With [`RARE`] times the mass where only one sample in so many is taken.
    #[inline(always)]
    pub fn weighed_in_tail(self, beside_tail: L::Mask) -> Self {
        Self {
            mass: L::select(
                beside_tail,
                self.mass,
                self.mass * L::splat(mutate!(RARE, RouletteWeightForgotten => 1.0)),
            ),
            ..self
        }
    }

    /// Lanes where the lobe's axis is outside the cap.
    #[inline(always)]
    fn outside(&self) -> L::Mask {
        self.apart.gt(self.one_minus_cos_max) & self.one_minus_cos_max.le(L::one())
    }

    /// Samples a ring from `u` in [0, 1).
    #[inline(always)]
    pub fn draw(&self, alpha: L, u: L) -> Ring<L> {
        let (zero, one) = (L::zero(), L::one());
        let outside = self.outside();
        let inside_light = self.one_minus_cos_max.gt(one);
        let first = self.nearest.or_zero(outside);
        let part = (u * self.share).min(L::splat(BELOW_ONE));
        let r = -expm1(ln_1m(part) / (alpha + one));
        let past = (one - first) * r;
        let t = first + past;
        // Distance past the nearest ring of the rim.
        let g = L::select(outside, past, t - self.nearest);
        let sine = (g * (self.width - g)).safe_sqrt();
        let cosine = t + self.apart - t * self.apart - self.one_minus_cos_max;
        let arc = angle(sine, cosine);
        let half_arc = L::select(inside_light, L::splat(PI), mutate!(arc, ArcTakenAsPi => L::splat(PI)));
        Ring {
            t: t.max(zero),
            half_arc,
        }
    }

    /// `f_cos / pdf` without the reflectance and the cosine of a direction of `ring`.
    #[inline(always)]
    pub fn weight(&self, ring: &Ring<L>) -> L {
        self.mass * ring.half_arc * L::splat(FRAC_1_PI)
    }
}

impl<L: Lane> Ring<L> {
    /// The unit direction at `v` in [0, 1) on the ring's arc, about the lobe's axis `wr`; `toward` is the axis of the cap.
    ///
    /// The azimuth is that of the cap's axis, plus or minus a part of half the arc: no frame is needed but where the axes coincide.
    #[inline(always)]
    pub fn direction(&self, wr: Vec3<L>, toward: Vec3<L>, v: L) -> Vec3<L> {
        let one = L::one();
        // The chord, not the axis itself, loses no digits where the axes nearly coincide.
        let chord = toward - wr;
        let mut aside = wr.mul_add(-wr.dot(chord), chord);
        let mut level = aside.length_squared();
        // If the axes coincide, any azimuth works.
        let leans = level.gt(L::zero());
        if !leans.all() {
            aside = Vec3::select(leans, aside, Frame::about(wr).tangent);
            level = L::select(leans, level, one);
        }
        let (sin, cos) = sin_cos_turn((v + v - one) * self.half_arc * L::splat(0.5 * FRAC_1_PI));
        let k = (self.t * (L::splat(2.0) - self.t) / level).safe_sqrt();
        let across = aside * (k * cos) + wr.cross(aside) * (k * sin);
        wr.mul_add(one - self.t, across)
    }
}
