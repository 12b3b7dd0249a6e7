//! The part of a light above the horizon, sampled uniformly in projected solid angle, i.e. cosine-weighted. The cosine is all that
//! varies over an unoccluded light on a diffuse surface.
//!
//! The idea is from Peters and Dachsbacher 2019, "Sampling Projected Spherical Caps in Real Time". Regions and maps are derived
//! anew here for single precision. In the projection onto the plane of the surface, the cap's rim is an ellipse and the horizon is
//! the unit circle. With `x` along the projected axis of the cap:
//!
//! - **whole**: the ellipse, filled like a disk;
//! - **cut**, axis above the horizon: two fans around the center of the ellipse. The area of the fan to the rim's arc is linear in
//!   the rim's angle; the area of the fan to the horizon's arc follows Kepler's equation;
//! - **lune**, axis below the horizon: strips along `x` between rim and horizon. Their lengths are `height^2 / (sum of both ends)`.
//!   Their sum is a quadrature of positive terms, inverted by Newton's method.
//!
//! No direction depends on a difference of nearly equal numbers: the maps compute offsets from the axis instead of points of the
//! plane. They therefore hold for caps with a sine of 1e-7 as well as for half the sky. Three of the maps' lengths are squares over
//! sums, as in [`Cone`].

use std::f32::consts::{FRAC_1_PI, PI};

use super::Cone;
use crate::lane::{Lane, Mask};
use crate::math::elementary::{angle, exp, ln, sin_cos_turn};
use crate::math::{Frame, Vec3};

/// The part of a light above the plane of a surface.
#[derive(Clone, Copy, Debug)]
pub struct Cap<L: Lane> {
    /// Towards the center of the light; perpendicular to it towards the normal; along the horizon.
    axes: [Vec3<L>; 3],
    /// `1 - cos` of the half-angle, its cosine and its sine.
    one_minus_cos_max: L,
    cosine: L,
    sine: L,
    /// Height of the axis over the plane, and length of its projection.
    high: L,
    level: L,
    /// `x` of the ellipse's center, and 1 minus that.
    middle: L,
    from_middle: L,
    /// Half the arc of the rim above the horizon, and half the arc of the horizon inside the rim; radians.
    rim: L,
    horizon: L,
    /// Half the areas of both fans, or of the lune.
    by_rim: L,
    by_horizon: L,
    /// Squared sine of half the rim's arc of a lune.
    tip: L,
    /// Sum of the lune's strips, in the units of [`Self::rest`].
    strips: L,
    lune: L::Mask,
}

/// A direction in the cap.
#[derive(Clone, Copy, Debug)]
pub struct Drawn<L: Lane> {
    /// The unit direction.
    pub wi: Vec3<L>,
    /// Its cosine with the normal; positive except for underflow.
    pub cos_theta: L,
    /// `1 - cos` of the angle from the axis of the light's cone.
    pub t: L,
}

/// Gauss-Legendre nodes and weights on [0, 1].
const NODES: [(f32, f32); 8] = [
    (0.019_855_072, 0.050_614_268),
    (0.101_666_76, 0.111_190_52),
    (0.237_233_8, 0.156_853_32),
    (0.408_282_67, 0.181_341_89),
    (0.591_717_3, 0.181_341_89),
    (0.762_766_2, 0.156_853_32),
    (0.898_333_25, 0.111_190_52),
    (0.980_144_9, 0.050_614_268),
];

