//! The strip of pictures: every estimator after equal time.

use serde::Serialize;

use super::curves::{Weights, weighted};
use super::measure::{self, Effort, Runs};
use super::settings::Variant;
use super::truth::Truth;
use crate::pipeline::SetupError;
use crate::run::Observer;
use crate::scene::{FilmSize, Scene};
use crate::study::error::RELMSE_FLOOR;

/// Samples per pixel of the defaults, few enough to leave visible noise.
const SPP: f64 = 32.0;

/// Side of a crop in pixels.
pub const CROP: u32 = 24;

/// One picture of the strip.
#[derive(Clone, Debug, Serialize)]
pub struct Frame {
    /// The estimator.
    pub label: String,
    /// Samples per pixel.
    pub spp: u32,
    /// Seconds of rendering, from the pass times of the rounds.
    pub seconds: f64,
    /// Relative mean squared error against the reference.
    pub relative_mse: f64,
    /// The picture, row by row.
    #[serde(skip)]
    pub pixels: Vec<[f32; 3]>,
}

impl Frame {
    /// The error of each pixel: `|x - r| / sqrt(r^2 + 1e-4)`, the largest of its three colours.
    pub fn error(&self, truth: &Truth) -> Vec<f64> {
        let pixel = |(x, r): (&[f32; 3], &[f64; 3])| {
            (0..3)
                .map(|c| (f64::from(x[c]) - r[c]).abs() / (r[c] * r[c] + RELMSE_FLOOR).sqrt())
                .fold(0.0, f64::max)
        };
        self.pixels.iter().zip(&truth.mean).map(pixel).collect()
    }
}

/// All frames, and the crops where they differ most.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Strip {
    /// One frame per estimator, including that of the defaults.
    pub frames: Vec<Frame>,
    /// Left and top pixel of each crop.
    pub crops: Vec<[u32; 2]>,
}

/// Renders every estimator for as long as the defaults take for 32 samples per pixel.
///
/// # Errors
/// Where a render cannot start.
pub fn render(
    scene: &Scene,
    variants: &[Variant],
    all: &[Runs],
    effort: &Effort,
    truth: &Truth,
    watch: &dyn Observer,
) -> Result<Strip, SetupError> {
    let pass = |runs: &Runs| {
        let seconds: Vec<f64> = runs.iter().map(measure::Run::pass_seconds).collect();
        super::statistics::median(&seconds).value
    };
    let time = SPP * pass(&all[0]);
    let weights = Weights::new(truth).well_sampled;
    let minus = |(x, r): (&[f32; 3], &[f64; 3])| std::array::from_fn(|c| f64::from(x[c]) - r[c]);
    let mut strip = Strip::default();
    for (variant, runs) in variants.iter().zip(all) {
        if !matches!(variant.setting, "" | "estimator") || watch.stopped() {
            continue;
        }
        let spp = ((time / pass(runs)).round() as u32).max(1);
        let look = Effort {
            looks: vec![spp],
            ..effort.clone()
        };
        let run = measure::run(scene, variant, &look, effort.seed.wrapping_sub(1), watch)?;
        let pixels = run.looks[0].pixels.to_vec();
        strip.frames.push(Frame {
            label: variant.choice.settings.estimator.name().to_owned(),
            spp,
            seconds: f64::from(spp) * pass(runs),
            relative_mse: weighted(pixels.iter().zip(&truth.mean).map(minus), &weights),
            pixels,
        });
    }
    strip.frames.sort_by_key(|frame| order(&frame.label));
    strip.crops = crops(&strip.frames, effort.film, truth);
    Ok(strip)
}

/// Sorts by the order of `EstimatorKind::ALL`.
fn order(label: &str) -> usize {
    crate::settings::EstimatorKind::ALL
        .iter()
        .position(|kind| kind.name() == label)
        .unwrap_or(usize::MAX)
}

/// Two disjoint windows: the one where the worst estimator has the largest error over that of the best, and of the others the first
/// in that order where another estimator is best, if there is one.
fn crops(frames: &[Frame], film: FilmSize, truth: &Truth) -> Vec<[u32; 2]> {
    if film.width < 2 * CROP || film.height < CROP {
        return Vec::new();
    }
    let errors: Vec<Vec<f64>> = frames.iter().map(|frame| frame.error(truth)).collect();
    // (best estimator, factor by which the worst is worse, window)
    let mut windows: Vec<(usize, f64, [u32; 2])> = Vec::new();
    for top in (0..=film.height - CROP).step_by(8) {
        for left in (0..=film.width - CROP).step_by(8) {
            let sums: Vec<f64> = errors.iter().map(|error| window(error, film, left, top)).collect();
            let best = (0..sums.len()).min_by(|&a, &b| sums[a].total_cmp(&sums[b]));
            let worst = sums.iter().copied().fold(0.0, f64::max);
            if let Some(best) = best {
                // Adding a tenth avoids large ratios between negligible errors.
                windows.push((best, worst / (sums[best] + 0.1), [left, top]));
            }
        }
    }
    windows.sort_by(|a, b| b.1.total_cmp(&a.1));
    let Some(&(best, _, first)) = windows.first() else {
        return Vec::new();
    };
    let apart = |window: &&(usize, f64, [u32; 2])| {
        window.2[0].abs_diff(first[0]) >= CROP || window.2[1].abs_diff(first[1]) >= CROP
    };
    let second = windows
        .iter()
        .filter(apart)
        .find(|window| window.0 != best)
        .or_else(|| windows.iter().find(apart));
    std::iter::once(first).chain(second.map(|window| window.2)).collect()
}

/// The sum of clamped errors in a window, so that a few outliers do not decide.
fn window(error: &[f64], film: FilmSize, left: u32, top: u32) -> f64 {
    let rows = top..top + CROP;
    rows.map(|y| {
        let start = (y * film.width + left) as usize;
        error[start..start + CROP as usize]
            .iter()
            .map(|e| e.min(1.0))
            .sum::<f64>()
    })
    .sum()
}
