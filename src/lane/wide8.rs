//! Eight lanes with AVX2. Only this file uses `wide`.
//!
//! Most operations come from `wide`; seven instructions are called directly. A splat in `wide` is an array of eight: where branches
//! merged, the compiler carried eight scalars, which took a third of the camera stage's time. The others are missing in `wide`:
//! widening bytes, and interleaving within halves.

use std::arch::x86_64::{
    __m128i, __m256, __m256d, _mm256_castpd_ps, _mm256_castps_pd, _mm256_cvtepi8_epi32, _mm256_set1_epi32,
    _mm256_set1_ps, _mm256_unpackhi_pd, _mm256_unpackhi_ps, _mm256_unpacklo_pd, _mm256_unpacklo_ps,
};
use std::ops::{Add, BitAnd, BitOr, BitXor, Div, Mul, Neg, Not, Sub};

use bytemuck::must_cast;
use wide::{f32x8, i32x8, u32x8};

use super::{Bits, Lane, Mask};

/// Eight `f32`.
#[derive(Clone, Copy, Debug)]
#[repr(transparent)]
pub struct F32x8(f32x8);

/// Eight `u32`; arithmetic wraps.
#[derive(Clone, Copy, Debug)]
#[repr(transparent)]
pub struct U32x8(u32x8);

/// Eight lanes of all ones or all zeros, as Embree expects for `valid`.
#[derive(Clone, Copy, Debug)]
#[repr(transparent)]
pub struct Mask8(f32x8);

/// Calls instructions of AVX2.
macro_rules! avx2 {
    ($call:expr) => {
        // SAFETY: the crate does not compile without AVX2 (`lane/mod.rs`), and `cpu::suffices` asks the processor. None of these
        // instructions touches memory.
        unsafe { $call }
    };
}

impl Mask8 {
    /// −1 in active lanes, 0 in the others.
    #[inline(always)]
    pub fn to_valid(self) -> [i32; 8] {
        must_cast(self.0)
    }

    /// Active where `valid` is nonzero (Embree writes −1 or 0).
    #[inline(always)]
    pub fn from_valid(valid: [i32; 8]) -> Self {
        !U32x8(must_cast(valid)).eq(U32x8(u32x8::ZERO))
    }
}

/// `PACK[m]` lists the set bits of `m` in ascending order, padded with lane 0. It consists of bytes to leave the L1 cache to the
/// streams.
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
    type Packing = u32x8;
    type Rows = [[f32; 4]; 8];
    type Plain = Self;

    #[inline(always)]
    fn splat(x: f32) -> Self {
        Self(avx2!(_mm256_set1_ps(x)).into())
    }
    #[inline(always)]
    fn load(source: &[f32]) -> Self {
        let eight: [f32; 8] = source[..8].try_into().expect("eight numbers");
        Self(f32x8::new(eight))
    }
    #[inline(always)]
    fn store(self, target: &mut [f32]) {
        target[..8].copy_from_slice(self.0.as_array());
    }
    #[inline(always)]
    fn from_fn(f: impl FnMut(usize) -> f32) -> Self {
        Self::load(&gather(f))
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
    // One instruction; a selection takes three.
    #[inline(always)]
    fn or_zero(self, mask: Mask8) -> Self {
        Self(self.0 & mask.0)
    }
    #[inline(always)]
    fn to_bits(self) -> U32x8 {
        U32x8(must_cast(self.0))
    }
    #[inline(always)]
    fn from_bits(bits: U32x8) -> Self {
        Self(must_cast(bits.0))
    }
    #[inline(always)]
    fn to_i32(self) -> U32x8 {
        U32x8(must_cast(self.0.fast_round_int()))
    }
    #[inline(always)]
    fn from_i32(bits: U32x8) -> Self {
        Self(must_cast::<_, i32x8>(bits.0).round_float())
    }
    #[inline(always)]
    fn negated(self, mask: Mask8) -> Self {
        Self(self.0 ^ (mask.0 & Self::splat(-0.0).0))
    }
    #[inline(always)]
    fn rows(x: Self, y: Self, z: Self) -> [[f32; 4]; 8] {
        let [x, y, z, zero]: [__m256; 4] = [x.0, y.0, z.0, f32x8::ZERO].map(__m256::from);
        let (low, high) = (
            |a: __m256, b| avx2!(_mm256_castps_pd(_mm256_unpacklo_ps(a, b))),
            |a: __m256, b| avx2!(_mm256_castps_pd(_mm256_unpackhi_ps(a, b))),
        );
        let (xy, z0, more_xy, more_z0) = (low(x, y), low(z, zero), high(x, y), high(z, zero));
        // Each holds the rows of a lane and of the fourth lane after it.
        let both = |v: __m256d| -> [[f32; 4]; 2] { must_cast(f32x8::from(avx2!(_mm256_castpd_ps(v)))) };
        let [a, e] = both(avx2!(_mm256_unpacklo_pd(xy, z0)));
        let [b, f] = both(avx2!(_mm256_unpackhi_pd(xy, z0)));
        let [c, g] = both(avx2!(_mm256_unpacklo_pd(more_xy, more_z0)));
        let [d, h] = both(avx2!(_mm256_unpackhi_pd(more_xy, more_z0)));
        [a, b, c, d, e, f, g, h]
    }
    #[inline(always)]
    fn packing(mask: Mask8) -> u32x8 {
        let row = u64::from_le_bytes(PACK[mask.to_bitmask() as usize & 255]);
        let row: __m128i = must_cast([row, 0]);
        avx2!(_mm256_cvtepi8_epi32(row)).into()
    }
    #[inline(always)]
    fn pack(self, packing: u32x8) -> Self {
        Self(self.0.shuffle(packing))
    }
}

