//! The command line: one module per subcommand.
//!
//! Standard output carries data, standard error everything else. Exit codes: 0 success, 2 bad usage or a bad scene, 1 any other
//! error, 130 interrupted.

mod batch;
mod budget_bar;
mod compare;
mod done;
mod error;
mod explain;
mod explain_effects;
mod hints;
mod hunt;
mod info;
mod inputs;
mod interrupt;
mod leftovers;
mod manifest;
mod merge;
mod names;
mod noise;
mod options;
mod outputs;
mod overall;
mod patterns;
mod picture;
mod progress;
mod reading;
mod reference;
mod render;
mod replay;
mod report;
mod request;
mod selftest;
mod several;
mod shards;
mod stats;
mod study;
mod tev;
mod units;
mod verify;
mod verify_report;
mod view;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

pub use error::{CliError, Exit};

use octolux::about;
use octolux::lane::AVX512;

const EXAMPLES: &str = "\
Examples:
  octolux render scenes/veach-mis.toml
      writes veach-mis.exr and veach-mis.png, 64 samples a pixel
  octolux render scenes/veach-mis.toml --time 10 -o a.exr
      takes as many samples as 10 seconds allow
  octolux explain scenes/veach-mis.toml
      says what the scene calls for, without rendering it
  octolux view scenes/veach-mis.toml
      shows the picture in the browser while it is rendered
  octolux verify scenes/veach-mis.toml
      proves in a minute that the renderer is right on this scene
  octolux study scenes/veach-mis.toml -o study
      shows in a minute what accuracy costs in time: study/study.html

Exit codes: 0 well, 2 bad usage or a bad scene, 1 anything else,
130 interrupted.";

/// Direct illumination in packets of rays.
#[derive(Parser)]
#[command(name = "octolux", version = about::VERSION_LINE.as_str(), after_help = EXAMPLES, max_term_width = 100)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Render scenes to pictures
    Render(render::Args),
    /// Show a picture in the browser while it is rendered, race estimators, open one sample
    View(view::Args),
    /// Render those pictures of a manifest that do not exist yet
    Batch(batch::Args),
    /// Add up the parts that shards of one render have written
    Merge(merge::Args),
    /// List which shards of a render exist, and which are missing
    Shards(shards::Args),
    /// Say what a scene contains and requires, and how it would be rendered
    Explain(explain::Args),
    /// Describe pictures, checkpoints and parts of renders
    Info(info::Args),
    /// Render with the independent f64 oracle: slow, one ray at a time
    Reference(reference::Args),
    /// Measure the error of one picture against another
    Compare(compare::Args),
    /// Check on a scene that lanes, threads, estimators and the oracle agree
    Verify(verify::Args),
    /// Measure the hard cases of direct illumination against their bounds
    Selftest(selftest::Args),
    /// Look for faults in random scenes; what fails is written as a small scene
    #[command(hide = true)]
    Hunt(hunt::Args),
    /// Show what accuracy costs in time: a page, every run, and the cheapest command line
    Study(study::Args),
}

/// Runs the command and returns its exit code.
pub fn main() -> ExitCode {
    // clap prints its own errors, to standard error with exit code 2 (help and version: standard output, 0).
    let parsed = Cli::try_parse().map_err(hints::with_hint);
    let command = parsed.unwrap_or_else(|error| error.exit()).command;
    let outcome = environment().and_then(|()| match command {
        Command::Render(args) => render::run(&args),
        Command::View(args) => view::run(&args),
        Command::Batch(args) => batch::run(&args),
        Command::Merge(args) => merge::run(&args),
        Command::Shards(args) => shards::run(&args),
        Command::Explain(args) => explain::run(&args),
        Command::Info(args) => info::run(&args),
        Command::Reference(args) => reference::run(&args),
        Command::Compare(args) => compare::run(&args),
        Command::Verify(args) => verify::run(&args),
        Command::Selftest(args) => selftest::run(&args),
        Command::Hunt(args) => hunt::run(&args),
        Command::Study(args) => study::run(&args),
    });
    match outcome {
        Ok(exit) => exit.into(),
        Err(error) => {
            report::error(&error);
            error.exit().into()
        }
    }
}

/// Checks that environment variables for kernels have valid values.
fn environment() -> Result<(), CliError> {
    match std::env::var_os(AVX512) {
        Some(value) if !["", "on", "off"].iter().any(|known| value == *known) => Err(CliError::usage(format!(
            "the environment variable {AVX512} is {value:?}"
        ))
        .with_help(format!("use {AVX512}=off to do without AVX-512, or leave it out"))),
        _ => Ok(()),
    }
}
