//! Renders one scene to its pictures: setup or resume, render by blocks, write.

mod writing;

use std::cell::RefCell;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use super::inputs::Inputs;
use super::interrupt::Interrupt;
use super::overall::TotalProgress;
use super::progress::Bar;
use super::request::Request;
use super::tev::Feed;
use super::{CliError, done, options, report};
use octolux::film::Film;
use octolux::pipeline::{Chosen, Prepared, Progress, Settings};
use octolux::run::{Checkpoint, Goal, MOST_SPP, Observer, ResumeError, Run, Saved, replicates};
use octolux::scene::{Scene, available_memory};
use octolux::study::outliers::FirstSamples;
use octolux::study::verify::sanity::plural;

/// One scene of a command.
#[derive(Clone, Copy)]
pub struct Job<'a> {
    pub request: &'a Request,
    pub interrupt: &'a Interrupt,
    /// State shared with the other pictures of a batch.
    pub overall: Option<&'a TotalProgress>,
}

/// What came of a job.
#[derive(Default)]
pub struct Outcome {
    /// Whether anything was rendered.
    pub began: bool,
    pub errors: Vec<CliError>,
}

impl<'a> Job<'a> {
    /// Renders and writes.
    pub fn run(self) -> Outcome {
        match self.set_up() {
            Ok(Some((render, run))) => self.interrupt.rendering(|| render.complete(run)),
            Ok(None) => Outcome::default(),
            Err(error) => Outcome {
                began: false,
                errors: vec![error],
            },
        }
    }

    /// Loads the scene and prepares or resumes its run; `None` if a batch has already finished it.
    fn set_up(self) -> Result<Option<(Render<'a>, Run)>, CliError> {
        let (request, started) = (self.request, Instant::now());
        let scene = self.interrupt.loading(|| request.load())?;
        Inputs::of_scene(&scene).are_kept_by(request.targets.all())?;
        let load_time = started.elapsed();
        options::check_size(request.options.size)?;
        let (settings, goal) = (request.settings(&scene), request.goal(scene.render().spp));
        self.announce_memory(settings, &goal)?;
        let prepared = Prepared::holding(&scene, settings, request.hold)
            .map_err(|error| CliError::setup(&request.scene, &error))?;
        let key = done::key(&request.decisive_words(&prepared, &goal));
        if let Some(overall) = self.overall
            && overall.is_done(&key, &request.targets.pictures)
        {
            return Ok(None);
        }
        self.tell_notes(&scene, &prepared);
        let run = match request.targets.checkpoint.as_deref().filter(|path| path.exists()) {
            Some(path) => self.resume(path, &prepared, goal)?,
            None => prepared.start(goal),
        };
        let checkpoint = request.targets.checkpoint.as_deref();
        let kept = Kept {
            fresh: run.passes_done() == 0,
            written_passes: run.passes(),
            checkpoint: checkpoint.map(|path| Checkpoint::new(path, request.every)),
            first: None,
            tev: self.show(scene.name()),
            write_time: Duration::ZERO,
            errors: Vec::new(),
        };
        let writer = Writer {
            job: self,
            key,
            load_time,
            estimator_why: Chosen::of(&scene, request.options.estimator).why,
        };
        let render = Render {
            name: scene.name().to_owned(),
            writer,
            kept: RefCell::new(kept),
        };
        Ok(Some((render, run)))
    }

    /// Resumes from the checkpoint, if allowed.
    fn resume(self, path: &Path, prepared: &Prepared, goal: Goal) -> Result<Run, CliError> {
        if !self.request.resume {
            let what = format!("{}: a checkpoint is there already", path.display());
            return Err(CliError::usage(what).with_help("--resume goes on from it; or delete it"));
        }
        let saved = Saved::read(path).map_err(|error| CliError::bad_path(&error))?;
        let run = prepared.resume(goal, saved).map_err(|error| self.other(path, &error))?;
        if !self.request.quiet {
            let done = match run.goal().error_asked() {
                None => plural(run.passes_done() as usize, "pass"),
                Some(_) => plural(run.replicates(), "picture"),
            };
            report::note(&format!("{}: going on after {done}", path.display()));
        }
        Ok(run)
    }

    /// The error of a checkpoint of another render.
    fn other(self, path: &Path, error: &ResumeError) -> CliError {
        let (checkpoint, scene) = (path.display(), self.request.scene.display());
        let what = match error {
            ResumeError::OtherRender(difference) => {
                format!("{checkpoint}: belongs to another render than that of {scene}: {difference}")
            }
            ResumeError::OtherShard => format!("{checkpoint}: {error}, {scene}"),
        };
        let help = "render that scene with those settings (`octolux info` shows them), or name another --checkpoint";
        CliError::usage(what).with_help(help)
    }

    /// Connects to the viewer tev, if it is running.
    fn show(self, name: &str) -> Option<Feed> {
        let started = Feed::start(self.request.tev.as_deref()?, name);
        let warn = |error| report::warning(&format!("{error}: the render goes on without tev"));
        started.map_err(warn).ok()
    }

