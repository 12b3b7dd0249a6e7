//! Errors of commands, and their exit codes.

use std::fmt;
use std::ops::Range;
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

/// A place in a text, to be shown below a message.
#[derive(Clone, Debug)]
pub struct Quote {
    /// The file.
    pub name: String,
    /// All of its text.
    pub text: String,
    /// The place in bytes, with the label below it.
    pub label: (Range<usize>, String),
}

/// Lines longer than this are not quoted, as in errors of scenes.
const LONGEST_QUOTED_LINE: usize = 500;

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
    /// Another invalid text, such as a manifest: exit code 2.
    Text {
        /// The problem, in one line, with the file and the number of the line.
        what: String,
        /// A remedy.
        help: Option<String>,
        /// The place in the text; `None` for the text as a whole.
        quote: Option<Box<Quote>>,
    },
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

    /// A mistake at a place of the file `path` with this text; the range `0..0` means the text as a whole.
    pub fn text(path: &Path, text: &str, place: Range<usize>, label: &str, what: &str) -> Self {
        let help = None;
        if place.is_empty() && place.start == 0 {
            let (what, quote) = (format!("{}: {what}", path.display()), None);
            return Self::Text { what, help, quote };
        }
        let line = 1 + text.bytes().take(place.start).filter(|&byte| byte == b'\n').count();
        let quoted = text
            .lines()
            .nth(line - 1)
            .is_none_or(|line| line.len() <= LONGEST_QUOTED_LINE);
        let quote = quoted.then(|| {
            Box::new(Quote {
                name: path.to_string_lossy().into_owned(),
                text: text.to_owned(),
                label: (place, label.to_owned()),
            })
        });
        let what = format!("{}:{line}: {what}", path.display());
        Self::Text { what, help, quote }
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
        if let (Self::Usage { help, .. } | Self::Text { help, .. } | Self::Failed { help, .. }, false) =
            (&mut self, remedy.is_empty())
        {
            *help = Some(remedy);
        }
        self
    }

    /// The outcome of a command that ends with this error.
    pub const fn exit(&self) -> Exit {
        match self {
            Self::Usage { .. } | Self::Scene(_) | Self::Text { .. } => Exit::BadInput,
            Self::Failed { .. } => Exit::Failed,
        }
    }

    /// The place in a text that the error is about, if there is one.
    pub fn quote(&self) -> Option<Quote> {
        match self {
            Self::Usage { .. } | Self::Failed { .. } => None,
            Self::Scene(error) => {
                let (span, label) = error.place()?;
                let text = error.text().filter(|text| !text.is_empty())?;
                Some(Quote {
                    name: error.path().to_string_lossy().into_owned(),
                    text: text.to_owned(),
                    label: (span, label.to_owned()),
                })
            }
            Self::Text { quote, .. } => quote.as_deref().cloned(),
        }
    }

    /// A remedy, if there is one.
    pub fn help(&self) -> Option<String> {
        match self {
            Self::Usage { help, .. } | Self::Text { help, .. } | Self::Failed { help, .. } => help.clone(),
            Self::Scene(error) => Some(error.remedy().to_owned()),
        }
    }
}

impl fmt::Display for CliError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Usage { what, .. } | Self::Text { what, .. } | Self::Failed { what, .. } => f.write_str(what),
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
