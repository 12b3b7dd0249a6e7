//! Intervals with few assumptions: order statistics for medians of independent values, the bootstrap over seeds for everything
//! else.

use serde::Serialize;

use crate::sampling::hash::mix;
use crate::study::distributions::{p_student, t_quantile};

/// The probability outside every interval of a study: 95 % intervals.
pub const OUTSIDE: f64 = 0.05;

/// A number with its 95 % interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Figure {
    /// The number.
    pub value: f64,
    /// The interval's lower end.
    pub low: f64,
    /// Its upper end.
    pub high: f64,
}

impl Figure {
    /// A number known exactly.
    pub const fn exact(value: f64) -> Self {
        Self {
            value,
            low: value,
            high: value,
        }
    }

    /// Student's t interval of an estimate.
    pub fn student(value: f64, stderr: f64, dof: f64) -> Self {
        let reach = if stderr > 0.0 {
            t_quantile(OUTSIDE, dof) * stderr
        } else {
            0.0
        };
        Self {
            value,
            low: value - reach,
            high: value + reach,
        }
    }

    /// The figure of `exp(x)`, given that of `x`.
    pub fn exp(self) -> Self {
        Self {
            value: self.value.exp(),
            low: self.low.exp(),
            high: self.high.exp(),
        }
    }

    /// Half the width of the interval.
    pub fn reach(self) -> f64 {
        0.5 * (self.high - self.low)
    }
}

/// An estimate from independent replicates with its standard error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// The estimate from all replicates.
    pub value: f64,
    /// Its standard error.
    pub stderr: f64,
    /// Degrees of freedom of the standard error.
    pub dof: f64,
}

impl Estimate {
    /// Its 95 % interval.
    pub fn figure(self) -> Figure {
        Figure::student(self.value, self.stderr, self.dof)
    }

    /// The probability of an estimate as far from 0 as this, if the truth is 0.
    pub fn probability_of_zero(self) -> f64 {
        if self.value == 0.0 {
            1.0
        } else if self.stderr > 0.0 {
            p_student(self.value / self.stderr, self.dof)
        } else {
            0.0
        }
    }

    /// The sum of two independent estimates, conservatively with the smaller degrees of freedom.
    pub fn plus(self, other: Self) -> Self {
        Self {
            value: self.value + other.value,
            stderr: self.stderr.hypot(other.stderr),
            dof: self.dof.min(other.dof),
        }
    }
}

/// Bootstrap resamples: enough to know its standard error to 5 %.
const RESAMPLES: u32 = 200;

/// The bootstrap over independent replicates (Efron 1979). `of` receives indices of replicates: each index once for the estimate
/// itself, and as many indices drawn with replacement for each resample. Unlike the jackknife it also works for medians. The
/// standard error is infinite where a resample has no finite value.
///
/// # Panics
/// Below two replicates.
pub fn bootstrap(count: usize, of: impl Fn(&[usize]) -> f64) -> Estimate {
    assert!(count >= 2, "a spread of {count} replicates");
    let n = count as f64;
    let draw = |resample: u32| -> Vec<usize> {
        let one = |i: usize| mix(mix(resample).wrapping_add(i as u32)) as usize % count;
        (0..count).map(one).collect()
    };
    let values: Vec<f64> = (0..RESAMPLES)
        .map(draw)
        // With few replicates, all drawn may be the same one, which has no spread.
        .filter(|drawn| drawn.iter().any(|&i| i != drawn[0]))
        .map(|drawn| of(&drawn))
        .collect();
    let all = values.len() as f64;
    let mean = values.iter().sum::<f64>() / all;
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    // Resamples vary about the sample, whose own variance is (n - 1) / n of the true one.
    let stderr = (squares / (all - 1.0) * n / (n - 1.0)).sqrt();
    Estimate {
        value: of(&(0..count).collect::<Vec<_>>()),
        stderr: if stderr.is_finite() { stderr } else { f64::INFINITY },
        dof: n - 1.0,
    }
}

/// The mean of at least two independent values.
pub fn mean(values: &[f64]) -> Estimate {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    Estimate {
        value: mean,
        stderr: (squares / (n * (n - 1.0))).sqrt(),
        dof: n - 1.0,
    }
}

