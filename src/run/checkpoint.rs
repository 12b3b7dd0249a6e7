//! Saved runs: sums of finished renders and shards, and checkpoints of running ones.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use super::{Record, Run};
use crate::film::{Film, Picture, PictureError, Value, sums_file};

/// A saved run: its sums, and the render that they belong to.
#[derive(Debug)]
pub struct Saved {
    /// Describes the render.
    pub record: Record,
    /// The sums.
    pub film: Film,
    /// For a render to an error, the films of its further replicates, and pictures of all of them.
    pub others: (Vec<Film>, Vec<Picture>),
}

impl Saved {
    /// Reads what [`Run::save`] wrote.
    ///
    /// # Errors
    /// A sentence about a file that is missing, of another kind or version, truncated or damaged.
    pub fn read(path: &Path) -> Result<Self, PictureError> {
        let count = |record: &Record| match &record.replicates {
            Some(kept) => [kept.levels.len().max(1), kept.halves.pictures.len()],
            None => [1, 0],
        };
        let (record, mut films, pictures) = sums_file::read_all(path, count)?;
        let film = films.remove(0);
        Ok(Self {
            record,
            film,
            others: (films, pictures),
        })
    }
}

/// Why a saved run cannot be resumed.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ResumeError {
    /// It belongs to another render, with this difference.
    #[error("belongs to another render: {0}")]
    OtherRender(String),
    /// It belongs to another shard.
    #[error("belongs to another shard of this render")]
    OtherShard,
}

impl Run {
    /// Writes the sums atomically, with the attributes for an EXR of them. [`Saved::read`] reads them.
    ///
    /// # Errors
    /// Errors of the system; an older file is then kept.
    pub fn save(&self, path: &Path, attributes: Vec<(String, Value)>) -> Result<(), PictureError> {
        let mut record = Record::of(self, attributes);
        let (replicates, films, pictures) = self.kept();
        record.replicates = replicates;
        sums_file::write_all(path, &record, &films, &pictures)
    }
}

/// A file to which a run is saved at intervals.
#[derive(Debug)]
pub struct Checkpoint {
    path: PathBuf,
    every: Duration,
    saved: Instant,
}

impl Checkpoint {
    /// A checkpoint that is due every `every`. Writes nothing yet.
    pub fn new(path: &Path, every: Duration) -> Self {
        Self {
            path: path.to_owned(),
            every,
            saved: Instant::now(),
        }
    }

    /// When the next save is due.
    pub fn due(&self) -> Instant {
        self.saved + self.every
    }

    /// Whether a save is due.
    pub fn is_due(&self) -> bool {
        Instant::now() >= self.due()
    }

    /// Saves the run, due or not.
    ///
    /// # Errors
    /// Errors of the system. A full disk is no reason to stop: the previous checkpoint is kept.
    pub fn save(&mut self, run: &Run, attributes: Vec<(String, Value)>) -> Result<(), PictureError> {
        let written = run.save(&self.path, attributes);
        self.saved = Instant::now();
        written
    }

    /// Removes the file after the run has finished, if there is one.
    pub fn remove(&self) {
        // Without a file there is nothing to remove.
        let _ = std::fs::remove_file(&self.path);
    }
}
