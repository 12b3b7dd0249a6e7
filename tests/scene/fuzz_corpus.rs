//! What the fuzzers found worth keeping goes through the readers on any compiler: each file is a scene or an error, never
//! a panic. CONTRIBUTING.md says how the corpus is made and grows.

#[path = "../../fuzz/src/lib.rs"]
mod readers;

use std::path::Path;

#[test]
fn no_file_of_the_corpus_panics() {
    for kind in ["scene", "obj", "ply", "stl", "off", "glb", "gltf", "gz"] {
        let folder = Path::new("fuzz/corpus").join(kind);
        let files: Vec<_> = std::fs::read_dir(&folder)
            .unwrap()
            .map(|entry| entry.unwrap().path())
            .collect();
        assert!(files.len() >= 20, "{} holds {} files", folder.display(), files.len());
        for file in files {
            let bytes = std::fs::read(&file).unwrap();
            match (kind, std::str::from_utf8(&bytes)) {
                ("scene", Ok(text)) => readers::scene(text),
                ("scene", Err(_)) => {}
                ("gz", _) => readers::mesh("obj.gz", &bytes),
                _ => readers::mesh(kind, &bytes),
            }
        }
    }
}
