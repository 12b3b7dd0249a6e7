//! Splits the budget: a twelfth for measuring what things cost, a quarter for the reference, half for the rounds, the rest for
//! pictures and the page.

use std::time::Instant;

use super::measure::{self, Effort};
use super::settings::Variant;
use crate::pipeline::SetupError;
use crate::run::Observer;
use crate::scene::{FilmSize, Scene};
use crate::study::verify::blocks::shrink;

/// Minimum number of rounds. All pixels of a picture share a table of Sobol points, so their errors are correlated: the mean
/// squared error of one seed on Veach's scene differs from the next by a quarter, however many pixels there are. More seeds
/// improve a slope more than more samples do: 16 seeds and seven looks determine it to 0.05.
pub const LEAST_ROUNDS: usize = 16;

/// More rounds add little information.
pub const MOST_ROUNDS: usize = 24;

/// The share of the budget for the reference.
pub const FOR_REFERENCE: f64 = 0.25;

/// The share for the rounds that are planned.
pub const FOR_ROUNDS: f64 = 0.55;

/// The share of the budget after which no further round begins: time left over by other phases goes into more rounds.
pub const UNTIL_PRICES: f64 = 0.8;

/// Maximum film size: 192 x 128, at which comparing many pictures takes negligible time.
const MOST_PIXELS: f64 = 24_576.0;

/// Minimum film size: 48 x 32.
const LEAST_PIXELS: f64 = 1_536.0;

/// Samples per pixel at the last look.
const LEAST_SPP: u32 = 16;
const MOST_SPP: u32 = 4096;

/// Samples per pixel at the first look.
const FIRST_LOOK: u32 = 4;

/// Samples per pixel from which a larger film is preferred.
const GOOD_SPP: f64 = 128.0;

/// The cost of a render of a variant.
#[derive(Clone, Copy, Debug)]
pub struct Cost {
    /// Seconds before the first pass.
    pub setup_s: f64,
    /// Seconds per sample of one pixel.
    pub sample_s: f64,
}

/// Measures the cost of each variant, on a small film.
///
/// # Errors
/// Where a render cannot start.
pub fn costs(
    scene: &Scene,
    variants: &[Variant],
    film: FilmSize,
    seconds: f64,
    watch: &dyn Observer,
) -> Result<Vec<Cost>, SetupError> {
    let film = shrink(film, 4096.0);
    let pixels = f64::from(film.width) * f64::from(film.height);
    let each = seconds / variants.len() as f64;
    let one = |variant: &Variant| {
        let mut spp = 4;
        loop {
            let effort = Effort {
                film,
                looks: vec![spp / 4, spp],
                rounds: 1,
                seed: 0,
            };
            let started = Instant::now();
            let run = measure::run(scene, variant, &effort, 0, watch)?;
            let all = started.elapsed().as_secs_f64();
            if all * 4.0 > each || spp >= 1024 || watch.stopped() {
                let rendering = run.looks[1].seconds;
                return Ok(Cost {
                    setup_s: (all - rendering).max(0.0),
                    sample_s: run.pass_seconds() / pixels,
                });
            }
            spp *= 4;
        }
    };
    variants.iter().map(one).collect()
}

/// The effort that fits into so many seconds of rounds: first a film that leaves each pixel a good number of samples, then as
/// many samples as there is time for.
pub fn effort(costs: &[Cost], film: FilmSize, seconds: f64, seed: u32) -> Effort {
    let setup: f64 = costs.iter().map(|cost| cost.setup_s).sum();
    let sample: f64 = costs.iter().map(|cost| cost.sample_s).sum();
    // Seconds per round so that the minimum number of rounds fits.
    let round = (0.9 * seconds / LEAST_ROUNDS as f64 - setup).max(0.01 * seconds);
    let film = shrink(film, (round / sample / GOOD_SPP).clamp(LEAST_PIXELS, MOST_PIXELS));
    let pixels = f64::from(film.width) * f64::from(film.height);
    let most = (round / sample / pixels).clamp(f64::from(LEAST_SPP), f64::from(MOST_SPP)) as u32;
    let last = 1 << most.ilog2();
    // A look costs almost nothing and makes slopes more certain.
    let looks = (0..=6).rev().map(|k| last >> k);
    Effort {
        film,
        looks: looks.filter(|&spp| spp >= FIRST_LOOK).collect(),
        rounds: LEAST_ROUNDS,
        seed,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FILM: FilmSize = FilmSize {
        width: 768,
        height: 512,
    };

    #[test]
    fn what_is_planned_fits_and_looks_ascend() {
        let fast = Cost {
            setup_s: 0.002,
            sample_s: 3e-8,
        };
        for (cost, seconds) in [(fast, 30.0), (fast, 2.0), (Cost { sample_s: 3e-6, ..fast }, 30.0)] {
            let costs = [cost; 12];
            let effort = effort(&costs, FILM, seconds, 5);
            let pixels = f64::from(effort.film.width * effort.film.height);
            assert!((1_000.0..=24_576.0).contains(&pixels), "{effort:?}");
            assert!(effort.looks.is_sorted() && effort.looks.iter().all(|n| n.is_power_of_two()));
            let last = *effort.looks.last().unwrap();
            let takes = LEAST_ROUNDS as f64 * 12.0 * (cost.setup_s + f64::from(last) * pixels * cost.sample_s);
            assert!(
                takes < seconds || last == LEAST_SPP,
                "{takes} s of {seconds}: {effort:?}"
            );
            assert!(
                takes > 0.3 * seconds || last == MOST_SPP,
                "{takes} s of {seconds}: {effort:?}"
            );
        }
    }
}
