//! Lanes: one real number per ray, and the masks that say which rays still matter.
//!
//! Everything above is written once, generic over [`Lane`]. The trait holds only operations that IEEE 754 rounds
//! exactly (`+ - * / sqrt fma`, comparisons, selections, conversions) and bit operations, so `f32` and `f32x8` give the
//! same bits for every lane; functions such as `exp` are built from these in [`crate::math::elementary`]. The estimates
//! that vector units offer for `1/x` and `1/sqrt(x)` are not exact and are kept out on purpose.
//!
//! Sixteen lanes have no name outside of the crate: a number in them could be made on a processor that lacks their instructions.
//! They are reached through [`crate::embree::in_sixteen`], which asks the processor first.
//!
//! ```compile_fail
//! use octolux::lane::{F32x16, Lane};
//! let number = F32x16::splat(1.0);
//! ```
//!
//! Eight lanes are chosen when the program is compiled: without AVX2 and `fma` the build is refused (`.cargo/config.toml` sets the
//! baseline).

mod avx512;
mod scalar;
mod wide16;
mod wide8;

use std::fmt::Debug;
use std::ops::{Add, BitAnd, BitOr, BitXor, Div, Mul, Neg, Not, Sub};

pub use avx512::{AVX512, has_avx512};
pub(crate) use avx512::{Work, with_avx512};
pub use scalar::Word;
pub use wide8::{F32x8, Mask8, U32x8};
pub(crate) use wide16::F32x16;

#[cfg(not(all(target_feature = "avx2", target_feature = "fma")))]
compile_error!(
    "Octolux needs AVX2 and FMA at compile time: build with -C target-cpu=x86-64-v3 (see .cargo/config.toml)"
);

/// One `f32` per lane.
pub trait Lane:
    Copy
    + Debug
    + Send
    + Sync
    + 'static
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// How many lanes there are.
    const N: usize;
    /// Which lanes a thing holds for.
    type Mask: Mask;
    /// One `u32` per lane.
    type Bits: Bits<Mask = Self::Mask>;
    /// How the active lanes of a mask move to the front; see [`Lane::pack`].
    type Packing: Copy;
    /// See [`Lane::rows`].
    type Rows: AsRef<[[f32; 4]]>;
    /// The same lanes, or where these need AVX-512 as many as do without: for what is not inlined into kernels.
    type Plain: Lane;

    /// The same number in every lane.
    fn splat(x: f32) -> Self;
    /// The first `N` numbers of `source`, which must hold as many.
    fn load(source: &[f32]) -> Self;
    /// Writes `N` numbers to the front of `target`, which must hold as many.
    fn store(self, target: &mut [f32]);
    /// `f(0)`, `f(1)`, … `f(N - 1)`.
    fn from_fn(f: impl FnMut(usize) -> f32) -> Self;
    /// The number in lane `i < N`.
    fn lane(self, i: usize) -> f32;

    /// `self * a + b`, rounded once.
    fn mul_add(self, a: Self, b: Self) -> Self;
    /// Square root, exactly rounded.
    fn sqrt(self) -> Self;
    /// Absolute value.
    fn abs(self) -> Self;
    /// `self` where it is smaller than `other`, else `other` (also where either is NaN).
    fn min(self, other: Self) -> Self;
    /// `self` where it is larger than `other`, else `other` (also where either is NaN).
    fn max(self, other: Self) -> Self;
    /// The nearest whole number, ties to even. The result must fit in an `i32` for [`Self::to_i32`].
    fn round(self) -> Self;

    /// `self < other`; false with NaN, as are the others.
    fn lt(self, other: Self) -> Self::Mask;
    /// `self <= other`.
    fn le(self, other: Self) -> Self::Mask;
    /// `self > other`.
    fn gt(self, other: Self) -> Self::Mask {
        other.lt(self)
    }
    /// `self >= other`.
    fn ge(self, other: Self) -> Self::Mask {
        other.le(self)
    }
    /// `yes` where the mask holds, else `no`.
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self;

    /// The bits of each number.
    fn to_bits(self) -> Self::Bits;
    /// Numbers from their bits.
    fn from_bits(bits: Self::Bits) -> Self;
    /// Each number, already whole, as a signed integer in two's complement.
    fn to_i32(self) -> Self::Bits;
    /// Signed integers in two's complement, rounded to the nearest number.
    fn from_i32(bits: Self::Bits) -> Self;

    /// A row of three numbers for each lane, and a 0.
    fn rows(x: Self, y: Self, z: Self) -> Self::Rows;
    /// How to move the lanes of `mask` to the front.
    fn packing(mask: Self::Mask) -> Self::Packing;
    /// The lanes of the mask in their order, at the front; what is behind them is unspecified.
    fn pack(self, packing: Self::Packing) -> Self;

    /// Zero in every lane.
    #[inline(always)]
    fn zero() -> Self {
        Self::splat(0.0)
    }
    /// One in every lane.
    #[inline(always)]
    fn one() -> Self {
        Self::splat(1.0)
    }
    /// `self / divisor` where the mask holds, else 0: an idle lane is 0, never NaN.
    #[inline(always)]
    fn div_or_zero(self, divisor: Self, mask: Self::Mask) -> Self {
        Self::select(mask, self / divisor, Self::zero())
    }
    /// `-self` where the mask holds, else `self`.
    #[inline(always)]
    fn negated(self, mask: Self::Mask) -> Self {
        Self::select(mask, -self, self)
    }
    /// `self` where the mask holds, else 0.
    #[inline(always)]
    fn or_zero(self, mask: Self::Mask) -> Self {
        Self::select(mask, self, Self::zero())
    }
    /// `sqrt(max(self, 0))`: for what is not negative but for rounding.
    #[inline(always)]
    fn safe_sqrt(self) -> Self {
        self.max(Self::zero()).sqrt()
    }
}

