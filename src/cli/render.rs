//! `octolux render`: scenes to pictures, each in turn.

use std::path::{Path, PathBuf};
use std::time::Instant;

use super::interrupt::Interrupt;
use super::options::{self, Options};
use super::outputs::{self, Targets};
use super::progress::Bar;
use super::schedule::Goal;
use super::stats::{Stats, Times};
use super::{CliError, Exit, replay, report};
use crate::film::write_picture;
use crate::pipeline::{Renderer, Settings};

const EXAMPLES: &str = "\
Examples:
  octolux render scene.toml
      writes scene.exr and scene.png into the working directory
  octolux render scene.toml -o a.exr -o a.npy --time 5
      writes these two instead, after 5 seconds of rendering
  octolux render a.toml b.toml -o 'out/{name}.png'
      writes out/a.png and out/b.png; one bad scene does not stop the others
  octolux render scene.toml --json --quiet | jq .rays_per_s
      prints one figure of the render

Ctrl-c stops early and writes what is rendered (exit code 130); a second one
exits at once, writes nothing and leaves older pictures as they were.";

/// Render scenes to pictures
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Scene files; several are rendered in turn
    #[arg(required = true, value_name = "SCENE")]
    scenes: Vec<PathBuf>,
    /// A picture to write, .exr, .png or .npy by its ending; may be repeated. {name} stands for the scene's name, and
    /// has to be there with several scenes [default: {name}.exr and {name}.png]
    #[arg(short, long = "output", value_name = "FILE")]
    outputs: Vec<PathBuf>,
    /// Samples a pixel, at least 1 [default: the scene's, else 64]
    #[arg(long, value_name = "N", value_parser = options::spp, conflicts_with = "time", allow_negative_numbers = true)]
    spp: Option<u32>,
    /// Render for so many seconds instead (loading and writing aside), at least one sample a pixel
    #[arg(long, value_name = "SECONDS", value_parser = options::seconds, allow_negative_numbers = true)]
    time: Option<f64>,
    /// Give more samples to pixels with more relative error, from a quarter of --spp to 64 times as many, and as many
    /// together. For mis and light; uniform and brdf on small lights are too noisy for it. The .exr tells the samples of
    /// each pixel (samples.N). Changes nothing up to 8 samples a pixel
    #[arg(long, conflicts_with_all = ["time", "snapshots"])]
    adaptive: bool,
    #[command(flatten)]
    options: Options,
    /// Also write each picture after 1, 2, 4, 8, ... samples a pixel, as NAME_0001spp.png and so on
    #[arg(long)]
    snapshots: bool,
    /// Brighten the PNG by so many stops, each twice as bright; .exr and .npy stay as they are
    #[arg(long, value_name = "STOPS", default_value = "0", value_parser = options::stops, allow_negative_numbers = true)]
    exposure: f64,
    /// Write the figures of the render (settings, times, rays) to this .json file; {name} as above
    #[arg(long, value_name = "FILE")]
    stats: Option<PathBuf>,
    /// Print the same figures on standard output, one line a scene
    #[arg(long)]
    json: bool,
    /// Print one sample step by step instead of rendering: its eye ray and hit, and for each light the cone, the direction, its
    /// density, what it would bring and what is in the way. With --json as one object. Pixels and passes count from 0
    #[arg(long, value_name = "X,Y,PASS", value_parser = replay::sample,
          conflicts_with_all = ["outputs", "spp", "time", "adaptive", "snapshots", "stats"])]
    replay: Option<[u32; 3]>,
    /// Say nothing but errors
    #[arg(short, long)]
    quiet: bool,
}

/// Renders every scene; the errors of each are told as they come.
///
/// # Errors
/// Only what stops all of them: files that could not be written later on.
pub fn run(args: Args) -> Result<Exit, CliError> {
    if let Some(sample) = args.replay {
        return match &args.scenes[..] {
            [path] => replay::run(path, &args.options, sample, args.json),
            _ => Err(CliError::usage("--replay takes one scene".to_owned())),
        };
    }
    let targets = outputs::plan(&args.scenes, &args.outputs, args.stats.as_deref())?;
    let interrupt = Interrupt::listen(args.quiet)?;
    let mut exit = Exit::Well;
    for (path, targets) in args.scenes.iter().zip(&targets) {
        if interrupt.asked() {
            break;
        }
        for error in (Job {
            path,
            targets,
            args: &args,
            interrupt: &interrupt,
        })
        .run()
        {
            report::error(&error);
            // A failure outweighs bad scenes: 2 says that every failure is a bad scene.
            exit = if exit == Exit::Failed { exit } else { error.exit() };
        }
    }
    Ok(if interrupt.asked() { Exit::Interrupted } else { exit })
}

/// One scene of the batch.
#[derive(Clone, Copy)]
struct Job<'a> {
    path: &'a Path,
    targets: &'a Targets,
    args: &'a Args,
    interrupt: &'a Interrupt,
}

