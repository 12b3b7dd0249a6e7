//! Tail probabilities and quantiles of Student's t, the normal and the chi-square distribution.
//!
//! A standard error estimated from R values is itself uncertain. At the small false-alarm rates of a family of tests this
//! matters: with 16 values, one t statistic in 10 million lies beyond 9.5 estimated standard errors, not beyond 5.3.
//!
//! Tail probabilities come from `statrs`. Quantiles come from bisection of them: `StudentsT::inverse_cdf` of statrs 0.19.1 is
//! 1.9 times too small at 1e-9 with one degree of freedom, and off by 6e-5 at 0.05 with a million.

use std::f64::consts::SQRT_2;

use statrs::distribution::{ChiSquared, ContinuousCDF, StudentsT};
use statrs::function::erf::{erfc, erfc_inv};

/// From this many degrees of freedom Student's t is treated as normal: `statrs` loses a digit with each factor of ten.
const NORMAL: f64 = 1e7;

/// The probability that `|t|` is at least this large, with `dof` degrees of freedom (above 0, may be infinite).
/// NaN if either is NaN.
pub fn p_student(t: f64, dof: f64) -> f64 {
    if t.is_nan() || dof.is_nan() {
        f64::NAN
    } else if dof >= NORMAL {
        erfc(t.abs() / SQRT_2)
    } else {
        StudentsT::new(0.0, 1.0, dof).map_or(f64::NAN, |student| 2.0 * student.sf(t.abs()))
    }
}

/// The probability that chi-square with `degrees` of freedom (above 0) is at least this large.
pub fn p_chi_square(statistic: f64, degrees: usize) -> f64 {
    if statistic.is_nan() {
        return f64::NAN;
    }
    ChiSquared::new(degrees as f64).map_or(f64::NAN, |chi| chi.sf(statistic.max(0.0)))
}

/// The `t` that `|t|` exceeds with probability `alpha`.
///
/// # Panics
/// Unless `alpha` is in (0, 1) and `dof` is above 0.
pub fn t_quantile(alpha: f64, dof: f64) -> f64 {
    assert!(alpha > 0.0 && alpha < 1.0 && dof > 0.0, "alpha {alpha}, dof {dof}");
    exceeded(alpha, |t| p_student(t, dof))
}

/// The same for the normal distribution.
pub fn z_quantile(alpha: f64) -> f64 {
    SQRT_2 * erfc_inv(alpha)
}

/// The normal deviate with the same tail probability as chi-square at `statistic`; infinite if that probability is 0.
pub fn chi_square_as_normal(statistic: f64, degrees: usize) -> f64 {
    z_quantile(2.0 * p_chi_square(statistic, degrees))
}

/// The normal deviate with the same tail probability and sign as this `t`; at most 37, also where `t` is NaN.
pub fn t_as_normal(t: f64, dof: f64) -> f64 {
    z_quantile(p_student(t, dof).max(f64::MIN_POSITIVE)).copysign(t)
}

/// The root mean square that `count` normal deviates exceed with probability `alpha`.
pub fn rms_bound(alpha: f64, count: usize) -> f64 {
    (exceeded(alpha, |x| p_chi_square(x, count)) / count as f64).sqrt()
}

/// The argument at which a tail probability that falls from 1 to 0 reaches `alpha`.
fn exceeded(alpha: f64, tail: impl Fn(f64) -> f64) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    while tail(high) > alpha && high < 1e150 {
        (low, high) = (high, high * 2.0);
    }
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if tail(middle) > alpha {
            low = middle;
        } else {
            high = middle;
        }
    }
    high
}

#[cfg(test)]
mod tests {
    use super::*;

    /// References by mpmath 1.3 with 50 digits; tolerance 1e-7, relative.
    fn close(found: f64, truth: f64, of: &str) {
        assert!((found / truth - 1.0).abs() < 1e-7, "{of}: {found:e}, not {truth:e}");
    }