/// Which lanes a thing holds for.
pub trait Mask:
    Copy + Debug + Send + Sync + 'static + BitAnd<Output = Self> + BitOr<Output = Self> + Not<Output = Self>
{
    /// The same in every lane.
    fn splat(on: bool) -> Self;
    /// The first `n` lanes; all where `n` is at least their number. `n` is below 2^31.
    fn first(n: usize) -> Self;
    /// Bit `i` tells of lane `i`.
    fn to_bitmask(self) -> u32;
    /// Lane `i` from bit `i`.
    fn from_bitmask(bits: u32) -> Self;
    /// Whether any lane holds.
    #[inline(always)]
    fn any(self) -> bool {
        self.to_bitmask() != 0
    }
    /// Whether every lane does.
    #[inline(always)]
    fn all(self) -> bool {
        (!self).none()
    }
    /// Whether none does.
    #[inline(always)]
    fn none(self) -> bool {
        self.to_bitmask() == 0
    }
    /// How many hold.
    #[inline(always)]
    fn count(self) -> usize {
        self.to_bitmask().count_ones() as usize
    }
    /// The lanes that hold, in ascending order.
    #[inline(always)]
    fn lanes(self) -> SetLanes {
        SetLanes(self.to_bitmask())
    }
}

/// The lanes of a mask, in ascending order.
#[derive(Clone, Debug)]
pub struct SetLanes(u32);

impl Iterator for SetLanes {
    type Item = usize;
    #[inline(always)]
    fn next(&mut self) -> Option<usize> {
        if self.0 == 0 {
            return None;
        }
        let lane = self.0.trailing_zeros() as usize;
        self.0 &= self.0 - 1;
        Some(lane)
    }
}

/// One `u32` per lane; arithmetic wraps.
pub trait Bits:
    Copy
    + Debug
    + Send
    + Sync
    + 'static
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + BitXor<Output = Self>
    + BitAnd<Output = Self>
    + BitOr<Output = Self>
{
    /// The mask that goes with it.
    type Mask: Mask;
    /// The same in every lane.
    fn splat(x: u32) -> Self;
    /// `f(0)`, `f(1)`, …
    fn from_fn(f: impl FnMut(usize) -> u32) -> Self;
    /// The first `N` numbers of `source`, which must hold as many.
    fn load(source: &[u32]) -> Self;
    /// Writes `N` numbers to the front of `target`, which must hold as many.
    fn store(self, target: &mut [u32]);
    /// The number in lane `i`.
    fn lane(self, i: usize) -> u32;
    /// Shift to the left by the same number of bits, below 32.
    fn shl(self, by: u32) -> Self;
    /// Logical shift to the right by the same number of bits, below 32.
    fn shr(self, by: u32) -> Self;
    /// Of a table of sixteen, the number at each lane's index; of an index the low four bits count.
    fn lookup(table: &[u32], index: Self) -> Self;
    /// Which lanes are equal.
    fn eq(self, other: Self) -> Self::Mask;
    /// Which lanes have their top bit set.
    fn top_bit(self) -> Self::Mask;
    /// `yes` where the mask holds, else `no`.
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self;
}

#[cfg(test)]
mod tests;