/// The median of independent values, with the narrowest interval of order statistics that contains the true median in 95 % of
/// cases for any distribution; the full range where there are too few values for that (below six).
///
/// # Panics
/// Without values.
pub fn median(values: &[f64]) -> Figure {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let n = sorted.len();
    // The interval from the k-th lowest to the k-th highest misses with twice the probability of fewer than k heads in fair
    // coin flips.
    let (mut below, mut term, mut k) = (0.0, 0.5_f64.powi(n as i32), 0);
    while 2.0 * (below + term) <= OUTSIDE {
        below += term;
        term *= (n - k) as f64 / (k + 1) as f64;
        k += 1;
    }
    let k = k.max(1);
    Figure {
        value: 0.5 * (sorted[(n - 1) / 2] + sorted[n / 2]),
        low: sorted[k - 1],
        high: sorted[n - k],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mean_has_its_standard_error() {
        let estimate = mean(&[1.0, 2.0, 3.0, 6.0]);
        // Variance 14 / 3 of a value, 14 / 12 of the mean.
        assert!((estimate.value - 3.0).abs() < 1e-15 && (estimate.stderr - (14.0_f64 / 12.0).sqrt()).abs() < 1e-12);
        assert_eq!(estimate.dof, 3.0);
        // t of 3 degrees of freedom at 95 %.
        assert!((estimate.figure().reach() / estimate.stderr - 3.182_446).abs() < 1e-5);
    }

    /// Of 64 values: the bootstrap of a mean is its standard error, that of the median of normal values is 1.25 times as large.
    #[test]
    fn the_bootstrap_knows_means_and_medians() {
        let noise = |i: usize| -> f64 {
            (0..12)
                .map(|k| f64::from(mix((12 * i + k) as u32)) / 4_294_967_296.0)
                .sum()
        };
        let values: Vec<f64> = (0..64).map(noise).collect();
        let picked = |drawn: &[usize]| -> Vec<f64> { drawn.iter().map(|&i| values[i]).collect() };
        let plain = mean(&values);
        let seen = bootstrap(64, |drawn| mean(&picked(drawn)).value);
        assert!(
            seen.value == plain.value && (seen.stderr / plain.stderr - 1.0).abs() < 0.2,
            "{seen:?} {plain:?}"
        );
        let middle = bootstrap(64, |drawn| median(&picked(drawn)).value);
        let expected = 1.2533 / 64.0_f64.sqrt();
        assert!((middle.stderr / expected - 1.0).abs() < 0.35, "{middle:?} {expected}");
        let never = bootstrap(4, |drawn| if drawn == [0, 1, 2, 3] { 1.0 } else { f64::NAN });
        assert!(never.value == 1.0 && never.stderr == f64::INFINITY);
    }

    #[test]
    fn medians_hold_95_percent_between_order_statistics() {
        // Binomial(8, 1/2): P(0) = 1/256 and P(0 or 1) = 9/256 = 0.035, so at most one value at each end may be dropped.
        let eight = median(&[5.0, 1.0, 2.0, 8.0, 3.0, 4.0, 7.0, 6.0]);
        assert_eq!((eight.value, eight.low, eight.high), (4.5, 1.0, 8.0));
        // Binomial(9, 1/2): P(0 or 1) = 10/512 = 0.0195, twice that is 0.039.
        let nine = median(&[9.0, 5.0, 1.0, 2.0, 8.0, 3.0, 4.0, 7.0, 6.0]);
        assert_eq!((nine.value, nine.low, nine.high), (5.0, 2.0, 8.0));
        assert_eq!(median(&[2.0]), Figure::exact(2.0));
    }

    #[test]
    fn zero_is_as_probable_as_student_says() {
        let estimate = Estimate {
            value: 2.364_624,
            stderr: 1.0,
            dof: 7.0,
        };
        assert!((estimate.probability_of_zero() - 0.05).abs() < 1e-6);
        let none = Estimate {
            value: 0.0,
            stderr: 0.0,
            dof: 7.0,
        };
        assert_eq!(none.probability_of_zero(), 1.0);
        assert_eq!(Estimate { value: 1e-9, ..none }.probability_of_zero(), 0.0);
        let sum = estimate.plus(Estimate {
            value: 1.0,
            stderr: 1.0,
            dof: 3.0,
        });
        assert!((sum.stderr - 2.0_f64.sqrt()).abs() < 1e-15 && sum.dof == 3.0);
    }
}
