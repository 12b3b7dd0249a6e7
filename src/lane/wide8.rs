//! Eight lanes of AVX2: the one file that names `wide`.

use std::ops::{Add, BitAnd, BitOr, BitXor, Div, Mul, Neg, Not, Sub};

use super::{Bits, Lane, Mask};
use wide::{f32x8, i32x8, u32x8};

/// Eight `f32`.
#[derive(Clone, Copy, Debug)]
#[repr(transparent)]
pub struct F32x8(f32x8);

/// Eight `u32`; arithmetic wraps.
#[derive(Clone, Copy, Debug)]
#[repr(transparent)]
pub struct U32x8(u32x8);

/// Eight lanes of all ones or all zeros: what Embree takes for its `valid` as well.
#[derive(Clone, Copy, Debug)]
#[repr(transparent)]
pub struct Mask8(f32x8);

impl Mask8 {
    /// −1 where the mask holds, 0 elsewhere.
    #[inline(always)]
    pub fn to_valid(self) -> [i32; 8] {
        bytemuck::cast(self.0)
    }

    /// Holds where `valid` is not 0 (Embree writes −1 or 0).
    #[inline(always)]
    pub fn from_valid(valid: [i32; 8]) -> Self {
        Self(f32x8::from_bits(bytemuck::cast(
            !i32x8::new(valid).simd_eq(i32x8::splat(0)),
        )))
    }
}

/// `PACK[m]` lists the set bits of `m` in ascending order, then fills up with lane 0.
static PACK: [[u32; 8]; 256] = {
    let mut table = [[0; 8]; 256];
    let mut m = 0;
    while m < 256 {
        let (mut lane, mut slot) = (0, 0);
        while lane < 8 {
            if m >> lane & 1 == 1 {
                table[m][slot] = lane as u32;
                slot += 1;
            }
            lane += 1;
        }
        m += 1;
    }
    table
};

impl Lane for F32x8 {
    const N: usize = 8;
    type Mask = Mask8;
    type Bits = U32x8;
    type Packing = u32x8;

    #[inline(always)]
    fn splat(x: f32) -> Self {
        Self(f32x8::splat(x))
    }
    #[inline(always)]
    fn load(source: &[f32]) -> Self {
        let eight: &[f32; 8] = source[..8].try_into().expect("eight numbers");
        Self(f32x8::new(*eight))
    }
    #[inline(always)]
    fn store(self, target: &mut [f32]) {
        let eight: &mut [f32; 8] = (&mut target[..8]).try_into().expect("room for eight");
        *eight = self.0.to_array();
    }
    #[inline(always)]
    fn from_fn(f: impl FnMut(usize) -> f32) -> Self {
        Self(f32x8::new(gather(f)))
    }
    #[inline(always)]
    fn lane(self, i: usize) -> f32 {
        self.0.as_array()[i]
    }
    #[inline(always)]
    fn mul_add(self, a: Self, b: Self) -> Self {
        Self(self.0.mul_add(a.0, b.0))
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(self.0.sqrt())
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self(self.0.abs())
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self(self.0.fast_min(other.0))
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self(self.0.fast_max(other.0))
    }
    #[inline(always)]
    fn round(self) -> Self {
        Self(self.0.round_ties_even())
    }
    #[inline(always)]
    fn lt(self, other: Self) -> Mask8 {
        Mask8(self.0.simd_lt(other.0))
    }
    #[inline(always)]
    fn le(self, other: Self) -> Mask8 {
        Mask8(self.0.simd_le(other.0))
    }
    #[inline(always)]
    fn select(mask: Mask8, yes: Self, no: Self) -> Self {
        Self(mask.0.select(yes.0, no.0))
    }
    #[inline(always)]
    fn to_bits(self) -> U32x8 {
        U32x8(self.0.to_bits())
    }
    #[inline(always)]
    fn from_bits(bits: U32x8) -> Self {
        Self(f32x8::from_bits(bits.0))
    }
    #[inline(always)]
    fn to_i32(self) -> U32x8 {
        U32x8(bytemuck::cast(self.0.fast_round_int()))
    }
    #[inline(always)]
    fn from_i32(bits: U32x8) -> Self {
        Self(f32x8::from_i32x8(bytemuck::cast(bits.0)))
    }
    #[inline(always)]
    fn packing(mask: Mask8) -> u32x8 {
        u32x8::new(PACK[mask.to_bitmask() as usize & 255])
    }
    #[inline(always)]
    fn pack(self, packing: u32x8) -> Self {
        Self(self.0.shuffle(packing))
    }
}

