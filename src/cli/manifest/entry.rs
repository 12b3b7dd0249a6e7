//! An entry of a manifest: keys and values become a command line, and its errors become those of keys.

use std::collections::BTreeMap;
use std::error::Error as _;
use std::ops::Range;
use std::path::{Path, PathBuf};

use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{Arg, CommandFactory as _, Parser};
use toml::de::{DeTable, DeValue};

use super::Node;
use super::fault::Fault;
use crate::cli::options::switch;
use crate::cli::request::Request;
use crate::cli::{CliError, outputs, patterns, render};

/// Keys that are not options of `render`.
const SCENES: [&str; 2] = ["scene", "scenes"];

/// Keys whose values are files, relative to the manifest.
const FILES: [&str; 3] = ["outputs", "stats", "checkpoint"];

/// On/off options, for which TOML booleans are accepted.
const SWITCHES: [&str; 2] = ["robust", "cull"];

/// Options that apply to the whole batch, or to no picture.
const NOT_HERE: [&str; 5] = ["json", "quiet", "threads", "output", "replay"];

#[derive(Parser)]
#[command(no_binary_name = true)]
struct Line {
    #[command(flatten)]
    args: render::Args,
}

/// A key of an entry or of the defaults.
struct Given<'t> {
    key: Range<usize>,
    value: &'t Node<'t>,
}

/// Where a picture comes from.
#[derive(Clone, Debug)]
pub struct Source {
    /// Its outputs, or its scene if it names none.
    place: Range<usize>,
    /// Its files, with the place of each.
    files: Vec<(String, Range<usize>)>,
}

impl Source {
    /// An error that begins with the name of a file.
    pub fn fault(&self, error: &CliError) -> Fault {
        let said = error.to_string();
        let begins = |file: &str| said.strip_prefix(file).is_some_and(|rest| rest.starts_with(':'));
        let named = self.files.iter().find(|(file, _)| begins(file));
        Fault::of(named.map_or(&self.place, |(_, place)| place).clone(), error)
    }
}

/// An entry with the defaults.
pub struct Entry<'t> {
    /// Such as `[[pictures]] 2`.
    title: String,
    /// Its header.
    place: Range<usize>,
    given: BTreeMap<&'t str, Given<'t>>,
    text: &'t str,
}

impl<'t> Entry<'t> {
    /// The keys of `own`, and those of `defaults` that it does not have.
    pub fn new(
        title: String,
        place: Range<usize>,
        own: &'t DeTable<'t>,
        defaults: &'t DeTable<'t>,
        text: &'t str,
    ) -> Self {
        let given = |table: &'t DeTable<'t>| {
            let keys = table.iter();
            keys.map(|(key, value)| (key.get_ref().as_ref(), Given { key: key.span(), value }))
        };
        let mut all: BTreeMap<&str, Given<'_>> = given(defaults).collect();
        // Two spellings of one key.
        if given(own).any(|(key, _)| SCENES.contains(&key)) {
            all.retain(|key, _| !SCENES.contains(key));
        }
        all.extend(given(own));
        Self {
            title,
            place,
            given: all,
            text,
        }
    }

    /// A request for each scene, with the places of its files.
    ///
    /// # Errors
    /// The first key that no option has, or whose value the option refuses.
    pub fn requests(&self, folder: &Path) -> Result<Vec<(Source, Request)>, Fault> {
        let line = self.line(folder)?;
        let mut all = Vec::new();
        for (place, scene) in self.scenes(folder)? {
            let words = ["--".to_owned(), scene.display().to_string()];
            let words = line.iter().cloned().chain(words);
            let args = Line::try_parse_from(words).map_err(|error| self.refused(&error))?.args;
            args.combined().map_err(|error| Fault::of(self.place.clone(), &error))?;
            let source = self.source(&scene, place, folder)?;
            let (stats, checkpoint) = (args.stats.as_deref(), args.checkpoint.as_deref());
            let targets = outputs::of_scene(&scene, &args.outputs, stats, checkpoint);
            let targets = targets
                .map_err(|error| source.fault(&error))?
                .with_snapshots(args.snapshots);
            let requests = args.requests(vec![targets]);
            all.extend(requests.into_iter().map(|request| (source.clone(), request)));
        }
        Ok(all)
    }