impl<L: Lane> Cap<L> {
    /// The part of a cone above the plane with the unit normal `n`. Inside a light it is the hemisphere.
    #[inline(always)]
    pub fn above(n: Vec3<L>, cone: &Cone<L>) -> Self {
        let (zero, one, two) = (L::zero(), L::one(), L::splat(2.0));
        let inside = cone.inside;
        let axis = Vec3::select(inside, n, cone.axis);
        let one_minus_cos_max = L::select(inside, one, cone.one_minus_cos_max);
        let sine = (one_minus_cos_max * (two - one_minus_cos_max)).sqrt();
        let cosine = one - one_minus_cos_max;
        let frame = Frame::about(axis);
        let (a, b) = (n.dot(frame.tangent), n.dot(frame.bitangent));
        let high = n.dot(axis);
        let level = a.mul_add(a, b * b).sqrt();
        // If the normal is the axis, any perpendicular direction works.
        let leans = level.gt(zero);
        let (a, b) = (
            L::select(leans, a.div_or_zero(level, leans), one),
            b.div_or_zero(level, leans),
        );
        let up = frame.tangent * a + frame.bitangent * b;
        let across = frame.bitangent * a - frame.tangent * b;

        // Height of the rim's center over its radius: the rim is above the horizon where `level cos(angle) + rise > 0`.
        let rise = cosine * high / sine;
        let risen = high.ge(zero);
        let crosses = rise.abs().lt(level);
        let lune = crosses & !risen;
        let cut = crosses & risen;
        let middle = cosine * level;
        let from_middle = sine * sine * rise.mul_add(rise, one) / (one + middle);
        let (cos_rim, both) = (-rise.div_or_zero(level, crosses), level * level);
        let sin_rim = ((level - rise) * (level + rise)).div_or_zero(both, crosses).safe_sqrt();
        let rim = L::select(crosses, angle(sin_rim, cos_rim), L::splat(PI));
        let horizon = angle(sine * sin_rim, cosine.div_or_zero(level, cut));
        let horizon = horizon.or_zero(cut);
        let mut cap = Self {
            axes: [axis, up, across],
            one_minus_cos_max,
            cosine,
            sine,
            high,
            level,
            middle,
            from_middle,
            rim,
            horizon,
            by_rim: (L::splat(0.5) * sine * sine * high * rim).or_zero(risen),
            by_horizon: zero,
            tip: (level + rise).div_or_zero(level + level, lune).max(zero),
            strips: zero,
            lune,
        };
        if cut.any() {
            cap.by_horizon = mutate!((L::splat(0.5) * cap.kepler(horizon)).or_zero(cut), HorizonArcForgotten => zero);
        }
        if lune.any() {
            cap.strips = cap.rest(zero);
            let tip = cap.tip.sqrt();
            let scale = cap.sine * cap.tip;
            cap.by_rim = L::select(lune, scale * scale * cap.sine * tip * cap.strips, cap.by_rim);
        }
        cap
    }

    /// Projected solid angle, in steradians, [0, pi]: the density of a direction is its cosine over this.
    #[inline(always)]
    pub fn projected(&self) -> L {
        let half = self.by_rim + self.by_horizon;
        half + half
    }

    /// Samples a direction from `u` and `v` in [0, 1). Undefined where [`Self::projected`] is 0.
    #[inline(always)]
    pub fn draw(&self, u: L, v: L) -> Drawn<L> {
        let (zero, one) = (L::zero(), L::one());
        // The two halves are symmetric. The map is continuous across the middle.
        let signed = u + u - one;
        let share = signed.abs();
        let area = share * (self.by_rim + self.by_horizon);
        let by_horizon = area.gt(self.by_rim) & !self.lune;
        let (mut height, mut offsets) = self.in_fan_of_rim(area, v);
        if (by_horizon | self.lune).any() {
            let (mut dx, mut y, mut z) = (zero, zero, zero);
            if by_horizon.any() {
                (dx, y, z) = self.in_fan_of_horizon(area - self.by_rim, v, by_horizon);
            }
            if self.lune.any() {
                let (a, b, c) = self.in_lune(share, v);
                dx = L::select(self.lune, a, dx);
                y = L::select(self.lune, b, y);
                z = L::select(self.lune, c, z);
            }
            let from_axis = self.high * self.high / (one + self.level);
            let t = dx + from_axis - dx * from_axis - z * self.high;
            let up = z * self.level - (one - dx) * self.high;
            let low = by_horizon | self.lune;
            height = L::select(low, z, height);
            offsets = Vec3::select(low, Vec3::new(t, up, y), offsets);
        }
        let (t, aside) = (offsets.x.max(zero), L::select(signed.lt(zero), -offsets.z, offsets.z));
        let [axis, up, across] = self.axes;
        Drawn {
            wi: axis.mul_add(one - t, up * offsets.y + across * aside),
            cos_theta: height,
            t,
        }
    }

    /// Height of a point of the ellipse, and its offset from the axis: `t`, up and sideways. With `(p, q)` on the unit disk the
    /// height is the root of `(c + s p level)^2 + s^2 (1 - p^2 - q^2)`.
    #[inline(always)]
    fn in_fan_of_rim(&self, area: L, v: L) -> (L, Vec3<L>) {
        let part = area.div_or_zero(self.by_rim, self.by_rim.gt(L::zero())).min(L::one());
        let (sin, cos) = sin_cos_turn(part * self.rim * L::splat(0.5 * FRAC_1_PI));
        let radius = v.sqrt() * self.sine;
        let below = (self.level * radius).mul_add(cos, self.cosine * self.high);
        let squared = self.sine * self.sine * (L::one() - v);
        let height = below.mul_add(below, squared).sqrt();
        let over = squared / (height + below);
        let t = self.one_minus_cos_max - self.high * over;
        (
            height,
            Vec3::new(t, radius.mul_add(cos, self.level * over), radius * sin),
        )
    }

