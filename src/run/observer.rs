//! Who looks on while something renders.

use std::sync::Arc;
use std::time::Instant;

use super::steps::{Run, Step};
use crate::pipeline::Progress;

/// Looks on while something renders: a progress bar, a live view, a writer of checkpoints, ctrl-c. Every method does nothing unless it
/// is written, and `()` is nobody.
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
    /// A run begins. Its counts can be read, and it can be stopped, from any thread.
    fn begins(&self, progress: &Arc<Progress>) {
        let _ = progress;
    }

    /// Whether to stop; asked before every step.
    fn stopped(&self) -> bool {
        false
    }

    /// When to [`look`](Self::look) at the latest; `None` leaves it to the blocks, which double until a leaf of the film is full. The
    /// run pauses between two tiles then, and no bit depends on it.
    fn next_look(&self) -> Option<Instant> {
        None
    }

    /// After each step: the picture so far.
    fn look(&self, run: &Run) {
        let _ = run;
    }

    /// What a longer piece of work, such as a verification, does at `share` (0 to 1) of its time.
    fn doing(&self, share: f64, what: &str) {
        let _ = (share, what);
    }
}

impl Observer for () {}

impl Run {
    /// Goes on until the goal is reached or a stop.
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

    /// Goes on until the goal is reached, unobserved.
    #[must_use]
    pub fn finish(mut self) -> Self {
        let _ = self.run(&());
        self
    }
}
