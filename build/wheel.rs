//! Our own copy of Embree, taken from the wheel that Python's `embreex` is published as.
//!
//! Debian 12 has only Embree 3, and an own build of Embree 4 takes minutes. The wheel carries the library and its TBB,
//! needs glibc 2.27 and nothing else, and unpacks in seconds. It goes into a cache outside `target/`, so that `cargo
//! clean` and a second checkout do not download it again.

use std::ffi::OsStr;
use std::fs::{self, File};
use std::io;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::time::SystemTime;

use crate::embree::setting;

const PACKAGE: &str = "embreex==4.4.0.post1";
const SHA256: &str = "2cd0f7d5c6342e6247e31f700761689cae7829454d8c6de0c41e62124a023e1f";
/// The one file whose checksum that is, whichever Python runs pip.
const PLATFORM: [&str; 6] = [
    "--platform",
    "manylinux_2_28_x86_64",
    "--python-version",
    "311",
    "--implementation",
    "cp",
];
const NAME: &str = "embree-4.4.0";

const ADVICE: &str = "install Embree 4.3 or later (Debian 13: apt-get install libembree-dev), or set EMBREE_DIR to the \
                      folder above its lib/";

/// The folder above `lib/libembree4.so`; filled now if it is not `complete` yet.
pub fn prefix(complete: impl Fn(&Path) -> bool) -> Result<PathBuf, String> {
    let parents = caches();
    if let Some(found) = parents
        .iter()
        .map(|parent| parent.join(NAME))
        .find(|prefix| complete(prefix))
    {
        return Ok(found);
    }
    if setting("OCTOLUX_NO_FETCH").is_some_and(|value| value != "0") {
        return Err(format!(
            "no Embree 4 found, and OCTOLUX_NO_FETCH forbids to download it\n{ADVICE}, or unset OCTOLUX_NO_FETCH"
        ));
    }
    let (parent, _lock) = parents
        .into_iter()
        .find_map(|parent| lock(&parent).ok().map(|lock| (parent, lock)))
        .ok_or("no folder can be written to for the Embree library: neither the cache nor Cargo's OUT_DIR")?;
    let prefix = parent.join(NAME);
    // Another build may have filled it while this one waited for the lock.
    if !complete(&prefix) {
        let work = parent.join(format!("{NAME}.unfinished"));
        let filled = fill(&work, &prefix).map_err(|why| format!("{why}\nOr {ADVICE}"));
        remove(&work).and(filled)?;
        // Not said by `cargo::warning`: Cargo repeats those with every command, and that it was downloaded is no warning.
    }
    Ok(prefix)
}

/// Where the copy may live, best first.
fn caches() -> Vec<PathBuf> {
    let cache = setting("XDG_CACHE_HOME")
        .map(PathBuf::from)
        .filter(|path| path.is_absolute()) // the XDG specification: relative ones are to be ignored
        .or_else(|| setting("HOME").map(|home| Path::new(&home).join(".cache")));
    let last_resort = setting("OUT_DIR").map(PathBuf::from);
    cache
        .into_iter()
        .map(|path| path.join("octolux"))
        .chain(last_resort)
        .collect()
}

/// Holds other builds off. The kernel gives the lock back even if this process is killed.
fn lock(parent: &Path) -> io::Result<File> {
    fs::create_dir_all(parent)?;
    let file = File::create(parent.join(format!("{NAME}.lock")))?;
    file.lock()?;
    Ok(file)
}

