//! `octolux explain`: effects with their evidence, and what they cost.

use crate::place::{Place, stdout};

#[test]
fn effects_are_found_with_their_evidence_and_the_absent_ones_named() {
    let place = Place::new();
    let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/blend.toml");
    let text = stdout(&place.succeeds(&format!("explain {scene}")));
    for words in [
        "blend             4 of 6 materials, on 4 shapes in sight",
        "absent     one-sided, smooth normals, textures, lens, mesh lights",
        "spheres emit: on diffuse and Phong surfaces '--estimator product' has less noise than mis",
    ] {
        assert!(text.contains(words), "{words}\n{text}");
    }
}

#[test]
fn costs_are_measured_where_they_are_asked_for() {
    let place = Place::new();
    let output = place.succeeds("explain in/small.toml --measure --json --size 16x12");
    let object: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let costs = &object["costs"];
    assert!(costs["ns"].as_f64().unwrap() > 0.0);
    let effects = costs["effects"].as_array().unwrap();
    assert!(!effects.is_empty());
    for cost in effects.iter().filter(|cost| cost["present"] == false) {
        assert_eq!(cost["same_bits"], true, "{cost}");
    }
}
