//! State shared by several pictures of one command: finished ones, and overall progress.

use std::collections::HashSet;
use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::CliError;
use super::done::Done;
use octolux::pipeline::Progress;

/// The shared state.
#[derive(Debug)]
pub struct TotalProgress {
    done: Option<Done>,
    again: bool,
    /// Total samples to render; pictures that exist or cannot begin are subtracted.
    total: AtomicU64,
    begun: Mutex<Vec<Arc<Progress>>>,
    /// Pictures that existed already.
    there: AtomicUsize,
    /// Notes already printed.
    told: Mutex<HashSet<String>>,
}

impl TotalProgress {
    /// For pictures with so many samples in all. `done` records finished pictures; `again` renders them anyway.
    pub fn new(done: Option<Done>, again: bool, samples: u64) -> Self {
        Self {
            done,
            again,
            total: AtomicU64::new(samples),
            begun: Mutex::default(),
            there: AtomicUsize::new(0),
            told: Mutex::default(),
        }
    }

    /// Counts the samples of a render.
    pub fn watch(&self, progress: Arc<Progress>) {
        self.list().push(progress);
    }

    /// Whether these files exist and are up to date.
    pub fn is_done(&self, key: &str, files: &[PathBuf]) -> bool {
        let there = !self.again && self.done.as_ref().is_some_and(|done| done.holds(key, files));
        self.there.fetch_add(usize::from(there), Ordering::Relaxed);
        there
    }

    /// Whether finished pictures are recorded, as in a batch.
    pub fn is_batch(&self) -> bool {
        self.done.is_some()
    }

    /// Number of pictures that existed already.
    pub fn there(&self) -> usize {
        self.there.load(Ordering::Relaxed)
    }

    /// Whether a note is new, so that it is printed once.
    pub fn is_new(&self, note: &str) -> bool {
        let mut told = self.told.lock().unwrap_or_else(PoisonError::into_inner);
        told.insert(note.to_owned())
    }

    /// Records that these files are finished.
    ///
    /// # Errors
    /// A record that cannot be written.
    pub fn note(&self, key: String, files: &[PathBuf]) -> Result<(), CliError> {
        self.done.as_ref().map_or(Ok(()), |done| done.note(key, files))
    }

    /// Subtracts samples that will not be rendered.
    pub fn forget(&self, samples: u64) {
        self.total.fetch_sub(samples, Ordering::Relaxed);
    }

    /// Total samples to render.
    pub fn total(&self) -> u64 {
        self.total.load(Ordering::Relaxed)
    }

    /// Samples so far.
    pub fn samples(&self) -> u64 {
        self.list().iter().map(|progress| progress.samples()).sum()
    }

    fn list(&self) -> MutexGuard<'_, Vec<Arc<Progress>>> {
        self.begun.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
