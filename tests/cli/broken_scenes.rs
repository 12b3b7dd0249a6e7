//! Every scene of `tests/broken_scenes` ends the real binary with its sentence, exit code 2 and no file.
//!
//! Each states in its first two lines what is said of it: `# expect: ` the sentence, `# help: ` the remedy.

use std::fs;
use std::path::PathBuf;
use std::process::{Command, Stdio};

#[test]
fn broken_scenes_end_with_their_sentence_and_no_file() {
    // The sentences name the scenes as they are seen from the package's folder, where cargo runs tests.
    // Not there before the reader of scene files is merged.
    let Ok(entries) = fs::read_dir("tests/broken_scenes") else {
        return;
    };
    let mut scenes: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    scenes.retain(|path| path.extension().is_some_and(|ending| ending == "toml"));
    // There are machines with room for 256 GiB of picture, on which this scene is not broken.
    scenes.retain(|path| !path.to_string_lossy().contains("too-large-for-memory"));
    scenes.sort();
    assert!(!scenes.is_empty(), "tests/broken_scenes has no scenes");
    let place = tempfile::tempdir().unwrap();
    for scene in scenes {
        let text = String::from_utf8_lossy(&fs::read(&scene).unwrap()).into_owned();
        let stated = |word: &str| text.lines().find_map(|line| line.strip_prefix(word)).map(str::to_owned);
        let output = Command::new(env!("CARGO_BIN_EXE_octolux"))
            .arg("render")
            .arg(&scene)
            .arg("--output")
            .arg(place.path().join("x.exr"))
            .arg("--stats")
            .arg(place.path().join("x.json"))
            .stdin(Stdio::null())
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        let name = scene.display();
        assert_eq!(output.status.code(), Some(2), "{name}: {said}");
        let expected = stated("# expect: ").unwrap_or_else(|| format!("{name}:"));
        assert!(said.starts_with(&format!("error: {expected}")), "{name}: {said}");
        let help = stated("# help: ").unwrap_or_default();
        assert!(
            said.contains(&format!("\nhelp: {help}")) && !said.contains("panicked"),
            "{name}: {said}"
        );
        assert!(output.stdout.is_empty(), "{name}");
        let left: Vec<_> = fs::read_dir(place.path()).unwrap().collect();
        assert!(left.is_empty(), "{name} left {left:?}");
    }
}
