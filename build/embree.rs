//! Where Embree 4 is: `EMBREE_DIR`, else the system's, else our own copy.

use std::env;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use crate::wheel;

/// The library by its possible names; the first is all there is where only the runtime package is installed.
const NAMES: [&str; 2] = ["libembree4.so.4", "libembree4.so"];

/// Folders below `EMBREE_DIR` that may hold it.
const BELOW: [&str; 4] = ["lib", "lib64", "lib/x86_64-linux-gnu", ""];

/// Library folders of Debian and its children, of Fedora and its children, of Arch, and of hand-made installations.
const SYSTEM: [&str; 6] = [
    "/usr/lib/x86_64-linux-gnu",
    "/usr/lib64",
    "/usr/lib",
    "/usr/local/lib/x86_64-linux-gnu",
    "/usr/local/lib64",
    "/usr/local/lib",
];

/// A shared library that the program will open.
pub struct Library {
    folder: PathBuf,
    name: &'static str,
}

/// Finds Embree, and fetches it where there is none and nobody forbids it.
///
/// The program is not linked with it: it is told the folder, as one of the places to look (`src/embree/library.rs`).
pub fn find() -> Result<Option<Library>, String> {
    for name in ["EMBREE_DIR", "OCTOLUX_NO_FETCH", "XDG_CACHE_HOME", "HOME"] {
        println!("cargo::rerun-if-env-changed={name}");
    }
    if let Some(prefix) = setting("EMBREE_DIR") {
        let prefix = PathBuf::from(prefix);
        return Library::below(&prefix).map(Some).ok_or_else(|| {
            format!(
                "EMBREE_DIR is {}, but neither it nor its lib/, lib64/ or lib/x86_64-linux-gnu/ holds {}: let it be the \
                 folder above Embree 4's library, or unset it",
                prefix.display(),
                NAMES.join(" or ")
            )
        });
    }
    if let Some(library) = SYSTEM.iter().find_map(|folder| Library::inside(Path::new(folder))) {
        return Ok(Some(library));
    }
    let fetched = wheel::prefix(|prefix| Library::below(prefix).is_some())
        .and_then(|prefix| Library::below(&prefix).ok_or_else(|| "the fetched Embree is incomplete".to_owned()));
    // The build goes on: the program may run where there is an Embree, and says so where there is none.
    fetched.map(Some).or_else(|why| {
        println!("cargo::warning=this build knows no Embree, and the program will look for one when it runs:");
        for line in why.lines() {
            println!("cargo::warning={line}");
        }
        Ok(None)
    })
}

/// An environment variable; one that is set to nothing counts as unset.
pub fn setting(name: &str) -> Option<std::ffi::OsString> {
    env::var_os(name).filter(|value| value != OsStr::new(""))
}

impl Library {
    fn below(prefix: &Path) -> Option<Self> {
        // Absolute, because the program may run anywhere.
        let prefix = prefix.canonicalize().ok()?;
        BELOW.iter().find_map(|folder| Self::inside(&prefix.join(folder)))
    }

    fn inside(folder: &Path) -> Option<Self> {
        let name = NAMES.into_iter().find(|name| folder.join(name).exists())?;
        Some(Self {
            folder: folder.to_owned(),
            name,
        })
    }

    /// Tells Cargo, and through it the program.
    pub fn announce(&self) -> Result<(), String> {
        let folder = self.folder.to_str().ok_or_else(|| {
            format!(
                "the path of Embree's folder must be UTF-8, and {} is not",
                self.folder.display()
            )
        })?;
        println!("cargo::rerun-if-changed={folder}/{}", self.name); // runs again if it disappears
        println!("cargo::rustc-env=OCTOLUX_EMBREE={folder}");
        Ok(())
    }
}
