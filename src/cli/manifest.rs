//! The manifest of a batch: a TOML file with scenes, options and outputs.
//!
//! Its keys are the long options of `octolux render`, parsed by the same parser: a picture accepts what a command line accepts.

use std::path::{Path, PathBuf};

use clap::Parser;
use toml::{Table, Value};

use super::inputs::Inputs;
use super::options::switch;
use super::outputs;
use super::request::Request;
use super::{CliError, patterns, render};

/// Maximum size of a manifest in bytes.
const LONGEST: u64 = 16 << 20;

/// Keys that are not options of `render`.
const SCENES: [&str; 2] = ["scene", "scenes"];

/// Keys whose values are files, relative to the manifest.
const FILES: [&str; 3] = ["outputs", "stats", "checkpoint"];

/// On/off options, for which TOML booleans are accepted.
const SWITCHES: [&str; 2] = ["robust", "cull"];

/// Options that apply to the whole batch.
const NOT_HERE: [&str; 4] = ["json", "quiet", "threads", "output"];

#[derive(Parser)]
#[command(no_binary_name = true)]
struct Line {
    #[command(flatten)]
    args: render::Args,
}

/// The pictures of the manifest at `path`, in its order.
///
/// # Errors
/// Errors of the manifest; files that could not be written, or would be written twice.
pub fn read(path: &Path) -> Result<Vec<Request>, CliError> {
    let bad = |what: String| CliError::usage(format!("{}: {what}", path.display()));
    let unreadable = |error: std::io::Error| bad(format!("cannot be read: {error}"));
    let length = std::fs::metadata(path).map_err(unreadable)?.len();
    if length > LONGEST {
        return Err(bad(format!("is larger than {} MiB", LONGEST >> 20)));
    }
    let text = std::fs::read_to_string(path).map_err(unreadable)?;
    let table: Table = text.parse().map_err(|error: toml::de::Error| {
        let at = error.span().map_or(0, |span| span.start);
        let line = 1 + text.bytes().take(at).filter(|&byte| byte == b'\n').count();
        CliError::usage(format!(
            "{}:{line}: not valid TOML: {}",
            path.display(),
            error.message()
        ))
    })?;
    if let Some(key) = table.keys().find(|key| *key != "defaults" && *key != "pictures") {
        let help = "a manifest has [defaults] and [[pictures]]";
        return Err(bad(format!("has no key \"{key}\"")).with_help(help));
    }
    let none = Table::new();
    let defaults = table.get("defaults").and_then(Value::as_table).unwrap_or(&none);
    let pictures = table
        .get("pictures")
        .and_then(Value::as_array)
        .filter(|list| !list.is_empty());
    let pictures = pictures
        .ok_or_else(|| bad("has no [[pictures]]".to_owned()).with_help("add [[pictures]] with scene = \"a.toml\""))?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut wanted = Vec::new();
    for (number, picture) in (1..).zip(pictures) {
        let entry = picture.as_table().unwrap_or(&none);
        let of_entry = entry_of(entry, defaults, folder);
        wanted.extend(of_entry.map_err(|what| bad(format!("[[pictures]] {number}: {what}")))?);
    }
    let mut inputs = Inputs::named_by(wanted.iter().map(|one| &one.scene));
    inputs.add(Inputs::of("this batch", [path.to_owned(), notes_beside(path)]));
    let mut made = Vec::new();
    let folders = wanted
        .iter()
        .flat_map(|one| one.targets.all())
        .try_for_each(|output| make_folder(output, &mut made));
    let looked = folders.and_then(|()| outputs::look(wanted.iter().map(|one| &one.targets), &inputs));
    if looked.is_err() {
        // What is refused leaves nothing behind. Folders that something is in by now stay.
        made.iter().rev().for_each(|folder| _ = std::fs::remove_dir(folder));
    }
    looked.map(|()| wanted)
}

