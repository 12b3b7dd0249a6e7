//! Means with their errors.

use super::distributions::p_student;

/// A mean and the variance of that mean, estimated from `dof + 1` independent values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// The mean.
    pub mean: f64,
    /// The variance of the mean: the square of its standard error.
    pub variance: f64,
    /// Degrees of freedom of the variance; infinite if it is known exactly.
    pub dof: f64,
}

impl Estimate {
    /// A number without error.
    pub const fn exact(mean: f64) -> Self {
        Self {
            mean,
            variance: 0.0,
            dof: f64::INFINITY,
        }
    }

    /// The mean of at least two independent values.
    pub fn of(values: &[f64]) -> Self {
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        let squares: f64 = values.iter().map(|x| (x - mean).powi(2)).sum();
        Self {
            mean,
            variance: squares / (n * (n - 1.0)),
            dof: n - 1.0,
        }
    }

    /// The standard error.
    pub fn error(self) -> f64 {
        self.variance.sqrt()
    }

    /// The difference of two independent ones, with the degrees of freedom of Welch (Biometrika 34, 1947).
    pub fn minus(self, other: Self) -> Self {
        let (a, b) = (self.variance, other.variance);
        let dof = (a + b).powi(2) / (a * a / self.dof + b * b / other.dof);
        Self {
            mean: self.mean - other.mean,
            variance: a + b,
            dof: if dof.is_nan() { self.dof.min(other.dof) } else { dof },
        }
    }

    /// The difference to the other estimate in standard errors. A difference of `slack`, relative to the larger of the two,
    /// counts as rounding and is subtracted first. Infinite where both are exact and differ, or one is NaN.
    pub fn sigmas(self, other: Self, slack: f64) -> f64 {
        let size = self.mean.abs().max(other.mean.abs());
        let beyond = (self.mean - other.mean).abs() - slack * size;
        let sigmas = beyond / (self.variance + other.variance).sqrt();
        match beyond {
            _ if beyond <= 0.0 => 0.0,
            _ if sigmas.is_nan() => f64::INFINITY,
            _ => sigmas,
        }
    }

    /// The p-value of the difference (Welch's test), after `slack` as in [`Self::sigmas`].
    pub fn p(self, other: Self, slack: f64) -> f64 {
        p_student(self.sigmas(other, slack), self.minus(other).dof)
    }

    /// Both and their difference, for a table.
    pub fn against(self, other: Self) -> String {
        format!(
            "{:.7e} against {:.7e}: relative {:+.2e} +- {:.1e}",
            self.mean,
            other.mean,
            self.mean / other.mean - 1.0,
            self.minus(other).error() / other.mean.abs()
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mean_its_error_and_a_difference() {
        let a = Estimate::of(&[1.0, 2.0, 3.0, 6.0]);
        // Variance 14 / 3 of a value, 14 / 12 of the mean.
        assert!(a.mean == 3.0 && (a.variance - 14.0 / 12.0).abs() < 1e-15 && a.dof == 3.0);
        let same = a.minus(a);
        assert!(same.mean == 0.0 && same.variance == 2.0 * a.variance && (same.dof - 6.0).abs() < 1e-12);
        assert!((a.minus(Estimate::exact(1.0)).dof - 3.0).abs() < 1e-12);
        assert_eq!(a.sigmas(Estimate::exact(3.003), 1e-2), 0.0);
        assert!((a.sigmas(Estimate::exact(0.0), 0.0) - 3.0 / a.error()).abs() < 1e-12);
    }

    #[test]
    fn what_is_exact_differs_or_does_not_and_nan_is_never_the_same() {
        let one = Estimate::exact(1.0);
        assert_eq!((one.p(one, 0.0), one.p(Estimate::exact(1.1), 0.0)), (1.0, 0.0));
        assert_eq!(Estimate::exact(f64::NAN).sigmas(one, 1e-5), f64::INFINITY);
    }
}
