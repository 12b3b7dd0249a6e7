//! `octolux batch` through the real binary: what is rendered, what is left alone, what is said.

use std::fs;

use crate::place::{Place, stderr, stdout};

/// Five pictures of two scenes, one of which is missing.
const MANIFEST: &str = r#"
[defaults]
spp     = 2
outputs = ["out/{name}.npy", "out/{name}.exr"]

[[pictures]]
scenes = ["in/small.toml", "in/other.toml"]

[[pictures]]
scene   = "in/small.toml"
outputs = ["out/more.npy"]
spp     = 5
seed    = 7
size    = "9x7"

[[pictures]]
scene   = "in/missing.toml"

[[pictures]]
scene    = "in/small.toml"
outputs  = ["out/bright.png"]
exposure = -1.5
adaptive = true
"#;

fn place() -> Place {
    let place = Place::new();
    place.scene("other");
    fs::create_dir(place.path().join("out")).unwrap();
    fs::write(place.path().join("jobs.toml"), MANIFEST).unwrap();
    place
}

/// The scenes of the lines of JSON, sorted, each with its samples.
fn rendered(place: &Place, status: i32) -> Vec<String> {
    let output = place.octolux("batch jobs.toml");
    assert_eq!(output.status.code(), Some(status), "{}", stderr(&output));
    let of_line = |line: &str| {
        let stats: serde_json::Value = serde_json::from_str(line).unwrap();
        format!("{} {}", stats["scene"].as_str().unwrap(), stats["spp"])
    };
    let mut lines: Vec<String> = stdout(&output).lines().map(of_line).collect();
    lines.sort();
    lines
}

#[test]
fn scenes_that_are_rendered_side_by_side_have_the_bits_of_each_alone() {
    let place = Place::new();
    let names = ["small", "other", "third"];
    names[1..].iter().for_each(|name| place.scene(name));
    place.succeeds("render in/small.toml in/other.toml in/third.toml --spp 9 -o {name}.npy -o {name}.exr");
    for name in names {
        place.succeeds(&format!(
            "render in/{name}.toml --spp 9 -o alone.npy -o alone.exr --threads 2"
        ));
        for ending in ["npy", "exr"] {
            let bytes = |name: &str| fs::read(place.path().join(format!("{name}.{ending}"))).unwrap();
            assert!(bytes(name) == bytes("alone"), "{name}.{ending}");
        }
    }
    let output = place.octolux("render in/small.toml in/missing.toml in/other.toml --spp 2 -o 2-{name}.npy --json");
    assert_eq!(output.status.code(), Some(2));
    assert_eq!(
        stdout(&output).lines().count(),
        2,
        "a bad scene does not stop the others"
    );
    assert!(stderr(&output).contains("missing.toml"), "{}", stderr(&output));
}

