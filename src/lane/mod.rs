//! Lanes: one real number per ray, and masks of active rays.
//!
//! All code above is generic over [`Lane`]. The trait has only operations that IEEE 754 rounds exactly (`+ - * / sqrt fma`,
//! comparisons, selections, conversions) and bit operations. So every lane type gives the same bits in each lane. Functions such as
//! `exp` are built from these in [`crate::math::elementary`]. The approximate instructions for `1/x` and `1/sqrt(x)` are not exact
//! and are deliberately excluded.
//!
//! The type of sixteen lanes is not public: a value of it could be created on a processor without its instructions. Use
//! [`crate::embree::in_sixteen`], which checks the processor first.
//!
//! ```compile_fail
//! use octolux::lane::{F32x16, Lane};
//! let number = F32x16::splat(1.0);
//! ```
//!
//! Eight lanes are selected at compile time: the build fails without AVX2 and `fma` (`.cargo/config.toml` sets the baseline).

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
    /// Number of lanes.
    const N: usize;
    /// A boolean per lane.
    type Mask: Mask;
    /// One `u32` per lane.
    type Bits: Bits<Mask = Self::Mask>;
    /// How the active lanes of a mask are compacted; see [`Lane::pack`].
    type Packing: Copy;
    /// See [`Lane::rows`].
    type Rows: AsRef<[[f32; 4]]>;
    /// The same lanes; for lanes that require AVX-512, the widest that do not. For code that is not inlined into kernels.
    type Plain: Lane;

    /// Broadcasts a number to all lanes.
    fn splat(x: f32) -> Self;
    /// Loads the first `N` numbers of `source`, which must have at least that many.
    fn load(source: &[f32]) -> Self;
    /// Stores `N` numbers at the front of `target`, which must have room for them.
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
    /// `self` if it is less than `other`, else `other` (also if either is NaN).
    fn min(self, other: Self) -> Self;
    /// `self` if it is greater than `other`, else `other` (also if either is NaN).
    fn max(self, other: Self) -> Self;
    /// The nearest integer, ties to even. The result must fit in an `i32` for [`Self::to_i32`].
    fn round(self) -> Self;

    /// `self < other`; false for NaN, as in all comparisons.
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
    /// `yes` in active lanes, else `no`.
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self;

    /// The bits of each number.
    fn to_bits(self) -> Self::Bits;
    /// Numbers from their bits.
    fn from_bits(bits: Self::Bits) -> Self;
    /// Converts integral numbers to signed integers in two's complement.
    fn to_i32(self) -> Self::Bits;
    /// Converts signed integers in two's complement to the nearest number.
    fn from_i32(bits: Self::Bits) -> Self;

    /// For each lane a row of three numbers and a 0.
    fn rows(x: Self, y: Self, z: Self) -> Self::Rows;
    /// Prepares the compaction of the lanes of `mask`.
    fn packing(mask: Self::Mask) -> Self::Packing;
    /// Moves the lanes of the mask to the front, in order; the remaining lanes are unspecified.
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
    /// `self / divisor` in active lanes, else 0: an idle lane is 0, never NaN.
    #[inline(always)]
    fn div_or_zero(self, divisor: Self, mask: Self::Mask) -> Self {
        Self::select(mask, self / divisor, Self::zero())
    }
    /// `-self` in active lanes, else `self`.
    #[inline(always)]
    fn negated(self, mask: Self::Mask) -> Self {
        Self::select(mask, -self, self)
    }
    /// `self` in active lanes, else 0.
    #[inline(always)]
    fn or_zero(self, mask: Self::Mask) -> Self {
        Self::select(mask, self, Self::zero())
    }
    /// `sqrt(max(self, 0))`: for numbers that only rounding makes negative.
    #[inline(always)]
    fn safe_sqrt(self) -> Self {
        self.max(Self::zero()).sqrt()
    }
}

/// A boolean per lane.
pub trait Mask:
    Copy + Debug + Send + Sync + 'static + BitAnd<Output = Self> + BitOr<Output = Self> + Not<Output = Self>
{
    /// The same value in every lane.
    fn splat(on: bool) -> Self;
    /// The first `n` lanes; all if `n` is at least their number. `n` is below 2^31.
    fn first(n: usize) -> Self;
    /// Bit `i` is lane `i`.
    fn to_bitmask(self) -> u32;
    /// Lane `i` is bit `i`.
    fn from_bitmask(bits: u32) -> Self;
    /// Whether any lane is active.
    #[inline(always)]
    fn any(self) -> bool {
        self.to_bitmask() != 0
    }
    /// Whether all lanes are active.
    #[inline(always)]
    fn all(self) -> bool {
        (!self).none()
    }
    /// Whether no lane is active.
    #[inline(always)]
    fn none(self) -> bool {
        self.to_bitmask() == 0
    }
    /// Number of active lanes.
    #[inline(always)]
    fn count(self) -> usize {
        self.to_bitmask().count_ones() as usize
    }
    /// The active lanes, in ascending order.
    #[inline(always)]
    fn lanes(self) -> SetLanes {
        SetLanes(self.to_bitmask())
    }
}

/// Iterator over the active lanes of a mask, in ascending order.
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
    /// The corresponding mask type.
    type Mask: Mask;
    /// Broadcasts a number to all lanes.
    fn splat(x: u32) -> Self;
    /// `f(0)`, `f(1)`, …
    fn from_fn(f: impl FnMut(usize) -> u32) -> Self;
    /// Loads the first `N` numbers of `source`, which must have at least that many.
    fn load(source: &[u32]) -> Self;
    /// Stores `N` numbers at the front of `target`, which must have room for them.
    fn store(self, target: &mut [u32]);
    /// The number in lane `i`.
    fn lane(self, i: usize) -> u32;
    /// Left shift by the same number of bits in all lanes, below 32.
    fn shl(self, by: u32) -> Self;
    /// Logical right shift by the same number of bits in all lanes, below 32.
    fn shr(self, by: u32) -> Self;
    /// Looks up each lane's index in a table of sixteen; only the low four bits of an index count.
    fn lookup(table: &[u32], index: Self) -> Self;
    /// Columns of a matrix that has a row of eight numbers in each lane.
    fn transposed(row: impl FnMut(usize) -> [u32; 8]) -> [Self; 8];
    /// Which lanes are equal.
    fn eq(self, other: Self) -> Self::Mask;
    /// Which lanes have their top bit set.
    fn top_bit(self) -> Self::Mask;
    /// `yes` in active lanes, else `no`.
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self;
}

#[cfg(test)]
mod tests;
