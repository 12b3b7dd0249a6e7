//! `octolux render`: scenes to pictures, each in turn.

use std::path::{Path, PathBuf};
use std::time::Instant;

use super::interrupt::Interrupt;
use super::options::{self, Options};
use super::outputs::{self, Targets};
use super::progress::Bar;
use super::schedule::Goal;
use super::stats::{Stats, Times};
use super::{CliError, Exit, report};
use crate::film::{Attributes, write_picture};
use crate::pipeline::{Renderer, Settings};

const EXAMPLES: &str = "\
Examples:
  octolux render scene.toml                       scene.exr and scene.png in the working directory
  octolux render scene.toml -o a.exr -o a.npy     both of these, no PNG
  octolux render scene.toml --time 5 --quiet      5 seconds of rendering, nothing said but errors
  octolux render a.toml b.toml -o out/{name}.png  a batch; one bad scene does not stop the others
  octolux render scene.toml --json | jq .rays_per_s

Ctrl-c stops early and writes what is rendered (exit code 130); a second one exits at once and writes nothing.";

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
    #[arg(long, value_name = "N", value_parser = options::spp, conflicts_with = "time")]
    spp: Option<u32>,
    /// Render for so many seconds instead (loading and writing aside), at least one sample a pixel
    #[arg(long, value_name = "SECONDS", value_parser = options::seconds, allow_negative_numbers = true)]
    time: Option<f64>,
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
    /// Say nothing but errors
    #[arg(short, long)]
    quiet: bool,
}

/// Renders every scene; the errors of each are told as they come.
///
/// # Errors
/// Only what stops all of them: files that could not be written later on.
pub fn run(args: Args) -> Result<Exit, CliError> {
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
struct Job<'a> {
    path: &'a Path,
    targets: &'a Targets,
    args: &'a Args,
    interrupt: &'a Interrupt,
}

impl Job<'_> {
    /// Renders and writes; returns everything that went wrong, as a picture that cannot be written is no reason to
    /// keep back the others.
    fn run(&self) -> Vec<CliError> {
        let mut errors = Vec::new();
        if let Err(error) = self.render(&mut errors) {
            errors.push(error);
        }
        errors
    }

    fn render(&self, errors: &mut Vec<CliError>) -> Result<(), CliError> {
        let started = Instant::now();
        let scene = super::temporary::load(self.path).map_err(CliError::scene)?;
        let mut times = Times {
            load_s: started.elapsed().as_secs_f64(),
            ..Times::default()
        };
        let settings = self.args.options.settings(&scene)?;
        let mut renderer = Renderer::new(&scene, settings).map_err(|error| CliError::setup(self.path, &error))?;
        self.interrupt.watch(renderer.progress());
        // MERGE: `for note in &scene.notes { self.say(|| report::note(note)) }`
        let spp = self.args.spp.or(scene.render.spp).unwrap_or(options::DEFAULT_SPP);
        let goal = self.args.time.map_or(Goal::Passes(spp), Goal::Seconds);

        self.passes(&scene.name, goal, settings, &mut renderer, &mut times, errors);

        let interrupted = self.interrupt.asked();
        if renderer.passes() == 0 {
            report::print(&format!(
                "{}: stopped before its first pass, nothing to write\n",
                self.path.display()
            ));
            return Ok(());
        }
        let about = Stats::new(self.path, settings, &renderer, times, interrupted);
        let attributes = about.attributes(self.args.exposure);
        let written = self.write(&renderer, &self.targets.pictures, &attributes, &mut times, errors);
        let stats = Stats {
            write_s: times.write_s,
            ..about
        };
        self.tell(&stats, &written)
    }

    /// Renders block after block until the goal or a stop.
    fn passes(
        &self,
        name: &str,
        goal: Goal,
        settings: Settings,
        renderer: &mut Renderer,
        times: &mut Times,
        errors: &mut Vec<CliError>,
    ) {
        let pixels = u64::from(settings.film.width) * u64::from(settings.film.height);
        let progress = renderer.progress();
        let _bar = Bar::start(name, goal, pixels, progress.clone(), self.args.quiet);
        let mut pass_s = 0.0;
        while !progress.stop_requested() {
            let (before, stop) = (renderer.passes(), renderer.next_stop());
            let Some(limit) = goal.limit(before, times.render_s, pass_s) else {
                break;
            };
            let started = Instant::now();
            let after = renderer.next_block(limit);
            let seconds = started.elapsed().as_secs_f64();
            times.render_s += seconds;
            if before == 0 {
                times.first_pass_s = seconds;
            }
            pass_s = seconds / f64::from((after - before).max(1));
            if self.args.snapshots && after > before && after.is_power_of_two() {
                let paths: Vec<PathBuf> = self
                    .targets
                    .pictures
                    .iter()
                    .map(|path| outputs::snapshot(path, after))
                    .collect();
                let interrupted = self.interrupt.asked();
                let about = Stats::new(self.path, settings, renderer, *times, interrupted);
                self.write(renderer, &paths, &about.attributes(self.args.exposure), times, errors);
            }
            // A block that was cut short is the last: sums are only the same for all if blocks end where all do.
            if after < stop {
                break;
            }
        }
    }

    /// Writes the picture as it stands to each path; returns those that stand.
    fn write(
        &self,
        renderer: &Renderer,
        paths: &[PathBuf],
        attributes: &Attributes,
        times: &mut Times,
        errors: &mut Vec<CliError>,
    ) -> Vec<PathBuf> {
        let started = Instant::now();
        let picture = renderer.picture();
        let mut written = Vec::new();
        for path in paths {
            match write_picture(path, &picture, attributes) {
                Ok(()) => written.push(path.clone()),
                Err(error) => errors.push(error.into()),
            }
        }
        times.write_s += started.elapsed().as_secs_f64();
        written
    }

    /// Says what was done: figures for programs, a summary and warnings for people.
    fn tell(&self, stats: &Stats, written: &[PathBuf]) -> Result<(), CliError> {
        if let Some(path) = &self.targets.stats {
            stats.write(path)?;
        }
        if self.args.json {
            report::data(&stats.json()?)?;
        }
        if self.args.quiet {
            return Ok(());
        }
        let invalid = stats.invalid_samples;
        if invalid.total() > 0 {
            report::warning(&format!(
                "{}: {} contributions were thrown away ({} NaN, {} infinite, {} negative): the picture may be too dark",
                stats.scene,
                invalid.total(),
                invalid.nan,
                invalid.inf,
                invalid.negative
            ));
        }
        if !self.args.json {
            let files: Vec<String> = written.iter().map(|path| path.display().to_string()).collect();
            let files = if files.is_empty() {
                "nothing".to_owned()
            } else {
                files.join(", ")
            };
            report::print(&format!("{}\nwrote {files}\n", stats.summary()));
        }
        Ok(())
    }
}
