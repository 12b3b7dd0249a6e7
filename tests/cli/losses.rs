//! What happens to long renders when disks fill, folders go, files change and memory is short: a sentence, and a whole file
//! or none.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use crate::place::{Place, stderr};

/// 12 leaves; the state takes 200 kB, the picture 49.
const RENDER: &str = "render in/small.toml --size 64x64 --spp 768 --checkpoint state --resume";

/// Longer than anybody waits for.
const ENDLESS: &str = "render in/small.toml --size 64x64 --spp 1000000000 --checkpoint state --every 0.01 --resume";

fn bytes(place: &Place, name: &str) -> Vec<u8> {
    fs::read(place.path().join(name)).unwrap()
}

fn begin(place: &Place, arguments: &str) -> Child {
    Command::new(env!("CARGO_BIN_EXE_octolux"))
        .args(arguments.split_whitespace())
        .current_dir(place.path())
        .stdin(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

fn wait_for(path: &Path) {
    let started = Instant::now();
    while !path.exists() {
        assert!(
            started.elapsed() < Duration::from_secs(60),
            "{} does not come",
            path.display()
        );
        std::thread::sleep(Duration::from_millis(2));
    }
}

fn signal(child: &Child, name: &str) {
    let command = format!("kill -{name} {}", child.id());
    assert!(Command::new("sh").args(["-c", &command]).status().unwrap().success());
}

/// A tiny disk in memory, for as long as it lives; `None`, with a sentence, where one cannot be mounted.
struct Disk(PathBuf);

impl Disk {
    fn mount(place: &Place, name: &str, size: &str) -> Option<Self> {
        let path = place.path().join(name);
        fs::create_dir(&path).unwrap();
        let size = format!("size={size}");
        let mount = Command::new("mount")
            .args(["-t", "tmpfs", "-o", &size, "none"])
            .arg(&path)
            .output();
        if mount.is_ok_and(|output| output.status.success()) {
            return Some(Self(path));
        }
        println!("skipped: a disk in memory can be mounted by root alone");
        None
    }
}

impl Drop for Disk {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg(&self.0).output();
    }
}

#[test]
fn a_full_disk_costs_no_sample() {
    let place = Place::new();
    place.succeeds(&format!("{RENDER} -q -o whole.npy"));
    let Some(_disk) = Disk::mount(&place, "full", "32k") else {
        return;
    };
    // The picture does not fit: the state is kept, whole, and the picture made of it where there is room.
    let output = place.octolux(&format!("{RENDER} -q -o full/a.npy"));
    assert_eq!(output.status.code(), Some(1));
    let said = stderr(&output);
    assert!(
        said.starts_with("error: full/a.npy: cannot be written: No space left"),
        "{said}"
    );
    assert_eq!(
        fs::read_dir(place.path().join("full")).unwrap().count(),
        0,
        "nothing half-written"
    );
    let output = place.succeeds(&format!("{RENDER} -o a.npy"));
    assert!(
        stderr(&output).contains("state: going on after 768 passes"),
        "{}",
        stderr(&output)
    );
    assert!(bytes(&place, "a.npy") == bytes(&place, "whole.npy"));
    // The state does not fit: a warning, and the render goes on.
    let output = place.succeeds(
        &format!("{RENDER} -q --checkpoint full/state --every 0.001 -o b.npy").replacen("--checkpoint state", "", 1),
    );
    assert!(
        stderr(&output).contains("warning: full/state: cannot be written: No space left"),
        "{}",
        stderr(&output)
    );
    assert!(bytes(&place, "b.npy") == bytes(&place, "whole.npy"));
}

/// The picture fits below the limit, the state does not.
#[test]
fn a_state_that_was_to_be_kept_and_is_not_is_a_failure() {
    let place = Place::new();
    let run = |arguments: &str| {
        let program = env!("CARGO_BIN_EXE_octolux");
        let command = format!("trap '' XFSZ; ulimit -f 200; exec '{program}' {RENDER} -q -o a.npy {arguments}");
        let mut sh = Command::new("sh");
        sh.args(["-c", &command]).current_dir(place.path()).output().unwrap()
    };
    let output = run("--keep");
    let said = stderr(&output);
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(
        said.starts_with("error: state: cannot be written: File too large"),
        "{said}"
    );
    assert_eq!(place.files(), ["a.npy"], "the picture is written, and nothing else");
    // Nobody asked to keep it.
    let output = run("");
    assert_eq!((output.status.code(), stderr(&output)), (Some(0), String::new()));
}

#[test]
fn a_folder_that_goes_during_the_render_costs_no_sample() {
    let place = Place::new();
    fs::create_dir(place.path().join("out")).unwrap();
    let child = begin(&place, &format!("{ENDLESS} -q -o out/a.npy"));
    wait_for(&place.path().join("state"));
    fs::remove_dir(place.path().join("out")).unwrap();
    signal(&child, "INT");
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130));
    let said = stderr(&output);
    assert!(
        said.contains("error: out/a.npy: cannot be written: No such file or directory"),
        "{said}"
    );
    assert!(place.files().contains(&"state".to_owned()));
    let said = place.refused(&format!("{ENDLESS} -q -o out/a.npy"));
    assert!(said.contains("there is no folder out"), "{said}");
}