impl Mask for Mask8 {
    #[inline(always)]
    fn splat(on: bool) -> Self {
        Self(f32x8::from_bits(u32x8::splat(if on { !0 } else { 0 })))
    }
    #[inline(always)]
    fn first(n: usize) -> Self {
        let lane = i32x8::new([0, 1, 2, 3, 4, 5, 6, 7]);
        Self(f32x8::from_bits(bytemuck::cast(
            i32x8::splat(n.min(8) as i32).simd_gt(lane),
        )))
    }
    #[inline(always)]
    fn to_bitmask(self) -> u32 {
        self.0.to_bitmask()
    }
    #[inline(always)]
    fn from_bitmask(bits: u32) -> Self {
        let one = u32x8::new([1, 2, 4, 8, 16, 32, 64, 128]);
        Self(f32x8::from_bits((u32x8::splat(bits) & one).simd_eq(one)))
    }
}

impl Bits for U32x8 {
    type Mask = Mask8;
    #[inline(always)]
    fn splat(x: u32) -> Self {
        Self(u32x8::splat(x))
    }
    #[inline(always)]
    fn from_fn(f: impl FnMut(usize) -> u32) -> Self {
        Self(u32x8::new(gather(f)))
    }
    #[inline(always)]
    fn load(source: &[u32]) -> Self {
        let eight: &[u32; 8] = source[..8].try_into().expect("eight numbers");
        Self(u32x8::new(*eight))
    }
    #[inline(always)]
    fn store(self, target: &mut [u32]) {
        let eight: &mut [u32; 8] = (&mut target[..8]).try_into().expect("room for eight");
        *eight = self.0.to_array();
    }
    #[inline(always)]
    fn lane(self, i: usize) -> u32 {
        self.0.as_array()[i]
    }
    #[inline(always)]
    fn shl(self, by: u32) -> Self {
        Self(self.0 << by)
    }
    #[inline(always)]
    fn shr(self, by: u32) -> Self {
        Self(self.0 >> by)
    }
    #[inline(always)]
    fn eq(self, other: Self) -> Mask8 {
        Mask8(f32x8::from_bits(self.0.simd_eq(other.0)))
    }
    #[inline(always)]
    fn top_bit(self) -> Mask8 {
        Mask8(f32x8::from_bits(bytemuck::cast(
            bytemuck::cast::<u32x8, i32x8>(self.0).simd_lt(i32x8::splat(0)),
        )))
    }
    #[inline(always)]
    fn select(mask: Mask8, yes: Self, no: Self) -> Self {
        Self(mask.0.select(f32x8::from_bits(yes.0), f32x8::from_bits(no.0)).to_bits())
    }
}

/// As `std::array::from_fn`, which is not always inlined: a call a lane costs more than the lane.
#[inline(always)]
fn gather<T>(mut f: impl FnMut(usize) -> T) -> [T; 8] {
    [f(0), f(1), f(2), f(3), f(4), f(5), f(6), f(7)]
}

macro_rules! operators {
    ($type:ident: $($trait:ident $name:ident),*) => { $(
        impl $trait for $type {
            type Output = Self;
            #[inline(always)]
            fn $name(self, other: Self) -> Self {
                Self($trait::$name(self.0, other.0))
            }
        }
    )* };
}
operators!(F32x8: Add add, Sub sub, Mul mul, Div div);
operators!(U32x8: Add add, Sub sub, Mul mul, BitXor bitxor, BitAnd bitand, BitOr bitor);
operators!(Mask8: BitAnd bitand, BitOr bitor);

impl Neg for F32x8 {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        // The sign bit alone, as the scalar negation does: 0 − x would lose the sign of zero.
        Self(f32x8::from_bits(self.0.to_bits() ^ u32x8::splat(1 << 31)))
    }
}

impl Not for Mask8 {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        Self(f32x8::from_bits(self.0.to_bits() ^ u32x8::splat(!0)))
    }
}
