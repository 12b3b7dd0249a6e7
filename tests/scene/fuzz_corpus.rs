//! What the fuzzers found worth keeping goes through the readers on any compiler: each file is a scene or an error, never
//! a panic. CONTRIBUTING.md says how the corpus is made and grows.

#[path = "../../fuzz/src/lib.rs"]
mod readers;

use std::path::Path;
use std::time::{Duration, Instant};

use rand::{Rng, RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// The files of a kind.
fn corpus(kind: &str) -> Vec<Vec<u8>> {
    let folder = Path::new("fuzz/corpus").join(kind);
    let mut paths: Vec<_> = std::fs::read_dir(&folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .collect();
    // Pictures are few: each is of a kind of its own, made by hand.
    let least = match kind {
        "exr" => 16,
        "hdr" | "jpeg" => 7,
        _ => 20,
    };
    assert!(paths.len() >= least, "{} holds {} files", folder.display(), paths.len());
    paths.sort();
    paths.iter().map(|path| std::fs::read(path).unwrap()).collect()
}

fn read(kind: &str, bytes: &[u8]) {
    match (kind, std::str::from_utf8(bytes)) {
        ("scene", Ok(text)) => readers::scene(text),
        ("scene", Err(_)) => {}
        ("gz", _) => readers::mesh("obj.gz", bytes),
        ("exr" | "hdr" | "jpeg", _) => readers::picture(kind, bytes),
        _ => readers::mesh(kind, bytes),
    }
}

#[test]
fn no_file_of_the_corpus_panics() {
    for kind in [
        "scene", "obj", "ply", "stl", "off", "glb", "gltf", "gz", "exr", "hdr", "jpeg",
    ] {
        corpus(kind).iter().for_each(|bytes| read(kind, bytes));
    }
}

/// A file of the corpus with up to six changes: a bit, a byte, a number of interest, a cut, a piece twice, a piece of another file.
fn changed(files: &[Vec<u8>], rng: &mut impl Rng) -> Vec<u8> {
    let mut bytes = files[rng.random_range(0..files.len())].clone();
    for _ in 0..rng.random_range(1..=6) {
        if bytes.is_empty() {
            break;
        }
        let at = rng.random_range(0..bytes.len());
        let end = (at + rng.random_range(1..=64)).min(bytes.len());
        match rng.random_range(0..8) {
            0 | 1 => bytes[at] ^= 1 << rng.random_range(0..8),
            2 | 3 => bytes[at] = rng.random(),
            4 => {
                let number = [0, 1, -1, i32::MAX, i32::MIN, 65_536, 1 << 24][rng.random_range(0..7)];
                let room = (bytes.len() - at).min(4);
                bytes[at..at + room].copy_from_slice(&number.to_le_bytes()[..room]);
            }
            5 => bytes.truncate(at),
            6 => {
                let piece = bytes[at..end].to_vec();
                bytes.splice(at..at, piece);
            }
            _ => {
                let other = &files[rng.random_range(0..files.len())];
                let from = rng.random_range(0..other.len());
                let piece = other[from..(from + end - at).min(other.len())].to_vec();
                bytes.splice(at..end, piece);
            }
        }
    }
    bytes
}

/// The same with damaged pictures: 500 of each kind in the suite, or as many seconds of each as `OCTOLUX_FUZZ_SECONDS` says. A
/// seeded stand-in for the targets in `fuzz/`, on any compiler.
#[test]
fn no_damaged_picture_panics() {
    let seconds = std::env::var("OCTOLUX_FUZZ_SECONDS")
        .ok()
        .and_then(|text| text.parse().ok());
    let seed = std::env::var("OCTOLUX_FUZZ_SEED")
        .ok()
        .and_then(|text| text.parse().ok());
    for kind in ["exr", "hdr", "jpeg"] {
        let (files, mut rng) = (corpus(kind), Pcg64Mcg::seed_from_u64(seed.unwrap_or(0)));
        let (mut runs, started) = (0_u64, Instant::now());
        while seconds.map_or(runs < 500, |s| started.elapsed() < Duration::from_secs(s)) {
            let bytes = changed(&files, &mut rng);
            if std::panic::catch_unwind(|| read(kind, &bytes)).is_err() {
                let kept = std::env::temp_dir().join(format!("octolux-{kind}-{runs}"));
                std::fs::write(&kept, &bytes).unwrap();
                panic!("run {runs} of {kind} panics; its file is {}", kept.display());
            }
            runs += 1;
        }
        println!("{kind}: {runs} runs");
    }
}
