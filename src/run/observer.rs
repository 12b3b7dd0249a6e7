//! Observers of a render.

use std::sync::Arc;
use std::time::Instant;

use super::steps::{Run, Step};
use crate::pipeline::Progress;

/// Observes a render: a progress bar, a live view, a writer of checkpoints, ctrl-c. Every method does nothing by default, and
/// `()` is the observer that does nothing.
///
/// ```
/// use octolux::run::{Observer, Run};
///
/// /// Prints how far a run is.
/// struct Printer;
///
/// impl Observer for Printer {
///     fn look(&self, run: &Run) {
///         println!("{} passes", run.passes());
///     }
/// }
/// ```
pub trait Observer {
    /// A run begins. `progress` allows reading counts and requesting a stop from any thread.
    fn begins(&self, progress: &Arc<Progress>) {
        let _ = progress;
    }

    /// Whether to stop; called before every step.
    fn stopped(&self) -> bool {
        false
    }

    /// The latest time of the next [`look`](Self::look): the run then pauses between two tiles, which changes no bit of the
    /// picture. `None` waits for the end of a block; blocks double until a leaf of the film is full.
    fn next_look(&self) -> Option<Instant> {
        None
    }

    /// Called after each step with the picture so far.
    fn look(&self, run: &Run) {
        let _ = run;
    }

    /// Reports the current activity of longer work, such as a verification, at `share` (0 to 1) of its time.
    fn doing(&self, share: f64, what: &str) {
        let _ = (share, what);
    }
}

impl Observer for () {}

impl Run {
    /// Runs until the goal is reached or a stop is requested.
    pub fn run(&mut self, observer: &dyn Observer) -> Step {
        observer.begins(self.progress());
        loop {
            if observer.stopped() {
                self.stop();
            }
            let step = self.step_until(observer.next_look());
            observer.look(self);
            if !step.is_more() {
                return step;
            }
        }
    }

    /// Runs until the goal is reached, without an observer.
    #[must_use]
    pub fn finish(mut self) -> Self {
        let _ = self.run(&());
        self
    }
}
