//! Atomic replacement of files.
//!
//! The bytes go to a temporary file in the same folder (a rename across file systems would copy), which is synced and then
//! renamed. Readers see the old file or the new one.

use std::fs::{self, File, Permissions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use tempfile::{Builder, NamedTempFile};

use super::PictureError;

/// Existing temporary files, for [`abandon_all`].
static PENDING: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

fn pending() -> MutexGuard<'static, Vec<PathBuf>> {
    // A list of paths is always consistent, so poisoning does not matter.
    PENDING.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Atomically replaces `path` by what `fill` writes.
///
/// # Errors
/// A sentence with the error of the system or of `fill`; `path` is then unchanged, and no temporary file is left.
pub fn replace(path: &Path, fill: impl FnOnce(&mut BufWriter<&File>) -> io::Result<()>) -> Result<(), PictureError> {
    let target = behind_links(path);
    let failed = |error: io::Error| PictureError::io(path, "cannot be written", &error);
    let temporary = Temporary::beside(&target).map_err(failed)?;
    let mut buffer = BufWriter::new(temporary.file.as_file());
    fill(&mut buffer).and_then(|()| buffer.flush()).map_err(failed)?;
    drop(buffer);
    temporary.file.as_file().sync_all().map_err(failed)?;
    temporary.become_file(&target).map_err(failed)?;
    // Makes the rename survive a power cut. Not every file system supports this; the file exists either way.
    let _ = File::open(folder(&target)).and_then(|folder| folder.sync_all());
    Ok(())
}

/// Checks whether [`replace`] could write `path`: its folder exists and is writable, and `path` is no folder or device.
///
/// # Errors
/// A sentence about the first violated condition.
pub fn check(path: &Path) -> Result<(), PictureError> {
    if path.file_name().is_none() {
        return Err(PictureError::new(path, "is a folder, not a file"));
    }
    let folder = folder(path);
    match fs::metadata(folder) {
        Ok(found) if !found.is_dir() => {
            return Err(PictureError::new(path, format!("{} is not a folder", folder.display())));
        }
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            return Err(
                PictureError::new(path, format!("there is no folder {}", folder.display()))
                    .help("create the folder first"),
            );
        }
        Err(error) => return Err(PictureError::io(path, "cannot be written", &error)),
        Ok(_) => {}
    }
    match fs::metadata(path) {
        Ok(found) if found.is_dir() => return Err(PictureError::new(path, "is a folder, not a file")),
        Ok(found) if !found.is_file() => return Err(PictureError::new(path, "is a device, not a file")),
        Err(error) if error.kind() != io::ErrorKind::NotFound => {
            return Err(PictureError::io(path, "cannot be written", &error));
        }
        _ => {}
    }
    // Permission bits are not sufficient (root, ACLs, read-only mounts), so create a file.
    let probe = Temporary::beside(&behind_links(path)).map(drop);
    probe.map_err(|error| {
        PictureError::io(path, "its folder cannot be written to", &error).help("name a folder that you may write to")
    })
}

/// Removes all temporary files and blocks the creation of others: for a process that is about to exit.
pub fn abandon_all() {
    let pending = pending();
    for path in pending.iter() {
        let _ = fs::remove_file(path);
    }
    // Never unlocked: a writer that wants to start now waits for the exit.
    std::mem::forget(pending);
}

/// Resolves symbolic links, so that the target is replaced and not the link.
fn behind_links(path: &Path) -> PathBuf {
    fs::canonicalize(path).unwrap_or_else(|_| path.to_owned())
}

fn folder(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}

/// The system's own words: `tempfile` adds the random name of its file.
fn without_path(error: io::Error) -> io::Error {
    match error.to_string().split_once(" at path ") {
        Some((words, _)) => io::Error::new(error.kind(), words.to_owned()),
        None => error,
    }
}

/// A temporary file that [`abandon_all`] knows of. Dropping it removes it.
struct Temporary {
    file: NamedTempFile,
    pending: Pending,
}

/// An entry in the list of temporary files, removed when dropped.
struct Pending(PathBuf);

impl Drop for Pending {
    fn drop(&mut self) {
        pending().retain(|path| *path != self.0);
    }
}

impl Temporary {
    fn beside(path: &Path) -> io::Result<Self> {
        let mut builder = Builder::new();
        builder.prefix(".octolux-").suffix(".tmp");
        // tempfile creates files with mode 0600; use the default mode of new files (the system applies the umask).
        #[cfg(unix)]
        builder.permissions(<Permissions as std::os::unix::fs::PermissionsExt>::from_mode(0o666));
        // Locked until the file is in the list, so that [`abandon_all`] misses none.
        let mut list = pending();
        let file = builder.tempfile_in(folder(path)).map_err(without_path)?;
        list.push(file.path().to_owned());
        drop(list);
        let pending = Pending(file.path().to_owned());
        Ok(Self { file, pending })
    }

    fn become_file(self, path: &Path) -> io::Result<()> {
        let Self { file, pending } = self;
        // On failure the error owns the file and removes it.
        let persisted = file.persist(path).map(drop).map_err(|failure| failure.error);
        drop(pending);
        persisted
    }
}
