//! `octolux shards`: which shards of a render exist.

use std::collections::BTreeMap;
use std::path::PathBuf;

use super::merge::same_render;
use super::outputs::is_sums;
use super::{CliError, Exit, report, units};
use octolux::film::sums_file;
use octolux::run::Record;
use octolux::study::verify::sanity::plural;

const EXAMPLES: &str = "\
Examples:
  octolux shards parts --of 64
      one line for each shard that is there
  sbatch --array=$(octolux shards parts --of 64 --missing) job.sh
      renders those that are not";

/// No scheduler takes more jobs.
const MOST_SHARDS: u64 = 1_000_000;

/// List which shards of a render exist, and which are missing
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// The folder with the parts (.acc)
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// Into how many shards the render was divided, 1 to 1000000
    #[arg(long, value_name = "N", value_parser = units::whole::<u32>("shards are", 1..=MOST_SHARDS), allow_negative_numbers = true)]
    of: u32,
    /// Print the numbers of those that are missing or damaged instead, as 2,5,6; nothing if there are none
    #[arg(long)]
    missing: bool,
}

/// Prints the shards on standard output, problems with files on standard error.
///
/// # Errors
/// A folder that cannot be read.
pub fn run(args: &Args) -> Result<Exit, CliError> {
    let unreadable = |error: std::io::Error| {
        let what = format!("{}: cannot be listed: {error}", args.folder.display());
        CliError::usage(what).with_help("name the folder that the parts were written into")
    };
    let entries = std::fs::read_dir(&args.folder).map_err(unreadable)?;
    let mut paths: Vec<PathBuf> = entries
        .flatten()
        .map(|entry| entry.path())
        .filter(|path| is_sums(path))
        .collect();
    paths.sort();
    let mut first: Option<(PathBuf, Record)> = None;
    let mut found = BTreeMap::new();
    for path in paths {
        let record = match sums_file::read_about::<Record>(&path) {
            Ok((record, _)) => record,
            Err(error) => {
                report::warning(&error.to_string());
                continue;
            }
        };
        let (first_path, first) = first.get_or_insert_with(|| (path.clone(), record.clone()));
        if let Err(error) = same_render((first_path, first), (&path, &record), true) {
            report::warning(&error.to_string());
            continue;
        }
        match record.shard {
            Some(shard) if shard.of == args.of => _ = found.insert(shard.number, (path, record)),
            _ => report::warning(&format!(
                "{}: is not one of {}",
                path.display(),
                plural(args.of as usize, "shard")
            )),
        }
    }
    if args.missing {
        let missing = (1..=args.of).filter(|number| !found.contains_key(number));
        let missing: Vec<String> = missing.map(|number| number.to_string()).collect();
        if !missing.is_empty() {
            report::data(&missing.join(","))?;
        }
        return Ok(Exit::Well);
    }
    for number in 1..=args.of {
        let line = match found.get(&number) {
            Some((path, record)) => {
                let passes = &record.passes;
                format!(
                    "{number}/{} passes {} to {} {}",
                    args.of,
                    passes.start,
                    passes.end,
                    path.display()
                )
            }
            None => format!("{number}/{} missing", args.of),
        };
        report::data(&line)?;
    }
    Ok(Exit::Well)
}