/// Creates the folder of an output if it is missing, and notes which folders are new, outer ones first.
fn make_folder(output: &Path, made: &mut Vec<PathBuf>) -> Result<(), CliError> {
    let folder = output.parent().unwrap_or(Path::new(""));
    let missing = folder
        .ancestors()
        .take_while(|one| !one.as_os_str().is_empty() && !one.exists());
    let mut missing: Vec<&Path> = missing.collect();
    missing.reverse();
    for one in missing {
        std::fs::create_dir(one).map_err(|error| {
            let what = format!(
                "{}: its folder {} cannot be made: {error}",
                output.display(),
                folder.display()
            );
            CliError::usage(what).with_help("write to another folder, or make this one")
        })?;
        made.push(one.to_owned());
    }
    Ok(())
}

fn entry_of(entry: &Table, defaults: &Table, folder: &Path) -> Result<Vec<Request>, String> {
    let mut options = defaults.clone();
    options.extend(entry.clone());
    let mut scenes = Vec::new();
    for key in SCENES {
        if let Some(value) = options.remove(key) {
            scenes.extend(texts(key, &value)?);
        }
    }
    if scenes.is_empty() {
        return Err("names no scene: write scene = \"a.toml\", or scenes = [\"a.toml\", \"b.toml\"]".to_owned());
    }
    let mut line = Vec::new();
    if !options.contains_key("outputs") {
        line.push(format!("--output={}", folder.join("{name}.exr").display()));
    }
    for (key, value) in &options {
        if NOT_HERE.contains(&key.as_str()) {
            return Err(format!(
                "has the key \"{key}\", which is for a command line alone (pictures go to outputs = [...])"
            ));
        }
        let option = if key == "outputs" { "output" } else { key };
        for text in texts(key, value)? {
            line.push(match (value, text) {
                (Value::Boolean(on), _) if SWITCHES.contains(&key.as_str()) => format!("--{option}={}", switch(*on)),
                (Value::Boolean(false), _) => continue,
                (Value::Boolean(true), _) => format!("--{option}"),
                (_, text) if FILES.contains(&key.as_str()) => format!("--{option}={}", folder.join(text).display()),
                (_, text) => format!("--{option}={text}"),
            });
        }
    }
    let paths: Vec<PathBuf> = scenes.into_iter().map(|scene| folder.join(scene)).collect();
    let one = |scene: PathBuf| {
        let scene = scene.display().to_string();
        let line = line.iter().cloned().chain(["--".to_owned(), scene]);
        let args = Line::try_parse_from(line)
            .map_err(|error| first_line(&error.to_string()))?
            .args;
        args.combined().map_err(|error| error.to_string())?;
        let (stats, checkpoint) = (args.stats.as_deref(), args.checkpoint.as_deref());
        let targets = outputs::of_scene(&args.scenes[0], &args.outputs, stats, checkpoint);
        let targets = targets.with_snapshots(args.snapshots);
        Ok(args.requests(vec![targets]))
    };
    let paths = patterns::expand(&paths).map_err(|error| error.to_string())?;
    let requests = paths.into_iter().map(one).collect::<Result<Vec<_>, String>>()?;
    Ok(requests.concat())
}

/// The command-line spelling of a value, or of each value in a list.
fn texts(key: &str, value: &Value) -> Result<Vec<String>, String> {
    match value {
        Value::Array(list) => Ok(list
            .iter()
            .map(|value| texts(key, value))
            .collect::<Result<Vec<_>, _>>()?
            .concat()),
        Value::String(text) => Ok(vec![text.clone()]),
        Value::Integer(_) | Value::Float(_) | Value::Boolean(_) => Ok(vec![value.to_string()]),
        Value::Datetime(_) | Value::Table(_) => Err(format!("has a value for \"{key}\" that no option takes")),
    }
}

fn first_line(text: &str) -> String {
    let line = text.lines().next().unwrap_or_default();
    line.strip_prefix("error: ").unwrap_or(line).to_owned()
}

/// The record of finished pictures: `jobs.done.jsonl` beside `jobs.toml`.
pub fn notes_beside(path: &Path) -> PathBuf {
    path.with_extension("done.jsonl")
}
