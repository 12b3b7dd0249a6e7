//! What is kept of a run: sums of whole renders and shards, and checkpoints of those under way.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use super::{Record, Run};
use crate::film::{Film, Picture, PictureError, Value, sums_file};

/// A run that was saved: its sums, and what they belong to.
#[derive(Debug)]
pub struct Saved {
    /// What it is of.
    pub record: Record,
    /// The sums.
    pub film: Film,
    /// Of a render to an error, the films of its further replicates, and pictures of all of them.
    pub others: (Vec<Film>, Vec<Picture>),
}

impl Saved {
    /// Reads what [`Run::save`] wrote.
    ///
    /// # Errors
    /// A sentence about a file that is missing, of another kind or version, cut short or damaged.
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

/// Why a saved run cannot be taken up.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ResumeError {
    /// It is of another render, which differs in this.
    #[error("belongs to another render: {0}")]
    OtherRender(String),
    /// It is of another shard.
    #[error("belongs to another shard of this render")]
    OtherShard,
}

impl Run {
    /// Writes the sums whole or not at all, with what an EXR of them is to say of its making. [`Saved::read`] reads them.
    ///
    /// # Errors
    /// What the system answers; an older file then still stands.
    pub fn save(&self, path: &Path, attributes: Vec<(String, Value)>) -> Result<(), PictureError> {
        let mut record = Record::of(self, attributes);
        let (replicates, films, pictures) = self.kept();
        record.replicates = replicates;
        sums_file::write_all(path, &record, &films, &pictures)
    }
}

/// A file that a run is saved to from time to time.
#[derive(Debug)]
pub struct Checkpoint {
    path: PathBuf,
    every: Duration,
    saved: Instant,
}

impl Checkpoint {
    /// One that is due after `every`, and so on. Nothing is written yet.
    pub fn new(path: &Path, every: Duration) -> Self {
        Self {
            path: path.to_owned(),
            every,
            saved: Instant::now(),
        }
    }

    /// When it is due.
    pub fn due(&self) -> Instant {
        self.saved + self.every
    }

    /// Whether it is.
    pub fn is_due(&self) -> bool {
        Instant::now() >= self.due()
    }

    /// Saves the run, due or not.
    ///
    /// # Errors
    /// What the system answers. A full disk is no reason to stop: the state before this one still stands.
    pub fn save(&mut self, run: &Run, attributes: Vec<(String, Value)>) -> Result<(), PictureError> {
        let written = run.save(&self.path, attributes);
        self.saved = Instant::now();
        written
    }

    /// Removes the file of a run that is done, if there is one.
    pub fn remove(&self) {
        // Where there never was one, there is nothing to remove.
        let _ = std::fs::remove_file(&self.path);
    }
}
