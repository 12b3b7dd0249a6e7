//! One scene to its pictures: set up or taken up again, rendered block by block, written.

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use super::interrupt::Interrupt;
use super::merge::is_sums;
use super::outputs::{self, Targets};
use super::progress::Bar;
use super::record::Record;
use super::render::Args;
use super::schedule::Goal;
use super::stats::{Stats, Times};
use super::target::{self, Reached};
use super::{CliError, machine, options, report};
use crate::film::{Film, leaf_passes, sums_file, write_picture};
use crate::pipeline::{Renderer, Settings};
use crate::scene::Effects;

/// One scene of a command.
#[derive(Clone, Copy)]
pub struct Job<'a> {
    pub path: &'a Path,
    pub targets: &'a Targets,
    pub args: &'a Args,
    pub interrupt: &'a Interrupt,
}

impl<'a> Job<'a> {
    /// Renders and writes; returns everything that went wrong.
    pub fn run(self) -> Vec<CliError> {
        let mut render = match self.set_up() {
            Ok(render) => render,
            Err(error) => return vec![error],
        };
        if let Some(asked) = self.args.target_error {
            render.toward(asked);
        } else if self.args.adaptive {
            render.adaptive();
        } else {
            render.passes();
        }
        if let Err(error) = render.finish() {
            render.errors.push(error);
        }
        render.errors
    }

    /// Loads the scene and builds what its render needs, or takes it up again.
    fn set_up(self) -> Result<Render<'a>, CliError> {
        let (args, started) = (self.args, Instant::now());
        let scene = args.options.reading.load(self.path)?;
        let times = Times {
            load_s: started.elapsed().as_secs_f64(),
            ..Times::default()
        };
        let settings = args.options.settings(&scene)?;
        let spp = args.spp.or(scene.render.spp).unwrap_or(options::DEFAULT_SPP);
        let passes = args
            .shard
            .map_or(0..spp, |shard| shard.passes(spp, leaf_passes(settings.film)));
        self.announce_memory(settings, passes.end - passes.start)?;
        let mut renderer = Renderer::holding(&scene, settings, Effects::of(&args.options.hold))
            .map_err(|error| CliError::setup(self.path, &error))?;
        renderer.begin_at(passes.start);
        self.interrupt.watch(renderer.progress());
        if !args.quiet {
            scene.notes.iter().for_each(|note| report::note(note));
        }
        let mut render = Render {
            job: self,
            name: scene.name,
            spp,
            goal: args.time.map_or(Goal::Passes(passes.end), Goal::Seconds),
            settings,
            record: Record {
                passes: passes.clone(),
                shard: args.shard,
                ..Record::new(&scene.hash, settings, spp, args.adaptive, &renderer)
            },
            passes,
            renderer,
            siblings: Vec::new(),
            reached: None,
            times,
            saved: Instant::now(),
            complete: false,
            errors: Vec::new(),
        };
        if let Some(path) = &self.targets.checkpoint {
            render.resume(path)?;
        }
        Ok(render)
    }

    /// Says before it is tried what would not fit.
    fn announce_memory(self, settings: Settings, passes: u32) -> Result<(), CliError> {
        let passes = if self.args.time.is_some() { 1 } else { passes };
        let needed = Film::bytes(settings.film, passes, self.args.adaptive);
        let free = machine::available_bytes().unwrap_or(u64::MAX);
        if needed <= free {
            return Ok(());
        }
        let gib = |bytes: u64| bytes as f64 / f64::from(1 << 30);
        let what = format!(
            "{}: {} x {} pixels with {passes} samples take {:.1} GiB of memory, and {:.1} GiB are free",
            self.path.display(),
            settings.film.width,
            settings.film.height,
            gib(needed),
            gib(free)
        );
        Err(CliError::usage(what).with_help("make the picture smaller, render it in shards, or close other programs"))
    }
}

