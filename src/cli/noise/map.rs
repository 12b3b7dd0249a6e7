//! The noise map: the standard deviation of every pixel.

use std::path::Path;

use serde::Serialize;

use super::{Ended, SEEDS, render};
use crate::cli::CliError;
use crate::cli::budget_bar::BudgetBar;
use octolux::film::{Attributes, Picture, write_picture};
use octolux::pipeline::Prepared;
use octolux::run::{Goal, replicates};

/// Samples per pixel of each seed.
const SPP: u32 = 4;

/// Range of the colour scale: standard deviations over the mean of the picture.
pub const ENDS: [f64; 2] = [0.01, 10.0];

/// From dark violet to yellow: five points of the scale "viridis" (Smith and van der Walt, 2015), which is uniform in
/// lightness.
const COLOURS: [[f64; 3]; 5] = [
    [68.0, 1.0, 84.0],
    [59.0, 82.0, 139.0],
    [33.0, 145.0, 140.0],
    [94.0, 201.0, 98.0],
    [253.0, 231.0, 37.0],
];

/// The variance of every pixel.
pub struct Map {
    width: u32,
    height: u32,
    /// Variance averaged over the three colours, over the squared mean of the picture, for a render of [`SPP`] samples per
    /// pixel.
    variance: Vec<f64>,
}

/// The distribution of the noise over the picture.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Spread {
    /// Samples per pixel of the renders for the map.
    pub map_spp: u32,
    /// The root of the mean variance of the pixels over the mean of the picture.
    pub map_error: f64,
    /// The smallest share of the pixels that contains half of the variance.
    pub half_in: f64,
}

impl Map {
    /// Renders all seeds.
    pub fn measure(prepared: &Prepared, observer: &BudgetBar) -> Result<Self, Ended> {
        let mut pictures = Vec::new();
        for seed in 0..SEEDS {
            pictures.push(render(prepared, Goal::passes(SPP), seed, observer)?.0);
        }
        Ok(Self::of(&pictures))
    }

    fn of(pictures: &[Picture]) -> Self {
        let mean = replicates::mean(pictures);
        let values = mean.pixels.as_flattened();
        let level = values.iter().copied().map(f64::from).sum::<f64>() / values.len() as f64;
        let n = pictures.len() as f64;
        let of_value = |p: usize, c: usize| {
            let middle = pictures.iter().map(|one| f64::from(one.pixels[p][c])).sum::<f64>() / n;
            let squares = pictures
                .iter()
                .map(|one| (f64::from(one.pixels[p][c]) - middle).powi(2));
            squares.sum::<f64>() / (n - 1.0)
        };
        let of_pixel = |p: usize| (0..3).map(|c| of_value(p, c)).sum::<f64>() / 3.0;
        let raw: Vec<f64> = (0..mean.pixels.len()).map(of_pixel).collect();
        let (width, height) = (mean.width, mean.height);
        let variance = smoothed(&raw, width as usize, height as usize);
        let over = |v: f64| if level > 0.0 { v / (level * level) } else { 0.0 };
        Self {
            width,
            height,
            variance: variance.into_iter().map(over).collect(),
        }
    }

    /// The distribution of the noise; `None` without noise.
    pub fn spread(&self) -> Option<Spread> {
        let total: f64 = self.variance.iter().sum();
        if total.is_nan() || total <= 0.0 {
            return None;
        }
        let mut sorted = self.variance.clone();
        sorted.sort_by(|a, b| b.total_cmp(a));
        let mut sum = 0.0;
        let half = sorted.iter().take_while(|v| {
            sum += **v;
            sum < total / 2.0
        });
        let pixels = sorted.len() as f64;
        Some(Spread {
            map_spp: SPP,
            map_error: (total / pixels).sqrt(),
            half_in: (half.count() as f64 + 1.0) / pixels,
        })
    }

    /// Writes the map: in colours as a PNG, as numbers in other formats.
    pub fn write(&self, path: &Path) -> Result<(), CliError> {
        let in_colours = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("png"));
        let deviations = self.variance.iter().map(|variance| variance.sqrt());
        let picture = Picture {
            width: self.width,
            height: self.height,
            pixels: match in_colours {
                true => deviations.map(colour).collect(),
                false => deviations.map(|x| [x as f32; 3]).collect(),
            },
        };
        Ok(write_picture(path, &picture, &Attributes::default())?)
    }
}

/// Means over 3 x 3 pixels: eight seeds determine a single variance only to a half.
fn smoothed(raw: &[f64], width: usize, height: usize) -> Vec<f64> {
    let around = |at: usize, end: usize| at.saturating_sub(1)..(at + 2).min(end);
    let mean = |x: usize, y: usize| {
        let window = around(y, height).flat_map(|y| around(x, width).map(move |x| raw[y * width + x]));
        let (sum, count) = window.fold((0.0, 0.0), |(sum, count), v| (sum + v, count + 1.0));
        sum / count
    };
    (0..height).flat_map(|y| (0..width).map(move |x| mean(x, y))).collect()
}

/// The colour of a standard deviation, as linear radiance for a PNG.
fn colour(deviation: f64) -> [f32; 3] {
    let [low, high] = ENDS.map(f64::log10);
    let at = ((deviation.max(1e-9).log10() - low) / (high - low)).clamp(0.0, 1.0) * (COLOURS.len() - 1) as f64;
    let first = (at as usize).min(COLOURS.len() - 2);
    let part = at - first as f64;
    // The inverse of the curve of IEC 61966-2-1.
    let linear = |byte: f64| {
        let s = byte / 255.0;
        if s <= 0.040_45 {
            s / 12.92
        } else {
            ((s + 0.055) / 1.055).powf(2.4)
        }
    };
    [0, 1, 2].map(|c| linear(COLOURS[first][c] * (1.0 - part) + COLOURS[first + 1][c] * part) as f32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use octolux::film::srgb;

    #[test]
    fn the_ends_of_the_scale_have_its_first_and_last_colour() {
        assert_eq!(colour(0.0).map(srgb), [68, 1, 84]);
        assert_eq!(colour(ENDS[1]).map(srgb), [253, 231, 37]);
        assert_eq!(colour(1e9).map(srgb), [253, 231, 37]);
        let middle = (ENDS[0] * ENDS[1]).sqrt();
        assert_eq!(colour(middle).map(srgb), [33, 145, 140]);
    }

    /// One of 4 x 4 pixels has a variance of 14/3 over four renders, and the picture's mean is 3/16.
    #[test]
    fn the_noise_of_one_pixel_is_spread_over_its_window_alone() {
        let pictures = [1.0, 2.0, 3.0, 6.0].map(|v| {
            let mut pixels = vec![[0.0; 3]; 16];
            pixels[5] = [v; 3];
            Picture {
                width: 4,
                height: 4,
                pixels,
            }
        });
        let map = Map::of(&pictures);
        let expected = 14.0 / 3.0 / (3.0_f64 / 16.0).powi(2);
        assert!((map.variance[5] - expected / 9.0).abs() < 1e-9 * expected);
        assert!((map.variance[0] - expected / 4.0).abs() < 1e-9 * expected);
        assert_eq!((map.variance[3], map.variance[15]), (0.0, 0.0));
        let black = Map::of(&[0, 1, 2, 3].map(|_| Picture {
            width: 1,
            height: 1,
            pixels: vec![[0.0; 3]],
        }));
        assert!(black.spread().is_none());
    }
}
