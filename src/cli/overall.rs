//! What several pictures of one command share: which are done, and how far all of them are.

use std::collections::HashSet;
use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::CliError;
use super::done::Done;
use octolux::pipeline::Progress;

/// What the pictures share.
#[derive(Debug)]
pub struct TotalProgress {
    done: Option<Done>,
    again: bool,
    /// Samples to render in all; pictures that are there, or fail, are taken off.
    total: AtomicU64,
    begun: Mutex<Vec<Arc<Progress>>>,
    /// Pictures that were there already.
    there: AtomicUsize,
    /// Notes that were told.
    told: Mutex<HashSet<String>>,
}

impl TotalProgress {
    /// Of pictures with so many samples in all. `done` notes what is done, and `again` is whether to render it all the same.
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

    /// Has the samples of a render counted.
    pub fn watch(&self, progress: Arc<Progress>) {
        self.list().push(progress);
    }

    /// Whether these files are there as they would be rendered.
    pub fn is_done(&self, key: &str, files: &[PathBuf]) -> bool {
        let there = !self.again && self.done.as_ref().is_some_and(|done| done.holds(key, files));
        self.there.fetch_add(usize::from(there), Ordering::Relaxed);
        there
    }

    /// Whether it is noted what is done: whether this is a batch.
    pub fn is_batch(&self) -> bool {
        self.done.is_some()
    }

    /// How many pictures were there already.
    pub fn there(&self) -> usize {
        self.there.load(Ordering::Relaxed)
    }

    /// Whether a note is told for the first time.
    pub fn is_new(&self, note: &str) -> bool {
        let mut told = self.told.lock().unwrap_or_else(PoisonError::into_inner);
        told.insert(note.to_owned())
    }

    /// Notes that they are.
    ///
    /// # Errors
    /// Notes that cannot be written.
    pub fn note(&self, key: String, files: &[PathBuf]) -> Result<(), CliError> {
        self.done.as_ref().map_or(Ok(()), |done| done.note(key, files))
    }

    /// How many renders have begun.
    pub fn begun(&self) -> usize {
        self.list().len()
    }

    /// Takes samples off that will not be rendered.
    pub fn forget(&self, samples: u64) {
        self.total.fetch_sub(samples, Ordering::Relaxed);
    }

    /// Samples to render in all.
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
