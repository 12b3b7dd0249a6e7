//! Sixteen lanes of AVX-512.
//!
//! Crates for vector types choose the width at compile time, so one binary for both widths requires these types over `std::arch`.
//! Kernels of these lanes run only through [`with_avx512`](super::with_avx512). Only `lane` and `embree/packet.rs` name the types;
//! `tests/layers.rs` checks this.

use std::arch::x86_64::*;
use std::ops::{Add, BitAnd, BitOr, BitXor, Div, Mul, Neg, Not, Sub};

use super::{Bits, Lane, Mask, U32x8};

/// Sixteen `f32`.
#[derive(Clone, Copy, Debug)]
#[repr(transparent)]
pub struct F32x16(__m512);

/// Sixteen `u32`; arithmetic wraps.
#[derive(Clone, Copy, Debug)]
#[repr(transparent)]
pub struct U32x16(__m512i);

/// Sixteen bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(transparent)]
pub struct Mask16(__mmask16);

/// Calls intrinsics.
macro_rules! avx512 {
    ($call:expr) => {
        // SAFETY: values of these types come to life only in kernels behind `with_avx512`, which has asked the processor: all other
        // code gets the types as parameters of a function that runs there.
        // No intrinsic here touches memory but through the references beside it, and in `rows`.
        unsafe { $call }
    };
}

/// The lane order of a transposed 4 x 4 matrix.
const TURNED: [u32; 16] = [0, 4, 8, 12, 1, 5, 9, 13, 2, 6, 10, 14, 3, 7, 11, 15];

impl Lane for F32x16 {
    const N: usize = 16;
    type Mask = Mask16;
    type Bits = U32x16;
    type Packing = Mask16;
    type Rows = [[f32; 4]; 16];
    type Plain = super::F32x8;

