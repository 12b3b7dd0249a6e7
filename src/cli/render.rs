//! `octolux render`: renders scenes to pictures.

use std::path::PathBuf;
use std::time::Duration;

use super::interrupt::Interrupt;
use super::options::{self, Options};
use super::outputs::{self, is_sums};
use super::picture::Job;
use super::request::Request;
use super::several::BatchScheduler;
use super::tev::HOME;
use super::{CliError, Exit, patterns, replay, report, units};
use octolux::pipeline::all_threads;
use octolux::run::{RenderOptions, Shard};
use octolux::scene::Effects;

const EXAMPLES: &str = "\
Examples:
  octolux render scene.toml
      writes scene.exr and scene.png into the working directory
  octolux render scene.toml -o a.exr -o a.npy --time 5
      writes these two instead, after 5 seconds of rendering
  octolux render scene.toml --target-error 0.01
      renders until the noise is 1 % of the picture's mean
  octolux render scene.toml --target-error 1% --time 10m
      the same, for ten minutes at most; says which error was reached
  octolux render a.toml b.toml -o 'out/{name}.png'
      writes out/a.png and out/b.png; one bad scene does not stop the others
  octolux render scene.toml --json --quiet | jq .rays_per_s
      prints one figure of the render
  octolux render scene.toml --spp 65536 --checkpoint scene.state --resume
      loses no more than a minute whatever happens, and goes on when it is
      started again; the picture has the same bits as without a break
  octolux render scene.toml --spp 256 --checkpoint scene.state --keep --resume
      adds samples to a render of fewer that kept its state
  octolux render scene.toml --spp 4096 --shard 2/7 -o part-2.acc
      renders the second seventh; `octolux merge` adds up the parts

Ctrl-c stops early and writes what is rendered (exit code 130); a second one
exits at once, writes nothing and leaves older pictures as they were.";

/// Render scenes to pictures
#[derive(clap::Args, Clone, Debug)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Scene files, or patterns such as 'scenes/*.toml'. Several small ones are rendered side by side, a thread each; with --threads
    /// they come in turn
    #[arg(required = true, value_name = "SCENE")]
    pub scenes: Vec<PathBuf>,
    /// A picture to write, .exr, .png or .npy by its ending, or its sums for `octolux merge`, .acc; may be repeated. {name}
    /// stands for the scene's name, and has to be there with several scenes [default: {name}.exr and {name}.png]
    #[arg(short, long = "output", value_name = "FILE")]
    pub outputs: Vec<PathBuf>,
    /// Samples a pixel, at least 1 [default: the scene's, else 64]
    #[arg(long, value_name = "N", value_parser = options::spp, conflicts_with = "time", allow_negative_numbers = true)]
    pub spp: Option<u32>,
    /// Render for so long instead (loading and writing aside), such as 10, 10s or 1m30s; at least one sample a pixel
    #[arg(long, value_name = "TIME", value_parser = units::time, allow_negative_numbers = true)]
    pub time: Option<f64>,
    /// Render until the root-mean-square noise of the pixels, divided by the picture's mean, is at most E: 0.01 or 1%. Renders at
    /// least eight pictures with different seeds, estimates the noise from their differences, and writes their mean. Each half
    /// of the pictures decides when the other half has enough samples, so that the mean stays unbiased. With --time it ends at
    /// the latest after this time, and says which error it has; with --checkpoint it can go on later, to another E too
    #[arg(long, value_name = "E", value_parser = units::error, allow_negative_numbers = true,
          conflicts_with_all = ["spp", "snapshots", "shard"])]
    pub target_error: Option<f64>,
    /// After a short trial render, give more of the same total number of samples to pixels with a large relative error: from a
    /// quarter of --spp to 64 times as many. For product, mis and light; uniform and brdf on small lights are too noisy for it. The .exr
    /// holds the samples of each pixel (samples.N). Changes nothing up to 8 samples a pixel. With --target-error each picture is
    /// rendered so
    #[arg(long, conflicts_with = "snapshots")]
    pub adaptive: bool,
    #[command(flatten)]
    pub options: Options,
    /// Also write each picture after 1, 2, 4, 8, ... samples a pixel, as NAME_0001spp.png and so on
    #[arg(long)]
    pub snapshots: bool,
    /// Brighten the PNG by so many stops, each twice as bright; .exr and .npy stay as they are
    #[arg(long, value_name = "STOPS", default_value = "0", value_parser = options::stops, allow_negative_numbers = true)]
    pub exposure: f64,
    /// Write the figures of the render (settings, times, rays) to this .json file; {name} as above
    #[arg(long, value_name = "FILE")]
    pub stats: Option<PathBuf>,
    /// Print the same figures on standard output, one line a scene
    #[arg(long)]
    pub json: bool,
    /// Keep the state of the render in this file, {name} as above, and remove it when the pictures are written (see --keep)
    #[arg(long, value_name = "FILE")]
    pub checkpoint: Option<PathBuf>,
    /// How often: 30s, 5m, 1h
    #[arg(long, value_name = "TIME", default_value = "60s", value_parser = units::time, requires = "checkpoint", allow_negative_numbers = true)]
    pub every: f64,
    /// Keep the checkpoint when the pictures are written: --resume with more --spp adds samples to the finished render
    #[arg(long, requires = "checkpoint")]
    pub keep: bool,
    /// Go on from the checkpoint, to more samples than before if --spp says so; begin anew where there is none
    #[arg(long, requires = "checkpoint")]
    pub resume: bool,
    /// Render a part of the passes, the I-th of N, and write its sums to the one output, which ends in .acc
    #[arg(long, value_name = "I/N", allow_hyphen_values = true, conflicts_with_all = ["time", "adaptive", "snapshots"])]
    pub shard: Option<Shard>,
    /// Print one sample step by step instead of rendering: its camera ray and hit, and for each light the cone, the direction, its
    /// density, its unblocked contribution, and what blocks it. With --json as one object. Pixels and passes count from 0
    #[arg(long, value_name = "X,Y,PASS", value_parser = replay::sample, allow_hyphen_values = true,
          conflicts_with_all = ["outputs", "spp", "time", "adaptive", "snapshots", "stats", "checkpoint", "shard"])]
    pub replay: Option<[u32; 3]>,
    /// Also show the picture in the viewer tev while it is rendered, at 127.0.0.1:14158 unless HOST:PORT is given. Without tev the
    /// render goes on with a warning
    #[arg(long, value_name = "HOST:PORT", num_args = 0..=1, require_equals = true, default_missing_value = HOME)]
    pub tev: Option<String>,
    /// Say nothing but errors
    #[arg(short, long)]
    pub quiet: bool,
}

