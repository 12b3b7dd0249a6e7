//! Cases 39 and 40: files that cannot be written, and malicious input files.

use std::fs;
use std::io;
use std::panic::{AssertUnwindSafe, catch_unwind};

use rand::{Rng, RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::bench;
use super::row::{Check, Checks, Effort};
use crate::film::replace;
use crate::scene::{FilmSize, Scene, SceneBuilder};

/// Case 39: a file is replaced whole or not at all.
pub fn writing(_: Effort) -> Checks {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("picture.exr");
    fs::write(&path, "old")?;
    let full = |_: &mut io::BufWriter<&fs::File>| Err(io::Error::from(io::ErrorKind::StorageFull));
    let cut = |file: &mut io::BufWriter<&fs::File>| {
        io::Write::write_all(file, b"half")?;
        Err(io::Error::from(io::ErrorKind::Interrupted))
    };
    let silent = usize::from(replace::replace(&path, full).is_ok()) + usize::from(replace::replace(&path, cut).is_ok());
    let changed = usize::from(fs::read(&path)? != b"old");
    let left = fs::read_dir(folder.path())?.count() - 1;
    let huge = SceneBuilder {
        film: FilmSize {
            width: 65536,
            height: 65536,
        },
        ..bench::test_point()
    };
    Ok(vec![
        Check::none("failed writes without an error", silent),
        Check::none(
            "older files that a failed write changed, and temporary ones that it left",
            changed + left,
        ),
        Check::none(
            "films of 2^32 pixels that start to allocate",
            usize::from(huge.build().is_ok()),
        ),
    ])
}

/// The plate of [`bench::test_point`], as a scene file.
pub const SPOT: &str = "[camera]\norigin = [-3, 3, 0]\ntarget = [0, 0, 0]\nup = [0, 1, 0]\nfov_x = 0.001\n\
    [film]\nwidth = 32\nheight = 32\n[materials.plate]\ndiffuse = [0.5, 0.5, 0.5]\n[[meshes]]\nmaterial = \"plate\"\n\
    vertices = [[-1, 0, 1], [1, 0, 1], [1, 0, -1], [-1, 0, -1]]\nfaces = [[0, 1, 2, 3]]\n";

/// Seeds of the mutations: one file of each kind that is read.
pub const CORPUS: [(&str, &[u8]); 4] = [
    ("scene.toml", include_bytes!("../../../scenes/tests/two-lights.toml")),
    ("mesh.obj", b"v 0 0 0\nv 1 0 0\nv 0 0 1\nv 1 0 1\nvn 0 1 0\nvt 0 0\nf 1 2 3\nf 2//1 4//1 3//1\nf -1 -2 -3 -4\n"),
    (
        "mesh.ply",
        b"ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
          element face 2\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 0 1\n1 0 1\n3 0 1 2\n3 1 3 2\n",
    ),
    (
        "binary.ply",
        b"ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
          element face 1\nproperty list uchar int vertex_indices\nend_header\n\
          \x00\x00\x00\x00\x00\x00\x00\x00\x00\x00\x00\x00\x00\x00\x80\x3f\x00\x00\x00\x00\x00\x00\x00\x00\
          \x00\x00\x00\x00\x00\x00\x00\x00\x00\x00\x80\x3f\x03\x00\x00\x00\x00\x01\x00\x00\x00\x02\x00\x00\x00",
    ),
];

/// Tokens that parsers often handle wrongly.
const WORDS: [&[u8]; 14] = [
    b"nan",
    b"-1",
    b"4294967296",
    b"99999999999999999999",
    b"1e400",
    b"0",
    b"\xff\xfe",
    b"\0",
    b"[[[[[[[[",
    b"\"",
    b"inf",
    b"\n\n",
    b"-0.0",
    b"18446744073709551615",
];

/// `source` with one to eight random mutations: bytes and tokens inserted, removed, duplicated, moved, bits flipped, the end
/// truncated.
pub fn mutated(source: &[u8], rng: &mut impl Rng) -> Vec<u8> {
    let mut bytes = source.to_vec();
    for _ in 0..rng.random_range(1..=8) {
        let at = rng.random_range(0..=bytes.len());
        let end = (at + rng.random_range(0..24)).min(bytes.len());
        match rng.random_range(0..7) {
            0 if at < bytes.len() => bytes[at] ^= 1 << rng.random_range(0..8),
            1 => _ = bytes.splice(at..at, WORDS[rng.random_range(0..WORDS.len())].iter().copied()),
            2 => _ = bytes.splice(at..end, WORDS[rng.random_range(0..WORDS.len())].iter().copied()),
            3 => _ = bytes.drain(at..end),
            4 => {
                let copy = bytes[at..end].to_vec();
                let to = rng.random_range(0..=bytes.len());
                bytes.splice(to..to, copy);
            }
            5 if rng.random_range(0..8) == 0 => bytes.truncate(at),
            _ if at < bytes.len() => bytes[at] = rng.random(),
            _ => {}
        }
    }
    bytes
}

/// Passes the bytes to the reader of files of that name and returns whether it panicked.
///
/// # Errors
/// If the folder cannot be written to.
pub fn panics(folder: &std::path::Path, name: &str, bytes: &[u8]) -> io::Result<bool> {
    let scene = folder.join("scene.toml");
    let text = if name == "scene.toml" {
        String::from_utf8_lossy(bytes).into_owned()
    } else {
        fs::write(folder.join(name), bytes)?;
        SPOT.to_owned() + &format!("[[meshes]]\nmaterial = \"plate\"\nfile = \"{name}\"\n")
    };
    Ok(catch_unwind(AssertUnwindSafe(|| drop(Scene::parse(&text, &scene)))).is_err())
}

/// Case 40.
pub fn hostile(effort: Effort) -> Checks {
    let folder = tempfile::tempdir()?;
    let mut rng = Pcg64::seed_from_u64(40);
    let mut count = 0;
    let hook = std::panic::take_hook();
    std::panic::set_hook(Box::new(|_| ()));
    for (name, source) in CORPUS {
        for _ in 0..effort.of(400) {
            count += usize::from(panics(folder.path(), name, &mutated(source, &mut rng))?);
        }
    }
    std::panic::set_hook(hook);
    Ok(vec![Check::none(
        "panics over 1600 broken scenes, .obj and .ply files",
        count,
    )])
}
