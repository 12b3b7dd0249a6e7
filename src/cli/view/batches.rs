//! The standard error of a pixel, estimated from means of batches of its samples.
//!
//! Looks occur at the ends of blocks; the samples between two of them form a batch. For batches of `k_i` samples with the means
//! `m_i`, `sum k_i (m_i - m)^2 / (batches - 1)` estimates the variance of one sample if samples are independent; divided by the
//! number of samples it is the variance of the mean. Points of a Sobol sequence are stratified, so their batches vary more than
//! the error of the total mean: the result is then an upper estimate.

use octolux::film::Picture;

/// Minimum number of batches for an estimate.
const FEWEST: u32 = 4;

/// The batches of one picture.
#[derive(Debug, Default)]
pub struct Batches {
    /// Samples of each pixel so far.
    samples: u32,
    batches: u32,
    /// Mean luminance of each pixel so far.
    means: Vec<f32>,
    /// Sum of sample counts times squared means of batches.
    squares: Vec<f64>,
}

/// The luminance of linear sRGB.
fn luminance([r, g, b]: [f32; 3]) -> f32 {
    0.2126 * r + 0.7152 * g + 0.0722 * b
}

impl Batches {
    /// Resets for another picture.
    pub fn clear(&mut self) {
        *self = Self::default();
    }

    /// Adds a picture of so many samples of every pixel; ignored if it has no more than the last.
    pub fn take(&mut self, picture: &Picture, samples: u32) {
        if samples <= self.samples {
            return;
        }
        if self.means.len() != picture.pixels.len() {
            self.means = vec![0.0; picture.pixels.len()];
            self.squares = vec![0.0; picture.pixels.len()];
        }
        let (before, now) = (f64::from(self.samples), f64::from(samples));
        let pixels = self.means.iter_mut().zip(&mut self.squares).zip(&picture.pixels);
        for ((mean, squares), &pixel) in pixels {
            let y = luminance(pixel);
            let batch = (now * f64::from(y) - before * f64::from(*mean)) / (now - before);
            *squares += (now - before) * batch * batch;
            *mean = y;
        }
        self.samples = samples;
        self.batches += 1;
    }

    /// The standard error of a pixel's luminance, by its index in the picture; `None` with too few batches.
    pub fn standard_error(&self, pixel: usize) -> Option<f64> {
        let (mean, squares) = (f64::from(*self.means.get(pixel)?), *self.squares.get(pixel)?);
        let samples = f64::from(self.samples);
        // Rounding may make it slightly negative.
        let variance = (squares - samples * mean * mean).max(0.0) / f64::from(self.batches.saturating_sub(1).max(1));
        (self.batches >= FEWEST).then(|| (variance / samples).sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn batches_of_known_means_have_the_standard_error_of_the_formula() {
        // Batches of 1, 1, 2 and 4 samples with the means 1, 3, 2 and 5.
        let sums = [(1, 1.0), (2, 4.0), (4, 8.0), (8, 28.0)];
        let mut batches = Batches::default();
        for (at, (samples, sum)) in sums.into_iter().enumerate() {
            assert_eq!(batches.standard_error(0), None, "{at} batches");
            let value = sum / samples as f32;
            let picture = Picture {
                width: 1,
                height: 1,
                pixels: vec![[value; 3]],
            };
            batches.take(&picture, samples);
            batches.take(&picture, samples);
        }
        let mean = 3.5_f64;
        let parts = [(1.0, 1.0), (1.0, 3.0), (2.0, 2.0), (4.0, 5.0)];
        let sum: f64 = parts.iter().map(|(k, m)| k * (m - mean) * (m - mean)).sum();
        let expected = (sum / 3.0 / 8.0).sqrt();
        assert!((batches.standard_error(0).unwrap() / expected - 1.0).abs() < 1e-5);
        assert_eq!(batches.standard_error(1), None, "beside the picture");
    }
}
