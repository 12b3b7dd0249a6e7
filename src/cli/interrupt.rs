//! Ctrl-c and termination signals: the first requests a stop, the second exits at once.
//!
//! After the first, the current render stops at the next tiles and its pictures are written. While scenes are loaded and nothing
//! is rendered, the first exits at once, too: a scene may come through a pipe that nobody writes to. The second removes the temporary files and exits without writing: older files of the same names
//! are kept.

use std::process;
use std::sync::{Arc, Mutex, PoisonError, Weak};

use super::{CliError, Exit, leftovers, report};
use octolux::film::replace;
use octolux::pipeline::Progress;

/// The state shared by the signal handler and the render.
#[derive(Clone, Default)]
pub struct Interrupt(Arc<Mutex<State>>);

#[derive(Default)]
struct State {
    asked: bool,
    /// Scenes that are being loaded, and pictures that are being rendered or written.
    loading: usize,
    rendering: usize,
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
                leftovers::remove_empty();
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

    /// Loads a scene.
    pub fn loading<T>(&self, load: impl FnOnce() -> T) -> T {
        self.counted(|state| &mut state.loading, load)
    }

    /// Renders and writes a picture.
    pub fn rendering<T>(&self, render: impl FnOnce() -> T) -> T {
        self.counted(|state| &mut state.rendering, render)
    }

    fn counted<T>(&self, count: fn(&mut State) -> &mut usize, act: impl FnOnce() -> T) -> T {
        self.with(|state| *count(state) += 1);
        let result = act();
        self.with(|state| *count(state) -= 1);
        result
    }

    /// Returns whether there is nothing to wait for: a stop had been requested before, or scenes are loaded and none is rendered.
    fn ask(&self) -> bool {
        self.with(|state| {
            let watched = state.watched.iter().filter_map(Weak::upgrade);
            watched.for_each(|progress| progress.request_stop());
            let idle = state.loading > 0 && state.rendering == 0;
            std::mem::replace(&mut state.asked, true) || idle
        })
    }

    fn with<T>(&self, act: impl FnOnce(&mut State) -> T) -> T {
        act(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}
