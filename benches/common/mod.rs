//! What all benches share: short measurements, numbers for inputs, and a note of the circumstances beside criterion's
//! figures, from which `benches/table` makes the tables of `docs/benches.md`.

#![allow(dead_code, reason = "each bench uses a part of it")]

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Duration;

use criterion::Criterion;
use octolux::embree::Device;
use octolux::scene::Scene;
use serde_json::{Value, json};

/// Criterion with short times, so that a whole run takes minutes; its own options (`--measurement-time 5`,
/// `--save-baseline NAME`) come after these and win.
pub fn criterion() -> Criterion {
    Criterion::default()
        .warm_up_time(Duration::from_millis(500))
        .measurement_time(Duration::from_secs(1))
        .sample_size(20)
        .without_plots()
        .configure_from_args()
}

/// Uniform numbers in [0, 1): the golden ratio's sequence, the same in every run.
pub fn uniform(i: usize, stream: u32) -> f32 {
    let bits = (i as u32 + 1)
        .wrapping_mul(0x9e37_79b9)
        .wrapping_add(stream.wrapping_mul(0x85eb_ca6b));
    (mixed(bits) >> 8) as f32 / 16_777_216.0
}

/// A bijection that mixes all bits (murmur3's last step).
pub fn mixed(mut x: u32) -> u32 {
    x = (x ^ (x >> 16)).wrapping_mul(0x85eb_ca6b);
    x = (x ^ (x >> 13)).wrapping_mul(0xc2b2_ae35);
    x ^ (x >> 16)
}

/// A scene of this repository.
pub fn scene(name: &str) -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name);
    Scene::load(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// Writes the circumstances of a bench, and numbers that go with single measurements, beside criterion's figures.
/// Nothing is written by a smoke run (`--test`), which measures nothing.
pub fn note_circumstances(bench: &str, numbers: &BTreeMap<String, Value>) {
    if std::env::args().any(|argument| argument == "--test" || argument == "--list") {
        return;
    }
    let embree = Device::new(1).map_or_else(|error| error.to_string(), |device| device.version());
    let note = json!({
        "commit": option_env!("OCTOLUX_COMMIT").unwrap_or("unknown"),
        "target_features": option_env!("OCTOLUX_TARGET_FEATURES").unwrap_or("unknown"),
        "embree": embree,
        "cpu": cpu(),
        "cores": std::thread::available_parallelism().map_or(0, usize::from),
        "load": std::fs::read_to_string("/proc/loadavg").unwrap_or_default().split(' ').next(),
        "numbers": numbers,
    });
    let folder = criterion_folder().join("octolux");
    let written = std::fs::create_dir_all(&folder)
        .and_then(|()| std::fs::write(folder.join(format!("{bench}.json")), note.to_string()));
    if let Err(error) = written {
        eprintln!("the circumstances of {bench} are not written: {error}");
    }
}

/// Where criterion writes, by its own rules but for the last: a bench lies in `target/release/deps`.
fn criterion_folder() -> PathBuf {
    let variable = |name| std::env::var_os(name).map(PathBuf::from);
    if let Some(home) = variable("CRITERION_HOME") {
        return home;
    }
    let target = variable("CARGO_TARGET_DIR").or_else(|| {
        let program = std::env::current_exe().ok()?;
        Some(program.ancestors().nth(3)?.to_path_buf())
    });
    target.unwrap_or_else(|| "target".into()).join("criterion")
}

fn cpu() -> String {
    let text = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name = text
        .lines()
        .find_map(|line| line.strip_prefix("model name")?.split_once(':'));
    name.map_or("unknown", |(_, name)| name.trim()).to_owned()
}
