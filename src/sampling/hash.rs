//! Integer hashes: an address gives the same bits on any thread and in any lane.

use crate::lane::Bits;

/// Four hashed words from four words: PCG4D of Jarzynski and Olano 2020, "Hash Functions for GPU Rendering", section 4. Uniform in
/// the top bits; passes the statistical tests of that paper at the cost of twelve products.
#[inline(always)]
pub fn pcg4d<B: Bits>(address: [B; 4]) -> [B; 4] {
    // No `map`: its closure would become a call, compiled without the lanes' instruction set.
    let (a, c) = (B::splat(1_664_525), B::splat(1_013_904_223));
    let [x, y, z, w] = address;
    let (mut x, mut y, mut z, mut w) = (x * a + c, y * a + c, z * a + c, w * a + c);
    x = x + y * w;
    y = y + z * x;
    z = z + x * y;
    w = w + y * z;
    (x, y, z, w) = (x ^ x.shr(16), y ^ y.shr(16), z ^ z.shr(16), w ^ w.shr(16));
    x = x + y * w;
    y = y + z * x;
    z = z + x * y;
    w = w + y * z;
    [x, y, z, w]
}

/// [`mix`] per lane.
#[inline(always)]
pub fn mix_lanes<B: Bits>(x: B) -> B {
    let x = (x ^ x.shr(16)) * B::splat(0x7feb_352d);
    let x = (x ^ x.shr(15)) * B::splat(0x846c_a68b);
    x ^ x.shr(16)
}

/// One hashed word from another: `lowbias32` of Wellons 2018 ("Prospecting for Hash Functions"), a bijection.
#[inline(always)]
pub const fn mix(mut x: u32) -> u32 {
    x ^= x >> 16;
    x = x.wrapping_mul(0x7feb_352d);
    x ^= x >> 15;
    x = x.wrapping_mul(0x846c_a68b);
    x ^ x >> 16
}