    /// Twice the area between the center of the ellipse and an arc of the horizon: `phi - middle sin(phi)`, without cancellation.
    #[inline(always)]
    fn kepler(&self, phi: L) -> L {
        let x = phi * phi;
        // phi - sin(phi) = phi^3 / 3! - phi^5 / 5! + …, relative error 1e-7 up to a right angle.
        let mut series = L::splat(1.0 / 39_916_800.0);
        for coefficient in [-1.0 / 362_880.0, 1.0 / 5_040.0, -1.0 / 120.0, 1.0 / 6.0] {
            series = series.mul_add(x, L::splat(coefficient));
        }
        phi * (self.middle * x).mul_add(series, self.from_middle)
    }

    /// `1 - x`, `|y|` and the height of a point between the center of the ellipse and the arc of the horizon.
    #[inline(always)]
    fn in_fan_of_horizon(&self, area: L, v: L, active: L::Mask) -> (L, L, L) {
        let (one, two) = (L::one(), L::splat(2.0));
        let twice = (area + area).or_zero(active);
        let mut phi = self.horizon * area.div_or_zero(self.by_horizon, active).min(one);
        let half = |phi: L| sin_cos_turn(phi * L::splat(0.25 * FRAC_1_PI));
        // The function is convex and nearly linear.
        for _ in 0..4 {
            let (sin, _) = half(phi);
            let slope = (two * self.middle * sin).mul_add(sin, self.from_middle);
            phi = phi + (twice - self.kepler(phi)).div_or_zero(slope, active);
            phi = phi.max(L::zero()).min(self.horizon);
        }
        let (sin, cos) = half(phi);
        let radius = v.sqrt();
        let rest = (one - v) / (one + radius);
        let bulge = two * radius * sin * sin;
        let inner = self.from_middle * (one + self.middle + radius * self.from_middle);
        (
            self.from_middle.mul_add(rest, bulge),
            two * radius * sin * cos,
            (rest * (two * self.middle).mul_add(bulge, inner)).sqrt(),
        )
    }

    /// The strip of a lune at `p`, which is `sin(angle / 2)` of the rim over its value at the end: `y`, the far end in `x`, the sum
    /// of both ends, and the height of the rim over `2 s level`.
    #[inline(always)]
    fn strip(&self, p: L) -> [L; 4] {
        let one = L::one();
        let squared = self.tip * p * p;
        let sine = (squared * (one - squared)).safe_sqrt();
        let y = self.sine * (sine + sine);
        // `1 - y^2` from positive terms.
        let turned = one - squared - squared;
        let far = (self.sine * turned)
            .mul_add(self.sine * turned, self.cosine * self.cosine)
            .sqrt();
        let near = self.middle - self.sine * self.high * turned;
        [y, far, far + near, self.tip * (one - p) * (one + p)]
    }

    /// The area of the lune's strips beyond `p`, over `s^3 tip^(5/2)`.
    #[inline(always)]
    fn rest(&self, p: L) -> L {
        let width = L::one() - p;
        let mut sum = L::zero();
        for (node, weight) in NODES {
            sum = L::splat(weight).mul_add(self.length(width.mul_add(L::splat(node), p)), sum);
        }
        sum * width
    }

    /// The length of the lune's strip at `p`, times the derivative of its position.
    #[inline(always)]
    fn length(&self, p: L) -> L {
        let one = L::one();
        let squared = self.tip * p * p;
        let [_, _, ends, _] = self.strip(p);
        let height = (one - p) * (one + p) * self.level;
        let turned = (one - squared - squared).max(L::zero());
        let bottom = (one - squared).sqrt() * ends;
        (L::splat(8.0) * height * height * turned).div_or_zero(bottom, bottom.gt(L::zero()))
    }

    /// `1 - x`, `|y|` and the height of a point of a lune.
    #[inline(always)]
    fn in_lune(&self, share: L, v: L) -> (L, L, L) {
        let (one, third) = (L::one(), L::splat(1.0 / 3.0));
        let left = (one - share).max(L::splat(1.0 / 33_554_432.0));
        let wanted = left * self.strips;
        // Most lengths are about (1 - p^2)^2.
        let root = exp(ln(left) * third);
        let mut p = one - root * (root * root).mul_add(L::splat(0.263), L::splat(0.737));
        // The cube root of the rest is nearly linear.
        for _ in 0..4 {
            let (rest, length) = (self.rest(p), self.length(p));
            let sound = self.lune & rest.gt(L::zero()) & length.gt(L::zero());
            let ratio = wanted.div_or_zero(rest, sound);
            let step = one - exp(ln(ratio.max(L::splat(1e-30))) * third);
            p = p + (L::splat(3.0) * rest * step).div_or_zero(length, sound);
            p = p.max(L::zero()).min(one);
        }
        let [y, far, ends, height] = self.strip(p);
        let height = (self.sine + self.sine) * self.level * height;
        let kept = (one - v) * (height * height).div_or_zero(ends, ends.gt(L::zero()));
        let dx = y * y / (one + far) + kept;
        (dx, y, (kept * (far + one - dx)).safe_sqrt())
    }
}