/// A render under way.
struct Render<'a> {
    job: Job<'a>,
    name: String,
    /// Samples a pixel, on average where they differ.
    spp: u32,
    /// The passes that are to be rendered here.
    passes: Range<u32>,
    goal: Goal,
    settings: Settings,
    renderer: Renderer,
    /// Further replicates, where an error is the goal.
    siblings: Vec<Renderer>,
    reached: Option<Reached>,
    record: Record,
    times: Times,
    /// When the state was kept last.
    saved: Instant,
    /// Whether the goal was reached.
    complete: bool,
    /// Pictures that could not be written: no reason to keep back the others.
    errors: Vec<CliError>,
}

impl Render<'_> {
    /// Shows the way to the goal until it is dropped.
    fn bar(&self) -> Bar {
        let pixels = u64::from(self.settings.film.width) * u64::from(self.settings.film.height);
        let goal = match self.goal {
            Goal::Passes(_) => Goal::Passes(self.passes.end - self.passes.start),
            seconds => seconds,
        };
        Bar::start(&self.name, goal, pixels, self.renderer.progress(), self.job.args.quiet)
    }

    /// Takes up what the checkpoint holds, if it may and there is one.
    fn resume(&mut self, path: &Path) -> Result<(), CliError> {
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

    /// Renders replicates until their spread is small enough or a stop.
    fn toward(&mut self, asked: f64) {
        let (name, quiet, progress) = (self.name.clone(), self.job.args.quiet, self.renderer.progress());
        let pixels = u64::from(self.settings.film.width) * u64::from(self.settings.film.height);
        let bar = |spp: u32| Bar::start(&name, Goal::Passes(spp), pixels, progress.clone(), quiet);
        self.siblings = target::siblings(&self.renderer, self.settings.seed);
        let reached = target::render(&mut self.renderer, &mut self.siblings, asked, &mut self.times, bar);
        self.reached = Some(reached);
        self.complete = !progress.stop_requested();
    }

    /// Renders pilot passes and what follows from them until all is spent or a stop.
    fn adaptive(&mut self) {
        let progress = self.renderer.progress();
        let _bar = self.bar();
        let mut more = true;
        while more && !progress.stop_requested() {
            let due = self.next_checkpoint();
            let first = self.renderer.passes() == 0;
            let started = Instant::now();
            more = self.renderer.next_adaptive_block(self.spp);
            let seconds = started.elapsed().as_secs_f64();
            self.times.render_s += seconds;
            if first {
                self.times.first_pass_s = seconds;
            }
            self.save_if_due(due);
        }
        self.complete = !more;
    }

    /// Renders block after block until the goal or a stop.
    fn passes(&mut self) {
        let progress = self.renderer.progress();
        let _bar = self.bar();
        let mut pass_s = 0.0;
        while !progress.stop_requested() {
            let due = self.next_checkpoint();
            let (before, stop) = (self.renderer.passes(), self.renderer.next_stop());
            let Some(limit) = self.goal.limit(before, self.times.render_s, pass_s) else {
                self.complete = true;
                break;
            };
            let started = Instant::now();
            let after = self.renderer.next_block(limit);
            let seconds = started.elapsed().as_secs_f64();
            self.times.render_s += seconds;
            if before == self.passes.start {
                self.times.first_pass_s = seconds;
            }
            if after > before {
                pass_s = seconds / f64::from(after - before);
                self.snapshot(after);
            }
            self.save_if_due(due);
            // A block that was cut short is the last: sums are the same for all only if blocks end where all do.
            if after == limit && limit < stop {
                self.complete = true;
                break;
            }
        }
    }

    /// When the state is to be kept next; tiles pause then.
    fn next_checkpoint(&mut self) -> Option<Instant> {
        let every = Duration::from_secs_f64(self.job.args.every);
        let due = self.job.targets.checkpoint.as_ref().map(|_| self.saved + every);
        self.renderer.pause_at(due);
        due
    }

    fn save_if_due(&mut self, due: Option<Instant>) {
        if due.is_some_and(|due| Instant::now() >= due) {
            self.save();
        }
    }

    /// Keeps the state. A disk that is full is no reason to stop: the state before this one still stands.
    fn save(&mut self) {
        let Some(path) = &self.job.targets.checkpoint else {
            return;
        };
        if let Err(error) = sums_file::write(path, &self.state(), self.renderer.film()) {
            report::warning(&error.to_string());
        }
        self.saved = Instant::now();
    }

    /// What a file of the sums says as they stand.
    fn state(&self) -> Record {
        let attributes = self.stats().attributes(0.0).settings.into_iter();
        Record {
            counters: self.renderer.counters(),
            render_s: self.times.render_s,
            attributes: attributes.map(|(name, value)| (name.to_owned(), value)).collect(),
            ..self.record.clone()
        }
    }

    /// Writes what `--snapshots` asks for after so many passes.
    fn snapshot(&mut self, passes: u32) {
        if self.job.args.snapshots && passes.is_power_of_two() {
            let pictures = self.job.targets.pictures.iter().filter(|path| !is_sums(path));
            self.write(pictures.map(|path| outputs::snapshot(path, passes)).collect());
        }
    }

    /// Writes the pictures and tells how it went.
    fn finish(&mut self) -> Result<(), CliError> {
        let args = self.job.args;
        if !self.complete {
            self.save();
        }
        if self.renderer.passes() == self.passes.start && !self.complete {
            if !args.quiet {
                report::note(&format!(
                    "{}: stopped before its first pass, nothing to write",
                    self.job.path.display()
                ));
            }
            return Ok(());
        }
        let written = self.write(self.job.targets.pictures.clone());
        if self.complete {
            self.leave_checkpoint();
        }
        let stats = self.stats();
        if let Some(path) = &self.job.targets.stats {
            stats.write(path)?;
        }
        if args.json {
            report::data(&stats.json()?)?;
        }
        if !args.quiet {
            stats
                .invalid_samples
                .warning(&stats.scene)
                .iter()
                .for_each(|warning| report::warning(warning));
        }
        if !args.quiet && !args.json {
            let files = if written.is_empty() {
                "nothing".to_owned()
            } else {
                written.join(", ")
            };
            report::print(&format!("{}\nwrote {files}\n", stats.summary()));
        }
        Ok(())
    }

    /// Removes the checkpoint of a render that is done, or keeps all of it where its pictures could not be written.
    fn leave_checkpoint(&mut self) {
        if !self.errors.is_empty() {
            self.save();
        } else if let Some(path) = &self.job.targets.checkpoint {
            // Where there never was one, there is nothing to remove.
            let _ = std::fs::remove_file(path);
        }
    }

    /// Writes the picture, or its sums if they are complete, to each path; returns the names of those that stand.
    fn write(&mut self, paths: Vec<PathBuf>) -> Vec<String> {
        let started = Instant::now();
        let (sums, pictures): (Vec<_>, Vec<_>) = paths.into_iter().partition(|path| is_sums(path));
        let mut results = Vec::new();
        if !pictures.is_empty() {
            let picture = target::picture(&self.renderer, &self.siblings);
            let mut attributes = self.stats().attributes(self.job.args.exposure);
            if self.job.args.adaptive {
                attributes.samples = Some(self.renderer.samples());
            }
            for path in pictures {
                let result = write_picture(&path, &picture, &attributes);
                results.push((path, result));
            }
        }
        for path in sums {
            if self.complete {
                let result = sums_file::write(&path, &self.state(), self.renderer.film());
                results.push((path, result));
            } else {
                report::note(&format!(
                    "{}: not written, as sums are of whole renders",
                    path.display()
                ));
            }
        }
        let mut written = Vec::new();
        for (path, result) in results {
            match result {
                Ok(()) => written.push(path.display().to_string()),
                Err(error) => self.errors.push(error.into()),
            }
        }
        self.times.write_s += started.elapsed().as_secs_f64();
        written
    }

    fn stats(&self) -> Stats {
        let mut stats = Stats::new(
            self.job.path,
            self.settings,
            self.job.args.adaptive,
            &self.renderer,
            self.times,
            self.job.interrupt.asked(),
        );
        self.siblings.iter().for_each(|sibling| stats.add_replicate(sibling));
        stats.target_error = self.reached.map(|reached| reached.asked);
        stats.error = self.reached.map(|reached| reached.error);
        stats
    }
}