#[test]
fn a_batch_renders_what_is_missing_or_changed() {
    let place = place();
    let all = [
        "in/other.toml 2",
        "in/small.toml 2",
        "in/small.toml 2",
        "in/small.toml 5",
    ];
    assert_eq!(
        rendered(&place, 2),
        all,
        "a scene that is missing is reported, the rest goes on"
    );
    let none: [&str; 0] = [];
    assert_eq!(rendered(&place, 2), none, "everything is there");
    place.scene("missing");
    assert_eq!(rendered(&place, 0), ["in/missing.toml 2"]);
    fs::remove_file(place.path().join("out/more.npy")).unwrap();
    fs::write(place.path().join("out/other.exr"), "changed").unwrap();
    assert_eq!(rendered(&place, 0), ["in/other.toml 2", "in/small.toml 5"]);
    let other = place.path().join("in/other.toml");
    let text = fs::read_to_string(&other)
        .unwrap()
        .replace("radius   = 0.5", "radius   = 0.6");
    fs::write(&other, text).unwrap();
    assert_eq!(rendered(&place, 0), ["in/other.toml 2"], "a scene that has changed");
    fs::write(
        place.path().join("jobs.toml"),
        MANIFEST.replace("spp     = 5", "spp     = 6"),
    )
    .unwrap();
    assert_eq!(rendered(&place, 0), ["in/small.toml 6"], "a setting that has changed");
    // A line of the notes that a kill has cut.
    let notes = place.path().join("jobs.done.jsonl");
    let text = fs::read_to_string(&notes).unwrap();
    fs::write(&notes, &text[..text.len() - 9]).unwrap();
    assert_eq!(rendered(&place, 0), ["in/small.toml 6"]);
    assert_eq!(rendered(&place, 0), none);
    // On and off are true and false in TOML.
    for robust in ["\"off\"", "false"] {
        let text = format!("[[pictures]]\nscene = \"in/small.toml\"\nspp = 4\naccel = \"embree\"\nrobust = {robust}\n");
        fs::write(place.path().join("jobs.toml"), text).unwrap();
        let expected: &[&str] = if robust == "false" { &none } else { &["in/small.toml 4"] };
        assert_eq!(rendered(&place, 0), expected, "{robust}");
    }
    let text = "[[pictures]]\nscene = \"in/small.toml\"\nspp = 4\naccel = \"embree\"\nrobust = true\n";
    fs::write(place.path().join("jobs.toml"), text).unwrap();
    assert_eq!(rendered(&place, 0), ["in/small.toml 4"], "another robust");
}

#[test]
fn a_picture_of_a_batch_is_that_of_a_render() {
    let place = place();
    place.scene("missing");
    place.succeeds("batch jobs.toml -q");
    place.succeeds("render in/small.toml --spp 5 --seed 7 --size 9x7 -o alone.npy");
    let bytes = |name: &str| fs::read(place.path().join(name)).unwrap();
    assert!(bytes("alone.npy") == bytes("out/more.npy"));
}

#[test]
fn a_batch_of_which_nothing_comes_leaves_nothing_behind() {
    let place = Place::new();
    let text = "[[pictures]]\nscene = \"in/missing.toml\"\noutputs = \"new/deep/a.exr\"\n";
    fs::write(place.path().join("jobs.toml"), text).unwrap();
    let said = place.refused("batch jobs.toml");
    assert!(said.contains("in/missing.toml: "), "{said}");
    // Beside a picture that is made, the folder of one that is not goes, too.
    let text = format!("{text}[[pictures]]\nscene = \"in/small.toml\"\noutputs = \"new/b.exr\"\n");
    fs::write(place.path().join("jobs.toml"), text).unwrap();
    assert_eq!(place.octolux("batch jobs.toml").status.code(), Some(2));
    assert_eq!(place.files(), ["jobs.done.jsonl", "jobs.toml", "new"]);
    assert!(place.path().join("new/b.exr").exists() && !place.path().join("new/deep").exists());
}

#[test]
fn patterns_stand_for_scenes_folders_are_made_and_the_end_is_summed_up() {
    let place = Place::new();
    place.scene("other");
    fs::write(place.path().join("in/bad.toml"), "[film]\n").unwrap();
    let text = "[[pictures]]\nscene = \"in/*.toml\"\nspp = 2\noutputs = [\"new/deep/{name}.npy\"]\n";
    fs::write(place.path().join("jobs.toml"), text).unwrap();
    let output = place.octolux("batch jobs.toml");
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    assert_eq!(
        stdout(&output).lines().count(),
        2,
        "a line of JSON for each, as this is no terminal"
    );
    let said = stderr(&output);
    assert!(said.contains("batch: 2 of 3 pictures rendered, 1 failed, "), "{said}");
    assert!(place.path().join("new/deep/other.npy").exists());
    let said = stderr(&place.octolux("batch jobs.toml"));
    assert!(
        said.contains("batch: 0 of 3 pictures rendered, 2 there already, 1 failed, "),
        "{said}"
    );
    place.succeeds("render in/s*.toml in/ot?er.toml -o {name}.npy");
    assert!(place.files().contains(&"other.npy".to_owned()));
    let said = place.refused("render in/nothing-*.toml");
    assert!(said.contains("in/nothing-*.toml: no file matches"), "{said}");
}