/// Downloads, checks and unpacks in `work`, and renames what is complete to `prefix`: a prefix is whole or absent.
fn fill(work: &Path, prefix: &Path) -> Result<(), String> {
    remove(work)?; // left by a build that was killed
    let (wheels, tree, made) = (work.join("wheel"), work.join("tree"), work.join("made"));
    fs::create_dir_all(made.join("lib")).map_err(|why| format!("cannot make {}: {why}", made.display()))?;

    download(&wheels)?;
    let wheel = entry(&wheels, |name| name.ends_with(".whl")).ok_or("pip downloaded no wheel")?;
    let sum = "import hashlib, sys; print(hashlib.sha256(open(sys.argv[1], 'rb').read()).hexdigest())";
    let sum = python(
        [OsStr::new("-c"), OsStr::new(sum), wheel.as_os_str()],
        "cannot read the wheel",
    )?;
    if sum.trim() != SHA256 {
        return Err(format!(
            "the wheel of {PACKAGE} has SHA-256 {}, but {SHA256} is expected: not used",
            sum.trim()
        ));
    }
    let unzip = [
        OsStr::new("-m"),
        OsStr::new("zipfile"),
        OsStr::new("-e"),
        wheel.as_os_str(),
        tree.as_os_str(),
    ];
    python(unzip, "cannot unpack the wheel")?;

    install(&tree.join("embreex.libs"), &made.join("lib")).map_err(|why| format!("cannot unpack the wheel: {why}"))?;
    remove(prefix)?; // here only if it was damaged
    fs::rename(&made, prefix).map_err(|why| format!("cannot make {}: {why}", prefix.display()))
}

fn download(wheels: &Path) -> Result<(), String> {
    python(
        ["-m", "pip", "--version"].map(OsStr::new),
        "python3 has no pip (Debian: apt-get install python3-pip)",
    )?;
    let mut arguments = [
        "-m",
        "pip",
        "download",
        "-q",
        "--disable-pip-version-check",
        "--no-deps",
        "--only-binary=:all:",
    ]
    .map(OsStr::new)
    .to_vec();
    arguments.extend(PLATFORM.map(OsStr::new));
    arguments.extend([OsStr::new("-d"), wheels.as_os_str(), OsStr::new(PACKAGE)]);
    python(arguments, &format!("pip cannot download {PACKAGE} (no network?)")).map(drop)
}

/// Moves the libraries, and gives Embree's, whose name holds a hash, a name that the program looks for.
fn install(from: &Path, to: &Path) -> io::Result<()> {
    for file in fs::read_dir(from)? {
        let file = file?;
        fs::rename(file.path(), to.join(file.file_name()))?;
    }
    let library = entry(to, |name| name.starts_with("libembree4-")).ok_or(io::ErrorKind::NotFound)?;
    // Cargo watches this file, and would find it newer than the run that made it: everything would be compiled twice.
    File::open(&library)?.set_modified(SystemTime::UNIX_EPOCH)?;
    symlink(library.file_name().unwrap_or_default(), to.join("libembree4.so"))
}

/// The first file of a folder whose name fits.
fn entry(folder: &Path, fits: impl Fn(&str) -> bool) -> Option<PathBuf> {
    let files = fs::read_dir(folder).ok()?.flatten().map(|file| file.path());
    files
        .into_iter()
        .find(|path| path.file_name().and_then(OsStr::to_str).is_some_and(&fits))
}

/// What Python prints; if it fails, `trouble` and the last line that it complained with.
fn python<'a>(arguments: impl IntoIterator<Item = &'a OsStr>, trouble: &str) -> Result<String, String> {
    let Output { status, stdout, stderr } =
        Command::new("python3")
            .args(arguments)
            .output()
            .map_err(|why| match why.kind() {
                io::ErrorKind::NotFound => {
                    "no Embree 4 found, and to download it takes python3 with pip: no python3 in PATH".to_owned()
                }
                _ => format!("cannot run python3: {why}"),
            })?;
    if status.success() {
        return Ok(String::from_utf8_lossy(&stdout).into_owned());
    }
    let complaint = String::from_utf8_lossy(&stderr);
    let last = complaint
        .lines()
        .rev()
        .map(str::trim)
        .find(|line| !line.is_empty())
        .unwrap_or("no reason given");
    Err(format!("{trouble}: {last}"))
}

fn remove(folder: &Path) -> Result<(), String> {
    match fs::remove_dir_all(folder) {
        Err(why) if why.kind() != io::ErrorKind::NotFound => Err(format!("cannot remove {}: {why}", folder.display())),
        _ => Ok(()),
    }
}
