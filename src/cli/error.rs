//! What ends a command, and the exit code that says so.

use std::fmt;
use std::path::Path;
use std::process::ExitCode;

use octolux::embree::EmbreeError;
use octolux::film::PictureError;
use octolux::pipeline::SetupError;
use octolux::scene::{InvalidScene, SceneError};

/// How a command ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Exit {
    /// All went well.
    Well,
    /// Something failed that is neither the command line's fault nor a scene's.
    Failed,
    /// The command line or a scene is wrong.
    BadInput,
    /// Ctrl-c; what was rendered is written.
    Interrupted,
}

impl Exit {
    /// The number that the shell sees.
    pub const fn code(self) -> u8 {
        match self {
            Self::Well => 0,
            Self::Failed => 1,
            Self::BadInput => 2,
            Self::Interrupted => 130,
        }
    }

    /// How a command ends of which this part and a later one went so: a failure outweighs bad scenes, as 2 says that every
    /// failure is a bad scene.
    pub fn and(self, later: Self) -> Self {
        if self == Self::Failed { self } else { later }
    }
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        Self::from(exit.code())
    }
}

/// Why a command cannot go on. `Display` is one line without `error: ` in front.
#[derive(Debug)]
pub enum CliError {
    /// The command line asks for something that cannot be: exit code 2.
    Usage {
        /// What is wrong, in one line.
        what: String,
        /// What would do.
        help: Option<String>,
    },
    /// A scene is wrong, with the place in its text: exit code 2.
    Scene(SceneError),
    /// Anything else, in one line: exit code 1.
    Failed {
        /// What is wrong, in one line.
        what: String,
        /// What would do.
        help: Option<String>,
    },
}

impl CliError {
    /// A wrong command line.
    pub fn usage(what: impl Into<String>) -> Self {
        Self::Usage {
            what: what.into(),
            help: None,
        }
    }

    /// A wrong scene.
    pub fn scene(error: SceneError) -> Self {
        Self::Scene(error)
    }

    /// A scene that cannot be changed as the command line asks.
    pub fn change(error: &InvalidScene) -> Self {
        Self::usage(error.to_string()).with_help(error.remedy())
    }

    /// Something that is nobody's input.
    pub fn failed(what: impl Into<String>) -> Self {
        Self::Failed {
            what: what.into(),
            help: None,
        }
    }

    /// A scene at `path` that cannot be rendered as the settings say.
    pub fn setup(path: &Path, error: &SetupError) -> Self {
        let what = format!("{}: {error}", path.display());
        match error {
            SetupError::Unsupported { remedy, .. } => Self::usage(what).with_help(*remedy),
            // Of the machine, not of the scene.
            SetupError::Embree(error @ (EmbreeError::Missing { .. } | EmbreeError::TooOld { .. })) => {
                Self::failed(error.to_string()).with_help(error.remedy())
            }
            SetupError::Embree(error) => Self::failed(what).with_help(error.remedy()),
            SetupError::Threads(_) => Self::failed(what),
        }
    }

    /// A picture that the command line names and that cannot be: an output that could never be written, an input that
    /// is missing. Wrong usage, where the same error after a render is a failure.
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

    /// The exit code of a command that ends with this error.
    pub const fn exit(&self) -> Exit {
        match self {
            Self::Usage { .. } | Self::Scene(_) => Exit::BadInput,
            Self::Failed { .. } => Exit::Failed,
        }
    }

    /// What would do, where there is something to say.
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
