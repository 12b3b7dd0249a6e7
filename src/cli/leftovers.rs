//! Folders and files that a batch makes before it renders. Those that are still empty at its end are removed.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// In the order in which they were made, for [`remove_empty`].
static MADE: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Notes a folder or a file that did not exist before.
pub fn note(path: &Path) {
    MADE.lock()
        .unwrap_or_else(PoisonError::into_inner)
        .push(path.to_owned());
}

/// Removes what was noted and is empty, the inner folders first.
pub fn remove_empty() {
    let made = std::mem::take(&mut *MADE.lock().unwrap_or_else(PoisonError::into_inner));
    for path in made.iter().rev() {
        let _ = match fs::symlink_metadata(path) {
            // Only empty folders can be removed so.
            Ok(found) if found.is_dir() => fs::remove_dir(path),
            Ok(found) if found.is_file() && found.len() == 0 => fs::remove_file(path),
            _ => Ok(()),
        };
    }
}
