//! Ctrl-c and termination signals: the first requests a stop, the second exits at once.
//!
//! After the first, the current render stops at the next tiles and its pictures are written; a scene that is loading is loaded
//! completely and then dropped. The second removes the temporary files and exits without writing: older files of the same names
//! are kept.

use std::process;
use std::sync::{Arc, Mutex, PoisonError, Weak};

use super::{CliError, Exit, report};
use octolux::film::replace;
use octolux::pipeline::Progress;

/// The state shared by the signal handler and the render.
#[derive(Clone, Default)]
pub struct Interrupt(Arc<Mutex<State>>);

#[derive(Default)]
struct State {
    asked: bool,
    watched: Vec<Weak<Progress>>,
}

impl Interrupt {
    /// Starts handling signals.
    ///
    /// # Errors
    /// If the system rejects the handler.
    pub fn listen(quiet: bool) -> Result<Self, CliError> {
        let interrupt = Self::default();
        let heard = interrupt.clone();
        ctrlc::set_handler(move || {
            if heard.ask() {
                replace::abandon_all();
                process::exit(Exit::Interrupted.code().into());
            }
            if !quiet {
                report::print("\nstopping: what is rendered will be written (ctrl-c again: exit at once)\n");
            }
        })
        .map_err(|error| CliError::failed(format!("cannot listen for ctrl-c: {error}")))?;
        Ok(interrupt)
    }

    /// Whether a stop was requested.
    pub fn asked(&self) -> bool {
        self.with(|state| state.asked)
    }

    /// Forwards stops to this render, too.
    pub fn watch(&self, progress: Arc<Progress>) {
        self.with(|state| {
            if state.asked {
                progress.request_stop();
            }
            state.watched.retain(|other| other.strong_count() > 0);
            state.watched.push(Arc::downgrade(&progress));
        });
    }

    /// Returns whether a stop had been requested before.
    fn ask(&self) -> bool {
        self.with(|state| {
            let watched = state.watched.iter().filter_map(Weak::upgrade);
            watched.for_each(|progress| progress.request_stop());
            std::mem::replace(&mut state.asked, true)
        })
    }

    fn with<T>(&self, act: impl FnOnce(&mut State) -> T) -> T {
        act(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}
