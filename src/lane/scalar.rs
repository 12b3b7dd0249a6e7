//! One lane: plain `f32`, `u32` and `bool`.

use super::{Bits, Lane, Mask};

impl Lane for f32 {
    const N: usize = 1;
    type Mask = bool;
    type Bits = Word;
    type Packing = ();
    type Rows = [[f32; 4]; 1];
    type Plain = Self;

    #[inline(always)]
    fn splat(x: f32) -> Self {
        x
    }
    #[inline(always)]
    fn load(source: &[f32]) -> Self {
        source[0]
    }
    #[inline(always)]
    fn store(self, target: &mut [f32]) {
        target[0] = self;
    }
    #[inline(always)]
    fn from_fn(mut f: impl FnMut(usize) -> f32) -> Self {
        f(0)
    }
    #[inline(always)]
    fn lane(self, _: usize) -> f32 {
        self
    }
    #[inline(always)]
    fn mul_add(self, a: Self, b: Self) -> Self {
        f32::mul_add(self, a, b)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        f32::sqrt(self)
    }
    #[inline(always)]
    fn abs(self) -> Self {
        f32::abs(self)
    }
    // Like the vector instructions: returns the second operand unless the comparison holds. `f32::min` differs for NaN and signed
    // zeros.
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        if self < other { self } else { other }
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        if self > other { self } else { other }
    }
    #[inline(always)]
    fn round(self) -> Self {
        self.round_ties_even()
    }
    #[inline(always)]
    fn lt(self, other: Self) -> bool {
        self < other
    }
    #[inline(always)]
    fn le(self, other: Self) -> bool {
        self <= other
    }
    #[inline(always)]
    fn select(mask: bool, yes: Self, no: Self) -> Self {
        if mask { yes } else { no }
    }
    #[inline(always)]
    fn to_bits(self) -> Word {
        Word(f32::to_bits(self))
    }
    #[inline(always)]
    fn from_bits(bits: Word) -> Self {
        f32::from_bits(bits.0)
    }
    #[inline(always)]
    fn to_i32(self) -> Word {
        Word(self as i32 as u32)
    }
    #[inline(always)]
    fn from_i32(bits: Word) -> Self {
        bits.0 as i32 as f32
    }
    #[inline(always)]
    fn rows(x: Self, y: Self, z: Self) -> [[f32; 4]; 1] {
        [[x, y, z, 0.0]]
    }
    #[inline(always)]
    fn packing(_: bool) {}
    #[inline(always)]
    fn pack(self, (): ()) -> Self {
        self
    }
}

impl Mask for bool {
    #[inline(always)]
    fn splat(on: bool) -> Self {
        on
    }
    #[inline(always)]
    fn first(n: usize) -> Self {
        n > 0
    }
    #[inline(always)]
    fn to_bitmask(self) -> u32 {
        u32::from(self)
    }
    #[inline(always)]
    fn from_bitmask(bits: u32) -> Self {
        bits & 1 != 0
    }
}

/// One `u32` with wrapping operators.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Word(pub u32);

macro_rules! operator {
    ($trait:ident, $name:ident, $a:ident, $b:ident, $result:expr) => {
        impl std::ops::$trait for Word {
            type Output = Self;
            #[inline(always)]
            fn $name(self, other: Self) -> Self {
                let ($a, $b) = (self.0, other.0);
                Self($result)
            }
        }
    };
}
operator!(Add, add, a, b, a.wrapping_add(b));
operator!(Sub, sub, a, b, a.wrapping_sub(b));
operator!(Mul, mul, a, b, a.wrapping_mul(b));
operator!(BitXor, bitxor, a, b, a ^ b);
operator!(BitAnd, bitand, a, b, a & b);
operator!(BitOr, bitor, a, b, a | b);

impl Bits for Word {
    type Mask = bool;
    #[inline(always)]
    fn splat(x: u32) -> Self {
        Self(x)
    }
    #[inline(always)]
    fn from_fn(mut f: impl FnMut(usize) -> u32) -> Self {
        Self(f(0))
    }
    #[inline(always)]
    fn load(source: &[u32]) -> Self {
        Self(source[0])
    }
    #[inline(always)]
    fn store(self, target: &mut [u32]) {
        target[0] = self.0;
    }
    #[inline(always)]
    fn lane(self, _: usize) -> u32 {
        self.0
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
        Self(table[(index.0 & 15) as usize])
    }
    #[inline(always)]
    fn transposed(mut row: impl FnMut(usize) -> [u32; 8]) -> [Self; 8] {
        row(0).map(Self)
    }
    #[inline(always)]
    fn eq(self, other: Self) -> bool {
        self.0 == other.0
    }
    #[inline(always)]
    fn top_bit(self) -> bool {
        self.0 >> 31 != 0
    }
    #[inline(always)]
    fn select(mask: bool, yes: Self, no: Self) -> Self {
        if mask { yes } else { no }
    }
}
