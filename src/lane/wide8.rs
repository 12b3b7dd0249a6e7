//! Eight lanes of AVX2: the one file that names `safe_arch`.
//!
//! `wide` would say the same in fewer words, but makes a splat of eight scalars. Where two ways met, the compiler carried these one by
//! one: a third of the eye stage's time.

use std::ops::{Add, BitAnd, BitOr, BitXor, Div, Mul, Neg, Not, Sub};

use bytemuck::{must_cast, must_cast_mut, must_cast_ref};
use safe_arch::*;

use super::{Bits, Lane, Mask};

/// Eight `f32`.
#[derive(Clone, Copy, Debug)]
#[repr(transparent)]
pub struct F32x8(m256);

/// Eight `u32`; arithmetic wraps.
#[derive(Clone, Copy, Debug)]
#[repr(transparent)]
pub struct U32x8(m256i);

/// Eight lanes of all ones or all zeros: what Embree takes for its `valid` as well.
#[derive(Clone, Copy, Debug)]
#[repr(transparent)]
pub struct Mask8(m256);

impl Mask8 {
    /// −1 where the mask holds, 0 elsewhere.
    #[inline(always)]
    pub fn to_valid(self) -> [i32; 8] {
        must_cast(self.0)
    }

    /// Holds where `valid` is not 0 (Embree writes −1 or 0).
    #[inline(always)]
    pub fn from_valid(valid: [i32; 8]) -> Self {
        !Self::of(cmp_eq_mask_i32_m256i(must_cast(valid), zeroed_m256i()))
    }

    #[inline(always)]
    fn of(ones_or_zeros: m256i) -> Self {
        Self(cast_to_m256_from_m256i(ones_or_zeros))
    }
}

