//! What a direction is worth before colours are known.

use crate::lane::Lane;
use crate::math::Vec3;

/// What `f_cos`, or a quotient of it, is without the colours of the material and of the light: as few numbers as the model can do
/// with, so that weights are computed for these and not for three colours.
pub trait Tint<L: Lane>: Copy {
    /// So many times as much.
    fn scaled(self, by: L) -> Self;
    /// A part of it.
    fn over(self, by: L) -> Self;
    /// Lanes where it is above 0.
    fn lit(self) -> L::Mask;
    /// `yes` where the mask holds, else `no`.
    fn chosen(mask: L::Mask, yes: Self, no: Self) -> Self;
    /// The sum.
    fn plus(self, other: Self) -> Self;
    /// Itself where the mask holds, else 0.
    fn kept(self, mask: L::Mask) -> Self;
    /// The colour of white light so reflected by a material of reflectance `rho`. For light of another colour, both arguments are
    /// multiplied by it.
    fn colour(self, rho: Vec3<L>, white: Vec3<L>) -> Vec3<L>;
}

/// `rho` times one number: all of it has the colour of the material.
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

/// `rho tinted + white`: some of it has the colour of the material, some has none. Schlick's Fresnel reflectance has this form, for
/// `rho + (1 - rho) s = rho (1 - s) + s`.
#[derive(Clone, Copy, Debug)]
pub struct Tints<L> {
    /// What is multiplied by the colour of the material.
    pub tinted: L,
    /// What is not.
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
        self.each(|x| x.or_zero(mask))
    }
    #[inline(always)]
    fn colour(self, rho: Vec3<L>, white: Vec3<L>) -> Vec3<L> {
        rho * self.tinted + white * self.white
    }
}

/// A colour of its own, by which the reflectance of the material is multiplied.
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
