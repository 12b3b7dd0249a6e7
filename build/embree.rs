//! Where Embree 4 is: `EMBREE_DIR`, else the system's, else our own copy.

use std::env;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use crate::wheel;

/// The library by its possible names; the second is all there is where only the runtime package is installed.
const NAMES: [&str; 2] = ["libembree4.so", "libembree4.so.4"];

/// Library folders of Debian and its children, of Fedora and its children, of Arch, and of hand-made installations.
const SYSTEM: [&str; 6] = [
    "/usr/lib/x86_64-linux-gnu",
    "/usr/lib64",
    "/usr/lib",
    "/usr/local/lib/x86_64-linux-gnu",
    "/usr/local/lib64",
    "/usr/local/lib",
];

/// A shared library to link.
pub struct Library {
    folder: PathBuf,
    name: &'static str,
}

/// Finds Embree, and fetches it where there is none and nobody forbids it.
pub fn find() -> Result<Library, String> {
    for name in ["EMBREE_DIR", "OCTOLUX_NO_FETCH", "XDG_CACHE_HOME", "HOME"] {
        println!("cargo::rerun-if-env-changed={name}");
    }
    if let Some(prefix) = setting("EMBREE_DIR") {
        let prefix = PathBuf::from(prefix);
        return Library::below(&prefix).ok_or_else(|| {
            format!(
                "EMBREE_DIR is {}, but neither its lib/ nor its lib64/ holds {}: point it at the folder \
                 above Embree 4's library, or unset it",
                prefix.display(),
                NAMES.join(" or ")
            )
        });
    }
    if let Some(library) = SYSTEM.iter().find_map(|folder| Library::inside(Path::new(folder))) {
        return Ok(library);
    }
    wheel::prefix(|prefix| Library::below(prefix).is_some())
        .and_then(|prefix| Library::below(&prefix).ok_or_else(|| "the fetched Embree is incomplete".to_owned()))
}

/// An environment variable; one that is set to nothing counts as unset.
pub fn setting(name: &str) -> Option<std::ffi::OsString> {
    env::var_os(name).filter(|value| value != OsStr::new(""))
}

impl Library {
    fn below(prefix: &Path) -> Option<Self> {
        // Made absolute, because it becomes an rpath.
        let prefix = prefix.canonicalize().ok()?;
        ["lib", "lib64"]
            .iter()
            .find_map(|folder| Self::inside(&prefix.join(folder)))
    }

    fn inside(folder: &Path) -> Option<Self> {
        let name = NAMES.into_iter().find(|name| folder.join(name).exists())?;
        Some(Self {
            folder: folder.to_owned(),
            name,
        })
    }

    /// Tells Cargo.
    pub fn link(&self) -> Result<(), String> {
        let folder = self.folder.to_str().ok_or_else(|| {
            format!(
                "the path of Embree's folder must be UTF-8, and {} is not",
                self.folder.display()
            )
        })?;
        println!("cargo::rerun-if-changed={folder}/{}", self.name); // runs again if it disappears
        println!("cargo::rustc-link-search=native={folder}");
        // Verbatim, because `-lembree4` would not find `libembree4.so.4`.
        println!("cargo::rustc-link-lib=dylib:+verbatim={}", self.name);
        println!("cargo::rustc-link-arg=-Wl,-rpath,{folder}");
        Ok(())
    }
}
