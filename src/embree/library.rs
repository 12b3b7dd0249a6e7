//! Finds and opens Embree's library.
//!
//! The library is opened when the first device is created, not linked. A program using this crate needs no linker flags and can be
//! moved to machines with another Embree. These places are searched in order; the first that has a library is used:
//!
//! 1. the folder named by the environment variable `EMBREE_DIR`, if set: its `lib`, `lib64` and `lib/x86_64-linux-gnu`, and the
//!    folder itself. Then no other place is searched;
//! 2. the folder of the program, and `../lib` from there. If this crate is part of a shared library (e.g. a Python module), the
//!    folder of that library comes first;
//! 3. the folder where `build.rs` found or put a library;
//! 4. the search path of the system's loader (`LD_LIBRARY_PATH`, `ld.so.conf`, the default folders).

use std::env;
use std::error::Error;
use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use libloading::os::unix::{Library, RTLD_LOCAL, RTLD_NOW};

use super::device::EmbreeError;
use super::ffi::Functions;

/// The environment variable that names the parent folder of Embree's library.
pub const EMBREE_DIR: &str = "EMBREE_DIR";

/// File names of the library. Programs link to the first; the second is for developers.
const NAMES: [&str; 2] = ["libembree4.so.4", "libembree4.so"];

/// Subfolders of a prefix: on most systems, on Fedora, on Debian; and the prefix itself.
const BELOW: [&str; 4] = ["lib", "lib64", "lib/x86_64-linux-gnu", ""];

/// Where the build found Embree, if it did.
const BUILT_WITH: Option<&str> = option_env!("OCTOLUX_EMBREE");

/// An open library.
#[derive(Debug)]
pub(crate) struct Embree {
    /// Its functions.
    pub functions: Functions,
    /// The file, or the name given to the system's loader.
    pub path: PathBuf,
}

/// Opens the library on first use. It stays open until the process ends, because its threads may run until then.
pub(crate) fn embree() -> Result<&'static Embree, EmbreeError> {
    static OPEN: OnceLock<Embree> = OnceLock::new();
    if let Some(open) = OPEN.get() {
        return Ok(open);
    }
    let places = Places {
        named: env::var_os(EMBREE_DIR)
            .filter(|value| !value.is_empty())
            .map(PathBuf::from),
        beside: [own_file(), env::current_exe().ok()]
            .into_iter()
            .flatten()
            .filter_map(|file| file.parent().map(Path::to_owned))
            .collect(),
        built: BUILT_WITH.map(PathBuf::from),
    };
    let opened = places.open()?;
    Ok(OPEN.get_or_init(|| opened))
}

/// Places to search before the system's loader.
struct Places {
    named: Option<PathBuf>,
    beside: Vec<PathBuf>,
    built: Option<PathBuf>,
}

impl Places {
    fn open(&self) -> Result<Embree, EmbreeError> {
        if let Some(prefix) = &self.named {
            let file = BELOW.iter().find_map(|folder| library_in(&prefix.join(folder)));
            let file = file.ok_or_else(|| EmbreeError::Missing {
                what: format!(
                    "{EMBREE_DIR} is {}, but neither it nor its lib/, lib64/ or lib/x86_64-linux-gnu/ holds {}",
                    prefix.display(),
                    NAMES[0]
                ),
                remedy: MEND_DIR,
            })?;
            return open(&file);
        }
        let beside = self
            .beside
            .iter()
            .flat_map(|folder| [folder.clone(), folder.join("../lib")]);
        let mut folders = beside.chain(self.built.clone());
        if let Some(file) = folders.find_map(|folder| library_in(&folder)) {
            return open(&file);
        }
        let known = NAMES.into_iter().find_map(|name| {
            // SAFETY: as in `open`.
            let library = unsafe { Library::open(Some(name), RTLD_NOW | RTLD_LOCAL) };
            Some((library.ok()?, name))
        });
        match known {
            Some((library, name)) => functions_of(library, Path::new(name)),
            None => Err(EmbreeError::Missing {
                what: self.nowhere(),
                remedy: INSTALL,
            }),
        }
    }

