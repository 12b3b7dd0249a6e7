//! Which estimator is taken where none is named: what is said of it, and what a saved render keeps.

use std::fs;

use serde_json::Value;

use crate::place::{Place, stderr, stdout};

const WHY: &str = "least error for its time";

fn bytes(place: &Place, name: &str) -> Vec<u8> {
    fs::read(place.path().join(name)).unwrap()
}

/// Rewrites `in/small.toml`.
fn edit(place: &Place, change: impl Fn(&str) -> String) {
    let path = place.path().join("in/small.toml");
    let text = fs::read_to_string(&path).unwrap();
    fs::write(path, change(&text)).unwrap();
}

#[test]
fn explain_names_the_estimator_and_the_reason() {
    let place = Place::new();
    let says = |arguments: &str, words: &str| {
        let text = stdout(&place.succeeds(&format!("explain in/small.toml {arguments}")));
        assert!(text.contains(&format!("  estimator  {words}\n")), "{text}");
    };
    says("", &format!("product: {WHY}"));
    says("--estimator auto", &format!("product: {WHY}"));
    says(
        "--estimator mis",
        &format!("mis: it was asked for; auto would take product: {WHY}"),
    );
    edit(&place, |text| {
        text.replace("[render]", "[render]\nestimator = \"light\"")
    });
    says(
        "",
        &format!("light: the scene names it; auto would take product: {WHY}"),
    );
    says("--estimator auto", &format!("product: {WHY}"));
    let output = place.succeeds("explain in/small.toml --json");
    let object: Value = serde_json::from_slice(&output.stdout).unwrap();
    let got = ["estimator", "estimator_why", "auto", "auto_why"].map(|key| object[key].as_str().unwrap());
    assert_eq!(got, ["light", "the scene names it", "product", WHY]);
}

#[test]
fn every_record_names_the_estimator_that_was_taken() {
    let place = Place::new();
    let summary = stderr(&place.succeeds("render in/small.toml -o a.exr -o a.npy"));
    assert!(summary.contains(", product, sobol in "), "{summary}");
    place.succeeds("render in/small.toml --spp 32 --shard 1/2 -o part-1.acc --quiet");
    place.succeeds("render in/small.toml --spp 3 --quiet -o b.npy --keep --checkpoint state.acc");
    for file in ["a.exr", "part-1.acc", "state.acc"] {
        let output = place.succeeds(&format!("info {file} --json"));
        let told: Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!(told["estimator"], "product", "{file}: {told}");
    }
    for (arguments, estimator, why) in [
        ("", "product", WHY),
        ("--estimator auto", "product", WHY),
        ("--estimator product", "product", "it was asked for"),
        ("--estimator mis", "mis", "it was asked for"),
    ] {
        let output = place.succeeds(&format!("render in/small.toml -o c.npy --json --quiet {arguments}"));
        let told: Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!(
            (&told["estimator"], &told["estimator_why"]),
            (&estimator.into(), &why.into())
        );
        assert_eq!(bytes(&place, "c.npy") == bytes(&place, "a.npy"), estimator == "product");
    }
}

#[test]
fn a_resumed_render_keeps_its_estimator_when_the_scene_was_edited() {
    let place = Place::new();
    let render = "render in/small.toml --quiet --checkpoint state";
    place.succeeds("render in/small.toml --quiet --spp 32 -o whole.npy");
    place.succeeds(&format!("{render} --keep --spp 8 -o a.npy"));
    let state = bytes(&place, "state");
    // A scene that now names another estimator is refused, and so is another scene.
    let original = fs::read_to_string(place.path().join("in/small.toml")).unwrap();
    let names = original.replace("[render]", "[render]\nestimator = \"mis\"");
    let dims = original.replace("emission = [10.0, 10.0, 10.0]", "emission = [0, 0, 0]")
        + "[environment]\nemission = [1, 1, 1]\n";
    for (text, words) in [
        (&names, "estimator is product here and mis there"),
        (&dims, "belongs to another render"),
    ] {
        edit(&place, |_| text.clone());
        let said = place.refused(&format!("{render} --resume --spp 32 -o a.npy"));
        assert!(said.contains(words), "{said}");
        assert!(bytes(&place, "state") == state);
    }
    // What changes no picture changes no estimator.
    edit(&place, |_| {
        format!("# Edited.\n{}", original.replace("grey", "gray")).replace("spp = 3", "spp = 5\nestimator = \"auto\"")
    });
    place.succeeds(&format!("{render} --resume --spp 32 -o a.npy"));
    assert!(bytes(&place, "a.npy") == bytes(&place, "whole.npy"));
}

#[test]
fn a_wrong_name_is_answered_with_auto_among_the_right_ones() {
    let place = Place::new();
    let said = place.refused("render in/small.toml --estimator best");
    assert!(said.contains("auto, uniform, light, brdf, mis,"), "{said}");
    edit(&place, |text| {
        text.replace("[render]", "[render]\nestimator = \"best\"")
    });
    let said = place.refused("render in/small.toml");
    assert!(
        said.contains("estimator must be one of auto, uniform, light,"),
        "{said}"
    );
}

#[test]
fn a_batch_names_an_estimator_as_the_command_line_does() {
    let place = Place::new();
    let jobs = "[[pictures]]\nscene = \"in/small.toml\"\noutputs = [\"a.npy\"]\n\
                [[pictures]]\nscene = \"in/small.toml\"\nestimator = \"auto\"\noutputs = [\"b.npy\"]\n\
                [[pictures]]\nscene = \"in/small.toml\"\nestimator = \"mis\"\noutputs = [\"c.npy\"]\n";
    fs::write(place.path().join("jobs.toml"), jobs).unwrap();
    let lines = stdout(&place.succeeds("batch jobs.toml --quiet"));
    let told: Vec<Value> = lines.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let count = |name: &str| told.iter().filter(|one| one["estimator"] == name).count();
    assert_eq!((count("product"), count("mis")), (2, 1), "{lines}");
    assert!(bytes(&place, "a.npy") == bytes(&place, "b.npy"));
    assert!(bytes(&place, "a.npy") != bytes(&place, "c.npy"));
}
