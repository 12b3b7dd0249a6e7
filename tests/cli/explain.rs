//! `octolux explain`: effects with their evidence, and what they cost.

use crate::place::{Place, stdout};

#[test]
fn effects_are_found_with_their_evidence_and_the_absent_ones_named() {
    let place = Place::new();
    let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/blend.toml");
    let text = stdout(&place.succeeds(&format!("explain {scene} --estimator mis")));
    for words in [
        "blend             4 of 6 materials, on 4 shapes in sight",
        "absent     one-sided, smooth normals, textures, lens, mesh lights",
        "mis: it was asked for; auto would take product: least error for its time",
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

/// A lamp that the camera does not see on grey, one far dimmer, and a black ball: all noise is of the first light and at the grey.
const TWO_LIGHTS: &str = r#"
[camera]
origin = [0, 1, 6]
target = [0, 0, 0]
up = [0, 1, 0]
fov_x = 30
[film]
width = 24
height = 16
[materials.grey]
diffuse = [0.5, 0.5, 0.5]
[materials.black]
diffuse = [0, 0, 0]
[[spheres]]
center = [0, 5, 2]
radius = 1.5
emission = [10, 10, 10]
[[spheres]]
center = [3, 5, 2]
radius = 0.1
emission = [0.01, 0.01, 0.01]
[[spheres]]
center = [-0.5, 0.3, 0]
radius = 0.3
material = "black"
[[spheres]]
center = [0.5, 0.3, 0]
radius = 0.3
material = "grey"
[[boxes]]
center = [0, -0.5, 0]
size = [20, 1, 20]
material = "grey"
"#;

#[test]
fn noise_is_shared_between_lights_and_materials_and_every_estimator_has_a_price() {
    let place = Place::new();
    std::fs::write(place.path().join("in/two.toml"), TWO_LIGHTS).unwrap();
    let output = place.succeeds("explain in/two.toml --estimator mis --noise=map.npy --json");
    let object: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let noise = &object["noise"];
    for kind in ["lights", "materials"] {
        let parts = noise[kind].as_array().unwrap();
        for share in ["share", "share_of_relmse"] {
            let sum: f64 = parts.iter().map(|part| part[share].as_f64().unwrap()).sum();
            assert!(
                (sum - 1.0).abs() < 1e-3,
                "the {share}s of {kind} add up to {sum}: {parts:?}"
            );
        }
    }
    assert_eq!(noise["lights"][0]["name"], "sphere 1 at 0, 5, 2");
    assert!(noise["lights"][0]["share"].as_f64().unwrap() > 0.99);
    assert_eq!(noise["materials"][0]["name"], "material grey");
    assert!(noise["materials"][0]["share"].as_f64().unwrap() > 0.99);
    let prices = noise["prices"].as_array().unwrap();
    // Eight estimators, the other sampler, and adaptive.
    assert_eq!(prices.len(), 10);
    let price = |arguments: &str| {
        let found = prices.iter().find(|price| price["arguments"] == arguments);
        found.unwrap()["seconds_to_1_percent"].as_f64().unwrap()
    };
    assert!(price("--estimator uniform") > 10.0 * price(""), "{prices:?}");
    let map = octolux::film::read_picture(&place.path().join("map.npy")).unwrap();
    assert_eq!((map.width, map.height), (24, 16));
    let text = stdout(&place.succeeds("explain in/two.toml --estimator mis --noise"));
    assert_eq!(place.files(), ["map.npy", "two-noise.png"]);
    for words in [
        "sphere 1 at 0, 5, 2",
        "material grey",
        "the largest shares of relMSE",
        "(as now)",
    ] {
        assert!(text.contains(words), "{words}\n{text}");
    }
}

/// The parts of a picture add up by each kind of estimator: meshes, an environment, suns, points and rough surfaces.
#[test]
fn shares_add_up_for_every_kind_of_light() {
    let place = Place::new();
    for scene in ["mesh-light", "sky", "lamps", "ggx"] {
        for estimator in ["uniform", "mis", "product"] {
            let path = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/");
            // The meshes have more than 64 triangles that emit: with lists of them there are no shares, unless no light is drawn.
            let lights = if estimator == "uniform" { "auto" } else { "all" };
            let line = format!(
                "explain {path}{scene}.toml --noise=a.npy --json --size 48x32 --estimator {estimator} --lights {lights}"
            );
            let object: serde_json::Value = serde_json::from_slice(&place.succeeds(&line).stdout).unwrap();
            for kind in ["lights", "materials"] {
                let parts = object["noise"][kind].as_array().unwrap();
                let sum: f64 = parts.iter().map(|part| part["share"].as_f64().unwrap()).sum();
                assert!((sum - 1.0).abs() < 1e-3, "{scene}, {estimator}: {kind} add up to {sum}");
            }
        }
    }
}

#[test]
fn a_map_that_would_replace_the_scene_or_cannot_be_written_is_refused() {
    let place = Place::new();
    assert!(
        place
            .refused("explain in/small.toml --noise=in/small.toml")
            .contains("would replace")
    );
    assert!(
        place
            .refused("explain in/small.toml --noise=nowhere/a.png")
            .contains("no folder nowhere")
    );
}

/// A part has no noise of the choice of its light, so shares would not add up.
#[test]
fn noise_of_many_lights_is_told_without_shares() {
    let place = Place::new();
    let light = |i: u32| {
        format!(
            "[[spheres]]\ncenter = [{}, 3, 0]\nradius = 0.01\nemission = [9, 9, 9]\n",
            f64::from(i) * 0.05 - 2.0
        )
    };
    let lights: String = (0..70).map(light).collect();
    std::fs::write(place.path().join("in/many.toml"), format!("{TWO_LIGHTS}{lights}")).unwrap();
    let text = stdout(&place.succeeds("explain in/many.toml --noise=map.npy"));
    assert!(text.contains("shares     not measured: passes sample lists"), "{text}");
    assert!(text.contains("settings "), "{text}");
}

/// A scene under this many points, and a sphere that emits where one is wanted.
fn points(count: u32, sphere: bool) -> String {
    let mut text = TWO_LIGHTS.split("[[spheres]]").next().unwrap().to_owned();
    text += "[[spheres]]\ncenter = [0, 0, 0]\nradius = 0.5\nmaterial = \"grey\"\n";
    if sphere {
        text += "[[spheres]]\ncenter = [0, 5, 2]\nradius = 1\nemission = [1, 1, 1]\n";
    }
    for i in 0..count {
        text += &format!("[[lights]]\nkind = \"point\"\nposition = [{i}, 3, 1]\nintensity = [1, 1, 1]\n");
    }
    text
}

/// Points count as lights of lists, for `brdf` alone; every sentence has the right number.
#[test]
fn the_rule_for_lists_counts_points_and_spots() {
    let place = Place::new();
    for (count, sphere, options, words) in [
        (
            1,
            false,
            "--estimator light",
            "every light in each pass: 1 point or spot that emits is not more than 64",
        ),
        (
            64,
            false,
            "--estimator mis",
            "every light in each pass: 64 points and spots that emit are not more than 64",
        ),
        (
            64,
            true,
            "--estimator mis",
            "a list of 8 lights for each group of pixels in a tile and each pass: 65 spheres, triangles, points and spots emit, more than the 64 that are all sampled",
        ),
        (
            64,
            true,
            "--estimator brdf",
            "whatever a direction meets: brdf draws none for a light; every point or spot in each pass: 64 points and spots that emit are not more than 64",
        ),
        (
            65,
            false,
            "--estimator brdf",
            "draws none for a light; a list of 8 points and spots for each group of pixels in a tile and each pass: 65 points and spots emit, more than the 64",
        ),
        (
            2,
            false,
            "--estimator product --lights 1",
            "a list of 1 light for each group of pixels in a tile and each pass: --lights 1 was asked for",
        ),
        (
            0,
            true,
            "--estimator mis",
            "every light in each pass: 1 sphere or triangle that emits is not more than 64",
        ),
        (
            0,
            true,
            "--estimator uniform",
            "sampled    whatever a direction meets: uniform draws none for a light\n",
        ),
        (
            65,
            false,
            "--estimator mis",
            "many lights       65 points and spots emit",
        ),
    ] {
        std::fs::write(place.path().join("in/points.toml"), points(count, sphere)).unwrap();
        let text = stdout(&place.succeeds(&format!("explain in/points.toml {options}")));
        assert!(text.contains(words), "{words}\n{text}");
    }
}
