//! The error type of scene files: a sentence, its place in the text and a remedy.

use std::fmt;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Lines longer than this are not quoted below a message: a line may contain a whole mesh.
const LONGEST_QUOTED_LINE: usize = 500;

/// Why a scene cannot be loaded.
///
/// `Display` is exactly one line, `scenes/studio.toml:14: sphere radius must be positive and finite, got -0.5`: the path as
/// given, the line (if any) and the problem. [`SceneError::remedy`] gives a remedy, also in one line; [`SceneError::place`] and
/// [`SceneError::text`] show the place. Tables are named as written, those of a list with their number from 1:
/// `[materials.steel]`, `[[spheres]] 3`. Indices of vertices and faces count from 0, as in the file.
pub struct SceneError(Box<Report>);

struct Report {
    path: PathBuf,
    line: Option<usize>,
    fault: Fault,
    /// The whole text, if it can be quoted.
    text: Option<String>,
}

/// An error before its file is known.
#[derive(Clone, Debug)]
pub(super) struct Fault {
    /// The problem, in one line and without a full stop.
    pub what: String,
    /// The remedy, in one line.
    pub help: String,
    /// The byte range in the text, with the label below it.
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
    /// An error of the file as a whole, without a line.
    pub(super) fn of_file(path: &Path, fault: Fault) -> Self {
        Self(Box::new(Report {
            path: path.to_owned(),
            line: None,
            fault,
            text: None,
        }))
    }

    /// An error in the text `text` of the file `path`.
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

    /// The scene file as given.
    pub fn path(&self) -> &Path {
        &self.0.path
    }

    /// The line of the scene file, from 1; `None` for errors of the file as a whole.
    pub fn line(&self) -> Option<usize> {
        self.0.line
    }

    /// The remedy, in one line.
    pub fn remedy(&self) -> &str {
        &self.0.fault.help
    }

    /// The byte range in [`SceneError::text`], with the label below it.
    pub fn place(&self) -> Option<(Range<usize>, &str)> {
        let (span, label) = self.0.fault.place.as_ref().filter(|_| self.0.text.is_some())?;
        Some((span.clone(), label))
    }

    /// The text of the scene file; `None` for errors of the file as a whole, and for lines too long to show.
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

/// Same as `Display`: a test that unwraps shows the sentence and not the whole source.
impl fmt::Debug for SceneError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{self} (help: {})", self.0.fault.help)
    }
}

impl std::error::Error for SceneError {}

/// Replaces newlines and other control characters by spaces: names and values of a file can contain anything.
fn one_line(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}