    /// Where the files of a scene are named; `place` is that of the scene.
    fn source(&self, scene: &Path, place: Range<usize>, folder: &Path) -> Result<Source, Fault> {
        let mut files = Vec::new();
        for key in FILES {
            let named = self
                .given
                .get(key)
                .map(|given| self.texts(key, given.value))
                .transpose()?;
            for (place, text) in named.into_iter().flatten() {
                let path = folder.join(text);
                let path = outputs::of_picture(scene, &path).unwrap_or(path);
                files.push((path.display().to_string(), place));
            }
        }
        let place = self.given.get("outputs").map_or(place, |given| given.value.span());
        Ok(Source { place, files })
    }

    /// The scenes that the entry names, each with its place.
    fn scenes(&self, folder: &Path) -> Result<Vec<(Range<usize>, PathBuf)>, Fault> {
        let mut scenes = Vec::new();
        for key in SCENES {
            let named = self
                .given
                .get(key)
                .map(|given| self.texts(key, given.value))
                .transpose()?;
            for (place, name) in named.into_iter().flatten() {
                let found = patterns::expand(&[folder.join(name)]);
                let found = found.map_err(|error| Fault::of(place.clone(), &error))?;
                scenes.extend(found.into_iter().map(|path| (place.clone(), path)));
            }
        }
        if scenes.is_empty() {
            let help = "write scene = \"a.toml\", or scenes = [\"a.toml\", \"b.toml\"]";
            return Err(Fault::new(
                self.place.clone(),
                format!("{} names no scene", self.title),
                help,
            ));
        }
        Ok(scenes)
    }

    /// The options of the entry as words of a command line, without the scene.
    fn line(&self, folder: &Path) -> Result<Vec<String>, Fault> {
        let command = Line::command();
        let mut line = Vec::new();
        if !self.given.contains_key("outputs") {
            line.push(format!("--output={}", folder.join("{name}.exr").display()));
        }
        for (&key, given) in self.given.iter().filter(|(key, _)| !SCENES.contains(key)) {
            let long = if key == "outputs" { "output" } else { key };
            let known = command.get_arguments().find(|option| option.get_long() == Some(long));
            let option = known.filter(|_| !NOT_HERE.contains(&key));
            let option = option.ok_or_else(|| self.unknown(key, given, known.is_some()))?;
            let texts = self.texts(key, given.value)?;
            if texts.is_empty() {
                return Err(self.wrong(key, given, "write a value, or leave the key out"));
            }
            for (_, text) in texts {
                line.push(match given.value.get_ref() {
                    DeValue::Boolean(on) if SWITCHES.contains(&key) => format!("--{long}={}", switch(*on)),
                    DeValue::Boolean(on) if may_stand_alone(option) => match on {
                        true => format!("--{long}"),
                        false => continue,
                    },
                    DeValue::Boolean(_) => return Err(self.wrong(key, given, "write a value, or leave the key out")),
                    _ if !option.get_action().takes_values() => {
                        return Err(self.wrong(key, given, "write true or false, without quotes"));
                    }
                    _ if FILES.contains(&key) => format!("--{long}={}", folder.join(text).display()),
                    _ => format!("--{long}={text}"),
                });
            }
        }
        Ok(line)
    }

    /// The command-line spelling of a value, or of each value in a list.
    fn texts(&self, key: &str, value: &Node<'_>) -> Result<Vec<(Range<usize>, String)>, Fault> {
        let one = |text: String| Ok(vec![(value.span(), text)]);
        match value.get_ref() {
            DeValue::Array(list) => {
                let texts: Result<Vec<_>, _> = list.iter().map(|value| self.texts(key, value)).collect();
                Ok(texts?.concat())
            }
            DeValue::String(text) => one(text.to_string()),
            DeValue::Integer(whole) => one(match i64::from_str_radix(whole.as_str(), whole.radix()) {
                Ok(whole) => whole.to_string(),
                Err(_) => whole.to_string(),
            }),
            DeValue::Float(number) => one(number.to_string()),
            DeValue::Boolean(on) => one(on.to_string()),
            DeValue::Datetime(_) | DeValue::Table(_) => {
                let help = "write a number, true, false, a text in quotes, or a list of these";
                Err(Fault::new(
                    value.span(),
                    format!("{} has a {key} that no option takes", self.title),
                    help,
                ))
            }
        }
    }