impl<'a> Job<'a> {
    /// Renders and writes; returns everything that went wrong.
    fn run(self) -> Vec<CliError> {
        let mut render = match self.set_up() {
            Ok(render) => render,
            Err(error) => return vec![error],
        };
        if self.args.adaptive {
            render.adaptive();
        } else {
            render.passes();
        }
        if let Err(error) = render.finish() {
            render.errors.push(error);
        }
        render.errors
    }

    /// Loads the scene and builds what its render needs.
    fn set_up(self) -> Result<Render<'a>, CliError> {
        let started = Instant::now();
        let scene = self.args.options.reading.load(self.path)?;
        let times = Times {
            load_s: started.elapsed().as_secs_f64(),
            ..Times::default()
        };
        let settings = self.args.options.settings(&scene)?;
        let renderer = Renderer::new(&scene, settings).map_err(|error| CliError::setup(self.path, &error))?;
        self.interrupt.watch(renderer.progress());
        if !self.args.quiet {
            scene.notes.iter().for_each(|note| report::note(note));
        }
        let spp = self.args.spp.or(scene.render.spp).unwrap_or(options::DEFAULT_SPP);
        let goal = self.args.time.map_or(Goal::Passes(spp), Goal::Seconds);
        Ok(Render {
            job: self,
            name: scene.name,
            spp,
            goal,
            settings,
            renderer,
            times,
            errors: Vec::new(),
        })
    }
}

/// A render under way.
struct Render<'a> {
    job: Job<'a>,
    name: String,
    /// Samples a pixel, on average where they differ.
    spp: u32,
    goal: Goal,
    settings: Settings,
    renderer: Renderer,
    times: Times,
    /// Pictures that could not be written: no reason to keep back the others.
    errors: Vec<CliError>,
}

impl Render<'_> {
    /// Shows the way to the goal until it is dropped.
    fn bar(&self) -> Bar {
        let pixels = u64::from(self.settings.film.width) * u64::from(self.settings.film.height);
        Bar::start(
            &self.name,
            self.goal,
            pixels,
            self.renderer.progress(),
            self.job.args.quiet,
        )
    }

    /// Renders pilot passes and what follows from them until all is spent or a stop.
    fn adaptive(&mut self) {
        let progress = self.renderer.progress();
        let _bar = self.bar();
        let mut more = true;
        while more && !progress.stop_requested() {
            let first = self.renderer.passes() == 0;
            let started = Instant::now();
            more = self.renderer.next_adaptive_block(self.spp);
            let seconds = started.elapsed().as_secs_f64();
            self.times.render_s += seconds;
            if first {
                self.times.first_pass_s = seconds;
            }
        }
    }

    /// Renders block after block until the goal or a stop.
    fn passes(&mut self) {
        let progress = self.renderer.progress();
        let _bar = self.bar();
        let mut pass_s = 0.0;
        while !progress.stop_requested() {
            let (before, stop) = (self.renderer.passes(), self.renderer.next_stop());
            let Some(limit) = self.goal.limit(before, self.times.render_s, pass_s) else {
                break;
            };
            let started = Instant::now();
            let after = self.renderer.next_block(limit);
            let seconds = started.elapsed().as_secs_f64();
            self.times.render_s += seconds;
            if before == 0 {
                self.times.first_pass_s = seconds;
            }
            if after > before {
                pass_s = seconds / f64::from(after - before);
                self.snapshot(after);
            }
            // A block that was cut short is the last: sums are the same for all only if blocks end where all do.
            if after < stop {
                break;
            }
        }
    }

    /// Writes what `--snapshots` asks for after so many passes.
    fn snapshot(&mut self, passes: u32) {
        if self.job.args.snapshots && passes.is_power_of_two() {
            let paths = self
                .job
                .targets
                .pictures
                .iter()
                .map(|path| outputs::snapshot(path, passes));
            self.write(paths.collect());
        }
    }

    /// Writes the pictures and tells how it went.
    fn finish(&mut self) -> Result<(), CliError> {
        let args = self.job.args;
        if self.renderer.passes() == 0 {
            if !args.quiet {
                report::note(&format!(
                    "{}: stopped before its first pass, nothing to write",
                    self.job.path.display()
                ));
            }
            return Ok(());
        }
        let written = self.write(self.job.targets.pictures.clone());
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

    /// Writes the picture as it stands to each path; returns the names of those that stand.
    fn write(&mut self, paths: Vec<PathBuf>) -> Vec<String> {
        let started = Instant::now();
        let picture = self.renderer.picture();
        let mut attributes = self.stats().attributes(self.job.args.exposure);
        if self.job.args.adaptive {
            attributes.samples = Some(self.renderer.samples());
        }
        let mut written = Vec::new();
        for path in paths {
            match write_picture(&path, &picture, &attributes) {
                Ok(()) => written.push(path.display().to_string()),
                Err(error) => self.errors.push(error.into()),
            }
        }
        self.times.write_s += started.elapsed().as_secs_f64();
        written
    }

    fn stats(&self) -> Stats {
        Stats::new(
            self.job.path,
            self.settings,
            self.job.args.adaptive,
            &self.renderer,
            self.times,
            self.job.interrupt.asked(),
        )
    }
}
