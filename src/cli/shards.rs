//! `octolux shards`: which shards of a render exist.

use std::path::PathBuf;

use super::merge::same_render;
use super::outputs::is_sums;
use super::{CliError, Exit, report};
use octolux::film::sums_file;
use octolux::run::Record;

const EXAMPLES: &str = "\
Examples:
  octolux shards parts --of 64
      one line for each shard that is there
  sbatch --array=$(octolux shards parts --of 64 --missing) job.sh
      renders those that are not";

/// List which shards of a render exist, and which are missing
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// The folder with the parts (.acc)
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// Into how many shards the render was divided
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
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
    let unreadable = |error: std::io::Error| CliError::usage(format!("{}: {error}", args.folder.display()));
    let entries = std::fs::read_dir(&args.folder).map_err(unreadable)?;
    let mut paths: Vec<PathBuf> = entries
        .flatten()
        .map(|entry| entry.path())
        .filter(|path| is_sums(path))
        .collect();
    paths.sort();
    let mut first: Option<Record> = None;
    let mut found = vec![None; args.of as usize];
    for path in paths {
        let record = match sums_file::read_about::<Record>(&path) {
            Ok((record, _)) => record,
            Err(error) => {
                report::warning(&error.to_string());
                continue;
            }
        };
        let first = first.get_or_insert_with(|| record.clone());
        if let Err(error) = same_render(first, &record, &path, true) {
            report::warning(&error.to_string());
            continue;
        }
        match record.shard {
            Some(shard) if shard.of == args.of => found[shard.number as usize - 1] = Some((path, record)),
            _ => report::warning(&format!("{}: is not one of {} shards", path.display(), args.of)),
        }
    }
    if args.missing {
        let missing = (1..).zip(&found).filter(|(_, part)| part.is_none());
        let missing: Vec<String> = missing.map(|(number, _): (u32, _)| number.to_string()).collect();
        if !missing.is_empty() {
            report::data(&missing.join(","))?;
        }
        return Ok(Exit::Well);
    }
    for (number, part) in (1_u32..).zip(&found) {
        let line = match part {
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
