//! `octolux batch`: renders the pictures of a manifest, small ones in parallel and large ones one after another.

use std::io::{self, IsTerminal as _};
use std::path::PathBuf;

use super::done::Done;
use super::interrupt::Interrupt;
use super::manifest;
use super::reading::LoadOptions;
use super::several::BatchScheduler;
use super::{CliError, Exit, leftovers, units};
use octolux::pipeline::all_threads;

const EXAMPLES: &str = "\
A manifest has the options of `octolux render` as keys:

  [defaults]
  spp     = 256
  outputs = [\"out/{name}.exr\"]

  [[pictures]]
  scenes = [\"a.toml\", \"b.toml\"]

  [[pictures]]
  scene   = \"b.toml\"
  size    = \"1920x1080\"
  outputs = [\"out/b-large.exr\", \"out/b-large.png\"]

Paths are relative to it; scenes may be patterns, such as \"scenes/*.toml\",
and folders of outputs are made. What is finished is noted in MANIFEST.done.jsonl;
run again, only what is missing or changed is rendered.";

/// Render those pictures of a manifest that do not exist yet
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// The manifest, a TOML file
    #[arg(value_name = "MANIFEST")]
    manifest: PathBuf,
    /// Also render pictures that already exist
    #[arg(long)]
    again: bool,
    /// Threads, 1 to 1024 [default: as many as the machine offers]
    #[arg(long, value_name = "N", value_parser = units::threads(), allow_negative_numbers = true)]
    threads: Option<usize>,
    #[command(flatten)]
    reading: LoadOptions,
    /// Print a line of JSON for each picture where standard output is a terminal too
    #[arg(long)]
    json: bool,
    /// No progress, and nothing but errors on standard error; the lines of JSON are still printed
    #[arg(short, long)]
    quiet: bool,
}

/// Renders the pictures of the manifest; the errors of each picture are reported as they occur.
///
/// # Errors
/// A manifest that cannot be read, and outputs that could not be written.
pub fn run(args: &Args) -> Result<Exit, CliError> {
    let exit = render(args);
    leftovers::remove_empty();
    exit
}

fn render(args: &Args) -> Result<Exit, CliError> {
    let mut pictures = manifest::read(&args.manifest)?;
    let interrupt = Interrupt::listen(args.quiet)?;
    let threads = args.threads.unwrap_or_else(all_threads);
    for one in &mut pictures {
        one.quiet = args.quiet;
        one.json = args.json || !io::stdout().is_terminal();
        if args.reading.allow_outside {
            one.reading.allow_outside = true;
        }
    }
    let crowd = BatchScheduler {
        name: "batch",
        threads,
        quiet: args.quiet,
        interrupt: &interrupt,
        done: Some(Done::open(&manifest::notes_beside(&args.manifest))?),
        again: args.again,
    };
    Ok(crowd.render(pictures))
}
