//! The goal of a run: a sample count, a time or an error.

use std::ops::Range;
use std::time::Duration;

use super::{MOST_SPP, Shard};
use crate::film::leaf_passes;
use crate::scene::FilmSize;

/// The goal of a run.
///
/// A goal says what is rendered; [`within`](Self::within) adds a time limit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Goal {
    pub(super) work: Work,
    pub(super) time: Option<Duration>,
}

/// What is rendered.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Work {
    /// So many passes, or one shard of them.
    Passes(u32, Option<Shard>),
    /// Pilot passes, then samples allocated to each pixel: this many samples per pixel on average.
    Adaptive(u32),
    /// Replicates of different seeds until their mean has this error; whether each of them is adaptive.
    Error(f64, bool),
}

impl Goal {
    /// `spp` samples of every pixel, at most [`MOST_SPP`].
    pub fn passes(spp: u32) -> Self {
        Self::new(Work::Passes(spp.min(MOST_SPP), None))
    }

    /// As many samples of every pixel as fit into `time`, rounded to the nearest number, at least one.
    pub fn time(time: Duration) -> Self {
        Self::passes(MOST_SPP).within(time)
    }

    /// `spp` samples per pixel on average, more where the relative error is larger.
    pub fn adaptive(spp: u32) -> Self {
        Self::new(Work::Adaptive(spp.min(MOST_SPP)))
    }

    /// Renders until the noise falls to this share of the picture: the root of the pixels' mean variance over the mean of the
    /// picture. Replicates of different seeds measure it, and their mean is the picture: see [`replicates`](super::replicates).
    pub fn error(error: f64) -> Self {
        Self::new(Work::Error(error, false))
    }

    /// The same, each replicate with more samples where the relative error is larger: see [`Goal::adaptive`].
    pub fn adaptive_error(error: f64) -> Self {
        Self::new(Work::Error(error, true))
    }

    /// One shard of `spp` samples of every pixel.
    pub fn shard(shard: Shard, spp: u32) -> Self {
        Self::new(Work::Passes(spp.min(MOST_SPP), Some(shard)))
    }

    /// The same with a limit of `time` of rendering. At least one sample per pixel is rendered.
    #[must_use]
    pub fn within(self, time: Duration) -> Self {
        Self {
            time: Some(time),
            ..self
        }
    }

    fn new(work: Work) -> Self {
        Self { work, time: None }
    }

    /// Samples per pixel of the whole render, on average; `None` where a time or an error decides.
    pub fn spp(&self) -> Option<u32> {
        match self.work {
            Work::Passes(spp, _) => (spp < MOST_SPP || self.time.is_none()).then_some(spp),
            Work::Adaptive(spp) => Some(spp),
            Work::Error(..) => None,
        }
    }

    /// The time limit.
    pub fn time_limit(&self) -> Option<Duration> {
        self.time
    }

    /// The shard that is rendered.
    pub fn shard_of(&self) -> Option<Shard> {
        match self.work {
            Work::Passes(_, shard) => shard,
            _ => None,
        }
    }

    /// Whether the render is adaptive.
    pub fn is_adaptive(&self) -> bool {
        matches!(self.work, Work::Adaptive(_) | Work::Error(_, true))
    }

    /// The target error.
    pub fn error_asked(&self) -> Option<f64> {
        match self.work {
            Work::Error(error, _) => Some(error),
            _ => None,
        }
    }

    /// Splits this goal to resume a run that was saved on its way to `saved` samples of every pixel. Returns the goal to reach
    /// first, and the number of samples to extend to afterwards, if this goal has more than `saved`.
    pub(super) fn resuming(self, saved: u32) -> (Self, Option<u32>) {
        match self.work {
            Work::Passes(spp, None) if saved < spp => {
                let work = Work::Passes(saved, None);
                (Self { work, ..self }, Some(spp))
            }
            _ => (self, None),
        }
    }

    /// The passes to render on a film of this size, on average where pixels differ.
    pub fn range(&self, film: FilmSize) -> Range<u32> {
        match self.work {
            Work::Passes(spp, Some(shard)) => shard.passes(spp, leaf_passes(film)),
            Work::Passes(spp, None) | Work::Adaptive(spp) => 0..spp,
            Work::Error(..) => 0..MOST_SPP,
        }
    }
}

/// The number of passes at which the next block must end at the latest; `None` when it is time to stop.
///
/// `end` is the target number of passes, `time` an optional limit in seconds, `spent` the seconds rendered so far,
/// `pass_seconds` the time of a pass of the last block. A time limit is rounded to the nearest pass: one more starts if less
/// than half of it is expected to exceed the limit.
pub(super) fn limit(end: u32, time: Option<f64>, passes: u32, spent: f64, pass_seconds: f64) -> Option<u32> {
    match time {
        _ if passes >= end => None,
        None => Some(end),
        Some(_) if passes == 0 => Some(1),
        Some(time) => {
            let more = ((time - spent) / pass_seconds).round();
            // The cast saturates: with 0 seconds per pass, any number fits.
            (more >= 1.0).then(|| passes.saturating_add(more as u32).min(end))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn passes_end_at_the_goal() {
        assert_eq!(limit(5, None, 4, 9.0, 9.0), Some(5));
        assert_eq!(limit(5, None, 5, 0.0, 0.0), None);
    }

    #[test]
    fn a_time_limit_is_taken_to_the_nearest_pass() {
        let limit = |time, passes, spent, pass_seconds| limit(MOST_SPP, Some(time), passes, spent, pass_seconds);
        assert_eq!(limit(0.001, 0, 0.0, 0.0), Some(1), "one pass at least");
        assert_eq!(limit(10.0, 4, 8.0, 2.0), Some(5));
        assert_eq!(limit(10.0, 4, 8.0, 3.9), Some(5), "less than half over");
        assert_eq!(limit(10.0, 4, 8.0, 4.1), None, "more than half over");
        assert_eq!(limit(10.0, 4, 11.0, 0.1), None);
        assert!(limit(10.0, 4, 8.0, 0.0).unwrap() > 1 << 20);
        assert_eq!(limit(10.0, 4, 10.0, 0.0), None);
    }

    #[test]
    fn a_time_and_a_number_of_passes_end_at_the_first_of_both() {
        assert_eq!(limit(5, Some(10.0), 4, 1.0, 1.0), Some(5));
        assert_eq!(limit(50, Some(10.0), 4, 8.0, 2.0), Some(5));
    }
}
