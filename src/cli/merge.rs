//! `octolux merge`: combines the sums of shards into one picture.

use std::path::{Path, PathBuf};

use super::inputs::{Inputs, keeps_checkpoints};
use super::names::were;
use super::{CliError, Exit, report};
use super::{options, outputs};
use octolux::film::{Film, check_output, sums_file, write_picture};
use octolux::run::{Record, Shard};
use octolux::study::verify::sanity::plural;

const EXAMPLES: &str = "\
Examples:
  octolux merge parts/*.acc -o picture.exr
      the picture that a render in one piece would have written, to the bit
  octolux merge parts/*.acc -o so-far.png --partial
      what there is of it";

/// Add up the parts that shards of one render have written
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Files that render wrote by --shard or -o FILE.acc, in any order
    #[arg(required = true, value_name = "PART")]
    parts: Vec<PathBuf>,
    /// A picture to write, .exr, .png or .npy by its ending; may be repeated
    #[arg(short, long = "output", value_name = "FILE", required = true)]
    outputs: Vec<PathBuf>,
    /// Merge even if parts are missing; the picture then has fewer samples
    #[arg(long)]
    partial: bool,
    /// Brighten the PNG by so many stops, each twice as bright
    #[arg(long, value_name = "STOPS", default_value = "0", value_parser = options::stops, allow_negative_numbers = true)]
    exposure: f64,
    /// Accept parts computed with different versions of Embree; the last bits of the picture then depend on which version computed
    /// which part
    #[arg(long)]
    any_embree: bool,
    /// Say nothing but errors
    #[arg(short, long)]
    quiet: bool,
}

/// A part whose file was checked.
#[derive(Clone)]
struct Part {
    path: PathBuf,
    record: Record,
    /// CRC of its sums.
    crc: u32,
}

/// Adds up the parts and writes the pictures.
///
/// # Errors
/// Parts that are damaged, do not belong together, overlap or are missing; pictures that cannot be written.
pub fn run(args: &Args) -> Result<Exit, CliError> {
    let parts = Inputs::of("merge", args.parts.iter().cloned());
    parts.are_kept_by(args.outputs.iter().map(PathBuf::as_path))?;
    for path in &args.outputs {
        outputs::without_placeholder(path)?;
        check_output(path).map_err(|error| CliError::bad_path(&error))?;
        keeps_checkpoints(path)?;
    }
    let parts = in_order(args)?;
    let mut film: Option<Film> = None;
    // One after the other: memory only holds the sums so far and those of one part.
    for part in &parts {
        let (_, sums): (Record, Film) = sums_file::read(&part.path).map_err(|error| CliError::bad_path(&error))?;
        if !sums.has_all(&part.record.passes) && !part.record.passes.is_empty() {
            let what = format!(
                "{}: is the checkpoint of a render that was not finished",
                part.path.display()
            );
            return Err(CliError::usage(what).with_help("finish it with --resume"));
        }
        match &mut film {
            Some(film) => film.absorb(sums),
            None => film = Some(sums),
        }
    }
    let (Some(film), Some(first)) = (film, parts.first()) else {
        return Err(CliError::usage("there is nothing to merge"));
    };
    let (least, total, _) = film.spread();
    let pixels = u64::from(film.size().width) * u64::from(film.size().height);
    let record = &first.record;
    let adaptive = film.most_samples().is_some();
    let spp = if adaptive {
        (total as f64 / pixels as f64).round() as u32
    } else {
        least
    };
    let mut attributes = record.attributes(spp, args.exposure);
    if adaptive {
        attributes.samples = Some(film.samples());
    }
    let picture = film.picture();
    for path in &args.outputs {
        write_picture(path, &picture, &attributes)?;
    }
    if !args.quiet {
        tell(args, &parts, spp);
    }
    Ok(Exit::Well)
}

/// The parts ordered by passes, without duplicates.
fn in_order(args: &Args) -> Result<Vec<Part>, CliError> {
    let mut parts: Vec<Part> = Vec::new();
    for path in &args.parts {
        let (record, crc): (Record, u32) = sums_file::read_about(path).map_err(|error| CliError::bad_path(&error))?;
        if record.replicates.is_some() {
            let what = format!("{}: is the checkpoint of a render to a --target-error", path.display());
            return Err(CliError::usage(what).with_help("finish it with --resume, which writes its picture"));
        }
        if let Some(first) = parts.first() {
            let help = "merge the parts of one render at a time; --any-embree takes other versions of Embree";
            let same = same_render((&first.path, &first.record), (path, &record), args.any_embree);
            same.map_err(|error| error.with_help(help))?;
        }
        let path = path.clone();
        parts.push(Part { path, record, crc });
    }
    // With more shards than leaves, some are empty. If all are, one of them represents the render.
    let nothing = |part: &Part| part.record.passes.is_empty();
    if !parts.iter().all(nothing) {
        parts.retain(|part| !nothing(part));
    }
    parts.sort_by_key(|part| (part.record.passes.start, part.record.passes.end));
    let all = parts.clone();
    let mut kept: Vec<Part> = Vec::new();
    let (mut end, mut repeated) = (0, 0);
    for part in parts {
        let passes = part.record.passes.clone();
        if let Some(before) = kept.last()
            && (passes.start < end || passes == before.record.passes)
        {
            if passes == before.record.passes && part.crc == before.crc {
                repeated += 1;
                continue;
            }
            return Err(overlap(before, &part));
        }
        if passes.start > end {
            missing(args, &all, end..passes.start)?;
        }
        end = passes.end;
        kept.push(part);
    }
    let spp = kept.first().map_or(0, |part| part.record.spp);
    if end < spp && kept.iter().any(|part| !part.record.is_adaptive()) {
        missing(args, &all, end..spp)?;
    }
    if repeated > 0 && !args.quiet {
        report::note(&format!(
            "{} left out: the same part twice counts once",
            were(repeated, "repeated file")
        ));
    }
    Ok(kept)
}

fn overlap(one: &Part, other: &Part) -> CliError {
    let passes = |part: &Part| format!("{} to {}", part.record.passes.start, part.record.passes.end);
    let what = format!(
        "{} holds passes {}, {} holds {}: some would count twice",
        one.path.display(),
        passes(one),
        other.path.display(),
        passes(other)
    );
    CliError::usage(what).with_help("merge the shards of one division: 1/N to N/N")
}

/// An error about passes that no part contains, unless they may be missing; names the missing shards if the parts are shards.
fn missing(args: &Args, parts: &[Part], passes: std::ops::Range<u32>) -> Result<(), CliError> {
    if args.partial {
        return Ok(());
    }
    let shards: Vec<Shard> = parts.iter().filter_map(|part| part.record.shard).collect();
    let of = shards.first().map_or(0, |shard| shard.of);
    let is_there = |number: &u32| shards.iter().any(|shard| shard.number == *number);
    let numbers: Vec<String> = (1..=of)
        .filter(|number| !is_there(number))
        .map(|number| number.to_string())
        .collect();
    let span = format!("passes {} to {}", passes.start, passes.end - 1);
    let what = match &numbers[..] {
        [] => format!("no part holds {span}"),
        [number] => format!("shard {number} of {of} ({span}) is missing"),
        numbers => format!(
            "shards {} of {of} are missing, the first with {span}",
            numbers.join(", ")
        ),
    };
    Err(CliError::usage(what).with_help("octolux shards DIR --of N --missing names them; --partial does without"))
}

fn tell(args: &Args, parts: &[Part], spp: u32) {
    let first = &parts[0].record;
    let others = parts.iter().map(|part| &part.record.cpu).find(|cpu| **cpu != first.cpu);
    if let Some(other) = others
        && first.through_embree()
    {
        report::note(&format!(
            "parts come from different processors ({} and {other}), and the last bits of Embree may differ between these",
            first.cpu
        ));
    }
    let counters = parts
        .iter()
        .fold(Default::default(), |mut sum: octolux::pipeline::Counters, part| {
            sum += part.record.counters;
            sum
        });
    let invalid = counters.invalid_nan + counters.invalid_inf + counters.invalid_negative;
    if invalid > 0 {
        report::warning(&format!(
            "{} rejected: the picture may be too dark",
            were(invalid, "contribution")
        ));
    }
    let seconds: f64 = parts.iter().map(|part| part.record.render_s).sum();
    let names: Vec<_> = args.outputs.iter().map(|path| path.display().to_string()).collect();
    report::print(&format!(
        "{}, {spp} spp, {seconds:.2} s of rendering together\nwrote {}\n",
        plural(parts.len(), "part"),
        names.join(", ")
    ));
}

/// Checks that the second part belongs to the render of the first.
///
/// # Errors
/// The difference.
pub fn same_render(first: (&Path, &Record), other: (&Path, &Record), any_embree: bool) -> Result<(), CliError> {
    match first.1.difference(other.1, any_embree) {
        None => Ok(()),
        Some(difference) => {
            let (path, first) = (other.0.display(), first.0.display());
            let what = format!("{path}: belongs to another render than {first}: {difference}");
            Err(CliError::usage(what))
        }
    }
}
