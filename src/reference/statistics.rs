//! Mean and standard error of a pixel's samples.

use glam::DVec3;

/// Running moments by Welford's recurrence (Technometrics 4, 1962): the variance is never a difference of two sums, so equal
/// samples have a variance of exactly 0.
#[derive(Clone, Copy, Debug, Default)]
pub struct Moments {
    count: f64,
    mean: DVec3,
    /// Sum of squared deviations from the mean.
    squares: DVec3,
}

impl Moments {
    /// Adds a sample.
    pub fn add(&mut self, sample: DVec3) {
        self.count += 1.0;
        let before = sample - self.mean;
        self.mean += before / self.count;
        self.squares += before * (sample - self.mean);
    }

    /// The mean so far.
    pub fn mean(&self) -> DVec3 {
        self.mean
    }

    /// Standard error of the mean; infinite with fewer than two samples.
    pub fn standard_error(&self) -> DVec3 {
        if self.count < 2.0 {
            return DVec3::INFINITY;
        }
        (self.squares / (self.count * (self.count - 1.0))).map(f64::sqrt)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_moments() {
        let mut moments = Moments::default();
        moments.add(DVec3::new(1.0, 1e9, 901.803));
        assert_eq!(moments.standard_error(), DVec3::INFINITY);
        for sample in [2.0, 3.0, 4.0] {
            moments.add(DVec3::new(sample, 1e9 + sample - 1.0, 901.803));
        }
        assert_eq!(moments.mean(), DVec3::new(2.5, 1e9 + 1.5, 901.803));
        // Deviations -1.5 -0.5 0.5 1.5: variance 5/3, of the mean 5/12.
        let expected = (5.0_f64 / 12.0).sqrt();
        let error = moments.standard_error();
        assert!((error.x - expected).abs() < 1e-15 && (error.y - expected).abs() < 1e-6);
        assert_eq!(error.z, 0.0);
    }
}