    /// The error of a value that `render` refuses.
    fn wrong(&self, key: &str, given: &Given<'_>, help: impl Into<String>) -> Fault {
        let got: String = self
            .text
            .get(given.value.span())
            .unwrap_or_default()
            .chars()
            .take(60)
            .collect();
        let got = got.split_whitespace().collect::<Vec<_>>().join(" ");
        Fault::new(
            given.value.span(),
            format!("{}: {key} cannot be {got}", self.title),
            help,
        )
    }

    /// The error of a key that no picture can have.
    fn unknown(&self, key: &str, given: &Given<'_>, is_option: bool) -> Fault {
        let what = format!("{} has no key `{key}`", self.title);
        let help = match key {
            "output" => "pictures go to outputs = [\"a.exr\", \"a.png\"]".to_owned(),
            _ if is_option => format!("it is for a command line alone: leave it out, or give --{key} to octolux"),
            _ => {
                let command = Line::command();
                let options = command.get_arguments().filter(|option| !option.is_hide_set());
                let options = options
                    .filter_map(Arg::get_long)
                    .filter(|name| !NOT_HERE.contains(name) && *name != "help");
                let keys: Vec<&str> = ["scene", "scenes", "outputs"].into_iter().chain(options).collect();
                format!("{}the keys are {}", meant(key), keys.join(", "))
            }
        };
        Fault::new(given.key.clone(), what, help)
    }

    /// The error of the parser, in words of the manifest.
    fn refused(&self, error: &clap::Error) -> Fault {
        let names = |kind: ContextKind| keys(error.get(kind));
        let (about, others) = (names(ContextKind::InvalidArg), names(ContextKind::PriorArg));
        let found = about.first().and_then(|key| Some((key, self.given.get(key.as_str())?)));
        match (error.kind(), found) {
            (ErrorKind::ValueValidation, Some((key, given))) => {
                self.wrong(key, given, error.source().map(ToString::to_string).unwrap_or_default())
            }
            (ErrorKind::InvalidValue, Some((key, given))) => {
                let names = error
                    .get(ContextKind::ValidValue)
                    .map(ToString::to_string)
                    .unwrap_or_default();
                self.wrong(key, given, format!("write one of {names}"))
            }
            (ErrorKind::ArgumentConflict, Some((key, given))) => {
                let what = format!("{}: {key} cannot be used with {}", self.title, others.join(", "));
                Fault::new(
                    given.key.clone(),
                    what,
                    "leave one of them out; those of [defaults] count too",
                )
            }
            (ErrorKind::MissingRequiredArgument, None) => {
                let what = format!("{} needs {}, too", self.title, about.join(", "));
                Fault::new(self.place.clone(), what, "another key has no meaning without it")
            }
            _ => {
                let said = error.to_string();
                let line = said.lines().next().unwrap_or_default();
                let what = format!("{}: {}", self.title, line.strip_prefix("error: ").unwrap_or(line));
                Fault::new(self.place.clone(), what, "octolux render --help says what options take")
            }
        }
    }
}

/// Whether an option needs no value.
fn may_stand_alone(option: &Arg) -> bool {
    !option.get_action().takes_values() || option.get_num_args().is_some_and(|range| range.min_values() == 0)
}

/// "did you mean `spp`? ", by the parser's own guess.
fn meant(key: &str) -> String {
    let error = Line::try_parse_from([format!("--{key}=1")]).err();
    let guess = error
        .as_ref()
        .and_then(|error| keys(error.get(ContextKind::SuggestedArg)).into_iter().next());
    guess.map(|near| format!("did you mean `{near}`? ")).unwrap_or_default()
}

/// The keys of options that an error names: "outputs" of "--output <FILE>".
fn keys(named: Option<&ContextValue>) -> Vec<String> {
    let options = match named {
        Some(ContextValue::String(option)) => std::slice::from_ref(option),
        Some(ContextValue::Strings(options)) => options,
        _ => &[],
    };
    let key = |option: &String| {
        let name = option
            .trim_start_matches('-')
            .split([' ', '=', '[', '<'])
            .next()
            .unwrap_or_default();
        if name == "output" {
            "outputs".to_owned()
        } else {
            name.to_owned()
        }
    };
    options.iter().map(key).collect()
}
