//! The command line through the real binary: what is refused, what fails, and what is left behind.

use std::fs;
use std::process::{Command, Stdio};

use crate::place::{Place, stderr, stdout};

#[test]
fn one_bad_scene_does_not_stop_the_others() {
    let place = Place::new();
    place.scene("other");
    let output = place.octolux("render in/small.toml in/missing.toml in/other.toml -o {name}.npy --stats {name}.json");
    assert_eq!(output.status.code(), Some(2), "every failure is a bad scene");
    assert_eq!(place.files(), ["other.json", "other.npy", "small.json", "small.npy"]);
    let said = stderr(&output);
    assert!(said.contains("error: in/missing.toml:"), "{said}");
}

#[test]
fn several_scenes_need_several_names() {
    let place = Place::new();
    place.scene("other");
    let said = place.refused("render in/small.toml in/other.toml -o x.exr");
    assert!(
        said.contains("error: x.exr: one file for 2 scenes") && said.contains("help: write {name}"),
        "{said}"
    );
    place.refused("render in/small.toml in/other.toml --stats s.json");
    let said = place.refused("render in/small.toml in/small.toml");
    assert!(said.contains("small.exr: would be written twice"), "{said}");
}

#[test]
fn bad_options_are_refused() {
    let place = Place::new();
    for arguments in [
        "--nonsense",
        "--size 0x5",
        "--size 5",
        "--size 5x",
        "--size -5x5",
        "--size 70000x5",
        "--lanes 3",
        "--spp 0",
        "--spp -1",
        "--spp 1.5",
        "--spp 99999999999999999999",
        "--time 0",
        "--time -1",
        "--time nan",
        "--time inf",
        "--time 1 --spp 1",
        "--threads 0",
        "--threads 100000",
        "--seed 4294967296",
        "--estimator best",
        "--sampler halton",
        "--exposure nan",
        "--exposure 65",
        "--stats s.txt",
        "--stats missing/s.json",
        "-o x.jpg",
        "-o x",
        "-o missing/x.exr",
        "-o in",
        "-o in/",
        "-o in/small.toml",
        "-o in/small.toml/x.png",
        "-o /dev/null",
        "-o a.exr -o a.exr",
    ] {
        place.refused(&format!("render in/small.toml {arguments}"));
    }
    place.refused("render");
    place.refused("paint in/small.toml");
    let said = place.refused("render in/small.toml -o missing/x.exr");
    assert_eq!(
        said,
        "error: missing/x.exr: there is no folder missing\nhelp: create the folder first\n"
    );
}

#[test]
fn a_size_beyond_memory_is_refused() {
    let place = Place::new();
    let said = place.refused("render in/small.toml --size 65536x65536");
    assert!(said.contains("GiB of memory"), "{said}");
}

/// The film alone would fit: 44 bytes a pixel, of which a render to an error needs eight.
#[test]
fn films_of_a_render_to_an_error_count_as_memory() {
    let memory = fs::read_to_string("/proc/meminfo").unwrap();
    let free = memory
        .lines()
        .find_map(|line| line.strip_prefix("MemAvailable:"))
        .unwrap();
    let free: f64 = free.trim().trim_end_matches(" kB").parse().unwrap();
    let side = (free * 1024.0 / 100.0).sqrt().min(65536.0) as u32;
    let place = Place::new();
    let said = place.refused(&format!("render in/small.toml --size {side}x{side} --target-error 0.1"));
    assert!(said.contains("with 32 samples at least take"), "{said}");
}

#[test]
fn a_folder_that_cannot_be_written_to_is_found_before_the_render() {
    let place = Place::new();
    fs::create_dir(place.path().join("x.exr")).unwrap();
    let said = place.refused("render in/small.toml -o x.exr");
    assert!(said.contains("x.exr: is a folder, not a file"), "{said}");
    // Not even root may create files in /proc/1.
    #[cfg(target_os = "linux")]
    place.refused("render in/small.toml -o /proc/1/x.exr");
    let locked = place.path().join("locked");
    fs::create_dir(&locked).unwrap();
    let mut permissions = fs::metadata(&locked).unwrap().permissions();
    permissions.set_readonly(true);
    fs::set_permissions(&locked, permissions).unwrap();
    // Root writes wherever it likes.
    if tempfile::tempfile_in(&locked).is_err() {
        let said = place.refused("render in/small.toml -o locked/x.exr");
        assert!(said.contains("cannot be written to"), "{said}");
    }
}

