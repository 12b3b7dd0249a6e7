//! The manifest of a batch: a TOML file with scenes, options and outputs.
//!
//! Its keys are the long options of `octolux render`, parsed by the same parser: a picture accepts what a command line accepts.

mod entry;
mod fault;

use std::path::{Path, PathBuf};

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use self::entry::{Entry, Source};
use self::fault::Fault;
use super::inputs::Inputs;
use super::request::Request;
use super::{CliError, leftovers, outputs};

/// Maximum size of a manifest in bytes.
const LONGEST: u64 = 16 << 20;

/// A value with its place in the text.
type Node<'t> = Spanned<DeValue<'t>>;

/// Reads the manifest at `path`, and makes the folders of its outputs.
///
/// # Errors
/// Mistakes in the manifest, with file and line; files that could not be written, or would be written twice.
pub fn read(path: &Path) -> Result<Vec<Request>, CliError> {
    let bad = |what: String| CliError::usage(format!("{}: {what}", path.display()));
    let unreadable = |error: std::io::Error| bad(format!("cannot be read: {error}")).with_help("check the name");
    let found = std::fs::metadata(path).map_err(unreadable)?;
    if !found.is_file() {
        return Err(bad("is no file".to_owned()).with_help("name a manifest, a TOML file with [[pictures]]"));
    }
    if found.len() > LONGEST {
        let help = "patterns such as scenes = [\"*.toml\"] stand for many scenes";
        return Err(bad(format!("is larger than {} MiB", LONGEST >> 20)).with_help(help));
    }
    let bytes = std::fs::read(path).map_err(unreadable)?;
    let text = String::from_utf8(bytes)
        .map_err(|_| bad("the text is not UTF-8".to_owned()).with_help("save the manifest as plain text in UTF-8"))?;
    let manifest = pictures(&text, path).and_then(|pictures| planned(pictures, path));
    manifest.map_err(|fault| fault.in_text(path, &text))
}

/// The pictures of all entries, each with the places of its files.
fn pictures(text: &str, path: &Path) -> Result<Vec<(Source, Request)>, Fault> {
    let tree = DeTable::parse(text).map_err(|error| {
        let help = "a manifest has [defaults] and [[pictures]]; keys are written spp = 64, names stand in quotes";
        let what = format!("not valid TOML: {}", error.message().lines().next().unwrap_or_default());
        Fault::new(error.span().unwrap_or(0..0), what, help)
    })?;
    let root = tree.get_ref();
    if let Some((key, _)) = root
        .iter()
        .find(|(key, _)| !["defaults", "pictures"].contains(&key.get_ref().as_ref()))
    {
        let what = format!("has no key \"{}\"", key.get_ref());
        return Err(Fault::new(
            key.span(),
            what,
            "a manifest has [defaults] and [[pictures]]",
        ));
    }
    let none = DeTable::new();
    let defaults = match root.get("defaults").map(|node| (node, node.get_ref())) {
        None => &none,
        Some((_, DeValue::Table(table))) => table,
        Some((node, _)) => {
            return Err(Fault::new(
                node.span(),
                "defaults is no table",
                "write them below [defaults]",
            ));
        }
    };
    let add = "add [[pictures]] with scene = \"a.toml\"";
    let list = match root.get("pictures").map(|node| (node, node.get_ref())) {
        None => return Err(Fault::new(0..0, "has no [[pictures]]", add)),
        Some((_, DeValue::Array(list))) if !list.is_empty() => list,
        Some((node, DeValue::Array(_))) => return Err(Fault::new(node.span(), "pictures has no entry", add)),
        Some((node, _)) => {
            let help = "begin each picture with a line [[pictures]]";
            return Err(Fault::new(node.span(), "pictures is no list of tables", help));
        }
    };
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut all = Vec::new();
    for (number, node) in (1..).zip(list.iter()) {
        let title = format!("[[pictures]] {number}");
        let DeValue::Table(table) = node.get_ref() else {
            let what = format!("{title} is no table");
            return Err(Fault::new(
                node.span(),
                what,
                "begin each picture with a line [[pictures]]",
            ));
        };
        all.extend(Entry::new(title, node.span(), table, defaults, text).requests(folder)?);
    }
    Ok(all)
}

/// Makes the folders of the outputs, and checks that all files can be written.
fn planned(pictures: Vec<(Source, Request)>, path: &Path) -> Result<Vec<Request>, Fault> {
    let mut inputs = Inputs::named_by(pictures.iter().map(|(_, one)| &one.scene));
    inputs.add(Inputs::of("this batch", [path.to_owned(), notes_beside(path)]));
    for (source, one) in &pictures {
        let made = one.targets.all().try_for_each(make_folder);
        made.map_err(|error| source.fault(&error))?;
    }
    let look = |count: usize| outputs::look(pictures[..count].iter().map(|(_, one)| &one.targets), &inputs);
    if let Err(error) = look(pictures.len()) {
        // The first picture whose files cannot be written beside those of the pictures before it.
        let counts: Vec<usize> = (1..pictures.len()).collect();
        let first = counts.partition_point(|&count| look(count).is_ok());
        let error = look(first + 1).err().unwrap_or(error);
        return Err(pictures[first].0.fault(&error));
    }
    Ok(pictures.into_iter().map(|(_, one)| one).collect())
}

/// Creates the folder of an output if it is missing, and notes which folders are new.
fn make_folder(output: &Path) -> Result<(), CliError> {
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
        leftovers::note(one);
    }
    Ok(())
}

/// The record of finished pictures: `jobs.done.jsonl` beside `jobs.toml`.
pub fn notes_beside(path: &Path) -> PathBuf {
    path.with_extension("done.jsonl")
}
