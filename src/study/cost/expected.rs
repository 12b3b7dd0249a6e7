//! What a recommendation is expected to take, and which settings cannot be told from the best one.

use super::Study;
use super::price::{Price, Verdict};
use super::statistics::Figure;
use crate::run::replicates::LEAST;

/// What a render to an error takes beside the samples of its pictures: see `run/halves.rs`.
const OVERHEAD: f64 = 1.35;

impl Price {
    /// Seconds until the error that `--target-error` means is there, in one picture, with the interval that the measured time and
    /// error leave.
    pub fn expected(&self, error: f64) -> Figure {
        let value = self.seconds_for_error(error);
        let part = |end: f64, value: f64| if value > 0.0 { end / value } else { 1.0 };
        let time = |end: f64| part(end, self.pass_seconds.value);
        let variance = |end: fn(&Figure) -> f64| {
            let last = self.points.last();
            last.map_or(1.0, |point| part(end(&point.error), point.error.value).powi(2))
        };
        // Less than one pass is no picture, however uncertain its error.
        let least = self.pass_seconds.low;
        Figure {
            value,
            low: (value * time(self.pass_seconds.low) * variance(|error| error.low)).max(least),
            high: value * time(self.pass_seconds.high) * variance(|error| error.high),
        }
    }

    /// How many times as long `--target-error` takes as one picture of that error: samples for certainty, and what Sobol points lose
    /// by being split between eight pictures at least, whose variances fall faster than 1/n.
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

    /// Settings that are not seen to be slower than the cheapest one: their intervals reach into its own. Those with its bits are it.
    pub fn ties(&self, error: f64) -> Vec<&Price> {
        let best = self.cheapest(error);
        let high = best.expected(error).high;
        let other = |price: &&Price| price.label != best.label && price.verdict != Verdict::Harmful;
        let tied = self.prices.iter().filter(other);
        tied.filter(|price| price.expected(error).low <= high).collect()
    }
}