/// `PACK[m]` lists the set bits of `m` in ascending order, then fills up with lane 0. Bytes: the table leaves the first cache to
/// the streams.
static PACK: [[u8; 8]; 256] = {
    let mut table = [[0; 8]; 256];
    let mut m = 0;
    while m < 256 {
        let (mut lane, mut slot) = (0, 0);
        while lane < 8 {
            if m >> lane & 1 == 1 {
                table[m][slot] = lane as u8;
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
    type Packing = m256i;
    type Rows = [[f32; 4]; 8];
    type Plain = Self;

    #[inline(always)]
    fn splat(x: f32) -> Self {
        Self(set_splat_m256(x))
    }
    #[inline(always)]
    fn load(source: &[f32]) -> Self {
        Self(load_unaligned_m256(source[..8].try_into().expect("eight numbers")))
    }
    #[inline(always)]
    fn store(self, target: &mut [f32]) {
        let eight = (&mut target[..8]).try_into().expect("room for eight");
        store_unaligned_m256(eight, self.0);
    }
    #[inline(always)]
    fn from_fn(f: impl FnMut(usize) -> f32) -> Self {
        Self::load(&gather(f))
    }
    #[inline(always)]
    fn lane(self, i: usize) -> f32 {
        self.0.to_array()[i]
    }
    #[inline(always)]
    fn mul_add(self, a: Self, b: Self) -> Self {
        Self(fused_mul_add_m256(self.0, a.0, b.0))
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(sqrt_m256(self.0))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self::from_bits(self.to_bits() & U32x8::splat(!SIGN))
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self(min_m256(self.0, other.0))
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self(max_m256(self.0, other.0))
    }
    #[inline(always)]
    fn round(self) -> Self {
        Self(round_m256::<{ round_op!(Nearest) }>(self.0))
    }
    #[inline(always)]
    fn lt(self, other: Self) -> Mask8 {
        Mask8(cmp_op_mask_m256::<{ cmp_op!(LessThanOrdered) }>(self.0, other.0))
    }
    #[inline(always)]
    fn le(self, other: Self) -> Mask8 {
        Mask8(cmp_op_mask_m256::<{ cmp_op!(LessEqualOrdered) }>(self.0, other.0))
    }
    #[inline(always)]
    fn select(mask: Mask8, yes: Self, no: Self) -> Self {
        Self(blend_varying_m256(no.0, yes.0, mask.0))
    }
    // One instruction where a selection takes three.
    #[inline(always)]
    fn or_zero(self, mask: Mask8) -> Self {
        Self(bitand_m256(self.0, mask.0))
    }
    #[inline(always)]
    fn to_bits(self) -> U32x8 {
        U32x8(cast_to_m256i_from_m256(self.0))
    }
    #[inline(always)]
    fn from_bits(bits: U32x8) -> Self {
        Self(cast_to_m256_from_m256i(bits.0))
    }
    #[inline(always)]
    fn to_i32(self) -> U32x8 {
        U32x8(convert_to_i32_m256i_from_m256(self.0))
    }
    #[inline(always)]
    fn from_i32(bits: U32x8) -> Self {
        Self(convert_to_m256_from_i32_m256i(bits.0))
    }
    #[inline(always)]
    fn negated(self, mask: Mask8) -> Self {
        Self(bitxor_m256(self.0, bitand_m256(mask.0, Self::splat(-0.0).0)))
    }
    #[inline(always)]
    fn rows(x: Self, y: Self, z: Self) -> [[f32; 4]; 8] {
        let wide = |v: m256| cast_to_m256d_from_m256(v);
        let (zero, low, high) = (zeroed_m256(), unpack_lo_m256d, unpack_hi_m256d);
        let (xy, z0) = (wide(unpack_lo_m256(x.0, y.0)), wide(unpack_lo_m256(z.0, zero)));
        let (more_xy, more_z0) = (wide(unpack_hi_m256(x.0, y.0)), wide(unpack_hi_m256(z.0, zero)));
        // Each holds the rows of a lane and of the fourth after it.
        let [a, e]: [[f32; 4]; 2] = must_cast(low(xy, z0));
        let [b, f]: [[f32; 4]; 2] = must_cast(high(xy, z0));
        let [c, g]: [[f32; 4]; 2] = must_cast(low(more_xy, more_z0));
        let [d, h]: [[f32; 4]; 2] = must_cast(high(more_xy, more_z0));
        [a, b, c, d, e, f, g, h]
    }
    #[inline(always)]
    fn packing(mask: Mask8) -> m256i {
        let row = u64::from_le_bytes(PACK[mask.to_bitmask() as usize & 255]);
        convert_to_i32_m256i_from_lower8_i8_m128i(set_i64_m128i_s(row as i64))
    }
    #[inline(always)]
    fn pack(self, packing: m256i) -> Self {
        Self(shuffle_av_f32_all_m256(self.0, packing))
    }
}

impl Mask for Mask8 {
    #[inline(always)]
    fn splat(on: bool) -> Self {
        Self::of(set_splat_i32_m256i(if on { -1 } else { 0 }))
    }
    #[inline(always)]
    fn first(n: usize) -> Self {
        let lane = must_cast([0, 1, 2, 3, 4, 5, 6, 7]);
        Self::of(cmp_gt_mask_i32_m256i(set_splat_i32_m256i(n as i32), lane))
    }
    #[inline(always)]
    fn to_bitmask(self) -> u32 {
        move_mask_m256(self.0) as u32
    }
    #[inline(always)]
    fn from_bitmask(bits: u32) -> Self {
        let one = U32x8(must_cast([1, 2, 4, 8, 16, 32, 64, 128]));
        (U32x8::splat(bits) & one).eq(one)
    }
}

impl Bits for U32x8 {
    type Mask = Mask8;
    #[inline(always)]
    fn splat(x: u32) -> Self {
        Self(set_splat_i32_m256i(x as i32))
    }
    #[inline(always)]
    fn from_fn(f: impl FnMut(usize) -> u32) -> Self {
        Self::load(&gather(f))
    }
    #[inline(always)]
    fn load(source: &[u32]) -> Self {
        let eight: &[u32; 8] = source[..8].try_into().expect("eight numbers");
        Self(load_unaligned_m256i(must_cast_ref(eight)))
    }
    #[inline(always)]
    fn store(self, target: &mut [u32]) {
        let eight: &mut [u32; 8] = (&mut target[..8]).try_into().expect("room for eight");
        store_unaligned_m256i(must_cast_mut(eight), self.0);
    }
    #[inline(always)]
    fn lane(self, i: usize) -> u32 {
        must_cast::<_, [u32; 8]>(self.0)[i]
    }
    #[inline(always)]
    fn shl(self, by: u32) -> Self {
        Self(shl_all_u32_m256i(self.0, set_i64_m128i_s(by.into())))
    }
    #[inline(always)]
    fn shr(self, by: u32) -> Self {
        Self(shr_all_u32_m256i(self.0, set_i64_m128i_s(by.into())))
    }
    #[inline(always)]
    fn lookup(table: &[u32], index: Self) -> Self {
        let (low, high) = (Self::load(table), Self::load(&table[8..]));
        let of = |half: Self| Self(shuffle_av_i32_all_m256i(half.0, index.0));
        Self::select(index.shl(28).top_bit(), of(high), of(low))
    }
    #[inline(always)]
    fn eq(self, other: Self) -> Mask8 {
        Mask8::of(cmp_eq_mask_i32_m256i(self.0, other.0))
    }
    #[inline(always)]
    fn top_bit(self) -> Mask8 {
        Mask8::of(shr_imm_i32_m256i::<31>(self.0))
    }
    #[inline(always)]
    fn select(mask: Mask8, yes: Self, no: Self) -> Self {
        F32x8::select(mask, F32x8::from_bits(yes), F32x8::from_bits(no)).to_bits()
    }
}

/// The bit of the sign.
const SIGN: u32 = 1 << 31;

/// As `std::array::from_fn`, which is not always inlined: a call a lane costs more than the lane.
#[inline(always)]
fn gather<T>(mut f: impl FnMut(usize) -> T) -> [T; 8] {
    [f(0), f(1), f(2), f(3), f(4), f(5), f(6), f(7)]
}

macro_rules! operators {
    ($type:ident: $($trait:ident $name:ident $operation:ident),*) => { $(
        impl $trait for $type {
            type Output = Self;
            #[inline(always)]
            fn $name(self, other: Self) -> Self {
                Self($operation(self.0, other.0))
            }
        }
    )* };
}
operators!(F32x8: Add add add_m256, Sub sub sub_m256, Mul mul mul_m256, Div div div_m256);
operators!(U32x8: Add add add_i32_m256i, Sub sub sub_i32_m256i, Mul mul mul_i32_keep_low_m256i,
    BitXor bitxor bitxor_m256i, BitAnd bitand bitand_m256i, BitOr bitor bitor_m256i);
operators!(Mask8: BitAnd bitand bitand_m256, BitOr bitor bitor_m256);

impl Neg for F32x8 {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        // The sign bit alone, as the scalar negation does: 0 − x would lose the sign of zero.
        Self::from_bits(self.to_bits() ^ U32x8::splat(SIGN))
    }
}

impl Not for Mask8 {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        Self(bitxor_m256(self.0, Self::splat(true).0))
    }
}
