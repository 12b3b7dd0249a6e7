//! How long to render: up to so many passes, or for so many seconds.

/// What ends a render.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Goal {
    /// So many passes.
    Passes(u32),
    /// So many seconds of rendering, loading and writing aside; at least one pass.
    Seconds(f64),
}

impl Goal {
    /// The most passes that there may be after the next block; `None` when it is time to stop.
    ///
    /// `spent` are the seconds rendered so far, `pass_seconds` what a pass of the last block took. A time limit is
    /// taken to the nearest pass: one more starts if less than half of it is expected to be over the limit.
    pub fn limit(self, passes: u32, spent: f64, pass_seconds: f64) -> Option<u32> {
        match self {
            Self::Passes(goal) => (passes < goal).then_some(goal),
            Self::Seconds(_) if passes == 0 => Some(1),
            Self::Seconds(goal) => {
                let more = ((goal - spent) / pass_seconds).round();
                // The cast saturates: a pass that took no time fits any number of times.
                (more >= 1.0).then(|| passes.saturating_add(more as u32).min(super::options::MOST_SPP as u32))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Goal;

    #[test]
    fn passes_end_at_the_goal() {
        assert_eq!(Goal::Passes(5).limit(4, 9.0, 9.0), Some(5));
        assert_eq!(Goal::Passes(5).limit(5, 0.0, 0.0), None);
    }

    #[test]
    fn a_time_limit_is_taken_to_the_nearest_pass() {
        assert_eq!(Goal::Seconds(0.001).limit(0, 0.0, 0.0), Some(1), "one pass at least");
        assert_eq!(Goal::Seconds(10.0).limit(4, 8.0, 2.0), Some(5));
        assert_eq!(Goal::Seconds(10.0).limit(4, 8.0, 3.9), Some(5), "less than half over");
        assert_eq!(Goal::Seconds(10.0).limit(4, 8.0, 4.1), None, "more than half over");
        assert_eq!(Goal::Seconds(10.0).limit(4, 11.0, 0.1), None);
        assert!(Goal::Seconds(10.0).limit(4, 8.0, 0.0).unwrap() > 1 << 20);
        assert_eq!(Goal::Seconds(10.0).limit(4, 10.0, 0.0), None);
    }
}
