//! The expected time of a recommendation, and settings that cannot be distinguished from the best one.

use super::Study;
use super::price::{Price, Verdict};
use super::statistics::Figure;
use crate::run::replicates::LEAST;

/// Overhead of a render to a target error, relative to its samples alone: see `run/halves.rs`.
const OVERHEAD: f64 = 1.35;

impl Price {
    /// Seconds until one picture reaches the error that `--target-error` means, with the interval from the measured time and
    /// error.
    pub fn expected(&self, error: f64) -> Figure {
        let value = self.seconds_for_error(error);
        let part = |end: f64, value: f64| if value > 0.0 { end / value } else { 1.0 };
        let time = |end: f64| part(end, self.pass_seconds.value);
        let variance = |end: fn(&Figure) -> f64| {
            let last = self.points.last();
            last.map_or(1.0, |point| part(end(&point.error), point.error.value).powi(2))
        };
        // The lower bound is one pass, however uncertain the error.
        let least = self.pass_seconds.low;
        Figure {
            value,
            low: (value * time(self.pass_seconds.low) * variance(|error| error.low)).max(least),
            high: value * time(self.pass_seconds.high) * variance(|error| error.high),
        }
    }

    /// Time of `--target-error` over that of one picture of the same error. `--target-error` takes further samples to be certain of
    /// its error, and Sobol points split between at least eight pictures lose their faster-than-1/n convergence.
    fn by_replicates(&self) -> f64 {
        let gained = self.by_error.map_or(0.0, |law| (-law.0.slope - 1.0).clamp(0.0, 1.0));
        OVERHEAD * (2.0 * LEAST as f64).powf(gained)
    }
}

impl Study {
    /// Seconds that the recommended command is expected to render, with an interval.
    pub fn expected_seconds(&self, error: f64) -> Figure {
        let best = self.cheapest(error);
        let factor = match best.variant.choice.adaptive {
            true => 1.0,
            false => best.by_replicates(),
        };
        let Figure { value, low, high } = best.expected(error);
        Figure {
            value: value * factor,
            low: low * factor,
            high: high * factor,
        }
    }

    /// Settings that the study cannot tell apart from the cheapest one, because their intervals overlap.
    pub fn ties(&self, error: f64) -> Vec<&Price> {
        let best = self.cheapest(error);
        let high = best.expected(error).high;
        let other = |price: &&Price| price.label != best.label && price.verdict != Verdict::Harmful;
        let tied = self.prices.iter().filter(other);
        tied.filter(|price| price.expected(error).low <= high).collect()
    }
}
