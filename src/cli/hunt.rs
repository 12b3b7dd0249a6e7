//! `octolux hunt`: random scenes, and properties that must hold for all of them. Hidden, for developers of Octolux.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use super::interrupt::Interrupt;
use super::{CliError, Exit, report};
use octolux::film::replace;
use octolux::study::hunt::draw::Kind;
use octolux::study::hunt::{Bag, Catch, FALSE_ALARMS, Options, hunt, recipe};

/// Look for faults in random scenes; what fails is written as a small scene
#[derive(clap::Args)]
pub struct Args {
    /// How many scenes
    #[arg(long, value_name = "N", default_value_t = 60)]
    scenes: u64,
    /// The number of the first
    #[arg(long, value_name = "N", default_value_t = 0)]
    first: u64,
    /// Seed of all scenes
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// Scenes over many orders of magnitude, of which means say nothing
    #[arg(long)]
    wild: bool,
    /// A folder for the scenes that fail; it is made where there is none
    #[arg(short, long = "output", value_name = "DIR")]
    output: PathBuf,
}

/// Hunts, and reports on standard output.
///
/// # Errors
/// Files that cannot be written; renders that cannot start.
pub fn run(args: &Args) -> Result<Exit, CliError> {
    let folder = &args.output;
    fs::create_dir_all(folder).map_err(|error| CliError::usage(format!("{}: {error}", folder.display())))?;
    recipe::write_pictures(folder)?;
    let interrupt = Interrupt::listen(true)?;
    let options = Options {
        kind: if args.wild { Kind::Wild } else { Kind::Ordinary },
        seed: args.seed,
        first: args.first,
        scenes: args.scenes,
    };
    let mut trouble = None;
    let heard = |number: u64, caught: Option<&Catch>| {
        if let Some(caught) = caught {
            let told = write(folder, args, caught).and_then(|path| report::data(&text(&path, caught)));
            trouble = told.err();
        }
        if (number + 1 - args.first).is_multiple_of(100) {
            report::note(&format!("{} scenes", number + 1 - args.first));
        }
        trouble.is_none() && !interrupt.asked()
    };
    let outcome = hunt(&options, folder, heard);
    if let Some(error) = trouble {
        return Err(error);
    }
    let Bag { scenes, none, catches } = outcome.map_err(|error| CliError::failed(error.to_string()))?;
    let all = catches.len();
    report::data(&format!(
        "{scenes} scenes, {none} drafts that were no valid scenes, {all} with faults; false alarms of means: {FALSE_ALARMS:e} for all scenes together"
    ))?;
    if interrupt.asked() {
        return Ok(Exit::Interrupted);
    }
    Ok(if all > 0 { Exit::Failed } else { Exit::Well })
}

/// Writes the original and the reduced scene; returns the path of the reduced one.
fn write(folder: &Path, args: &Args, caught: &Catch) -> Result<PathBuf, CliError> {
    let stem = format!(
        "{}{}-{}",
        if args.wild { "wild-" } else { "" },
        args.seed,
        caught.number
    );
    let small = folder.join(format!("{stem}-small.toml"));
    let faults: String = caught
        .faults
        .iter()
        .map(|fault| format!("# {}: {}\n", fault.rule, fault.what))
        .collect();
    for (path, recipe) in [
        (folder.join(format!("{stem}.toml")), &caught.recipe),
        (small.clone(), &caught.small),
    ] {
        let text = faults.clone() + &recipe.toml(1.0);
        replace::replace(&path, |file| file.write_all(text.as_bytes()))?;
    }
    Ok(small)
}

fn text(path: &Path, caught: &Catch) -> String {
    let faults = caught
        .faults
        .iter()
        .map(|fault| format!("  {}: {}", fault.rule, fault.what));
    let head = format!("{}: {} shapes", path.display(), caught.small.size());
    std::iter::once(head).chain(faults).collect::<Vec<_>>().join("\n")
}