#[test]
fn a_missing_scene_is_a_sentence() {
    let place = Place::new();
    for scene in ["missing.toml", "in", "..", "."] {
        let said = place.refused(&format!("render {scene}"));
        assert!(said.starts_with(&format!("error: {scene}:")), "{said}");
        place.refused(&format!("explain {scene}"));
    }
}

/// `octolux render --json | head -0`: the reader is gone before the line comes.
#[cfg(unix)]
#[test]
fn a_broken_pipe_is_no_panic() {
    let place = Place::new();
    let mut child = Command::new(env!("CARGO_BIN_EXE_octolux"))
        .args(["render", "in/small.toml", "--json", "--quiet"])
        .current_dir(place.path())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert_eq!((output.status.code(), stderr(&output)), (Some(0), String::new()));
    assert_eq!(place.files(), ["small.exr", "small.png"]);
}

/// The figures were asked for and could not be delivered.
#[cfg(target_os = "linux")]
#[test]
fn standard_output_that_is_full_is_a_failure() {
    let place = Place::new();
    let full = fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
    let output = Command::new(env!("CARGO_BIN_EXE_octolux"))
        .args(["render", "in/small.toml", "--json", "--quiet"])
        .current_dir(place.path())
        .stdout(full)
        .stderr(Stdio::piped())
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(1));
    assert!(
        stderr(&output).starts_with("error: standard output: "),
        "{}",
        stderr(&output)
    );
}

/// Ctrl-c in the middle of a render that would take days: the picture so far is written.
#[cfg(unix)]
#[test]
fn an_interrupted_render_writes_what_there_is() {
    use std::time::{Duration, Instant};
    let place = Place::new();
    place.scene("other");
    let child = Command::new(env!("CARGO_BIN_EXE_octolux"))
        .args([
            "render",
            "in/small.toml",
            "in/other.toml",
            "--spp",
            "1000000000",
            "--snapshots",
            "--json",
        ])
        .args(["-o", "{name}.npy"])
        .current_dir(place.path())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let started = Instant::now();
    while !place.path().join("small_0001spp.npy").exists() {
        assert!(started.elapsed() < Duration::from_secs(60), "no first pass");
        std::thread::sleep(Duration::from_millis(5));
    }
    let killed = Command::new("sh")
        .args(["-c", &format!("kill -INT {}", child.id())])
        .status()
        .unwrap();
    assert!(killed.success());
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130), "{}", stderr(&output));
    assert!(
        stderr(&output).contains("stopping: what is rendered will be written"),
        "{}",
        stderr(&output)
    );
    assert_eq!(
        stdout(&output).lines().count(),
        1,
        "the scenes that were not begun are left"
    );
    let stats: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(stats["interrupted"], true);
    let files = place.files();
    assert!(files.contains(&"small.npy".to_owned()), "{files:?}");
    assert!(
        files
            .iter()
            .all(|name| name.ends_with(".npy") && name.starts_with("small")),
        "{files:?}"
    );
}

/// A disk without room for the picture, played by a limit on the size of files.
#[cfg(target_os = "linux")]
#[test]
fn a_picture_that_does_not_fit_is_a_failure_and_leaves_the_old_one() {
    let place = Place::new();
    fs::write(place.path().join("b.npy"), "old").unwrap();
    let command = format!(
        "trap '' XFSZ; ulimit -f 8; exec '{}' render in/small.toml --size 200x200 --spp 1 -o b.npy -o a.png",
        env!("CARGO_BIN_EXE_octolux")
    );
    let output = Command::new("sh")
        .args(["-c", &command])
        .current_dir(place.path())
        .output()
        .unwrap();
    let said = stderr(&output);
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(
        said.contains("error: b.npy: cannot be written: File too large"),
        "{said}"
    );
    assert!(
        place.files().iter().all(|name| name == "a.png" || name == "b.npy"),
        "{:?}",
        place.files()
    );
    assert_eq!(fs::read(place.path().join("b.npy")).unwrap(), b"old");
}
