//! Elementary functions from exactly rounded operations: the same bits for one lane and for eight.
//!
//! The polynomials are minimax fits (Remez exchange at 40 digits) for the reduced range named at each. The stated errors are
//! measured by the tests below against `f64` over dense sweeps. All functions avoid computing `1 - t` or `2 pi u` first, which
//! loses digits.

use crate::lane::{Bits, Lane};

const LN2_HI: f32 = 0.693_145_75;
const LN2_LO: f32 = 1.428_606_8e-6;
/// `ln` of the smallest normal `f32`: below it, `exp` is 0.
const LN_MIN_POSITIVE: f32 = -87.336_54;

/// `x = k ln 2 + r`, `|r| <= ln 2 / 2`: returns `k` and `exp(r) - 1`. For `|x| <= 88`.
#[inline(always)]
fn reduced_expm1<L: Lane>(x: L) -> (L, L) {
    let k = (x * L::splat(std::f32::consts::LOG2_E)).round();
    let r = k.mul_add(L::splat(-LN2_HI), x);
    let r = k.mul_add(L::splat(-LN2_LO), r);
    // exp(r) = 1 + r + r^2 q(r), |error| < 1.5e-8 |r|
    let q = polynomial(r, [0.5, 0.166_665_38, 0.041_666_266, 0.008_367_247, 0.001_394_759_7]);
    (k, (r * r).mul_add(q, r))
}

/// `2^k` for whole `k` in [−126, 127].
#[inline(always)]
fn power_of_two<L: Lane>(k: L) -> L {
    L::from_bits((k.to_i32() + L::Bits::splat(127)).shl(23))
}

/// Horner's rule, lowest coefficient first.
#[inline(always)]
fn polynomial<L: Lane, const K: usize>(x: L, coefficients: [f32; K]) -> L {
    let mut sum = L::splat(coefficients[K - 1]);
    let mut i = K - 1;
    while i > 0 {
        i -= 1;
        sum = sum.mul_add(x, L::splat(coefficients[i]));
    }
    sum
}

/// `exp(x)` for `x <= 88`; exactly 0 below −87.34, where the result would be denormal. Error below 1.5 ulp.
#[inline(always)]
pub fn exp<L: Lane>(x: L) -> L {
    let lost = x.lt(L::splat(LN_MIN_POSITIVE));
    let (k, e) = reduced_expm1(x.max(L::splat(LN_MIN_POSITIVE)));
    let s = power_of_two(k);
    L::select(lost, L::zero(), e.mul_add(s, s))
}

/// `exp(x) - 1` for `x <= 0`, accurate for `x` close to 0. Error below 2 ulp.
#[inline(always)]
pub fn expm1<L: Lane>(x: L) -> L {
    let (k, e) = reduced_expm1(x.max(L::splat(LN_MIN_POSITIVE)));
    let s = power_of_two(k);
    e.mul_add(s, s - L::one())
}

/// `ln(1 + z) + exponent ln 2` for `z` in [sqrt(1/2) − 1, sqrt(2) − 1].
#[inline(always)]
fn ln_of_parts<L: Lane>(exponent: L, z: L) -> L {
    // ln(1 + z) = z - z^2/2 + z^3 q(z), |error| < 6e-9 |z|
    let q = polynomial(
        z,
        [
            0.333_333_16,
            -0.250_008_17,
            0.200_023_03,
            -0.166_243_48,
            0.141_806_99,
            -0.131_304_5,
            0.128_858_61,
            -0.078_599_55,
        ],
    );
    let z2 = z * z;
    let small = (z2 * z).mul_add(q, exponent * L::splat(LN2_LO));
    let sum = z2.mul_add(L::splat(-0.5), small) + z;
    exponent.mul_add(L::splat(LN2_HI), sum)
}

/// The exponent `e` with `x / 2^e` in [sqrt(1/2), sqrt(2)), and `2^-e`. For normal positive `x`.
#[inline(always)]
fn exponent_of<L: Lane>(x: L) -> (L, L) {
    let sqrt_half = L::Bits::splat(0x3f35_04f3);
    let one = L::one().to_bits();
    let e = (x.to_bits() + (one - sqrt_half)).shr(23) - L::Bits::splat(127);
    (L::from_i32(e), L::from_bits((L::Bits::splat(127) - e).shl(23)))
}

/// Natural logarithm of a normal `x` in (0, 2^126]. Error below 1 ulp, absolute error below 1e-7 close to 1.
#[inline(always)]
pub fn ln<L: Lane>(x: L) -> L {
    let (e, scale) = exponent_of(x);
    ln_of_parts(e, x.mul_add(scale, -L::one()))
}

/// `ln(1 - t)` for `t` in [0, 1 − 2^-24]; accurate for small `t`, for which `1 - t` loses digits.
#[inline(always)]
pub fn ln_1m<L: Lane>(t: L) -> L {
    let (e, scale) = exponent_of(L::one() - t);
    // s (1 - t) - 1 with a single rounding: s - 1 is exact.
    ln_of_parts(e, (-scale).mul_add(t, scale - L::one()))
}

