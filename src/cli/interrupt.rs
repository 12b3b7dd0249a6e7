//! Ctrl-c (and the signals that ask a process to end): the first asks for a stop, the second exits at once.
//!
//! After the first, the render under way stops at the next tiles and its pictures are written; a scene that is being
//! loaded is loaded to its end and then left. The second removes the temporary files and exits without writing: older
//! files of the same names stay as they were.

use std::process;
use std::sync::{Arc, Mutex, PoisonError, Weak};

use super::{CliError, Exit, report};
use octolux::film::replace;
use octolux::pipeline::Progress;

/// What the handler shares with the render.
#[derive(Clone, Default)]
pub struct Interrupt(Arc<Mutex<State>>);

#[derive(Default)]
struct State {
    asked: bool,
    watched: Vec<Weak<Progress>>,
}

impl Interrupt {
    /// Listens from now on.
    ///
    /// # Errors
    /// Where the system takes no handler.
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

    /// Whether a stop was asked for.
    pub fn asked(&self) -> bool {
        self.with(|state| state.asked)
    }

    /// Passes a stop on to this render too from now on.
    pub fn watch(&self, progress: Arc<Progress>) {
        self.with(|state| {
            if state.asked {
                progress.request_stop();
            }
            state.watched.retain(|other| other.strong_count() > 0);
            state.watched.push(Arc::downgrade(&progress));
        });
    }

    /// Returns whether a stop had been asked for before.
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
