//! Every scene of `tests/broken_scenes` ends the real binary with its sentence, exit code 2 and no file.
//!
//! The first comment of such a scene says what is expected, as in `# error: sphere radius must be positive`; the
//! reader's own tests compare the whole message.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

#[test]
fn broken_scenes_end_with_a_sentence_and_no_file() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/broken_scenes");
    // Not there before the reader of scene files is merged.
    let Ok(entries) = fs::read_dir(&folder) else { return };
    let mut scenes: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    scenes.retain(|path| path.extension().is_some_and(|ending| ending == "toml"));
    scenes.sort();
    assert!(!scenes.is_empty(), "tests/broken_scenes has no scenes");
    let place = tempfile::tempdir().unwrap();
    for scene in scenes {
        for command in ["render", "explain"] {
            let output = Command::new(env!("CARGO_BIN_EXE_octolux"))
                .arg(command)
                .arg(&scene)
                .current_dir(place.path())
                .stdin(Stdio::null())
                .output()
                .unwrap();
            let said = String::from_utf8_lossy(&output.stderr).into_owned();
            let name = scene.display();
            assert_eq!(output.status.code(), Some(2), "{command} {name}: {said}");
            assert!(said.starts_with(&format!("error: {name}:")), "{command} {name}: {said}");
            assert!(
                said.contains("\nhelp: ") && !said.contains("panicked"),
                "{command} {name}: {said}"
            );
            assert!(output.stdout.is_empty(), "{command} {name}");
            let left: Vec<_> = fs::read_dir(place.path()).unwrap().collect();
            assert!(left.is_empty(), "{command} {name} left {left:?}");
        }
    }
}
