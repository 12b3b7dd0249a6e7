//! `octolux info`: the metadata of pictures and sums.

use std::fs::{self, File};
use std::io::BufReader;
use std::path::{Path, PathBuf};

use exr::meta::header::Header;
use exr::prelude::{AttributeValue, MetaData};
use npyz::NpyFile;
use serde_json::{Map, Value, json};

use super::{CliError, Exit, report};
use octolux::film::sums_file;
use octolux::run::Saved;

const EXAMPLES: &str = "\
Examples:
  octolux info veach-mis.exr
      size, channels, and the settings that made it
  octolux info parts/*.acc --json | jq .passes
      one object a file";

/// Describe pictures, checkpoints and parts of renders
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Pictures (.exr, .npy, .png), checkpoints, or sums (.acc)
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// Print one JSON object a file instead
    #[arg(long)]
    json: bool,
}

/// Names with their values, in output order.
type Facts = Vec<(String, Value)>;

/// Prints the contents of each file on standard output; errors of each are reported as they occur.
///
/// # Errors
/// Errors of standard output.
pub fn run(args: &Args) -> Result<Exit, CliError> {
    let mut exit = Exit::Well;
    for path in &args.files {
        match facts(path) {
            Ok(facts) if args.json => report::data(&Value::Object(Map::from_iter(facts)).to_string())?,
            Ok(facts) => report::data(&text(&facts))?,
            Err(error) => {
                report::error(&error);
                exit = exit.and(error.exit());
            }
        }
    }
    Ok(exit)
}

fn facts(path: &Path) -> Result<Facts, CliError> {
    let unreadable = |error: std::io::Error| {
        CliError::usage(format!("{}: cannot be read: {error}", path.display())).with_help("check the name")
    };
    let found = fs::metadata(path).map_err(unreadable)?;
    if found.is_dir() {
        return Err(CliError::usage(format!("{}: is a folder, not a file", path.display())));
    }
    let mut facts = Facts::new();
    put(&mut facts, "file", path.display().to_string());
    let ending = path.extension().map(|ending| ending.to_ascii_lowercase());
    match ending.as_deref().and_then(|ending| ending.to_str()) {
        _ if sums_file::is_one(path) => sums(path, &mut facts)?,
        Some("exr") => exr(path, &mut facts)?,
        Some("npy") => npy(path, &mut facts)?,
        Some("png") => png(path, &mut facts)?,
        _ => {
            let what = format!("{}: is no picture and no sums of Octolux", path.display());
            return Err(CliError::usage(what).with_help("give a .exr, .npy or .png, a checkpoint, or a .acc"));
        }
    }
    put(&mut facts, "bytes", found.len());
    Ok(facts)
}

fn put(facts: &mut Facts, name: &str, value: impl Into<Value>) {
    let value = value.into();
    match facts.iter_mut().find(|(known, _)| known == name) {
        Some((_, known)) => *known = value,
        None => facts.push((name.to_owned(), value)),
    }
}

fn size(facts: &mut Facts, width: u64, height: u64) {
    put(facts, "width", width);
    put(facts, "height", height);
}

fn broken(path: &Path, kind: &str, error: impl std::fmt::Display) -> CliError {
    CliError::usage(format!("{}: is not a whole {kind} picture: {error}", path.display()))
}

fn exr(path: &Path, facts: &mut Facts) -> Result<(), CliError> {
    let meta = MetaData::read_from_file(path, false).map_err(|error| broken(path, "EXR", error))?;
    put(facts, "format", "OpenEXR, linear radiance");
    if let [header] = &meta.headers[..] {
        part(header, "", facts);
        return Ok(());
    }
    put(facts, "parts", meta.headers.len());
    for (number, header) in (1..).zip(&meta.headers) {
        let name = header.own_attributes.layer_name.as_ref();
        let name = name.map_or_else(|| format!("part {number}"), ToString::to_string);
        part(header, &format!("{name}: "), facts);
    }
    Ok(())
}

/// Facts of one part of an EXR file, each behind `of`.
fn part(header: &Header, of: &str, facts: &mut Facts) {
    let mut put = |name: &str, value: Value| put(facts, &format!("{of}{name}"), value);
    put("width", header.layer_size.0.into());
    put("height", header.layer_size.1.into());
    let channels = header.channels.list.iter();
    let channels = channels.map(|channel| format!("{} {}", channel.name, kind(channel.sample_type)));
    put("channels", channels.collect::<Vec<_>>().join(", ").into());
    put("compression", header.compression.to_string().into());
    let own = &header.own_attributes;
    if let Some(software) = &own.software_name {
        put("software", software.to_string().into());
    }
    let mut others: Vec<_> = header.shared_attributes.other.iter().chain(&own.other).collect();
    others.sort_by_key(|(name, _)| name.to_string());
    for (name, value) in others {
        let name = name.to_string();
        put(name.strip_prefix("octolux.").unwrap_or(&name), attribute(value));
    }
}

fn kind(of: exr::meta::attribute::SampleType) -> &'static str {
    match of {
        exr::meta::attribute::SampleType::F16 => "f16",
        exr::meta::attribute::SampleType::F32 => "f32",
        exr::meta::attribute::SampleType::U32 => "u32",
    }
}

fn attribute(value: &AttributeValue) -> Value {
    match value {
        AttributeValue::Text(text) => text.to_string().into(),
        AttributeValue::I32(number) => (*number).into(),
        AttributeValue::F32(number) => (*number).into(),
        AttributeValue::F64(number) => (*number).into(),
        other => format!("{other:?}").into(),
    }
}

fn npy(path: &Path, facts: &mut Facts) -> Result<(), CliError> {
    let file = File::open(path).map_err(|error| broken(path, "NPY", error))?;
    let array = NpyFile::new(BufReader::new(file)).map_err(|error| broken(path, "NPY", error))?;
    put(facts, "format", format!("NumPy array of {}", array.dtype().descr()));
    match array.shape() {
        &[height, width, 3] => size(facts, width, height),
        shape => put(facts, "shape", json!(shape)),
    }
    Ok(())
}

fn png(path: &Path, facts: &mut Facts) -> Result<(), CliError> {
    let (width, height) = image::image_dimensions(path).map_err(|error| broken(path, "PNG", error))?;
    put(facts, "format", "PNG, tone-mapped: to look at");
    size(facts, width.into(), height.into());
    Ok(())
}

fn sums(path: &Path, facts: &mut Facts) -> Result<(), CliError> {
    let Saved { record, film, .. } = Saved::read(path).map_err(|error| CliError::bad_path(&error))?;
    put(facts, "format", "sums of Octolux, whole");
    put(
        facts,
        "passes",
        format!("{} to {}", record.passes.start, record.passes.end),
    );
    put(facts, "spp", record.spp);
    match &record.replicates {
        Some(replicates) => {
            put(facts, "format", "checkpoint of a render to a --target-error, whole");
            put(facts, "pictures", replicates.levels.len());
            facts.retain(|(name, _)| name != "passes" && name != "spp");
        }
        None if record.passes.is_empty() => put(facts, "passes", "none: there are more shards than parts"),
        None => {
            let done = film.passes();
            if !film.has_all(&record.passes) {
                put(facts, "format", "checkpoint of a render, whole");
                put(facts, "done", format!("{} to {}", done.start, done.end));
            }
        }
    }
    if let Some(shard) = record.shard {
        put(facts, "shard", format!("{}/{}", shard.number, shard.of));
    }
    for (name, value) in &record.identity {
        put(facts, name, value.as_str());
    }
    put(facts, "samples", record.counters.samples);
    put(facts, "render_s", record.render_s);
    put(facts, "cpu", record.cpu.as_str());
    Ok(())
}

fn text(facts: &Facts) -> String {
    let widest = facts.iter().map(|(name, _)| name.chars().count()).max().unwrap_or(0);
    let value = |value: &Value| value.as_str().map_or_else(|| value.to_string(), str::to_owned);
    let lines = facts.iter().map(|(name, it)| format!("{name:<widest$}  {}", value(it)));
    lines.collect::<Vec<_>>().join("\n")
}
