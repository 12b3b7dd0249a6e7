//! Lays Embree and its TBB where maturin takes them into the wheel: the copy that Octolux fetches, or that of `EMBREE_DIR`.

// A copy of its own may be needed where the system has one, so not all of these are used here.
#[allow(dead_code)]
#[path = "../build/embree.rs"]
mod embree;
#[path = "../build/wheel.rs"]
mod wheel;

use std::env;
use std::fs;
use std::path::{Path, PathBuf};

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-changed=../build");
    for name in ["EMBREE_DIR", "OCTOLUX_NO_FETCH", "XDG_CACHE_HOME", "HOME"] {
        println!("cargo::rerun-if-env-changed={name}");
    }
    if let Err(why) = run() {
        for line in why.lines() {
            println!("cargo::error={line}");
        }
    }
}

/// A system's Embree needs that system; the fetched one needs glibc 2.27 alone, so a wheel with it runs elsewhere.
fn run() -> Result<(), String> {
    let prefix = match embree::setting("EMBREE_DIR") {
        Some(prefix) => PathBuf::from(prefix),
        None => wheel::prefix(|prefix| !libraries(prefix).is_empty())?,
    };
    let out = PathBuf::from(env::var_os("OUT_DIR").ok_or("Cargo sets no OUT_DIR")?);
    let files = libraries(&prefix);
    if files.is_empty() {
        return Err(format!("{} holds no libembree4 with its TBB", prefix.display()));
    }
    for file in files {
        let to = out.join(file.file_name().unwrap_or_default());
        fs::copy(&file, &to).map_err(|why| format!("cannot copy {} to {}: {why}", file.display(), to.display()))?;
    }
    Ok(())
}

/// The libraries of a prefix, links left out: Embree under the name that it has, and what it needs beside it.
fn libraries(prefix: &Path) -> Vec<PathBuf> {
    let folders = ["lib", "lib64", "lib/x86_64-linux-gnu", ""].map(|below| prefix.join(below));
    let found = folders.iter().map(|folder| {
        let files = fs::read_dir(folder)
            .into_iter()
            .flatten()
            .flatten()
            .map(|file| file.path());
        files.filter(|path| is_library(path)).collect::<Vec<_>>()
    });
    let whole = |files: &Vec<PathBuf>| {
        ["libembree4", "libtbb"]
            .iter()
            .all(|name| files.iter().any(|file| begins(file, name)))
    };
    found.filter(whole).next().unwrap_or_default()
}

fn is_library(path: &Path) -> bool {
    let plain = path.symlink_metadata().is_ok_and(|data| data.is_file());
    plain
        && ["libembree4", "libtbb-", "libtbb."]
            .iter()
            .any(|name| begins(path, name))
}

fn begins(path: &Path, name: &str) -> bool {
    path.file_name()
        .and_then(|file| file.to_str())
        .is_some_and(|file| file.starts_with(name) && file.contains(".so"))
}
