//! No command writes over a file that it reads, whatever the file is called: exit code 2 before anything is rendered, a sentence
//! with both names, and every byte as it was.

use std::collections::BTreeMap;
use std::fs;

use crate::place::{Place, stderr};
use octolux::film::{Attributes, Picture, write_picture};

/// All that `s.toml` reads, but for itself.
const READ: [&str; 5] = ["sky.exr", "wall.png", "floor.obj", "box.gltf", "box.bin"];

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
spp = 4
[materials.grey]
diffuse = [0.5, 0.5, 0.5]
[materials.wall]
diffuse = [0.5, 0.5, 0.5]
texture = "wall.png"
[environment]
file = "sky.exr"
[[meshes]]
file = "floor.obj"
material = "grey"
[[meshes]]
file = "box.gltf"
material = "grey"
"#;

const GLTF: &str = r#"{"asset":{"version":"2.0"},"buffers":[{"uri":"box.bin","byteLength":36}],
"bufferViews":[{"buffer":0,"byteLength":36}],
"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}],
"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],"nodes":[{"mesh":0}],"scenes":[{"nodes":[0]}],"scene":0}"#;

/// A folder with the scene `s.toml` and all that it reads, the same scene as `sky.toml`, links to its sky, and a scene
/// `other.toml` that reads nothing.
fn place() -> Place {
    let place = Place::new();
    let at = |name: &str| place.path().join(name);
    let picture = Picture {
        width: 2,
        height: 2,
        pixels: vec![[1.0; 3]; 4],
    };
    for name in ["sky.exr", "wall.png"] {
        write_picture(&at(name), &picture, &Attributes::default()).unwrap();
    }
    fs::copy(at("wall.png"), at("a_0002spp.png")).unwrap();
    fs::create_dir(at("out")).unwrap();
    fs::copy(at("wall.png"), at("out/01-wall.png")).unwrap();
    fs::write(at("floor.obj"), "v -9 -1 9\nv 9 -1 9\nv 0 -1 -9\nf 1 2 3\n").unwrap();
    fs::write(at("box.gltf"), GLTF).unwrap();
    let corners = [0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    fs::write(at("box.bin"), corners.map(f32::to_le_bytes).concat()).unwrap();
    for name in ["s.toml", "sky.toml", "s.json"] {
        fs::write(at(name), SCENE).unwrap();
    }
    fs::write(at("steps.toml"), SCENE.replace("wall.png", "a_0002spp.png")).unwrap();
    fs::write(at("evidence.toml"), SCENE.replace("wall.png", "out/01-wall.png")).unwrap();
    fs::copy(at("s.toml"), at("study.json")).unwrap();
    fs::copy(at("in/small.toml"), at("other.toml")).unwrap();
    std::os::unix::fs::symlink("sky.exr", at("soft.exr")).unwrap();
    std::os::unix::fs::symlink(".", at("here")).unwrap();
    fs::hard_link(at("sky.exr"), at("hard.exr")).unwrap();
    place
}

/// Every file with its bytes.
fn all(place: &Place) -> BTreeMap<String, Vec<u8>> {
    let files = place
        .files()
        .into_iter()
        .filter(|name| place.path().join(name).is_file());
    files
        .map(|name| (name.clone(), fs::read(place.path().join(name)).unwrap()))
        .collect()
}

/// Runs commands that must be refused with a sentence that has these words.
#[track_caller]
fn refused(place: &Place, cases: &[(&str, &str)]) {
    let before = all(place);
    for (arguments, words) in cases {
        let said = place.refused(arguments);
        assert!(said.contains(words), "{arguments}: {said}");
        assert!(all(place) == before, "{arguments}");
    }
}

#[test]
fn render_writes_over_nothing_that_a_scene_reads() {
    let place = place();
    for name in READ {
        // A checkpoint may have any name; sums end in .acc, pictures in theirs.
        let what = format!("{name}: would replace {name}, which the scene s.toml reads");
        let arguments = format!("render s.toml -o a.npy --checkpoint {name} --resume");
        refused(&place, &[(arguments.as_str(), what.as_str())]);
    }
    refused(
        &place,
        &[
            (
                "render s.toml -o sky.exr",
                "sky.exr: would replace sky.exr, which the scene s.toml reads",
            ),
            (
                "render s.toml -o ./in/../sky.exr",
                "./in/../sky.exr: would replace sky.exr",
            ),
            ("render s.toml -o soft.exr", "soft.exr: would replace sky.exr"),
            ("render s.toml -o hard.exr", "hard.exr: would replace sky.exr"),
            (
                "render s.toml -o here/wall.png",
                "here/wall.png: would replace wall.png",
            ),
            (
                "render sky.toml",
                "sky.exr: would replace sky.exr, which the scene sky.toml reads",
            ),
            ("render s.json -o a.npy --stats s.json", "s.json: would replace s.json"),
            (
                "render s.toml -o a.npy --checkpoint s.toml --resume",
                "s.toml: would replace s.toml",
            ),
            (
                "render steps.toml --snapshots -o a.png",
                "a_0002spp.png: would replace a_0002spp.png",
            ),
            // What another scene of the same command reads.
            ("render other.toml sky.toml", "sky.exr: would replace sky.exr"),
            (
                "render other.toml s.json -o {name}.npy --stats {name}.json",
                "s.json: would replace s.json",
            ),
        ],
    );
}

#[test]
fn an_output_that_is_named_twice_is_refused_by_whatever_name() {
    let place = place();
    refused(
        &place,
        &[
            (
                "render other.toml -o a.exr -o ./a.exr",
                "./a.exr: would be written twice, as a.exr is the same file",
            ),
            (
                "render other.toml -o a.exr -o here/a.exr",
                "here/a.exr: would be written twice",
            ),
            (
                "render other.toml --snapshots -o b.png -o b_0004spp.png",
                "would be written twice",
            ),
            (
                "reference other.toml -o a.npy --stderr ./a.npy",
                "./a.npy: would be written twice",
            ),
            (
                "merge in/small.toml -o a.npy -o here/a.npy",
                "here/a.npy: would be written twice",
            ),
        ],
    );
}

#[test]
fn batches_keep_what_any_of_their_scenes_reads_and_the_manifest() {
    let place = place();
    let manifest = |pictures: &str| fs::write(place.path().join("jobs.toml"), pictures).unwrap();
    let other = "[[pictures]]\nscene = \"other.toml\"\n";
    for (pictures, words) in [
        (
            "outputs = [\"box.npy\"]\ncheckpoint = \"box.bin\"\nresume = true",
            "box.bin: would replace box.bin",
        ),
        ("outputs = [\"here/sky.exr\"]", "here/sky.exr: would replace sky.exr"),
        (
            "outputs = [\"a.npy\"]\ncheckpoint = \"jobs.toml\"",
            "which this batch reads",
        ),
        (
            "outputs = [\"a.npy\"]\ncheckpoint = \"jobs.done.jsonl\"",
            "which this batch reads",
        ),
        (
            "outputs = [\"a.npy\"]\nstats = \"s.json\"",
            "s.json: would replace s.json",
        ),
    ] {
        // The picture of one scene, what another one reads.
        let reader = if words.contains("s.json") { "s.json" } else { "s.toml" };
        manifest(&format!(
            "{other}{pictures}\n[[pictures]]\nscene = \"{reader}\"\noutputs = [\"z.npy\"]\n"
        ));
        refused(&place, &[("batch jobs.toml", words)]);
    }
}

#[test]
fn reference_study_verify_and_merge_keep_their_inputs() {
    let place = place();
    place.succeeds("render other.toml -q -o part.acc");
    fs::rename(place.path().join("part.acc"), place.path().join("part.exr")).unwrap();
    refused(
        &place,
        &[
            (
                "reference s.toml --spp 2 -o sky.exr",
                "sky.exr: would replace sky.exr, which the scene s.toml reads",
            ),
            (
                "reference s.toml --spp 2 -o a.exr --stderr soft.exr",
                "soft.exr: would replace sky.exr",
            ),
            (
                "study study.json -o .",
                "study.json: would replace study.json, which the scene study.json reads",
            ),
            (
                "verify s.json --budget 1 --stats s.json",
                "s.json: would replace s.json",
            ),
            (
                "verify evidence.toml --budget 1 -o out",
                "out/01-wall.png: would replace out/01-wall.png",
            ),
            (
                "merge part.exr -o ./part.exr",
                "./part.exr: would replace part.exr, which merge reads",
            ),
            // Samples are worth more than a picture.
            (
                "render other.toml -o part.exr",
                "part.exr: would replace the checkpoint of a render",
            ),
            (
                "reference other.toml --spp 2 -o part.exr",
                "part.exr: would replace the checkpoint of a render",
            ),
        ],
    );
}

/// The names that are looked at before scenes are read are those of the files that are read.
#[test]
fn named_files_are_the_files_that_are_read() {
    let place = place();
    let path = place.path().join("s.toml");
    let sorted = |files: &[std::path::PathBuf]| {
        let mut files = files.to_vec();
        files.sort();
        files
    };
    let scene = octolux::scene::Scene::load(&path).unwrap();
    assert_eq!(scene.files().len(), 1 + READ.len());
    assert_eq!(
        sorted(scene.files()),
        sorted(&octolux::scene::Scene::named_files(&path))
    );
    for entry in fs::read_dir("scenes").unwrap().map(|entry| entry.unwrap().path()) {
        if let Ok(scene) = octolux::scene::Scene::load(&entry) {
            let mut read = sorted(scene.files());
            read.dedup();
            let mut named = sorted(&octolux::scene::Scene::named_files(&entry));
            named.dedup();
            assert_eq!(read, named, "{}", entry.display());
        }
    }
}

#[test]
fn what_is_no_input_is_replaced_as_ever() {
    let place = place();
    for _ in 0..2 {
        let output = place.succeeds("render s.toml -o a.exr -o new.png --stats new.json");
        assert!(stderr(&output).contains("wrote a.exr, new.png"), "{}", stderr(&output));
    }
}