    #[inline(always)]
    fn splat(x: f32) -> Self {
        Self(avx512!(_mm512_set1_ps(x)))
    }
    #[inline(always)]
    fn load(source: &[f32]) -> Self {
        let sixteen: &[f32; 16] = source[..16].try_into().expect("sixteen numbers");
        Self(avx512!(_mm512_loadu_ps(sixteen.as_ptr())))
    }
    #[inline(always)]
    fn store(self, target: &mut [f32]) {
        let sixteen: &mut [f32; 16] = (&mut target[..16]).try_into().expect("room for sixteen");
        avx512!(_mm512_storeu_ps(sixteen.as_mut_ptr(), self.0));
    }
    #[inline(always)]
    fn from_fn(f: impl FnMut(usize) -> f32) -> Self {
        Self::load(&gather(f))
    }
    #[inline(always)]
    fn lane(self, i: usize) -> f32 {
        let mut all = [0.0; 16];
        self.store(&mut all);
        all[i]
    }
    #[inline(always)]
    fn mul_add(self, a: Self, b: Self) -> Self {
        Self(avx512!(_mm512_fmadd_ps(self.0, a.0, b.0)))
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(avx512!(_mm512_sqrt_ps(self.0)))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self(avx512!(_mm512_abs_ps(self.0)))
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self(avx512!(_mm512_min_ps(self.0, other.0)))
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self(avx512!(_mm512_max_ps(self.0, other.0)))
    }
    #[inline(always)]
    fn round(self) -> Self {
        const NEAREST: i32 = _MM_FROUND_TO_NEAREST_INT | _MM_FROUND_NO_EXC;
        Self(avx512!(_mm512_roundscale_ps::<NEAREST>(self.0)))
    }
    #[inline(always)]
    fn lt(self, other: Self) -> Mask16 {
        Mask16(avx512!(_mm512_cmp_ps_mask::<_CMP_LT_OQ>(self.0, other.0)))
    }
    #[inline(always)]
    fn le(self, other: Self) -> Mask16 {
        Mask16(avx512!(_mm512_cmp_ps_mask::<_CMP_LE_OQ>(self.0, other.0)))
    }
    #[inline(always)]
    fn select(mask: Mask16, yes: Self, no: Self) -> Self {
        Self(avx512!(_mm512_mask_blend_ps(mask.0, no.0, yes.0)))
    }
    #[inline(always)]
    fn to_bits(self) -> U32x16 {
        U32x16(avx512!(_mm512_castps_si512(self.0)))
    }
    #[inline(always)]
    fn from_bits(bits: U32x16) -> Self {
        Self(avx512!(_mm512_castsi512_ps(bits.0)))
    }
    #[inline(always)]
    fn to_i32(self) -> U32x16 {
        U32x16(avx512!(_mm512_cvtps_epi32(self.0)))
    }
    #[inline(always)]
    fn from_i32(bits: U32x16) -> Self {
        Self(avx512!(_mm512_cvtepi32_ps(bits.0)))
    }
    #[inline(always)]
    fn rows(x: Self, y: Self, z: Self) -> [[f32; 4]; 16] {
        // The code below transposes each 4 x 4 block, so lanes are permuted first to come out in order.
        let turned = U32x16::load(&TURNED).0;
        let mut rows = [[0.0; 4]; 16];
        // Sixteen rows of four `f32` are 32 times 64 bits: four stores of eight, none past the end.
        avx512!({
            let x = _mm512_permutexvar_ps(turned, x.0);
            let y = _mm512_permutexvar_ps(turned, y.0);
            let z = _mm512_permutexvar_ps(turned, z.0);
            let zero = _mm512_setzero_ps();
            let xy = _mm512_castps_pd(_mm512_unpacklo_ps(x, y));
            let z0 = _mm512_castps_pd(_mm512_unpacklo_ps(z, zero));
            let more_xy = _mm512_castps_pd(_mm512_unpackhi_ps(x, y));
            let more_z0 = _mm512_castps_pd(_mm512_unpackhi_ps(z, zero));
            let to: *mut f64 = rows.as_mut_ptr().cast();
            _mm512_storeu_pd(to, _mm512_unpacklo_pd(xy, z0));
            _mm512_storeu_pd(to.add(8), _mm512_unpackhi_pd(xy, z0));
            _mm512_storeu_pd(to.add(16), _mm512_unpacklo_pd(more_xy, more_z0));
            _mm512_storeu_pd(to.add(24), _mm512_unpackhi_pd(more_xy, more_z0));
        });
        rows
    }
    #[inline(always)]
    fn packing(mask: Mask16) -> Mask16 {
        mask
    }
    #[inline(always)]
    fn pack(self, packing: Mask16) -> Self {
        Self(avx512!(_mm512_maskz_compress_ps(packing.0, self.0)))
    }
}

impl Mask for Mask16 {
    #[inline(always)]
    fn splat(on: bool) -> Self {
        Self(if on { !0 } else { 0 })
    }
    #[inline(always)]
    fn first(n: usize) -> Self {
        Self(((1_u32 << n.min(16)) - 1) as u16)
    }
    #[inline(always)]
    fn to_bitmask(self) -> u32 {
        u32::from(self.0)
    }
    #[inline(always)]
    fn from_bitmask(bits: u32) -> Self {
        Self(bits as u16)
    }
}

impl Mask16 {
    /// −1 in active lanes, 0 in the others.
    #[inline(always)]
    pub fn to_valid(self) -> [i32; 16] {
        let mut valid = [0; 16];
        avx512!(_mm512_storeu_si512(
            valid.as_mut_ptr().cast(),
            _mm512_movm_epi32(self.0)
        ));
        valid
    }
}

