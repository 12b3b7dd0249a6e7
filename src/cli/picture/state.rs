//! The state of a render in its checkpoint: taken up, kept from time to time, left or removed at the end.

use std::path::Path;
use std::time::{Duration, Instant};

use super::Render;
use crate::cli::record::Record;
use crate::cli::{CliError, report};
use crate::film::{Film, sums_file};

impl Render<'_> {
    /// Takes up what the checkpoint holds, if it may and there is one.
    pub fn resume(&mut self, path: &Path) -> Result<(), CliError> {
        if !path.exists() {
            return Ok(());
        }
        if !self.job.args.resume {
            let what = format!("{}: a checkpoint is there already", path.display());
            return Err(CliError::usage(what).with_help("--resume goes on from it; or delete it"));
        }
        let read = sums_file::read(path).map_err(|error| CliError::bad_path(&error));
        let (record, film): (Record, Film) = read?;
        let help = "render with the settings of the checkpoint, or delete it";
        self.record
            .expect(&record, path, false)
            .map_err(|error| error.with_help(help))?;
        if (&record.passes, record.shard) != (&self.passes, self.record.shard) {
            let what = format!("{}: belongs to another shard of this render", path.display());
            return Err(CliError::usage(what).with_help(help));
        }
        self.renderer.restore(film, record.counters);
        self.times.render_s = record.render_s;
        if !self.job.args.quiet {
            let share = self.renderer.passes() - self.passes.start;
            report::note(&format!("{}: going on after {share} passes", path.display()));
        }
        Ok(())
    }

    /// When the state is to be kept next; tiles pause then.
    pub fn next_checkpoint(&mut self) -> Option<Instant> {
        let every = Duration::from_secs_f64(self.job.args.every);
        let due = self.job.targets.checkpoint.as_ref().map(|_| self.saved + every);
        self.renderer.pause_at(due);
        due
    }

    pub fn save_if_due(&mut self, due: Option<Instant>) {
        if due.is_some_and(|due| Instant::now() >= due) {
            self.save();
        }
    }

    /// Keeps the state. A disk that is full is no reason to stop: the state before this one still stands.
    pub fn save(&mut self) {
        let Some(path) = &self.job.targets.checkpoint else {
            return;
        };
        if let Err(error) = sums_file::write(path, &self.state(), self.renderer.film()) {
            report::warning(&error.to_string());
        }
        self.saved = Instant::now();
    }

    /// What a file of the sums says as they stand.
    pub fn state(&self) -> Record {
        let attributes = self.stats().attributes(0.0).settings.into_iter();
        Record {
            counters: self.renderer.counters(),
            render_s: self.times.render_s,
            attributes: attributes.map(|(name, value)| (name.to_owned(), value)).collect(),
            ..self.record.clone()
        }
    }

    /// Removes the checkpoint of a render that is done, or keeps all of it where its pictures could not be written.
    pub fn leave_checkpoint(&mut self) {
        if !self.errors.is_empty() {
            self.save();
        } else if let Some(path) = &self.job.targets.checkpoint {
            // Where there never was one, there is nothing to remove.
            let _ = std::fs::remove_file(path);
        }
    }
}