    /// The error message for a missing library, with the places searched.
    fn nowhere(&self) -> String {
        let beside = self.beside.first().map_or(String::new(), |folder| {
            format!("not beside the program ({} or its ../lib), ", folder.display())
        });
        let built = self.built.as_ref().map_or(String::new(), |folder| {
            format!("not where the build had it ({}), ", folder.display())
        });
        format!(
            "Embree 4 is missing: {EMBREE_DIR} is not set, and {} is {beside}{built}and the system does not know it",
            NAMES[0]
        )
    }
}

const MEND_DIR: &str = "let EMBREE_DIR be the folder above Embree 4's library, or unset it";

const INSTALL: &str = "install Embree 4.3 or later (Debian 13: apt-get install libembree-dev), set EMBREE_DIR to the folder above \
                       its lib/, or put the library and its TBB beside the program";

/// The library in a folder. Names in Python wheels contain a hash.
fn library_in(folder: &Path) -> Option<PathBuf> {
    let known = NAMES.iter().map(|name| folder.join(name)).find(|path| path.exists());
    known.or_else(|| {
        let hashed = |path: &PathBuf| {
            let name = path.file_name().and_then(OsStr::to_str).unwrap_or_default();
            name.starts_with("libembree4-") && name.contains(".so")
        };
        let files = fs::read_dir(folder).ok()?.flatten().map(|file| file.path());
        files.filter(hashed).min()
    })
}

fn open(path: &Path) -> Result<Embree, EmbreeError> {
    // Absolute: for a bare name the loader would search, and Embree would look for its TBB in the working directory.
    let path = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    // SAFETY: opening runs the initialisers of Embree and of what it needs. That a file of this name is Embree is the promise of
    // whoever put it there, as with any linked library.
    let library = unsafe { Library::open(Some(&path), RTLD_NOW | RTLD_LOCAL) };
    let library = library.map_err(|error| EmbreeError::Missing {
        what: format!("Embree cannot be opened: {}", reason(&error)),
        remedy: INSTALL,
    })?;
    functions_of(library, &path)
}

/// The loader's own message, with the file it refers to.
fn reason(error: &libloading::Error) -> String {
    error.source().map_or_else(|| error.to_string(), ToString::to_string)
}

fn functions_of(library: Library, path: &Path) -> Result<Embree, EmbreeError> {
    // SAFETY: the types of the functions are those of Embree's headers since 4.0; `ffi` has them.
    let functions = unsafe { Functions::of(&library) }.map_err(|name| EmbreeError::Missing {
        what: format!("{} is no Embree 4: it has no function {name}", path.display()),
        remedy: INSTALL,
    })?;
    // Never closed, so that the function pointers stay valid.
    std::mem::forget(library);
    Ok(Embree {
        functions,
        path: path.to_owned(),
    })
}