/// What a terminal shows after carriage returns and codes: the last text of each line.
fn shown(typescript: &[u8]) -> Vec<String> {
    let text = String::from_utf8_lossy(typescript).into_owned();
    let mut plain = String::new();
    let mut rest = text.chars().peekable();
    while let Some(next) = rest.next() {
        if next == '\u{1b}' && rest.next_if_eq(&'[').is_some() {
            // A code ends at its letter.
            while rest.next_if(|c| !c.is_ascii_alphabetic()).is_some() {}
            let _ = rest.next();
        } else {
            plain.push(next);
        }
    }
    let lines = plain.split('\n').map(|line| line.trim_end_matches('\r'));
    lines
        .map(|line| line.rsplit('\r').next().unwrap_or_default().to_owned())
        .collect()
}

/// `script` of util-linux gives the program a terminal; where there is none, there is nothing to test with.
#[test]
fn on_a_terminal_a_batch_prints_a_short_line_a_picture_and_sums_up() {
    let place = Place::new();
    place.scene("other");
    let text = "[[pictures]]\nscenes = [\"in/small.toml\", \"in/other.toml\", \"in/missing.toml\"]\noutputs = [\"{name}.npy\"]\n";
    fs::write(place.path().join("jobs.toml"), text).unwrap();
    let on_a_terminal = |arguments: &str| {
        let command = format!("{} {arguments}", env!("CARGO_BIN_EXE_octolux"));
        let mut script = std::process::Command::new("script");
        script
            .args(["-q", "-e", "-c", &command, "/dev/null"])
            .current_dir(place.path());
        script.env("TERM", "xterm").stdin(std::process::Stdio::null()).output()
    };
    let output = match on_a_terminal("batch jobs.toml") {
        Ok(output) => output,
        Err(error) => return eprintln!("not tested: script: {error}"),
    };
    let lines = shown(&output.stdout);
    assert_eq!(output.status.code(), Some(2), "{lines:?}");
    for name in ["small", "other"] {
        let of = |line: &&String| line.starts_with(&format!("{name}.npy: "));
        let line = lines.iter().find(of).unwrap_or_else(|| panic!("{name}: {lines:?}"));
        assert!(line.chars().count() < 80, "{line}");
    }
    assert!(!lines.iter().any(|line| line.contains("{\"")), "no JSON: {lines:?}");
    let last = lines.iter().rfind(|line| !line.trim().is_empty()).unwrap();
    assert!(
        last.starts_with("batch: 2 of 3 pictures rendered, 1 failed, "),
        "{lines:?}"
    );
    let output = on_a_terminal("batch jobs.toml --again --json").unwrap();
    let lines = shown(&output.stdout);
    assert_eq!(
        lines.iter().filter(|line| line.starts_with("{\"")).count(),
        2,
        "{lines:?}"
    );
}

#[test]
fn each_note_is_told_once_and_not_where_nothing_is_rendered() {
    let place = Place::new();
    let scene = place.path().join("in/small.toml");
    let text = fs::read_to_string(&scene)
        .unwrap()
        .replace("diffuse = [0.5, 0.5, 0.5]", "diffuse = [128, 128, 128]");
    fs::write(&scene, text).unwrap();
    let picture =
        |seed: u32| format!("[[pictures]]\nscene = \"in/small.toml\"\nseed = {seed}\noutputs = [\"{seed}.npy\"]\n");
    fs::write(place.path().join("jobs.toml"), [1, 2, 3].map(picture).concat()).unwrap();
    let said = stderr(&place.succeeds("batch jobs.toml"));
    assert_eq!(said.matches("divide it by 255").count(), 1, "{said}");
    assert!(
        said.contains("in/small.toml: material grey reflects 128 times the light"),
        "{said}"
    );
    assert!(!stderr(&place.succeeds("batch jobs.toml")).contains("note:"));
}
