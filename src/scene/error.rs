//! The one error of scene files: a sentence, its place in the text and the remedy.

use std::fmt;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Lines longer than this are not quoted under a message: a whole mesh may stand on one line.
const LONGEST_QUOTED_LINE: usize = 500;

/// Why a scene cannot be loaded.
///
/// `Display` is exactly one line, `scenes/studio.toml:14: sphere radius must be positive and finite, got -0.5`: the
/// path as it was given, the line (where there is one) and what is wrong. [`SceneError::remedy`] says what would do, in
/// one line as well; [`SceneError::place`] and [`SceneError::text`] show where. Tables are called as they are written, those of a list with
/// their number from 1: `[materials.steel]`, `[[spheres]] 3`. Indices of vertices and faces count from 0, as in the file.
pub struct SceneError(Box<Report>);

struct Report {
    path: PathBuf,
    line: Option<usize>,
    fault: Fault,
    /// The whole text, where it is worth quoting.
    text: Option<String>,
}

/// A fault before it is known which file it is in.
#[derive(Clone, Debug)]
pub(super) struct Fault {
    /// What is wrong, in one line and without a full stop.
    pub what: String,
    /// What would do, in one line.
    pub help: String,
    /// Where, in bytes of the text, with the words that stand under it.
    pub place: Option<(Range<usize>, String)>,
}

impl Fault {
    pub fn new(what: impl Into<String>, help: impl Into<String>) -> Self {
        Self {
            what: one_line(&what.into()),
            help: one_line(&help.into()),
            place: None,
        }
    }

    pub fn at(mut self, span: Range<usize>, label: impl Into<String>) -> Self {
        self.place = Some((span, label.into()));
        self
    }
}

impl SceneError {
    /// A fault of the file as a whole: it has no line.
    pub(super) fn of_file(path: &Path, fault: Fault) -> Self {
        Self(Box::new(Report {
            path: path.to_owned(),
            line: None,
            fault,
            text: None,
        }))
    }

    /// A fault of the text `text` of the file `path`.
    pub(super) fn of_text(path: &Path, text: &str, mut fault: Fault) -> Self {
        let Some((span, _)) = &mut fault.place else {
            return Self::of_file(path, fault);
        };
        span.end = span.end.min(text.len());
        span.start = span.start.min(span.end);
        let before = &text.as_bytes()[..span.start];
        let line = 1 + before.iter().filter(|&&byte| byte == b'\n').count();
        let quoted = text
            .lines()
            .nth(line - 1)
            .is_none_or(|line| line.len() <= LONGEST_QUOTED_LINE);
        let text = quoted.then(|| text.to_owned());
        Self(Box::new(Report {
            path: path.to_owned(),
            line: Some(line),
            fault,
            text,
        }))
    }

    /// The scene file, as it was named.
    pub fn path(&self) -> &Path {
        &self.0.path
    }

    /// The line of the scene file, from 1; `None` where the file as a whole is at fault.
    pub fn line(&self) -> Option<usize> {
        self.0.line
    }

    /// What would do, in one line.
    pub fn remedy(&self) -> &str {
        &self.0.fault.help
    }

    /// Where in [`SceneError::text`], in bytes, with the words that belong under it.
    pub fn place(&self) -> Option<(Range<usize>, &str)> {
        let (span, label) = self.0.fault.place.as_ref().filter(|_| self.0.text.is_some())?;
        Some((span.clone(), label))
    }

    /// The text of the scene file; `None` where no part of it is at fault, and where the line is too long to be shown.
    pub fn text(&self) -> Option<&str> {
        self.0.text.as_deref()
    }
}

impl fmt::Display for SceneError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:", one_line(&self.0.path.to_string_lossy()))?;
        if let Some(line) = self.0.line {
            write!(f, "{line}:")?;
        }
        write!(f, " {}", self.0.fault.what)
    }
}

/// As `Display`: a test that unwraps shows the sentence and not the whole source.
impl fmt::Debug for SceneError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{self} (help: {})", self.0.fault.help)
    }
}

impl std::error::Error for SceneError {}

/// Newlines and other control characters become spaces: names and values of a file can hold anything.
fn one_line(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}
