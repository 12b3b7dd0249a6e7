//! Each file in `tests/broken_scenes` is wrong in one way and states, in its first two lines, exactly what is said of
//! it: `# expect:` the sentence, `# help:` the remedy.

use std::collections::BTreeSet;
use std::panic::catch_unwind;
use std::path::{Path, PathBuf};

use octolux::scene::Scene;

const FOLDER: &str = "tests/broken_scenes";

/// All files below `folder`.
fn files(folder: &Path) -> BTreeSet<PathBuf> {
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    entries
        .flat_map(|path| {
            if path.is_dir() {
                files(&path)
            } else {
                BTreeSet::from([path])
            }
        })
        .collect()
}

/// What is free on this machine, in bytes; enough where the system does not say.
fn free_memory() -> u64 {
    let text = std::fs::read_to_string("/proc/meminfo").unwrap_or_default();
    let line = text.lines().find_map(|line| line.strip_prefix("MemAvailable:"));
    line.and_then(|line| line.trim().trim_end_matches(" kB").parse::<u64>().ok())
        .map_or(u64::MAX, |kib| kib << 10)
}

#[test]
fn each_broken_scene_says_what_is_wrong_and_what_would_do() {
    let before = files(Path::new(FOLDER));
    let scenes: Vec<_> = before
        .iter()
        .filter(|path| path.extension().is_some_and(|ending| ending == "toml"))
        .collect();
    assert!(scenes.len() >= 40, "only {} broken scenes", scenes.len());

    let mut wrong = Vec::new();
    for path in scenes {
        // 256 GiB of picture: there are machines on which this scene is not broken.
        if path.to_string_lossy().contains("too-large-for-memory") && free_memory() > 250 << 30 {
            continue;
        }
        let text = std::fs::read_to_string(path).unwrap();
        let mut lines = text.lines();
        let mut stated = |word: &str| lines.next().and_then(|line| line.strip_prefix(word)).map(str::to_owned);
        let (Some(expect), Some(help)) = (stated("# expect: "), stated("# help: ")) else {
            wrong.push(format!("{} does not state its error", path.display()));
            continue;
        };
        let said = match catch_unwind(|| Scene::load(path)) {
            Ok(Err(error)) => (error.to_string(), error.remedy().to_owned()),
            Ok(Ok(_)) => ("nothing: it loads".to_owned(), String::new()),
            Err(_) => ("nothing: it panics".to_owned(), String::new()),
        };
        if said != (expect.clone(), help.clone()) {
            let (said, remedy) = said;
            wrong.push(format!(
                "{}\n  expect: {expect}\n    said: {said}\n    help: {help}\n    said: {remedy}",
                path.display()
            ));
        }
    }
    assert!(
        wrong.is_empty(),
        "{} broken scenes are not as they state:\n{}",
        wrong.len(),
        wrong.join("\n")
    );
    assert_eq!(
        files(Path::new(FOLDER)),
        before,
        "reading a scene leaves no file behind"
    );
}

#[test]
fn an_error_has_a_place_in_the_text() {
    let path = Path::new("scenes/studio.toml");
    let text = "[camera]\norigin = [0, 1, 5]\ntarget = [0, 0, 0]\nup = [0, 1, 0]\nfov_y = 30\n\n[film]\nwidth = 8\n\
        height = 8\n\n[[spheres]]\nemission = [1, 1, 1]\ncenter = [0, 0, 0]\nradius = -0.5\n";
    let error = Scene::parse(text, path).unwrap_err();
    assert_eq!(
        error.to_string(),
        "scenes/studio.toml:14: sphere radius must be positive and finite, got -0.5"
    );
    assert_eq!((error.path(), error.line()), (path, Some(14)));
    let (place, label) = error.place().unwrap();
    assert_eq!(&text[place], "-0.5");
    assert_eq!(label, "in [[spheres]] 1");
    assert_eq!(error.text(), Some(text));
}

#[test]
fn files_that_cannot_be_read_have_no_line() {
    let missing = Scene::load(Path::new("tests/broken_scenes/nowhere.toml"))
        .unwrap_err()
        .to_string();
    assert!(
        missing.starts_with("tests/broken_scenes/nowhere.toml: cannot read the scene file: No such"),
        "{missing}"
    );
    let folder = Scene::load(Path::new("tests")).unwrap_err();
    assert_eq!(folder.line(), None);
}

#[test]
fn a_text_in_another_encoding_has_a_line() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("latin.toml");
    std::fs::write(&path, b"# a scene\n# caf\xe9\n").unwrap();
    let error = Scene::load(&path).unwrap_err();
    assert_eq!(error.line(), Some(2));
    assert!(error.to_string().ends_with("the text is not UTF-8"));
}

#[test]
fn a_scene_on_one_endless_line_is_not_quoted() {
    let vertices = "[0, 0, 0], ".repeat(100);
    let text = format!("meshes = [{{ vertices = [{vertices}], surprise = 1 }}]");
    let error = Scene::parse(&text, Path::new("x.toml")).unwrap_err();
    assert!(error.text().is_none() && error.place().is_none());
}
