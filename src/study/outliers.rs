//! Outliers: samples that rarely find a light and are bright when they do. Measures how much of a picture depends on them.
//!
//! If one sample in `N` finds a light, each find is `N` times as bright as the mean, and the kurtosis of a sample is `N`, as
//! for a biased coin. The mean over `n` samples has a kurtosis of `3 + (N - 3) / n`. While that is large, the picture has
//! fireflies, and neither neighbouring pixels nor a standard error predict them. Nothing here changes a picture.
//!
//! Each pixel's first samples are compared with all its other samples, so a feature that is bright in all of them, such as a
//! visible light, is no outlier.

use serde::Serialize;

use crate::film::Picture;

/// A sample this many times as bright as the mean is an outlier. Cosines, edges and penumbras only make factors of a few.
const OUTLIER: f64 = 16.0;

/// Side in pixels of the blocks over which means are taken.
const BLOCK: usize = 16;

/// The picture has fireflies if outliers bring this share of its light and the kurtosis of a pixel exceeds that of a normal
/// variable by this much: then the error of every second pixel comes from samples that its neighbours do not have.
const WARNING: (f64, f64) = (0.1, 3.0);

/// The first samples of all pixels.
#[derive(Clone, Debug)]
pub struct FirstSamples {
    width: usize,
    samples: f64,
    light: Vec<f32>,
}

/// How much depends on few samples; every figure is relative to the other samples at the same place.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Outliers {
    /// The share of samples at least 16 times as bright as the mean around them.
    pub share: f64,
    /// The share of light from these samples.
    pub light: f64,
    /// Kurtosis of a sample: 3 for a normal variable, `N` where one in `N` brings all.
    pub kurtosis: f64,
}

fn light(pixel: &[f32; 3]) -> f64 {
    pixel.iter().copied().map(f64::from).sum()
}

impl FirstSamples {
    /// A picture of `samples` samples in every pixel.
    pub fn of(picture: &Picture, samples: u32) -> Self {
        Self {
            width: picture.width as usize,
            samples: samples.into(),
            light: picture.pixels.iter().map(|pixel| light(pixel) as f32).collect(),
        }
    }

    /// Compares the first samples with the picture of these and all further samples; `samples` is the sample count of each
    /// pixel. `None` if nothing is lit, or there are no further samples.
    pub fn outliers(&self, picture: &Picture, samples: &[u32]) -> Option<Outliers> {
        if !samples.iter().any(|&n| f64::from(n) > self.samples) {
            return None;
        }
        let blocks = self.width.div_ceil(BLOCK);
        let block = |i: usize| i / self.width / BLOCK * blocks + i % self.width / BLOCK;
        let mut means = vec![(0.0, 0.0); blocks * (picture.height as usize).div_ceil(BLOCK)];
        for (i, pixel) in picture.pixels.iter().enumerate() {
            let (sum, pixels): &mut (f64, f64) = &mut means[block(i)];
            (*sum, *pixels) = (*sum + light(pixel), *pixels + 1.0);
        }
        // Two passes avoid storing the values: pictures can be large.
        let relative = || {
            (0..self.light.len()).filter_map(|i| {
                let (n, all, first) = (
                    f64::from(samples[i]),
                    light(&picture.pixels[i]),
                    f64::from(self.light[i]),
                );
                let others = (n * all - self.samples * first) / (n - self.samples).max(1.0);
                let (sum, pixels) = means[block(i)];
                let mean = others.max(sum / pixels);
                (mean > 0.0 && (first / mean).is_finite()).then_some(first / mean)
            })
        };
        let (mut lit, mut total) = (0.0, 0.0);
        relative().for_each(|x| (lit, total) = (lit + 1.0, total + x));
        if total == 0.0 {
            return None;
        }
        let mean = total / lit;
        let (mut variance, mut fourth, mut found, mut bright) = (0.0, 0.0, 0.0, 0.0);
        for x in relative() {
            let square = (x - mean).powi(2);
            (variance, fourth) = (variance + square / lit, fourth + square * square / lit);
            if x >= OUTLIER {
                (found, bright) = (found + 1.0, bright + x);
            }
        }
        Some(Outliers {
            share: found / lit,
            light: bright / total,
            // Undoes the averaging over the first samples: a mean of n has kurtosis 3 + (k - 3) / n.
            kurtosis: if variance > 0.0 {
                3.0 + (fourth / (variance * variance) - 3.0) * self.samples
            } else {
                3.0
            },
        })
    }
}

