//! Student's t: how far a mean of few values may stray.
//!
//! A standard error that comes from R values is itself uncertain. At the small false-alarm rates of a family of tests
//! this is no detail: of 16 values, one in 10 million lies beyond 9.5 estimated standard errors, not beyond 5.3.

use std::f64::consts::PI;

/// The probability that `|t|` is at least this large, with `dof` degrees of freedom.
pub fn two_sided(t: f64, dof: f64) -> f64 {
    if t == 0.0 {
        return 1.0;
    }
    incomplete_beta(dof / 2.0, 0.5, dof / (dof + t * t))
}

/// The `t` that `|t|` exceeds with probability `alpha`.
///
/// # Panics
/// Unless `alpha` is in (0, 1) and `dof` is above 0.
pub fn quantile(alpha: f64, dof: f64) -> f64 {
    assert!(alpha > 0.0 && alpha < 1.0 && dof > 0.0, "alpha {alpha}, dof {dof}");
    let (mut low, mut high) = (0.0, 1.0);
    while two_sided(high, dof) > alpha && high < 1e150 {
        (low, high) = (high, high * 2.0);
    }
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if two_sided(middle, dof) > alpha {
            low = middle;
        } else {
            high = middle;
        }
    }
    high
}

/// The same for the normal distribution.
pub fn normal_quantile(alpha: f64) -> f64 {
    quantile(alpha, 1e6)
}

/// A normal deviate as improbable as this `t`, true to 0.05 from 7 degrees of freedom on: Wallace, "Bounds on Normal
/// Approximations to Student's and the Chi-Square Distributions", 1959.
pub fn as_normal(t: f64, dof: f64) -> f64 {
    let size = (dof * (t * t / dof).ln_1p()).sqrt() * (8.0 * dof + 1.0) / (8.0 * dof + 3.0);
    size.copysign(t)
}

/// The root mean square that `count` normal deviates exceed with probability `alpha`: Wilson and Hilferty, "The
/// Distribution of Chi-Square", 1931.
pub fn rms_bound(alpha: f64, count: f64) -> f64 {
    let ninth = 2.0 / (9.0 * count);
    // One-sided: the two-sided quantile of twice the rate.
    (1.0 - ninth + normal_quantile(2.0 * alpha) * ninth.sqrt()).powf(1.5)
}

/// The rate of each of `count` independent tests that together raise a false alarm with probability `alpha` (Šidák).
pub fn sidak(alpha: f64, count: usize) -> f64 {
    -((-alpha).ln_1p() / count.max(1) as f64).exp_m1()
}

/// The regularised incomplete beta function, by its continued fraction (DLMF 8.17.22) in the form of Lentz.
fn incomplete_beta(a: f64, b: f64, x: f64) -> f64 {
    if x <= 0.0 || x >= 1.0 {
        return if x <= 0.0 { 0.0 } else { 1.0 };
    }
    // The fraction converges fast below the mean of the distribution; above it, its mirror image does.
    if x > (a + 1.0) / (a + b + 2.0) {
        return 1.0 - incomplete_beta(b, a, 1.0 - x);
    }
    let front = (ln_gamma(a + b) - ln_gamma(a) - ln_gamma(b) + a * x.ln() + b * (-x).ln_1p()).exp() / a;
    let away = |value: f64| if value.abs() < 1e-300 { 1e-300 } else { value };
    let (mut c, mut d) = (1.0, 1.0 / away(1.0 - (a + b) * x / (a + 1.0)));
    let mut fraction = d;
    for m in 1..10_000 {
        let m = f64::from(m);
        let even = m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m));
        d = 1.0 / away(1.0 + even * d);
        c = away(1.0 + even / c);
        fraction *= d * c;
        let odd = -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0));
        d = 1.0 / away(1.0 + odd * d);
        c = away(1.0 + odd / c);
        let step = d * c;
        fraction *= step;
        if (step - 1.0).abs() < 1e-14 {
            break;
        }
    }
    front * fraction
}

/// Logarithm of the gamma function for `x > 0`: Stirling's series (DLMF 5.11.1) after a shift beyond 12, where its
/// first omitted term is below 1e-12.
fn ln_gamma(mut x: f64) -> f64 {
    let mut shift = 0.0;
    while x < 12.0 {
        shift += x.ln();
        x += 1.0;
    }
    let r = 1.0 / (x * x);
    let series = (1.0 / 12.0 - r * (1.0 / 360.0 - r * (1.0 / 1260.0 - r / 1680.0))) / x;
    (x - 0.5) * x.ln() - x + 0.5 * (2.0 * PI).ln() + series - shift
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_of_the_tables() {
        // Two-sided. One degree of freedom is Cauchy's distribution, two have a closed form.
        for (alpha, dof, expected) in [
            (0.05, 7.0, 2.364_624),
            (0.05, 15.0, 2.131_450),
            (0.001, 15.0, 4.072_765),
            (0.5, 1.0, 1.0),
            (1e-6, 2.0, 999.999_25),
            (0.05, 1e6, 1.959_966),
        ] {
            let t = quantile(alpha, dof);
            assert!((t / expected - 1.0).abs() < 2e-6, "{alpha} {dof}: {t}");
        }
        assert!((ln_gamma(0.5) - PI.sqrt().ln()).abs() < 1e-12 && ln_gamma(1.0).abs() < 1e-12);
    }

    #[test]
    fn t_becomes_normal() {
        for dof in [7.0, 15.0, 60.0] {
            for alpha in [0.3, 0.05, 1e-3, 1e-6] {
                let z = as_normal(quantile(alpha, dof), dof);
                assert!((z - normal_quantile(alpha)).abs() < 0.05, "{dof} {alpha}: {z}");
            }
        }
        assert!(as_normal(-2.0, 9.0) < -1.5);
    }

    #[test]
    fn bounds_of_a_family() {
        assert!((sidak(0.01, 1) - 0.01).abs() < 1e-15 && (sidak(1e-4, 100) / 1e-6 - 1.0).abs() < 1e-4);
        // The 99.9 % point of chi-square with 48 degrees of freedom is 84.037.
        assert!((rms_bound(1e-3, 48.0) - (84.037_f64 / 48.0).sqrt()).abs() < 2e-3);
    }
}
