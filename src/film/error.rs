//! The error type of picture files.

use std::io;
use std::path::{Path, PathBuf};

/// Why a picture cannot be read or written: the file and a sentence without a full stop.
#[derive(Debug, thiserror::Error)]
#[error("{}: {what}", path.display())]
pub struct PictureError {
    path: PathBuf,
    what: String,
    help: Option<&'static str>,
}

impl PictureError {
    pub(super) fn new(path: &Path, what: impl Into<String>) -> Self {
        Self {
            path: path.to_owned(),
            what: what.into(),
            help: None,
        }
    }

    /// A file that the system does not give.
    pub(super) fn unreadable(path: &Path, error: &io::Error) -> Self {
        Self::io(path, "cannot be read", error).help("check the name, and that the file may be read")
    }

    /// The failed action, and the system's error.
    pub(super) fn io(path: &Path, tried: &str, error: &io::Error) -> Self {
        Self::new(path, format!("{tried}: {error}"))
    }

    pub(super) fn help(mut self, help: &'static str) -> Self {
        self.help = Some(help);
        self
    }

    /// The file as given.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// A remedy, if one is known.
    pub fn remedy(&self) -> Option<&'static str> {
        self.help
    }
}