impl Outliers {
    /// Whether a picture with that many samples per pixel has fireflies.
    pub fn firefly(&self, spp: f64) -> bool {
        self.light > WARNING.0 && (self.kurtosis - 3.0) / spp > WARNING.1
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64;

    use super::*;

    /// Outliers of a film whose samples find a light once in `n`. In the middle row of each 16 a light is visible, twice as
    /// bright as the mean.
    fn found(n: f64, samples: u32) -> Option<Outliers> {
        let mut rng = Pcg64::seed_from_u64(38);
        let (width, height) = (200, 150);
        let (mut first, mut all) = (vec![], vec![]);
        for i in 0..width * height {
            let seen = i / width % 16 == 8;
            let mut sample = || match rng.random::<f64>() * n < 1.0 {
                _ if seen => 2.0,
                true => n as f32,
                false => 0.0,
            };
            let values: Vec<f32> = (0..samples).map(|_| sample()).collect();
            first.push([values[0]; 3]);
            all.push([values.iter().sum::<f32>() / samples as f32; 3]);
        }
        let [first, all] = [first, all].map(|pixels| Picture { width, height, pixels });
        FirstSamples::of(&first, 1).outliers(&all, &vec![samples; 200 * 150])
    }

    /// Share and kurtosis of what [`found`] shows, by the binomial law: a find is compared with the other samples of its pixel,
    /// or with the mean of its block, 17/16, where those are darker.
    fn truth(n: f64, samples: u32) -> [f64; 2] {
        let (p, others, hidden) = (1.0 / n, f64::from(samples - 1), 15.0 / 16.0);
        let mut chance = (1.0 - p).powf(others);
        let mut values = vec![(1.0 - hidden, 1.0), (hidden * (1.0 - p), 0.0)];
        for k in 0..samples {
            let k = f64::from(k);
            values.push((hidden * p * chance, n / (k * n / others).max(17.0 / 16.0)));
            chance *= (others - k) / (k + 1.0) * p / (1.0 - p);
        }
        let mean: f64 = values.iter().map(|(chance, x)| chance * x).sum();
        let moment = |power| {
            values
                .iter()
                .map(|(chance, x)| chance * (x - mean).powi(power))
                .sum::<f64>()
        };
        let share = values
            .iter()
            .filter(|(_, x)| *x >= OUTLIER)
            .map(|(chance, _)| chance)
            .sum();
        [share, moment(4) / moment(2).powi(2)]
    }

    #[test]
    fn the_outliers_of_a_coin_are_its_finds() {
        for (n, samples) in [(100.0, 64), (400.0, 64), (100.0, 8)] {
            let outliers = found(n, samples).unwrap();
            let [share, kurtosis] = truth(n, samples);
            let near = |found: f64, truth: f64| (found / truth - 1.0).abs() < 0.3;
            assert!(
                near(outliers.share, share) && near(outliers.kurtosis, kurtosis),
                "{outliers:?}, not {share} and {kurtosis}"
            );
            assert!(outliers.light > 0.7, "{outliers:?}");
            assert!(outliers.firefly(8.0) && !outliers.firefly(400.0));
        }
    }

    #[test]
    fn what_half_of_all_samples_find_is_no_outlier() {
        let outliers = found(2.0, 16).unwrap();
        assert_eq!((outliers.share, outliers.light), (0.0, 0.0));
        assert!(!outliers.firefly(1.0));
    }

    #[test]
    fn nothing_is_said_of_black_pictures_and_of_first_samples_alone() {
        let picture = |value: f32| Picture {
            width: 3,
            height: 1,
            pixels: vec![[value; 3]; 3],
        };
        let first = FirstSamples::of(&picture(1.0), 2);
        assert_eq!(first.outliers(&picture(1.0), &[2; 3]), None);
        assert_eq!(
            FirstSamples::of(&picture(0.0), 1).outliers(&picture(0.0), &[4; 3]),
            None
        );
        let even = first.outliers(&picture(1.0), &[4; 3]).unwrap();
        assert_eq!((even.share, even.light, even.kurtosis), (0.0, 0.0, 3.0));
    }
}