#[test]
fn two_interrupts_leave_whole_files_or_none() {
    let place = Place::new();
    let mut twice = 0;
    for round in 0..12 {
        let child = begin(
            &place,
            &format!("{ENDLESS} -o a.npy -o a.exr").replace("64x64", "400x400"),
        );
        wait_for(&place.path().join("state"));
        signal(&child, "INT");
        std::thread::sleep(Duration::from_millis(round));
        // Gone already, perhaps: then it was the first one that ended it.
        let _ = Command::new("sh")
            .args(["-c", &format!("kill -INT {} 2>/dev/null", child.id())])
            .status();
        let output: Output = child.wait_with_output().unwrap();
        assert_eq!(output.status.code(), Some(130), "{}", stderr(&output));
        for name in place.files() {
            assert!(["a.npy", "a.exr", "state"].contains(&name.as_str()), "{name} is left");
        }
        twice += u32::from(!place.path().join("a.exr").exists());
        for name in ["a.npy", "a.exr"] {
            let path = place.path().join(name);
            if path.exists() {
                octolux::film::read_picture(&path).unwrap();
                fs::remove_file(&path).unwrap();
            }
        }
        fs::remove_file(place.path().join("state")).unwrap();
    }
    println!("{twice} of 12 were ended by the second one");
}

#[test]
fn a_mesh_that_changes_under_a_render_is_noticed_when_it_is_taken_up_again() {
    let place = Place::new();
    let scene = place.path().join("in/small.toml");
    let mesh = "\n[[meshes]]\nfile = \"floor.obj\"\nmaterial = \"grey\"\n";
    fs::write(&scene, fs::read_to_string(&scene).unwrap() + mesh).unwrap();
    let floor = |y: i32| {
        fs::write(
            place.path().join("in/floor.obj"),
            format!("v -9 {y} 9\nv 9 {y} 9\nv 0 {y} -9\nf 1 2 3\n"),
        )
    };
    floor(-1).unwrap();
    place.succeeds(&format!("{RENDER} -q -o whole.npy"));
    let child = begin(&place, &format!("{ENDLESS} -q -o a.npy"));
    wait_for(&place.path().join("state"));
    floor(-2).unwrap();
    signal(&child, "INT");
    assert_eq!(child.wait_with_output().unwrap().status.code(), Some(130));
    let said = place.refused(&format!("{ENDLESS} -q -o a.npy"));
    assert!(
        said.contains("state: belongs to another render than that of in/small.toml: scene is in/small.toml ("),
        "{said}"
    );
    floor(-1).unwrap();
    let child = begin(&place, &format!("{ENDLESS} -o a.npy"));
    std::thread::sleep(Duration::from_millis(300));
    signal(&child, "INT");
    let output = child.wait_with_output().unwrap();
    assert!(stderr(&output).contains("state: going on after"), "{}", stderr(&output));
}

#[test]
fn memory_that_is_not_there_is_told_before_it_is_taken() {
    let place = Place::new();
    // The film alone, of 40 bytes a pixel, fits; the nodes of so many passes, of 24 bytes each, do not.
    let free = octolux::scene::available_memory().unwrap();
    let side = ((free / 200) as f64).sqrt() as u32;
    let said = place.refused(&format!("render in/small.toml --size {side}x{side} --spp 1073741824"));
    let words = format!("error: in/small.toml: {side} x {side} pixels with 1073741824 samples take ");
    assert!(said.starts_with(&words) && said.contains("GiB are free"), "{said}");
}