    fn tell_notes(self, scene: &Scene, prepared: &Prepared) {
        if self.request.quiet {
            return;
        }
        let of = self
            .overall
            .map(|_| format!("{}: ", self.request.scene.display()))
            .unwrap_or_default();
        // Several pictures of a batch may share a scene.
        let tell = |note: &str| {
            let note = format!("{of}{note}");
            if self.overall.is_none_or(|overall| overall.is_new(&note)) {
                report::note(&note);
            }
        };
        scene.notes().iter().for_each(|note| tell(note));
        let settings = prepared.settings();
        if !settings.robust && prepared.robust().is_none() {
            let what = "--robust off changes nothing: no ray goes through Embree, as all shapes are tested one by one";
            tell(what);
        }
        if !settings.cull && prepared.cull().is_none() {
            let what = "--cull off changes nothing: shapes are too many for any to be left out at once";
            tell(what);
        }
    }

    /// Refuses pictures that need more memory than is free. Where a time or an error decides, how much they need is only known
    /// afterwards: this is what they need at least.
    fn announce_memory(self, settings: Settings, goal: &Goal) -> Result<(), CliError> {
        let range = goal.range(settings.film);
        let (films, passes, least) = match (goal.error_asked(), goal.time_limit()) {
            (Some(_), _) => (2 * replicates::LEAST as u64, replicates::FIRST.passes, " at least"),
            (None, Some(time)) if goal.spp().is_none() => (1, slowest(settings, time), " at least"),
            _ => (1, range.end - range.start, ""),
        };
        let needed = films * Film::bytes(settings.film, passes, goal.is_adaptive());
        let free = available_memory().unwrap_or(u64::MAX);
        if needed <= free {
            return Ok(());
        }
        let gib = |bytes: u64| bytes as f64 / f64::from(1 << 30);
        let what = format!(
            "{}: {} x {} pixels with {}{least} take {:.1} GiB of memory, and {:.1} GiB are free",
            self.request.scene.display(),
            settings.film.width,
            settings.film.height,
            plural((films * u64::from(passes)) as usize, "sample"),
            gib(needed),
            gib(free)
        );
        Err(CliError::usage(what).with_help("make the picture smaller, render it in shards, or close other programs"))
    }
}

/// Passes that a slow scene gets in `time`: a million samples a second and thread.
fn slowest(settings: Settings, time: Duration) -> u32 {
    let pixels = f64::from(settings.film.width) * f64::from(settings.film.height);
    // The cast saturates.
    let passes = (time.as_secs_f64() * settings.threads as f64 * 1e6 / pixels) as u32;
    passes.clamp(1, MOST_SPP)
}

/// A running render: it observes its run.
struct Render<'a> {
    name: String,
    writer: Writer<'a>,
    kept: RefCell<Kept>,
}

/// The mutable state.
struct Kept {
    /// Whether the run was not resumed.
    fresh: bool,
    /// Passes at the last snapshot, or at the start.
    written_passes: u32,
    checkpoint: Option<Checkpoint>,
    /// The first samples, to be compared with later ones.
    first: Option<FirstSamples>,
    /// The live viewer.
    tev: Option<Feed>,
    write_time: Duration,
    /// Errors of pictures; the others are still written.
    errors: Vec<CliError>,
}

/// Writes the outputs of a run.
struct Writer<'a> {
    job: Job<'a>,
    /// A hash of everything that affects the pictures.
    key: String,
    load_time: Duration,
    estimator_why: &'static str,
}

impl Render<'_> {
    /// Renders and writes.
    fn complete(self, mut run: Run) -> Outcome {
        {
            let _bar = self.bar(&run);
            let _ = run.run(&self);
        }
        let mut kept = self.kept.into_inner();
        if let Some(tev) = kept.tev.take().filter(|_| run.failure().is_none()) {
            tev.finish(run.picture());
        }
        let writer = self.writer;
        if let Err(error) = writer.finish(&run, &mut kept) {
            kept.errors.push(error);
        }
        Outcome {
            began: true,
            errors: kept.errors,
        }
    }

    /// Shows progress until it is dropped.
    fn bar(&self, run: &Run) -> Bar {
        if self.writer.job.overall.is_some() {
            return Bar::none();
        }
        Bar::start(&self.name, run, self.writer.job.request.quiet)
    }
}

impl Observer for Render<'_> {
    fn begins(&self, progress: &Arc<Progress>) {
        self.writer.job.interrupt.watch(progress.clone());
        if let Some(overall) = self.writer.job.overall {
            overall.watch(progress.clone());
        }
    }

    fn next_look(&self) -> Option<Instant> {
        let kept = self.kept.borrow();
        let dues = [
            kept.checkpoint.as_ref().map(Checkpoint::due),
            kept.tev.as_ref().map(Feed::due),
        ];
        dues.into_iter().flatten().min()
    }

    fn look(&self, run: &Run) {
        // After a failed query the picture is wrong and nothing is written.
        if run.failure().is_some() {
            return;
        }
        let kept = &mut *self.kept.borrow_mut();
        if kept.fresh && kept.first.is_none() && run.replicates() == 1 && run.goal().shard_of().is_none() {
            let (least, _, most) = run.spread();
            if 0 < least && least == most {
                kept.first = Some(FirstSamples::of(&run.picture(), most));
            }
        }
        if run.passes() > kept.written_passes {
            kept.written_passes = run.passes();
            self.writer.snapshot(run, kept);
        }
        if let Some(tev) = &mut kept.tev {
            tev.show(|| run.picture());
        }
        // A full disk is no reason to stop: the previous checkpoint is kept.
        if kept.checkpoint.as_ref().is_some_and(Checkpoint::is_due)
            && let Err(error) = self.writer.save(run, kept)
        {
            report::warning(&error.to_string());
        }
    }
}
