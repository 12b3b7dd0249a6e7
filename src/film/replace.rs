//! Files that are written whole or not at all.
//!
//! The bytes go to a temporary file in the same folder (a rename across file systems would copy), are synced, and take
//! the name in one step. Whoever looks sees the old file or the new one.

use std::fs::{self, File, Permissions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use tempfile::{Builder, NamedTempFile};

use super::PictureError;

/// Temporary files that stand right now, for [`abandon_all`].
static PENDING: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

fn pending() -> MutexGuard<'static, Vec<PathBuf>> {
    // A list of paths is whole at any time: poison says nothing about it.
    PENDING.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Puts what `fill` writes in the place of `path`.
///
/// # Errors
/// A sentence with what the system or `fill` answered; `path` is then as it was, and no temporary file is left.
pub fn replace(path: &Path, fill: impl FnOnce(&mut BufWriter<&File>) -> io::Result<()>) -> Result<(), PictureError> {
    let target = behind_links(path);
    let failed = |error: io::Error| PictureError::io(path, "cannot be written", &error);
    let temporary = Temporary::beside(&target).map_err(failed)?;
    let mut buffer = BufWriter::new(temporary.file.as_file());
    fill(&mut buffer).and_then(|()| buffer.flush()).map_err(failed)?;
    drop(buffer);
    temporary.file.as_file().sync_all().map_err(failed)?;
    temporary.become_file(&target).map_err(failed)?;
    // Makes the new name itself last through a power cut. Not every file system can; the file stands either way.
    let _ = File::open(folder(&target)).and_then(|folder| folder.sync_all());
    Ok(())
}

/// Looks whether [`replace`] could write `path`: its folder is there and takes files, and no folder or device stands
/// in its place.
///
/// # Errors
/// A sentence about the first of these that does not hold.
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
    // Permission bits do not tell (root, ACLs, read-only mounts): try.
    let probe = Temporary::beside(&behind_links(path)).map(drop);
    probe.map_err(|error| PictureError::io(path, "its folder cannot be written to", &error))
}

/// Removes every temporary file and lets nobody create another: for a process that is about to exit at once.
pub fn abandon_all() {
    let pending = pending();
    for path in pending.iter() {
        let _ = fs::remove_file(path);
    }
    // Kept for good: a writer that wants to start now waits for the exit.
    std::mem::forget(pending);
}

/// Through a symbolic link the file that it points to is replaced, not the link.
fn behind_links(path: &Path) -> PathBuf {
    fs::canonicalize(path).unwrap_or_else(|_| path.to_owned())
}

fn folder(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}

/// A temporary file that [`abandon_all`] knows of. Dropping it removes it.
struct Temporary {
    file: NamedTempFile,
    pending: Pending,
}

/// An entry in the list of temporary files, for as long as it lives.
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
        // tempfile asks for 0600; a picture is as readable as any new file (the system takes the umask off).
        #[cfg(unix)]
        builder.permissions(<Permissions as std::os::unix::fs::PermissionsExt>::from_mode(0o666));
        // Locked until the file is in the list, so that none is missed.
        let mut list = pending();
        let file = builder.tempfile_in(folder(path))?;
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
