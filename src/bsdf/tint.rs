//! Values of directions before colors are applied.

use crate::lane::Lane;
use crate::math::Vec3;

/// `f_cos`, or a quotient of it, without the colors of the material and of the light. It has as few components as the model allows,
/// so that weights are computed for these instead of three colors.
pub trait Tint<L: Lane>: Copy {
    /// Multiplied by a factor.
    fn scaled(self, by: L) -> Self;
    /// Divided by a number.
    fn over(self, by: L) -> Self;
    /// Lanes where it is positive.
    fn lit(self) -> L::Mask;
    /// `yes` in lanes of the mask, else `no`.
    fn chosen(mask: L::Mask, yes: Self, no: Self) -> Self;
    /// The sum.
    fn plus(self, other: Self) -> Self;
    /// Itself in lanes of the mask, else 0.
    fn kept(self, mask: L::Mask) -> Self;
    /// The color of reflected white light for a material of reflectance `rho`. For light of another color, multiply both arguments
    /// by that color.
    fn colour(self, rho: Vec3<L>, white: Vec3<L>) -> Vec3<L>;
}

/// `rho` times a number: the reflection has the color of the material.
impl<L: Lane> Tint<L> for L {
    #[inline(always)]
    fn scaled(self, by: L) -> Self {
        by * self
    }
    #[inline(always)]
    fn over(self, by: L) -> Self {
        self / by
    }
    #[inline(always)]
    fn lit(self) -> L::Mask {
        self.gt(L::zero())
    }
    #[inline(always)]
    fn chosen(mask: L::Mask, yes: Self, no: Self) -> Self {
        L::select(mask, yes, no)
    }
    #[inline(always)]
    fn plus(self, other: Self) -> Self {
        self + other
    }
    #[inline(always)]
    fn kept(self, mask: L::Mask) -> Self {
        self.or_zero(mask)
    }
    #[inline(always)]
    fn colour(self, rho: Vec3<L>, _: Vec3<L>) -> Vec3<L> {
        rho * self
    }
}

/// `rho tinted + white`: a part has the color of the material and a part is uncolored. Schlick's Fresnel reflectance has this form,
/// because `rho + (1 - rho) s = rho (1 - s) + s`.
#[derive(Clone, Copy, Debug)]
pub struct Tints<L> {
    /// The factor of the material color.
    pub tinted: L,
    /// The uncolored part.
    pub white: L,
}

impl<L: Lane> Tints<L> {
    #[inline(always)]
    fn each(self, f: impl Fn(L) -> L) -> Self {
        Self {
            tinted: f(self.tinted),
            white: f(self.white),
        }
    }
}

impl<L: Lane> Tint<L> for Tints<L> {
    #[inline(always)]
    fn scaled(self, by: L) -> Self {
        self.each(|x| by * x)
    }
    #[inline(always)]
    fn over(self, by: L) -> Self {
        self.each(|x| x / by)
    }
    #[inline(always)]
    fn lit(self) -> L::Mask {
        (self.tinted + self.white).gt(L::zero())
    }
    #[inline(always)]
    fn chosen(mask: L::Mask, yes: Self, no: Self) -> Self {
        Self {
            tinted: L::select(mask, yes.tinted, no.tinted),
            white: L::select(mask, yes.white, no.white),
        }
    }
    #[inline(always)]
    fn plus(self, other: Self) -> Self {
        Self {
            tinted: self.tinted + other.tinted,
            white: self.white + other.white,
        }
    }
    #[inline(always)]
    fn kept(self, mask: L::Mask) -> Self {
        Self {
            tinted: self.tinted.or_zero(mask),
            white: self.white.or_zero(mask),
        }
    }
    #[inline(always)]
    fn colour(self, rho: Vec3<L>, white: Vec3<L>) -> Vec3<L> {
        rho * self.tinted + white * self.white
    }
}

/// A color per direction, multiplied by the reflectance of the material.
impl<L: Lane> Tint<L> for Vec3<L> {
    #[inline(always)]
    fn scaled(self, by: L) -> Self {
        self * by
    }
    #[inline(always)]
    fn over(self, by: L) -> Self {
        Self::new(self.x / by, self.y / by, self.z / by)
    }
    #[inline(always)]
    fn lit(self) -> L::Mask {
        (self.x + self.y + self.z).gt(L::zero())
    }
    #[inline(always)]
    fn chosen(mask: L::Mask, yes: Self, no: Self) -> Self {
        Self::select(mask, yes, no)
    }
    #[inline(always)]
    fn plus(self, other: Self) -> Self {
        self + other
    }
    #[inline(always)]
    fn kept(self, mask: L::Mask) -> Self {
        self.or_zero(mask)
    }
    #[inline(always)]
    fn colour(self, rho: Vec3<L>, _: Vec3<L>) -> Vec3<L> {
        rho.times(self)
    }
}
