//! The command line through the real binary: exit codes, what is said where, and which files there are afterwards.

use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use octolux::film::read_picture;

/// The smallest scene that shows something: one light over one ball, 8 x 6 pixels.
const SCENE: &str = r#"
[camera]
origin = [0.0, 0.0, 6.0]
target = [0.0, 0.0, 0.0]
up     = [0.0, 1.0, 0.0]
fov_x  = 45.0

[film]
width  = 8
height = 6

[render]
spp = 3

[materials.grey]
diffuse = [0.5, 0.5, 0.5]

[[spheres]]
center   = [0.0, 0.0, 0.0]
radius   = 1.0
material = "grey"

[[spheres]]
center   = [0.0, 3.0, 2.0]
radius   = 0.5
emission = [10.0, 10.0, 10.0]
"#;

/// A folder of its own for one test, with `SCENE` as `small.toml` in `in/`.
struct Place(tempfile::TempDir);

impl Place {
    fn new() -> Self {
        let place = Self(tempfile::tempdir().unwrap());
        fs::create_dir(place.0.path().join("in")).unwrap();
        place.scene("small");
        place
    }

    fn scene(&self, name: &str) {
        fs::write(self.0.path().join("in").join(name).with_extension("toml"), SCENE).unwrap();
    }

    fn path(&self) -> &Path {
        self.0.path()
    }

    /// Runs `octolux` in the folder; the arguments are separated by spaces.
    fn octolux(&self, arguments: &str) -> Output {
        Command::new(env!("CARGO_BIN_EXE_octolux"))
            .args(arguments.split_whitespace())
            .current_dir(self.path())
            .stdin(Stdio::null())
            .output()
            .unwrap()
    }

    /// The names in the folder, hidden ones too, without `in`.
    fn files(&self) -> Vec<String> {
        let mut names: Vec<String> = fs::read_dir(self.path())
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .filter(|name| name != "in")
            .collect();
        names.sort();
        names
    }

    /// Runs a command that must be refused as bad usage, and write nothing. Returns what it said.
    #[track_caller]
    fn refused(&self, arguments: &str) -> String {
        let before = self.files();
        let output = self.octolux(arguments);
        let said = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "{arguments}: {said}");
        assert!(
            said.starts_with("error: ") && !said.contains("panicked"),
            "{arguments}: {said}"
        );
        assert!(output.stdout.is_empty(), "{arguments}");
        assert_eq!(self.files(), before, "{arguments}");
        said
    }

    /// Runs a command that must succeed.
    #[track_caller]
    fn succeeds(&self, arguments: &str) -> Output {
        let output = self.octolux(arguments);
        assert_eq!(output.status.code(), Some(0), "{arguments}: {}", stderr(&output));
        output
    }
}

fn stdout(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).unwrap()
}

fn stderr(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).unwrap()
}

#[test]
fn a_render_leaves_an_exr_and_a_png_named_after_the_scene() {
    let place = Place::new();
    let output = place.succeeds("render in/small.toml");
    assert_eq!(place.files(), ["small.exr", "small.png"]);
    let picture = read_picture(&place.path().join("small.exr")).unwrap();
    assert!(picture.width > 0 && picture.pixels.len() == picture.width as usize * picture.height as usize);
    assert!(output.stdout.is_empty(), "standard output carries data only");
    let said = stderr(&output);
    assert!(said.contains("wrote small.exr, small.png"), "{said}");
    assert!(!said.contains('\x1b'), "no colours and no bar into a pipe: {said:?}");
}

#[test]
fn outputs_have_the_size_and_the_formats_that_were_asked_for() {
    let place = Place::new();
    place.succeeds("render in/small.toml --spp 2 --size 20x10 -o a.exr -o b.npy --output c.PNG");
    assert_eq!(place.files(), ["a.exr", "b.npy", "c.PNG"]);
    let (a, b) = (
        read_picture(&place.path().join("a.exr")).unwrap(),
        read_picture(&place.path().join("b.npy")).unwrap(),
    );
    assert_eq!((a.width, a.height), (20, 10));
    assert_eq!(a, b);
}