/// `cos^alpha` of an angle given as both `cosine` and `t = 1 - cos`; 0 if the cosine is not positive.
///
/// Close to the axis `t` is more precise (the power amplifies an error of the cosine by `alpha`), far from it the cosine: each lane
/// uses the better one. Compute `t` from the chord, `|a - b|^2 / 2`, which is insensitive to length errors of 1e-7 in rounded unit
/// vectors. Relative error below 5e-7 times `max(1, |alpha ln cos|)`.
#[inline(always)]
pub fn powcos<L: Lane>(cosine: L, t: L, alpha: L) -> L {
    let near = t.lt(L::splat(0.3));
    let positive = cosine.gt(L::zero());
    let base = L::select(near, L::one() - t, cosine.max(L::splat(f32::MIN_POSITIVE)));
    let (e, scale) = exponent_of(base);
    let from_t = (-scale).mul_add(t, scale - L::one());
    let from_cosine = base.mul_add(scale, -L::one());
    let ln_cos = ln_of_parts(e, L::select(near, from_t, from_cosine));
    L::select(positive, exp(ln_cos * alpha), L::zero())
}

/// `(sin, cos)` of `2 pi u` for `u` in [0, 1]. Absolute error below 1.2e-7.
#[inline(always)]
pub fn sin_cos_turn<L: Lane>(u: L) -> (L, L) {
    let quarter = (u * L::splat(4.0)).round();
    let f = quarter.mul_add(L::splat(-0.25), u); // exact: |f| <= 1/8
    let f2 = f * f;
    let s = f * polynomial(f2, [std::f32::consts::TAU, -41.341_663, 81.592_53, -75.400_77]);
    let c = polynomial(f2, [1.0, -19.739_208, 64.939_316, -85.442_825, 59.219_39]);
    let q = quarter.to_i32();
    let odd = q.shl(31).top_bit();
    let sine_sign = q.shl(30) & L::Bits::splat(1 << 31);
    let cosine_sign = (q + L::Bits::splat(1)).shl(30) & L::Bits::splat(1 << 31);
    let sine = L::select(odd, c, s);
    let cosine = L::select(odd, s, c);
    (
        L::from_bits(sine.to_bits() ^ sine_sign),
        L::from_bits(cosine.to_bits() ^ cosine_sign),
    )
}

