//! Errors of commands, and their exit codes.

use std::fmt;
use std::path::Path;
use std::process::ExitCode;

use octolux::embree::EmbreeError;
use octolux::film::PictureError;
use octolux::pipeline::SetupError;
use octolux::scene::{InvalidScene, SceneError};

/// The outcome of a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Exit {
    /// All went well.
    Well,
    /// A failure caused neither by the command line nor by a scene.
    Failed,
    /// Invalid command line or scene.
    BadInput,
    /// Ctrl-c; the picture so far is written.
    Interrupted,
}

impl Exit {
    /// The exit code.
    pub const fn code(self) -> u8 {
        match self {
            Self::Well => 0,
            Self::Failed => 1,
            Self::BadInput => 2,
            Self::Interrupted => 130,
        }
    }

    /// Combines the outcomes of two parts of a command. A failure outweighs bad scenes, because exit code 2 means that every
    /// error was a bad scene.
    pub fn and(self, later: Self) -> Self {
        if self == Self::Failed { self } else { later }
    }
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        Self::from(exit.code())
    }
}

/// Why a command cannot continue. `Display` is one line without the prefix `error: `.
#[derive(Debug)]
pub enum CliError {
    /// An invalid command line: exit code 2.
    Usage {
        /// The problem, in one line.
        what: String,
        /// A remedy.
        help: Option<String>,
    },
    /// An invalid scene, with the place in its text: exit code 2.
    Scene(SceneError),
    /// Anything else, in one line: exit code 1.
    Failed {
        /// The problem, in one line.
        what: String,
        /// A remedy.
        help: Option<String>,
    },
}

impl CliError {
    /// An invalid command line.
    pub fn usage(what: impl Into<String>) -> Self {
        Self::Usage {
            what: what.into(),
            help: None,
        }
    }

    /// An invalid scene.
    pub fn scene(error: SceneError) -> Self {
        Self::Scene(error)
    }

    /// A change of the scene by the command line that makes it invalid.
    pub fn change(error: &InvalidScene) -> Self {
        Self::usage(error.to_string()).with_help(error.remedy())
    }

    /// An error that no input caused.
    pub fn failed(what: impl Into<String>) -> Self {
        Self::Failed {
            what: what.into(),
            help: None,
        }
    }

    /// A scene at `path` that cannot be rendered with these settings.
    pub fn setup(path: &Path, error: &SetupError) -> Self {
        let what = format!("{}: {error}", path.display());
        match error {
            SetupError::Unsupported { remedy, .. } => Self::usage(what).with_help(*remedy),
            // Errors of the machine, not of the scene.
            SetupError::Embree(error @ (EmbreeError::Missing { .. } | EmbreeError::TooOld { .. })) => {
                Self::failed(error.to_string()).with_help(error.remedy())
            }
            SetupError::Embree(error) => Self::failed(what).with_help(error.remedy()),
            SetupError::Threads(_) => Self::failed(what),
        }
    }

    /// An invalid path on the command line: an output that can never be written, or a missing input. This is wrong usage; the
    /// same error after a render is a failure.
    pub fn bad_path(error: &PictureError) -> Self {
        Self::usage(error.to_string()).with_help(error.remedy().unwrap_or_default())
    }

    /// The same with a remedy, in one line; an empty one changes nothing.
    #[must_use]
    pub fn with_help(mut self, remedy: impl Into<String>) -> Self {
        let remedy = remedy.into();
        if let (Self::Usage { help, .. } | Self::Failed { help, .. }, false) = (&mut self, remedy.is_empty()) {
            *help = Some(remedy);
        }
        self
    }

    /// The outcome of a command that ends with this error.
    pub const fn exit(&self) -> Exit {
        match self {
            Self::Usage { .. } | Self::Scene(_) => Exit::BadInput,
            Self::Failed { .. } => Exit::Failed,
        }
    }

    /// A remedy, if there is one.
    pub fn help(&self) -> Option<String> {
        match self {
            Self::Usage { help, .. } | Self::Failed { help, .. } => help.clone(),
            Self::Scene(error) => Some(error.remedy().to_owned()),
        }
    }
}

impl fmt::Display for CliError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Usage { what, .. } | Self::Failed { what, .. } => f.write_str(what),
            Self::Scene(error) => error.fmt(f),
        }
    }
}

impl std::error::Error for CliError {}

impl From<PictureError> for CliError {
    fn from(error: PictureError) -> Self {
        Self::failed(error.to_string()).with_help(error.remedy().unwrap_or_default())
    }
}
