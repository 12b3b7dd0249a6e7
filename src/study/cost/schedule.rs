//! Splits the budget: a twelfth for measuring what things cost, a quarter for the reference, half for the rounds, the rest for
//! pictures and the page.

use std::fmt;
use std::time::Instant;

use serde::Serialize;

use super::measure::{self, Effort};
use super::settings::Variant;
use crate::pipeline::{Settings, SetupError};
use crate::run::Observer;
use crate::scene::{FilmSize, Scene};
use crate::settings::{AccelKind, LightsAsked};
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

/// Settings whose passes take this many times as long as those of the defaults are left out if they do not fit.
const SLOW: f64 = 8.0;

/// The share of the rounds that one of them may take with the least effort.
const FOR_SLOW: f64 = 0.5;

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
    let measured = |variant: &Variant, film: FilmSize, looks: Vec<u32>| {
        let effort = Effort {
            film,
            looks,
            rounds: 1,
            seed: 0,
        };
        let started = Instant::now();
        let run = measure::run(scene, variant, &effort, 0, watch);
        run.map(|run| (started.elapsed().as_secs_f64(), run))
    };
    let one = |variant: &Variant| {
        let mut spp = 4;
        let Settings { lights, accel, .. } = variant.choice.settings;
        if lights == LightsAsked::All || accel == Some(AccelKind::Linear) {
            // With many lights or shapes even one pass of the film may take longer than the whole study.
            let tiny = shrink(film, 64.0);
            let (all, run) = measured(variant, tiny, vec![1])?;
            let sample_s = run.pass_seconds() / (f64::from(tiny.width) * f64::from(tiny.height));
            if sample_s * pixels * f64::from(spp) > seconds {
                let setup_s = (all - run.looks[0].seconds).max(0.0);
                return Ok(Cost { setup_s, sample_s });
            }
        }
        loop {
            let (all, run) = measured(variant, film, vec![spp / 4, spp])?;
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

/// A setting whose passes take so long that the study has no time for it, such as every one of many lights.
#[derive(Clone, Debug, Serialize)]
pub struct TooSlow {
    /// The setting's name.
    pub label: String,
    /// Time of a pass over that of the defaults, from one short render.
    pub time_ratio: f64,
    /// The budget from which on it is measured, in seconds.
    pub budget: f64,
}

impl fmt::Display for TooSlow {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            label,
            time_ratio,
            budget,
        } = self;
        write!(
            f,
            "{label} is left out: a pass takes {time_ratio:.0} times as long as with the defaults. With --budget {:.0}s there is time for \
             it.",
            // A budget is met to within about a tenth, and so is this one.
            1.1 * budget
        )
    }
}

/// Takes out the settings that would leave too little of the budget for the others.
pub fn leave_out(variants: &mut Vec<Variant>, costs: &mut Vec<Cost>, film: FilmSize, budget: f64) -> Vec<TooSlow> {
    let (defaults, mut too_slow) = (costs[0], Vec::new());
    for (variant, cost) in std::mem::take(variants).into_iter().zip(std::mem::take(costs)) {
        match needed(&cost, &defaults, film).filter(|&needed| needed > budget) {
            Some(budget) => too_slow.push(TooSlow {
                label: variant.label(),
                time_ratio: cost.sample_s / defaults.sample_s,
                budget,
            }),
            None => {
                variants.push(variant);
                costs.push(cost);
            }
        }
    }
    too_slow
}

/// The budget from which on a setting is measured, in seconds; `None` if it is at any budget.
fn needed(cost: &Cost, defaults: &Cost, film: FilmSize) -> Option<f64> {
    let pixels = (f64::from(film.width) * f64::from(film.height)).min(LEAST_PIXELS);
    let picture = cost.setup_s + f64::from(LEAST_SPP) * pixels * cost.sample_s;
    let slow = cost.sample_s > SLOW * defaults.sample_s;
    slow.then(|| LEAST_ROUNDS as f64 * picture / (FOR_SLOW * FOR_ROUNDS))
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

    /// A setting is left out where its least effort, 16 pictures of 16 samples a pixel, would take more than half of the rounds; the
    /// budget that the sentence names has room for it.
    #[test]
    fn what_is_too_slow_for_the_budget_is_left_out_with_a_remedy() {
        let settings = Settings::default();
        let of = |sample_s: f64| Cost { setup_s: 0.1, sample_s };
        let left = |film: FilmSize, budget: f64| {
            let mut variants = vec![Variant::defaults(settings); 3];
            variants[2].setting = "lights";
            variants[2].value = "all".to_owned();
            let mut costs = vec![of(1e-7), of(8e-7), of(1e-4)];
            let too_slow = leave_out(&mut variants, &mut costs, film, budget);
            assert_eq!(variants.len(), costs.len());
            assert_eq!(variants.len() + too_slow.len(), 3);
            too_slow
        };
        let least = LEAST_ROUNDS as f64 * (0.1 + 16.0 * 1536.0 * 1e-4);
        let found = left(FILM, 60.0);
        assert_eq!((found.len(), found[0].label.as_str()), (1, "lights all"));
        assert!((0.5 * FOR_ROUNDS * found[0].budget / least - 1.0).abs() < 1e-9);
        assert_eq!(
            found[0].to_string(),
            "lights all is left out: a pass takes 1000 times as long as with the defaults. With --budget 164s there is time for it."
        );
        assert!(left(FILM, 164.0).is_empty());
        // A film of fewer pixels takes less.
        assert!(left(FilmSize { width: 24, height: 16 }, 60.0).is_empty());
    }

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
