//! One scene to its pictures: set up or taken up again, rendered block by block, written.

mod state;

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::Instant;

use super::interrupt::Interrupt;
use super::merge::is_sums;
use super::outputs::{self, Targets};
use super::progress::Bar;
use super::record::Record;
use super::render::Args;
use super::schedule::Goal;
use super::several::Overall;
use super::stats::{Stats, Times};
use super::target::{self, Reached};
use super::{CliError, done, options, report};
use crate::film::{Film, leaf_passes, sums_file, write_picture};
use crate::pipeline::{Renderer, Settings};
use crate::scene::{Effects, available_memory};
use crate::study::outliers::FirstSamples;

/// One scene of a command.
#[derive(Clone, Copy)]
pub struct Job<'a> {
    pub path: &'a Path,
    pub targets: &'a Targets,
    pub args: &'a Args,
    pub interrupt: &'a Interrupt,
    /// What it shares with the other pictures of a batch.
    pub overall: Option<&'a Overall>,
}

impl<'a> Job<'a> {
    /// Renders and writes; returns everything that went wrong.
    pub fn run(self) -> Vec<CliError> {
        let mut render = match self.set_up() {
            Ok(Some(render)) => render,
            Ok(None) => return Vec::new(),
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

    /// Loads the scene and builds what its render needs, or takes it up again; nothing where a batch has it already.
    fn set_up(self) -> Result<Option<Render<'a>>, CliError> {
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
            let of = self
                .overall
                .map(|_| format!("{}: ", self.path.display()))
                .unwrap_or_default();
            scene.notes.iter().for_each(|note| report::note(&format!("{of}{note}")));
            if !settings.robust && renderer.robust().is_none() {
                let what = "--robust off changes nothing: no ray goes through Embree, as shapes are tested in a line";
                report::note(&format!("{of}{what}"));
            }
            if !settings.cull && renderer.cull().is_none() {
                let what = "--cull off changes nothing: shapes are too many for any to be left out at once";
                report::note(&format!("{of}{what}"));
            }
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
            first: None,
            times,
            saved: Instant::now(),
            complete: false,
            errors: Vec::new(),
        };
        if let Some(overall) = self.overall {
            if overall.is_done(&render.key(), &self.targets.pictures) {
                return Ok(None);
            }
            overall.watch(render.renderer.progress());
        }
        if let Some(path) = &self.targets.checkpoint {
            render.resume(path)?;
        }
        Ok(Some(render))
    }

    /// Says before it is tried what would not fit.
    fn announce_memory(self, settings: Settings, passes: u32) -> Result<(), CliError> {
        let passes = if self.args.time.is_some() { 1 } else { passes };
        let needed = Film::bytes(settings.film, passes, self.args.adaptive);
        let free = available_memory().unwrap_or(u64::MAX);
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
    /// What later samples are held against.
    first: Option<FirstSamples>,
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
    /// A hash of everything that decides the pictures.
    fn key(&self) -> String {
        let args = self.job.args;
        let more = (
            &self.record.identity,
            self.record.shard,
            [args.time, args.target_error].map(|goal| goal.map(f64::to_bits)),
            args.exposure.to_bits(),
        );
        done::key(&format!("{more:?} {}", args.snapshots))
    }

    /// Shows the way to the goal until it is dropped.
    fn bar(&self) -> Bar {
        if self.job.overall.is_some() {
            return Bar::none();
        }
        let pixels = u64::from(self.settings.film.width) * u64::from(self.settings.film.height);
        let goal = match self.goal {
            Goal::Passes(_) => Goal::Passes(self.passes.end - self.passes.start),
            seconds => seconds,
        };
        Bar::start(&self.name, goal, pixels, self.renderer.progress(), self.job.args.quiet)
    }

    /// Renders replicates until their spread is small enough or a stop.
    fn toward(&mut self, asked: f64) {
        let (name, progress) = (self.name.clone(), self.renderer.progress());
        let quiet = self.job.args.quiet || self.job.overall.is_some();
        let pixels = u64::from(self.settings.film.width) * u64::from(self.settings.film.height);
        let bar = |spp: u32| Bar::start(&name, Goal::Passes(spp), pixels, progress.clone(), quiet);
        self.reached = target::render(
            &mut self.renderer,
            &mut self.siblings,
            self.settings.seed,
            asked,
            &mut self.times,
            bar,
        );
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
                self.look();
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
                self.look();
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

    /// Keeps the first samples of every pixel.
    fn look(&mut self) {
        let (least, _, most) = self.renderer.film().spread();
        if self.job.args.shard.is_none() && 0 < least && least == most {
            self.first = Some(FirstSamples::of(&self.renderer.picture(), most));
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
        if let Some(error) = self.renderer.progress().failure() {
            let what = format!(
                "{}: {error}: the picture would be wrong and is not written",
                self.job.path.display()
            );
            return Err(CliError::failed(what));
        }
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
        if let Some(overall) = self.job.overall.filter(|_| self.complete && self.errors.is_empty()) {
            overall.note(self.key(), &self.job.targets.pictures)?;
        }
        let mut stats = self.stats();
        let first = self.first.as_ref();
        stats.outliers = first.and_then(|first| first.outliers(&self.renderer.picture(), &self.renderer.samples()));
        if let Some(path) = &self.job.targets.stats {
            stats.write(path)?;
        }
        if args.json {
            report::data(&stats.json()?)?;
        }
        if !args.quiet {
            let warnings = [stats.invalid_samples.warning(&stats.scene), stats.speckles()];
            warnings.iter().flatten().for_each(|warning| report::warning(warning));
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