    #[test]
    fn tails_of_students_t() {
        for (t, dof, p) in [
            (1.0, 1.0, 0.5),
            (8.0, 1.0, 0.079_166_848_321_131_08),
            (2.1, 15.0, 0.053_055_256_152_042_73),
            (8.0, 15.0, 8.610_930_382_707_618e-7),
            (1.75, 1e4, 0.080_148_982_687_426_16),
            (8.0, 1e4, 1.382_120_872_906_538_2e-15),
            (0.001, 1e6, 0.999_202_115_771_649_1),
            (1.75, 1e6, 0.080_118_620_416_547_88),
            (2.1, 1e6, 0.035_729_090_974_635_02),
            (12.0, 1e6, 3.571_685_124_765_09e-33),
        ] {
            close(p_student(t, dof), p, &format!("t {t}, dof {dof}"));
            assert_eq!(p_student(-t, dof), p_student(t, dof));
        }
        assert_eq!(p_student(0.0, 9.0), 1.0);
        assert_eq!(p_student(f64::INFINITY, 9.0), 0.0);
        assert!(p_student(f64::NAN, 9.0).is_nan() && p_student(1.0, f64::NAN).is_nan());
    }

    #[test]
    fn quantiles_of_students_t() {
        for (alpha, dof, t) in [
            (1e-6, 1.0, 636_619.772_367_057_7),
            (1e-9, 1.0, 636_619_772.367_581_3),
            (1e-12, 2.0, 999_999.999_999_25),
            (0.05, 7.0, 2.364_624_251_592_785),
            (1e-9, 7.0, 42.750_802_477_245_34),
            (0.5, 15.0, 0.691_196_948_958_489_8),
            (1e-12, 15.0, 21.646_234_094_346_22),
            (1e-6, 62.0, 5.429_330_398_516_561),
            (0.5, 1e6, 0.674_489_995_531_087_4),
            (0.05, 1e6, 1.959_966_356_814_107),
            (1e-12, 1e6, 7.130_599_267_919_323),
        ] {
            close(t_quantile(alpha, dof), t, &format!("alpha {alpha}, dof {dof}"));
        }
    }

    #[test]
    fn normal_quantiles_and_what_is_normal_in_the_limit() {
        for (alpha, z) in [
            (0.5, 0.674_489_750_196_081_7),
            (0.05, 1.959_963_984_540_054_2),
            (1e-6, 4.891_638_475_698_59),
            (1e-12, 7.130_506_848_171_325),
        ] {
            close(z_quantile(alpha), z, &format!("alpha {alpha}"));
            close(t_quantile(alpha, f64::INFINITY), z, "infinite dof");
            for dof in [7.0, 60.0] {
                close(t_as_normal(-t_quantile(alpha, dof), dof), -z, "t as normal");
            }
        }
        assert!(t_as_normal(1e9, f64::INFINITY) > 37.0 && t_as_normal(1e9, f64::INFINITY).is_finite());
    }

    #[test]
    fn tails_of_chi_square() {
        for (x, degrees, p) in [
            (0.2, 1, 0.654_720_846_018_577),
            (3.0, 1, 0.083_264_516_663_550_4),
            (15.0, 5, 0.010_362_337_915_786_437),
            (144.0, 48, 1.585_513_839_471_311_7e-11),
            (600.0, 200, 1.411_021_510_211_152e-41),
            (4400.0, 4000, 7.169_925_088_244_839e-6),
            (100_000.0, 100_000, 0.499_405_291_895_206_7),
            (110_000.0, 100_000, 2.584_177_247_179_637_6e-104),
        ] {
            close(p_chi_square(x, degrees), p, &format!("{x} of {degrees}"));
        }
        close(
            chi_square_as_normal(3.841_458_820_694_124, 1),
            z_quantile(0.1),
            "as normal",
        );
        close(rms_bound(1.585_513_839_471_311_7e-11, 48), 3.0_f64.sqrt(), "rms");
        assert!(p_chi_square(f64::NAN, 3).is_nan());
    }
}