impl Args {
    /// Checks combinations of options that the parser does not check.
    ///
    /// # Errors
    /// Two options that exclude each other.
    pub fn combined(&self) -> Result<(), CliError> {
        let with_time = [
            ("--adaptive", self.adaptive),
            ("--checkpoint", self.checkpoint.is_some()),
        ];
        let alone = with_time.into_iter().find(|(_, given)| *given);
        if let Some((option, _)) = alone.filter(|_| self.time.is_some() && self.target_error.is_none()) {
            let what = format!("{option} cannot be used with --time, unless --target-error is given");
            return Err(
                CliError::usage(what).with_help("say how many samples with --spp, or which error with --target-error")
            );
        }
        if self.target_error.is_some() && self.outputs.iter().any(|path| is_sums(path)) {
            let what = "--target-error renders several pictures, and .acc holds the sums of one";
            return Err(CliError::usage(what).with_help("write .exr, .png or .npy, or say how many samples with --spp"));
        }
        if self.shard.is_some() && (self.outputs.len() != 1 || !is_sums(&self.outputs[0])) {
            let what = "--shard writes sums, and needs one output that ends in .acc";
            return Err(
                CliError::usage(what).with_help("such as -o part-3.acc; octolux merge makes a picture of the parts")
            );
        }
        Ok(())
    }

    /// The request for each scene, with its output files.
    pub fn requests(&self, targets: Vec<outputs::Targets>) -> Vec<Request> {
        let options = RenderOptions {
            adaptive: self.adaptive,
            time: self.time.map(Duration::from_secs_f64),
            target_error: self.target_error,
            ..self.options.render_options()
        };
        let request = |(scene, targets): (&PathBuf, outputs::Targets)| Request {
            scene: scene.clone(),
            reading: self.options.reading,
            options,
            spp: self.spp,
            shard: self.shard,
            hold: Effects::of(&self.options.hold),
            targets,
            snapshots: self.snapshots,
            exposure: self.exposure,
            every: Duration::from_secs_f64(self.every),
            resume: self.resume,
            keep: self.keep,
            tev: self.tev.clone(),
            json: self.json,
            quiet: self.quiet,
        };
        self.scenes.iter().zip(targets).map(request).collect()
    }
}

/// Renders every scene; the errors of each are reported as they occur.
///
/// # Errors
/// Only errors that concern all scenes: files that could not be written.
pub fn run(args: &Args) -> Result<Exit, CliError> {
    if let Some(sample) = args.replay {
        return match &args.scenes[..] {
            [path] => replay::run(path, &args.options, sample, args.json),
            _ => Err(CliError::usage("--replay takes one scene".to_owned())),
        };
    }
    args.combined()?;
    let args = &Args {
        scenes: patterns::expand(&args.scenes)?,
        ..args.clone()
    };
    let targets = outputs::plan(
        &args.scenes,
        &args.outputs,
        args.stats.as_deref(),
        args.checkpoint.as_deref(),
        args.snapshots,
    )?;
    let interrupt = Interrupt::listen(args.quiet)?;
    let requests = args.requests(targets);
    if requests.len() > 1 && args.options.threads.is_none() {
        let crowd = BatchScheduler {
            name: "render",
            threads: all_threads(),
            quiet: args.quiet,
            interrupt: &interrupt,
            done: None,
            again: true,
        };
        return Ok(crowd.render(requests));
    }
    let mut exit = Exit::Well;
    for request in &requests {
        if interrupt.asked() {
            break;
        }
        let job = Job {
            request,
            interrupt: &interrupt,
            overall: None,
        };
        for error in job.run().errors {
            report::error(&error);
            exit = exit.and(error.exit());
        }
    }
    Ok(if interrupt.asked() { Exit::Interrupted } else { exit })
}