/// The file that this code was loaded from: the program, or a shared library.
fn own_file() -> Option<PathBuf> {
    let here = own_file as fn() -> Option<PathBuf> as usize;
    fs::read_to_string("/proc/self/maps").ok()?.lines().find_map(|line| {
        // "start-end permissions offset device inode path"; the path may hold spaces.
        let (range, rest) = line.split_once(' ')?;
        let (start, end) = range.split_once('-')?;
        let ends = [start, end].map(|text| usize::from_str_radix(text, 16));
        let [Ok(start), Ok(end)] = ends else { return None };
        let path = &rest[rest.find('/')?..];
        (start..end).contains(&here).then(|| PathBuf::from(path))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A folder with an invalid file of the library's name; the loader's error names the file that was chosen.
    fn folder_with(name: &str) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join(name);
        fs::create_dir_all(file.parent().unwrap()).unwrap();
        fs::write(file, "no library").unwrap();
        folder
    }

    fn said(places: &Places) -> (String, &'static str) {
        let error = places.open().unwrap_err();
        (error.to_string(), error.remedy())
    }

    fn path(folder: &tempfile::TempDir) -> PathBuf {
        folder.path().canonicalize().unwrap()
    }

    #[test]
    fn the_first_place_with_a_library_decides() {
        let names = ["lib/libembree4.so.4", "libembree4-1a2b3c4d.so.4", "libembree4.so"];
        let [named, beside, built] = names.map(folder_with);
        let mut places = Places {
            named: Some(path(&named)),
            beside: vec![path(&beside)],
            built: Some(path(&built)),
        };
        for (folder, name) in [&named, &beside, &built].into_iter().zip(names) {
            let (what, _) = said(&places);
            assert!(what.contains(path(folder).join(name).to_str().unwrap()), "{what}");
            // Without this place, the next one is used.
            if places.named.take().is_none() {
                places.beside.clear();
            }
        }
    }

    /// An installed program in `bin` finds the `lib` beside it.
    #[test]
    fn the_lib_beside_bin_is_found() {
        let prefix = folder_with("lib/libembree4.so.4");
        let bin = path(&prefix).join("bin");
        fs::create_dir(&bin).unwrap();
        let places = Places {
            named: None,
            beside: vec![bin],
            built: None,
        };
        let (what, _) = said(&places);
        assert!(
            what.contains(path(&prefix).join("lib/libembree4.so.4").to_str().unwrap()),
            "{what}"
        );
    }

    #[test]
    fn every_layout_of_a_prefix_is_known() {
        for below in ["lib", "lib64", "lib/x86_64-linux-gnu", "."] {
            let prefix = folder_with(&format!("{below}/libembree4.so.4"));
            let places = Places {
                named: Some(path(&prefix)),
                beside: Vec::new(),
                built: None,
            };
            let (what, _) = said(&places);
            assert!(what.contains("cannot be opened"), "{below}: {what}");
        }
    }

    /// A missing library in a user-named folder is an error, not skipped.
    #[test]
    fn a_named_folder_without_a_library_is_an_error() {
        let [empty, beside] = [tempfile::tempdir().unwrap(), folder_with("libembree4.so.4")];
        let places = Places {
            named: Some(path(&empty)),
            beside: vec![path(&beside)],
            built: None,
        };
        let (what, remedy) = said(&places);
        assert!(
            what.contains(EMBREE_DIR) && what.contains(path(&empty).to_str().unwrap()),
            "{what}"
        );
        assert!(remedy.contains("unset"), "{remedy}");
    }

    #[test]
    fn where_it_was_looked_for_is_said() {
        let places = Places {
            named: None,
            beside: vec!["/no/such/bin".into()],
            built: Some("/no/such/cache/lib".into()),
        };
        let what = places.nowhere();
        for place in [EMBREE_DIR, "/no/such/bin", "/no/such/cache/lib", "libembree4.so.4"] {
            assert!(what.contains(place), "{place}: {what}");
        }
    }

    /// The C library lacks Embree's functions.
    #[test]
    fn another_library_of_that_name_is_refused() {
        let maps = fs::read_to_string("/proc/self/maps").unwrap();
        let libc = maps
            .lines()
            .filter_map(|line| Some(&line[line.find('/')?..]))
            .find(|path| path.contains("/libc.so"));
        let folder = tempfile::tempdir().unwrap();
        fs::copy(libc.unwrap(), folder.path().join("libembree4.so.4")).unwrap();
        let places = Places {
            named: Some(path(&folder)),
            beside: Vec::new(),
            built: None,
        };
        let (what, _) = said(&places);
        assert!(what.contains("rtcNewDevice"), "{what}");
    }

    #[test]
    fn this_code_knows_its_own_file() {
        assert_eq!(own_file(), env::current_exe().unwrap().canonicalize().ok());
    }
}
