//! Three-component vectors of lanes: a point, a direction or a color per ray.

use std::ops::{Add, Mul, Neg, Sub};

use crate::lane::{Bits, Lane};

/// 2^126.
const LARGE: f32 = f32::from_bits(253 << 23);

/// A point, a direction or linear RGB in every lane.
#[derive(Clone, Copy, Debug)]
pub struct Vec3<L> {
    /// First component, or red.
    pub x: L,
    /// Second component, or green.
    pub y: L,
    /// Third component, or blue.
    pub z: L,
}

impl<L: Lane> Vec3<L> {
    /// A vector from components.
    #[inline(always)]
    pub fn new(x: L, y: L, z: L) -> Self {
        Self { x, y, z }
    }

    /// Broadcasts a vector to all lanes.
    #[inline(always)]
    pub fn splat([x, y, z]: [f32; 3]) -> Self {
        Self::new(L::splat(x), L::splat(y), L::splat(z))
    }

    /// Zero.
    #[inline(always)]
    pub fn zero() -> Self {
        Self::splat([0.0; 3])
    }

    /// Dot product.
    #[inline(always)]
    pub fn dot(self, other: Self) -> L {
        self.x.mul_add(other.x, self.y.mul_add(other.y, self.z * other.z))
    }

    /// Squared length.
    #[inline(always)]
    pub fn length_squared(self) -> L {
        self.dot(self)
    }

    /// Length; overflows if the square does (above 1.8e19).
    #[inline(always)]
    pub fn length(self) -> L {
        self.length_squared().sqrt()
    }

    /// Scales to unit length; NaN for a vector of length 0.
    #[inline(always)]
    pub fn normalize(self) -> Self {
        self * (L::one() / self.length())
    }

    /// Like [`Self::normalize`], for any length: no square overflows or underflows. First scales by a power of two, which causes no
    /// relevant rounding; from 2^126 on the scale stays 2^-126.
    #[inline(always)]
    pub fn unit(self) -> Self {
        let largest = self.max_abs().min(L::splat(LARGE));
        let exponent = largest.to_bits() & L::Bits::splat(f32::INFINITY.to_bits());
        let scale = L::from_bits(L::Bits::splat((2.0 * LARGE).to_bits()) - exponent);
        (self * scale).normalize()
    }

    /// `self * scale + offset`, each component rounded once.
    #[inline(always)]
    pub fn mul_add(self, scale: L, offset: Self) -> Self {
        Self::new(
            self.x.mul_add(scale, offset.x),
            self.y.mul_add(scale, offset.y),
            self.z.mul_add(scale, offset.z),
        )
    }

    /// Componentwise product: a color filtered by another.
    #[inline(always)]
    pub fn times(self, other: Self) -> Self {
        Self::new(self.x * other.x, self.y * other.y, self.z * other.z)
    }

    /// The vector product.
    #[inline(always)]
    pub fn cross(self, other: Self) -> Self {
        Self::new(
            self.y.mul_add(other.z, -(self.z * other.y)),
            self.z.mul_add(other.x, -(self.x * other.z)),
            self.x.mul_add(other.y, -(self.y * other.x)),
        )
    }

    /// The largest absolute component.
    #[inline(always)]
    pub fn max_abs(self) -> L {
        self.x.abs().max(self.y.abs()).max(self.z.abs())
    }

    /// The opposite vector in active lanes, else the vector.
    #[inline(always)]
    pub fn negated(self, mask: L::Mask) -> Self {
        Self::new(self.x.negated(mask), self.y.negated(mask), self.z.negated(mask))
    }

    /// `yes` in active lanes, else `no`.
    #[inline(always)]
    pub fn select(mask: L::Mask, yes: Self, no: Self) -> Self {
        Self::new(
            L::select(mask, yes.x, no.x),
            L::select(mask, yes.y, no.y),
            L::select(mask, yes.z, no.z),
        )
    }

    /// The vector in active lanes, else 0.
    #[inline(always)]
    pub fn or_zero(self, mask: L::Mask) -> Self {
        Self::new(self.x.or_zero(mask), self.y.or_zero(mask), self.z.or_zero(mask))
    }

    /// The vector in lane `i`.
    #[inline(always)]
    pub fn lane(self, i: usize) -> [f32; 3] {
        [self.x.lane(i), self.y.lane(i), self.z.lane(i)]
    }
}

impl<L: Lane> Add for Vec3<L> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self::new(self.x + other.x, self.y + other.y, self.z + other.z)
    }
}

impl<L: Lane> Sub for Vec3<L> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self::new(self.x - other.x, self.y - other.y, self.z - other.z)
    }
}

impl<L: Lane> Mul<L> for Vec3<L> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, scale: L) -> Self {
        Self::new(self.x * scale, self.y * scale, self.z * scale)
    }
}

impl<L: Lane> Neg for Vec3<L> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self::new(-self.x, -self.y, -self.z)
    }
}
