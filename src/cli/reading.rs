//! How scenes are read, for every command that reads one.

use std::path::Path;

use super::CliError;
use octolux::scene::{Outside, Scene};

/// What a scene may do.
#[derive(clap::Args, Clone, Copy, Debug)]
pub struct Reading {
    /// Let scenes name files outside of their own folder
    #[arg(long)]
    pub allow_outside: bool,
}

impl Reading {
    /// Which files a scene may name.
    pub fn outside(self) -> Outside {
        if self.allow_outside {
            Outside::Allowed
        } else {
            Outside::Refused
        }
    }

    /// Reads the scene at `path`.
    ///
    /// # Errors
    /// What is wrong with it, and where.
    pub fn load(self, path: &Path) -> Result<Scene, CliError> {
        Scene::load_with(path, self.outside()).map_err(CliError::scene)
    }
}