#[test]
fn snapshots_are_written_after_powers_of_two() {
    let place = Place::new();
    place.succeeds("render in/small.toml --spp 5 --snapshots -o a.png -o a.npy");
    let expected = [
        "a.npy",
        "a.png",
        "a_0001spp.npy",
        "a_0001spp.png",
        "a_0002spp.npy",
        "a_0002spp.png",
    ];
    let files = place.files();
    assert_eq!(files[..6], expected);
    assert_eq!(files[6..], ["a_0004spp.npy", "a_0004spp.png"]);
}

#[test]
fn the_statistics_have_every_key() {
    let place = Place::new();
    let output = place.succeeds("render in/small.toml --spp 4 --seed 7 --threads 2 --lanes 8 --stats s.json --json");
    let line = stdout(&output);
    assert_eq!(line.lines().count(), 1, "one line a scene");
    let printed: serde_json::Value = serde_json::from_str(&line).unwrap();
    let written: serde_json::Value = serde_json::from_slice(&fs::read(place.path().join("s.json")).unwrap()).unwrap();
    assert_eq!(printed, written);
    let keys = "scene width height spp estimator sampler seed lanes threads target_features embree_version commit load_s \
                build_s render_s write_s samples eye_rays shadow_rays samples_per_s rays_per_s invalid_samples kernel \
                needs cpu first_pass_s peak_rss_bytes octolux_version interrupted";
    for key in keys.split_whitespace() {
        assert!(printed.get(key).is_some(), "{key}");
    }
    assert_eq!((&printed["spp"], &printed["seed"]), (&4.into(), &7.into()));
    assert_eq!(printed["scene"], "in/small.toml");
    assert_eq!(printed["estimator"], "mis");
    for cause in ["nan", "inf", "negative"] {
        assert_eq!(printed["invalid_samples"][cause], 0);
    }
}

#[test]
fn an_exr_says_how_it_was_made() {
    use exr::prelude::*;
    let place = Place::new();
    place.succeeds("render in/small.toml --spp 4 --seed 9 --estimator brdf --sampler independent -o a.exr");
    let meta = MetaData::read_from_file(place.path().join("a.exr"), true).unwrap();
    let get = |name: &str| meta.headers[0].own_attributes.other.get(&Text::from(name)).cloned();
    assert_eq!(get("octolux.spp"), Some(AttributeValue::I32(4)));
    assert_eq!(get("octolux.seed"), Some(AttributeValue::I32(9)));
    assert_eq!(get("octolux.estimator"), Some(AttributeValue::Text("brdf".into())));
    assert_eq!(get("octolux.sampler"), Some(AttributeValue::Text("independent".into())));
    assert_eq!(get("octolux.scene"), Some(AttributeValue::Text("in/small.toml".into())));
    for name in [
        "lanes",
        "kernel",
        "version",
        "commit",
        "embree_version",
        "target_features",
    ] {
        assert!(get(&format!("octolux.{name}")).is_some(), "{name}");
    }
}

#[test]
fn quiet_says_nothing() {
    let place = Place::new();
    let output = place.succeeds("render in/small.toml --quiet");
    assert_eq!((stdout(&output), stderr(&output)), (String::new(), String::new()));
}

#[test]
fn a_time_limit_renders_at_least_one_pass() {
    let place = Place::new();
    let output = place.succeeds("render in/small.toml --time 0.000001 --json");
    let stats: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert!(stats["spp"].as_u64() >= Some(1), "{stats}");
}

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

#[test]
fn explain_tells_the_counts_and_the_plan() {
    let place = Place::new();
    let text = stdout(&place.succeeds("explain in/small.toml"));
    for word in ["spheres", "materials", "needs", "kernel", "8 rays a packet"] {
        assert!(text.contains(word), "{text}");
    }
    let json = place.succeeds("explain in/small.toml --json --lanes 1 --size 5x4");
    let object: serde_json::Value = serde_json::from_slice(&json.stdout).unwrap();
    assert_eq!((&object["lanes"], &object["width"]), (&1.into(), &5.into()));
    assert!(place.files().is_empty(), "explain writes no file");
}

#[test]
fn help_and_version_go_to_standard_output() {
    let place = Place::new();
    assert!(stdout(&place.succeeds("--version")).starts_with("octolux 0."));
    assert!(stdout(&place.succeeds("--help")).contains("Examples:"));
    let help = stdout(&place.succeeds("render --help"));
    for word in ["Examples:", "--snapshots", "[default: 8]", "0001spp", "{name}"] {
        assert!(help.contains(word), "{word}: {help}");
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
