//! Writes the outputs of a run: pictures, sums, snapshots, figures and its checkpoint.

use std::path::PathBuf;
use std::time::Instant;

use super::{Kept, Writer};
use crate::cli::outputs::{self, is_sums};
use crate::cli::overall::TotalProgress;
use crate::cli::stats::{Stats, Times};
use crate::cli::{CliError, report};
use octolux::film::write_picture;
use octolux::run::Run;

impl Writer<'_> {
    /// Writes the pictures for `--snapshots`.
    pub fn snapshot(&self, run: &Run, kept: &mut Kept) {
        let request = self.job.request;
        if request.snapshots && run.passes().is_power_of_two() {
            let pictures = request.targets.pictures.iter().filter(|path| !is_sums(path));
            let paths = pictures.map(|path| outputs::snapshot(path, run.passes())).collect();
            self.write(run, paths, kept);
        }
    }

    /// Writes the pictures and reports the result.
    ///
    /// # Errors
    /// Figures that could not be written; errors of pictures are collected.
    pub fn finish(&self, run: &Run, kept: &mut Kept) -> Result<(), CliError> {
        let request = self.job.request;
        if let Some(error) = run.failure() {
            let what = format!(
                "{}: {error}: the picture would be wrong and is not written",
                request.scene.display()
            );
            return Err(CliError::failed(what));
        }
        if !run.is_complete()
            && let Err(error) = self.save(run, kept)
        {
            kept.errors.push(error);
        }
        if run.passes_done() == 0 && !run.is_complete() {
            if !request.quiet {
                report::note(&format!(
                    "{}: stopped before its first pass, nothing to write",
                    request.scene.display()
                ));
            }
            return Ok(());
        }
        let written = self.write(run, request.targets.pictures.clone(), kept);
        if run.is_complete() {
            self.leave_checkpoint(run, kept);
        }
        if let Some(overall) = self.job.overall.filter(|_| run.is_complete() && kept.errors.is_empty()) {
            overall.note(self.key.clone(), &request.targets.pictures)?;
        }
        let mut stats = self.stats(run, kept);
        let first = kept.first.as_ref().filter(|_| run.replicates() == 1);
        stats.outliers = first.and_then(|first| first.outliers(&run.picture(), &run.samples()));
        if let Some(path) = &request.targets.stats {
            stats.write(path)?;
        }
        if request.json {
            report::data(&stats.json()?)?;
        }
        if !request.quiet {
            let warnings = [stats.invalid_samples.warning(&stats.scene), stats.speckles()];
            warnings.iter().flatten().for_each(|warning| report::warning(warning));
        }
        if !request.quiet && !request.json {
            let files = if written.is_empty() {
                "nothing".to_owned()
            } else {
                written.join(", ")
            };
            report::print(&match self.job.overall.is_some_and(TotalProgress::is_batch) {
                true => format!("{files}: {}\n", stats.short()),
                false => format!("{}\nwrote {files}\n", stats.summary()),
            });
        }
        Ok(())
    }

    /// Saves a checkpoint, if one was asked for.
    ///
    /// # Errors
    /// Errors of the system; the previous checkpoint is then kept.
    pub fn save(&self, run: &Run, kept: &mut Kept) -> Result<(), CliError> {
        let attributes = self.stats(run, kept).attributes(0.0).settings;
        let saved = kept
            .checkpoint
            .as_mut()
            .map(|checkpoint| checkpoint.save(run, attributes));
        Ok(saved.unwrap_or(Ok(()))?)
    }

    /// Removes the checkpoint of a finished render. Saves it instead if requested, if its pictures could not be written, or if
    /// its time limit ended before its error was reached.
    fn leave_checkpoint(&self, run: &Run, kept: &mut Kept) {
        let early = run.reached().is_some_and(|reached| reached.early)
            || (run.goal().error_asked().is_some() && run.reached().is_none());
        if self.job.request.keep || early || !kept.errors.is_empty() {
            if let Err(error) = self.save(run, kept) {
                kept.errors.push(error);
            }
        } else if let Some(checkpoint) = &kept.checkpoint {
            checkpoint.remove();
        }
    }

    /// Writes the picture, or its sums if they are complete, to each path; returns the names of written files.
    fn write(&self, run: &Run, paths: Vec<PathBuf>, kept: &mut Kept) -> Vec<String> {
        let started = Instant::now();
        let (sums, pictures): (Vec<_>, Vec<_>) = paths.into_iter().partition(|path| is_sums(path));
        let mut results = Vec::new();
        if !pictures.is_empty() {
            let picture = run.picture();
            let mut attributes = self.stats(run, kept).attributes(self.job.request.exposure);
            if run.goal().is_adaptive() {
                attributes.samples = Some(run.samples());
            }
            for path in pictures {
                let result = write_picture(&path, &picture, &attributes);
                results.push((path, result));
            }
        }
        for path in sums {
            if run.is_complete() {
                let result = run.save(&path, self.stats(run, kept).attributes(0.0).settings);
                results.push((path, result));
            } else {
                report::note(&format!(
                    "{}: not written: a .acc holds the sums of a finished render",
                    path.display()
                ));
            }
        }
        let mut written = Vec::new();
        for (path, result) in results {
            match result {
                Ok(()) => written.push(path.display().to_string()),
                Err(error) => kept.errors.push(error.into()),
            }
        }
        kept.write_time += started.elapsed();
        written
    }

    fn stats(&self, run: &Run, kept: &Kept) -> Stats {
        let times = Times {
            load: self.load_time,
            write: kept.write_time,
        };
        let stats = Stats::new(&self.job.request.scene, run, times, self.job.interrupt.asked());
        Stats {
            estimator_why: Some(self.estimator_why),
            ..stats
        }
    }
}
