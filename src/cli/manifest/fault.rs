//! A mistake in a manifest, with its place.

use std::ops::Range;
use std::path::Path;

use crate::cli::CliError;

/// A mistake before its file is known.
#[derive(Debug)]
pub struct Fault {
    /// The problem, in one line and without a full stop.
    what: String,
    /// The remedy; empty if there is none.
    help: String,
    /// The byte range in the text; `0..0` for the file as a whole.
    place: Range<usize>,
}

impl Fault {
    pub fn new(place: Range<usize>, what: impl Into<String>, help: impl Into<String>) -> Self {
        let (what, help) = (what.into(), help.into());
        Self { what, help, place }
    }

    /// An error of a command line at this place.
    pub fn of(place: Range<usize>, error: &CliError) -> Self {
        Self::new(place, error.to_string(), error.help().unwrap_or_default())
    }

    /// The error of the manifest at `path` with this text.
    pub fn in_text(self, path: &Path, text: &str) -> CliError {
        let Self { what, help, place } = self;
        CliError::text(path, text, place, "here", &what).with_help(help)
    }
}