impl Bits for U32x16 {
    type Mask = Mask16;
    #[inline(always)]
    fn splat(x: u32) -> Self {
        Self(avx512!(_mm512_set1_epi32(x as i32)))
    }
    #[inline(always)]
    fn from_fn(f: impl FnMut(usize) -> u32) -> Self {
        Self::load(&gather(f))
    }
    #[inline(always)]
    fn load(source: &[u32]) -> Self {
        let sixteen: &[u32; 16] = source[..16].try_into().expect("sixteen numbers");
        Self(avx512!(_mm512_loadu_si512(sixteen.as_ptr().cast())))
    }
    #[inline(always)]
    fn store(self, target: &mut [u32]) {
        let sixteen: &mut [u32; 16] = (&mut target[..16]).try_into().expect("room for sixteen");
        avx512!(_mm512_storeu_si512(sixteen.as_mut_ptr().cast(), self.0));
    }
    #[inline(always)]
    fn lane(self, i: usize) -> u32 {
        let mut all = [0; 16];
        self.store(&mut all);
        all[i]
    }
    #[inline(always)]
    fn shl(self, by: u32) -> Self {
        Self(avx512!(_mm512_sll_epi32(self.0, _mm_cvtsi32_si128(by as i32))))
    }
    #[inline(always)]
    fn shr(self, by: u32) -> Self {
        Self(avx512!(_mm512_srl_epi32(self.0, _mm_cvtsi32_si128(by as i32))))
    }
    #[inline(always)]
    fn lookup(table: &[u32], index: Self) -> Self {
        Self(avx512!(_mm512_permutexvar_epi32(index.0, Self::load(table).0)))
    }
    #[inline(always)]
    fn transposed(mut row: impl FnMut(usize) -> [u32; 8]) -> [Self; 8] {
        let (low, high) = (U32x8::transposed(&mut row), U32x8::transposed(|lane| row(8 + lane)));
        let mut columns = [Self::splat(0); 8];
        for (column, (low, high)) in columns.iter_mut().zip(low.into_iter().zip(high)) {
            let mut both = [0; 16];
            low.store(&mut both);
            high.store(&mut both[8..]);
            *column = Self::load(&both);
        }
        columns
    }
    #[inline(always)]
    fn eq(self, other: Self) -> Mask16 {
        Mask16(avx512!(_mm512_cmpeq_epi32_mask(self.0, other.0)))
    }
    #[inline(always)]
    fn top_bit(self) -> Mask16 {
        Mask16(avx512!(_mm512_movepi32_mask(self.0)))
    }
    #[inline(always)]
    fn select(mask: Mask16, yes: Self, no: Self) -> Self {
        Self(avx512!(_mm512_mask_blend_epi32(mask.0, no.0, yes.0)))
    }
}

/// Like `std::array::from_fn`, which is not always inlined.
#[inline(always)]
fn gather<T: Copy + Default>(mut f: impl FnMut(usize) -> T) -> [T; 16] {
    let mut all = [T::default(); 16];
    let mut i = 0;
    while i < 16 {
        all[i] = f(i);
        i += 1;
    }
    all
}

macro_rules! operators {
    ($type:ident: $($trait:ident $name:ident $intrinsic:ident),*) => { $(
        impl $trait for $type {
            type Output = Self;
            #[inline(always)]
            fn $name(self, other: Self) -> Self {
                Self(avx512!($intrinsic(self.0, other.0)))
            }
        }
    )* };
}
operators!(F32x16: Add add _mm512_add_ps, Sub sub _mm512_sub_ps, Mul mul _mm512_mul_ps, Div div _mm512_div_ps);
operators!(U32x16: Add add _mm512_add_epi32, Sub sub _mm512_sub_epi32, Mul mul _mm512_mullo_epi32,
    BitXor bitxor _mm512_xor_si512, BitAnd bitand _mm512_and_si512, BitOr bitor _mm512_or_si512);

impl Neg for F32x16 {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        // Flips only the sign bit, like the scalar negation.
        Self::from_bits(self.to_bits() ^ U32x16::splat(1 << 31))
    }
}

impl BitAnd for Mask16 {
    type Output = Self;
    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }
}

impl BitOr for Mask16 {
    type Output = Self;
    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

impl Not for Mask16 {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        Self(!self.0)
    }
}