impl Mask for Mask8 {
    #[inline(always)]
    fn splat(on: bool) -> Self {
        Self(must_cast(U32x8::splat(if on { u32::MAX } else { 0 }).0))
    }
    #[inline(always)]
    fn first(n: usize) -> Self {
        let all: i32x8 = must_cast(U32x8::splat(n as u32).0);
        Self(must_cast(all.simd_gt(i32x8::new([0, 1, 2, 3, 4, 5, 6, 7]))))
    }
    #[inline(always)]
    fn to_bitmask(self) -> u32 {
        self.0.to_bitmask()
    }
    #[inline(always)]
    fn from_bitmask(bits: u32) -> Self {
        let one = U32x8(u32x8::new([1, 2, 4, 8, 16, 32, 64, 128]));
        (U32x8::splat(bits) & one).eq(one)
    }
}

impl Bits for U32x8 {
    type Mask = Mask8;
    #[inline(always)]
    fn splat(x: u32) -> Self {
        Self(avx2!(_mm256_set1_epi32(x as i32)).into())
    }
    #[inline(always)]
    fn from_fn(f: impl FnMut(usize) -> u32) -> Self {
        Self::load(&gather(f))
    }
    #[inline(always)]
    fn load(source: &[u32]) -> Self {
        let eight: [u32; 8] = source[..8].try_into().expect("eight numbers");
        Self(u32x8::new(eight))
    }
    #[inline(always)]
    fn store(self, target: &mut [u32]) {
        target[..8].copy_from_slice(self.0.as_array());
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
    fn lookup(table: &[u32], index: Self) -> Self {
        let (low, high) = (Self::load(table), Self::load(&table[8..]));
        let of = |half: Self| Self(half.0.shuffle_wrapping(index.0));
        Self::select(index.shl(28).top_bit(), of(high), of(low))
    }
    #[inline(always)]
    fn transposed(row: impl FnMut(usize) -> [u32; 8]) -> [Self; 8] {
        let rows: [f32x8; 8] = gather(row).map(must_cast);
        f32x8::transpose(rows).map(|column| Self(must_cast(column)))
    }
    #[inline(always)]
    fn eq(self, other: Self) -> Mask8 {
        Mask8(must_cast(self.0.simd_eq(other.0)))
    }
    #[inline(always)]
    fn top_bit(self) -> Mask8 {
        Mask8(must_cast(must_cast::<_, i32x8>(self.0) >> 31_u32))
    }
    #[inline(always)]
    fn select(mask: Mask8, yes: Self, no: Self) -> Self {
        F32x8::select(mask, F32x8::from_bits(yes), F32x8::from_bits(no)).to_bits()
    }
}

/// Like `std::array::from_fn`, which is not always inlined: a call per lane costs more than the lane's work.
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
    // Flips only the sign bit, like the scalar negation: 0 − x would lose the sign of zero.
    #[inline(always)]
    fn neg(self) -> Self {
        Self(-self.0)
    }
}

impl Not for Mask8 {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        Self(!self.0)
    }
}
