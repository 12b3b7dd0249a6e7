//! Files named by a scene: permitted places, and reading.

use std::cell::RefCell;
use std::fs::File;
use std::io::{ErrorKind, Read};
use std::path::{Component, Path, PathBuf};

use super::error::Fault;
use super::memory;

/// Whether a scene may name files outside of its own folder.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Outside {
    /// No: an untrusted scene cannot read other files.
    #[default]
    Refused,
    /// Yes.
    Allowed,
}

/// Estimated memory for parsing, relative to the file's length: numbers of a few bytes become 64-bit numbers.
const BYTES_PER_BYTE: u64 = 6;

/// The files of one scene.
#[derive(Debug)]
pub(super) struct Files {
    folder: PathBuf,
    outside: Outside,
    /// The scene file and every file read so far, as paths that can be opened.
    read: RefCell<Vec<PathBuf>>,
}

impl Files {
    /// For the scene file at `path`.
    pub fn new(path: &Path, outside: Outside) -> Self {
        Self {
            folder: path.parent().unwrap_or(Path::new("")).to_owned(),
            outside,
            read: vec![path.to_owned()].into(),
        }
    }

    /// The bytes of the file `name` in the scene's folder; `kind` is its description in errors, such as "mesh file".
    ///
    /// # Errors
    /// An error without a place about a file that is missing, empty, no regular file, outside, or too large for the free
    /// memory.
    pub fn bytes(&self, kind: &str, name: &str) -> Result<Vec<u8>, Fault> {
        let (file, length) = self.open(kind, name)?;
        let mut bytes = Vec::new();
        // Read no more than the length checked before, even if the file grows.
        let read = file.take(length).read_to_end(&mut bytes);
        read.map_err(|error| unreadable(kind, name, &error))?;
        Ok(bytes)
    }

    /// Streams the bytes of the file `name` to `reader`, with their number, so that they need not fit into memory at once. All
    /// bytes are read, even if `reader` stops early.
    ///
    /// # Errors
    /// As for [`bytes`](Self::bytes), or if the file changes while it is read.
    pub fn stream<T>(&self, kind: &str, name: &str, reader: impl FnOnce(&mut dyn Read, u64) -> T) -> Result<T, Fault> {
        let (file, length) = self.open(kind, name)?;
        let mut source = file.take(length);
        let made = reader(&mut source, length);
        let rest = std::io::copy(&mut source, &mut std::io::sink());
        rest.map_err(|error| unreadable(kind, name, &error))?;
        if source.limit() > 0 {
            let what = format!("{kind} \"{name}\" became shorter while it was read");
            return Err(Fault::new(what, "try again once it is written"));
        }
        Ok(made)
    }

    /// The file and its length, if it may be read and its length is possible.
    fn open(&self, kind: &str, name: &str) -> Result<(File, u64), Fault> {
        let fault = |what: &str, help: &str| Fault::new(format!("{kind} \"{name}\" {what}"), help);
        let unreadable = |error: std::io::Error| unreadable(kind, name, &error);
        let path = self.folder.join(name);
        if self.outside == Outside::Refused && !self.is_inside(&path, name) {
            return Err(fault(
                "lies outside of the scene's folder",
                "copy it beside the scene; or, if you trust the scene, give the option --allow-outside",
            ));
        }
        // Check the file type before opening: opening a named pipe would block until there is a writer.
        let length = match std::fs::metadata(&path) {
            Ok(metadata) if metadata.is_file() => metadata.len(),
            Ok(_) => {
                return Err(fault(
                    "is not a file",
                    "name a file: paths are relative to the scene file",
                ));
            }
            Err(error) if error.kind() == ErrorKind::NotFound => {
                return Err(fault("does not exist", &how_to_get(&self.folder, name)));
            }
            Err(error) => return Err(unreadable(error)),
        };
        if length == 0 {
            return Err(fault("is empty", "save it again, or name another file"));
        }
        if !memory::fits(length.saturating_mul(BYTES_PER_BYTE)) {
            return Err(fault("is too large for the memory that is free", "use a smaller one"));
        }
        self.read.borrow_mut().push(path.clone());
        Ok((File::open(&path).map_err(unreadable)?, length))
    }

    /// The scene file and every file that was read.
    pub fn all_read(self) -> Vec<PathBuf> {
        self.read.into_inner()
    }

    /// Whether `name` stays inside the folder, both as a path and after resolving symbolic links.
    fn is_inside(&self, path: &Path, name: &str) -> bool {
        let mut depth = 0_i32;
        for part in Path::new(name).components() {
            depth += match part {
                Component::Normal(_) => 1,
                Component::CurDir => 0,
                Component::ParentDir => -1,
                Component::RootDir | Component::Prefix(_) => return false,
            };
            if depth < 0 {
                return false;
            }
        }
        let here = here(&self.folder).canonicalize();
        match (here, path.canonicalize()) {
            (Ok(folder), Ok(path)) => path.starts_with(folder),
            _ => true,
        }
    }
}

fn unreadable(kind: &str, name: &str, error: &std::io::Error) -> Fault {
    Fault::new(
        format!("{kind} \"{name}\" cannot be read: {error}"),
        "check that the file may be read",
    )
}

/// Replaces the empty path (the folder of `dragon.toml`), which cannot be listed.
fn here(folder: &Path) -> &Path {
    if folder.as_os_str().is_empty() {
        Path::new(".")
    } else {
        folder
    }
}

/// How to get a missing file: a script `fetch-NAME.sh` beside the scene fetches files whose name contains NAME.
fn how_to_get(folder: &Path, name: &str) -> String {
    let scripts = std::fs::read_dir(here(folder)).into_iter().flatten().flatten();
    let script = scripts
        .map(|entry| entry.file_name().to_string_lossy().into_owned())
        .find(|script| {
            let subject = script.strip_prefix("fetch-").and_then(|rest| rest.strip_suffix(".sh"));
            subject.is_some_and(|subject| name.contains(subject))
        });
    match script {
        Some(script) => format!("run {}, which fetches it", folder.join(script).display()),
        None => "check the name: paths are relative to the scene file".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    /// A scene's folder `in` beside a file `secret`, in a temporary folder.
    fn place() -> (tempfile::TempDir, PathBuf) {
        let place = tempfile::tempdir().unwrap();
        fs::create_dir_all(place.path().join("in/deep")).unwrap();
        for name in ["secret", "in/own", "in/deep/own"] {
            fs::write(place.path().join(name), name).unwrap();
        }
        let scene = place.path().join("in/scene.toml");
        (place, scene)
    }

    #[test]
    fn a_scene_looks_at_nothing_outside_of_its_folder() {
        let (place, scene) = place();
        std::os::unix::fs::symlink(place.path().join("secret"), place.path().join("in/link")).unwrap();
        let absolute = place.path().join("secret");
        let outside = [
            "../secret",
            "deep/../../secret",
            "link",
            absolute.to_str().unwrap(),
            "../nothing",
        ];
        let files = Files::new(&scene, Outside::Refused);
        for name in outside {
            let fault = files.bytes("mesh file", name).unwrap_err();
            assert_eq!(
                fault.what,
                format!("mesh file \"{name}\" lies outside of the scene's folder")
            );
        }
        for name in ["own", "./own", "deep/own", "deep/../own"] {
            assert!(files.bytes("mesh file", name).is_ok(), "{name}");
        }
        let trusting = Files::new(&scene, Outside::Allowed);
        for name in &outside[..4] {
            assert_eq!(trusting.bytes("mesh file", name).unwrap(), b"secret");
        }
    }
}