/// The angle of the point `(x, y)` with `y >= 0` from the x axis, in [0, pi]; 0 for the origin. Error below 2.2 ulp, the worst near
/// 45 degrees.
#[inline(always)]
pub fn angle<L: Lane>(y: L, x: L) -> L {
    let width = x.abs();
    let (low, high) = (y.min(width), y.max(width));
    let r = low.div_or_zero(high, high.gt(L::zero()));
    let r2 = r * r;
    // atan(r) = r + r^3 q(r^2) on [0, 1], |error| < 1.7e-8 r
    let q = polynomial(
        r2,
        [
            -0.333_331_53,
            0.199_937_73,
            -0.142_110_56,
            0.106_660_046,
            -0.075_522_14,
            0.043_211_86,
            -0.016_367_927,
            0.002_920_669_2,
        ],
    );
    let low_angle = (r * r2).mul_add(q, r);
    let steep = y.gt(width);
    let acute = L::select(steep, L::splat(std::f32::consts::FRAC_PI_2) - low_angle, low_angle);
    L::select(x.lt(L::zero()), L::splat(std::f32::consts::PI) - acute, acute)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Largest error in ulps of the true value.
    fn worst_ulp(xs: impl Iterator<Item = f32>, f: fn(f32) -> f32, truth: fn(f64) -> f64) -> f64 {
        xs.map(|x| {
            let t = truth(f64::from(x));
            let ulp = f64::from((t as f32).abs().next_up() - (t as f32).abs());
            (f64::from(f(x)) - t).abs() / ulp
        })
        .fold(0.0, f64::max)
    }

    fn sweep(from: f64, to: f64, n: u32) -> impl Iterator<Item = f32> {
        (0..=n).map(move |i| (from + (to - from) * f64::from(i) / f64::from(n)) as f32)
    }

    fn log_sweep(from: f64, to: f64, n: u32) -> impl Iterator<Item = f32> {
        sweep(from.ln(), to.ln(), n).map(|x| f64::from(x).exp() as f32)
    }

    #[test]
    fn exp_is_within_its_bound_and_underflows_to_zero() {
        let worst = worst_ulp(sweep(-87.3, 80.0, 2_000_000), exp::<f32>, f64::exp);
        assert!(worst < 1.5, "{worst} ulp");
        assert_eq!(exp(-87.4_f32), 0.0);
        assert_eq!(exp(f32::NEG_INFINITY), 0.0);
        assert_eq!(exp(0.0_f32), 1.0);
    }

    #[test]
    fn expm1_keeps_its_digits_close_to_zero() {
        for xs in [
            sweep(-86.0, 0.0, 1_000_000).collect::<Vec<_>>(),
            log_sweep(1e-20, 1.0, 1_000_000).map(|x| -x).collect(),
        ] {
            let worst = worst_ulp(xs.into_iter(), expm1::<f32>, f64::exp_m1);
            assert!(worst < 2.0, "{worst} ulp");
        }
    }

    #[test]
    fn ln_and_ln_1m_are_within_their_bounds() {
        let worst = worst_ulp(log_sweep(1.2e-38, 8e37, 2_000_000), ln::<f32>, f64::ln);
        assert!(worst < 1.0, "ln: {worst} ulp");
        let worst = worst_ulp(log_sweep(1e-30, 0.999_999, 2_000_000), ln_1m::<f32>, |t| (-t).ln_1p());
        assert!(worst < 1.0, "ln_1m: {worst} ulp");
        assert_eq!(ln(1.0_f32), 0.0);
        assert_eq!(ln_1m(0.0_f32), 0.0);
    }

    #[test]
    fn angle_is_within_its_bound_all_round_the_upper_half_and_near_its_axis() {
        let ulp = |truth: f64| f64::from((truth as f32).next_up() - truth as f32);
        for (y, x) in sweep(0.0, std::f64::consts::PI, 1_000_000)
            .map(|a| (3.0 * a.sin().max(0.0), 3.0 * a.cos()))
            .chain(log_sweep(1e-30, 1.0, 200_000).map(|y| (y, 1.0)))
        {
            let truth = f64::from(y).atan2(f64::from(x));
            let error = (f64::from(angle(y, x)) - truth).abs() / ulp(truth);
            assert!(error < 2.2, "({x}, {y}): {error} ulp");
        }
        assert_eq!((angle(0.0_f32, 1.0), angle(0.0_f32, 0.0)), (0.0, 0.0));
        assert_eq!(angle(0.0_f32, -1.0), std::f32::consts::PI);
    }

    #[test]
    fn sin_cos_turn_is_within_its_bound() {
        for u in sweep(0.0, 1.0, 1 << 20) {
            let (s, c) = sin_cos_turn(u);
            let (ts, tc) = (std::f64::consts::TAU * f64::from(u)).sin_cos();
            assert!((f64::from(s) - ts).abs() < 1.2e-7, "sin(2 pi {u})");
            assert!((f64::from(c) - tc).abs() < 1.2e-7, "cos(2 pi {u})");
        }
    }

    #[test]
    fn powcos_holds_for_every_exponent() {
        for alpha in [1.0, 1.5, 10.0, 1e3, 1e5, 1e6_f32] {
            // Depth in the lobe: alpha ln cos from -60 to 0.
            for depth in sweep(-60.0, -1e-3, 20_000) {
                let t = (-(f64::from(depth) / f64::from(alpha)).exp_m1()) as f32;
                let cosine = 1.0 - t;
                if cosine <= 1e-6 {
                    continue;
                }
                // The true value for the input that the lane uses: t close to the axis, the cosine away from it.
                let ln_cos = if t < 0.3 {
                    (-f64::from(t)).ln_1p()
                } else {
                    f64::from(cosine).ln()
                };
                let truth = (f64::from(alpha) * ln_cos).exp();
                let error = (f64::from(powcos(cosine, t, alpha)) / truth - 1.0).abs();
                let bound = 5e-7 * f64::from(depth).abs().max(1.0);
                assert!(error < bound, "alpha {alpha}, t {t}: {error:e}");
            }
        }
        assert_eq!(powcos(0.0_f32, 1.0, 5.0), 0.0);
        assert_eq!(powcos(-0.5_f32, 1.5, 5.0), 0.0);
        assert_eq!(powcos(1.0_f32, 0.0, 1e6), 1.0);
    }

    #[test]
    fn eight_lanes_give_the_bits_of_one() {
        use crate::lane::F32x8;
        let xs: Vec<f32> = sweep(0.0, 1.0 - 1.0 / 16_777_216.0, 80_007).collect();
        for chunk in xs.chunks_exact(8) {
            let x = F32x8::load(chunk);
            let (s, c) = sin_cos_turn(x);
            let wide = [
                exp(-x * F32x8::splat(90.0)),
                expm1(-x),
                ln(x.max(F32x8::splat(1e-30))),
                ln_1m(x),
                s,
                c,
                powcos(F32x8::one() - x, x, F32x8::splat(37.0)),
            ];
            for (i, &u) in chunk.iter().enumerate() {
                let (s, c) = sin_cos_turn(u);
                let scalar = [
                    exp(-u * 90.0),
                    expm1(-u),
                    ln(u.max(1e-30)),
                    ln_1m(u),
                    s,
                    c,
                    powcos(1.0 - u, u, 37.0),
                ];
                for (k, (w, x)) in wide.iter().zip(scalar).enumerate() {
                    assert_eq!(w.lane(i).to_bits(), x.to_bits(), "function {k} at {u}");
                }
            }
        }
    }
}
