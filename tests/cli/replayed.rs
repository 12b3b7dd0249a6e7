//! `render --replay`: what is said of lights of every kind, and of directions that meet none.

use std::fs;

use crate::place::{Place, stdout};

/// A floor under a square that emits, a small lamp, and a sky; a board hides the square from the middle of the picture.
const LIGHTS: &str = r#"
[camera]
origin = [0, 1, 6]
target = [0, 0, 0]
up = [0, 1, 0]
fov_x = 30
[film]
width = 8
height = 6
[materials.grey]
diffuse = [0.5, 0.5, 0.5]
[environment]
emission = [0.1, 0.1, 0.1]
[[spheres]]
center = [0, 2, 3]
radius = 0.001
emission = [9, 9, 9]
[[boxes]]
center = [0, -0.5, 0]
size = [20, 1, 20]
material = "grey"
[[boxes]]
center = [0, 2, 0]
size = [6, 0.1, 2]
material = "grey"
[[meshes]]
emission = [1, 1, 1]
vertices = [[-1, 3, -1], [1, 3, -1], [1, 3, 1], [-1, 3, 1]]
faces = [[0, 1, 2, 3]]
[[boxes]]                        # twelve triangles, of which one is picked, behind the board too
emission = [1, 1, 1]
center = [0, 3.5, 0]
size = [1, 0.2, 1]
"#;

#[test]
fn rays_to_lights_of_every_kind_are_told_and_lobe_directions_that_meet_none() {
    let place = Place::new();
    fs::write(place.path().join("in/lights.toml"), LIGHTS).unwrap();
    for accel in ["embree", "linear"] {
        let line = format!("render in/lights.toml --replay 4,3,0 --estimator mis2-power --accel {accel}");
        let text = stdout(&place.succeeds(&line));
        for words in [
            "of box 1 at 0, -0.5, 0, at distance",
            "light 0    sphere 1 at 0, 2, 3, cone",
            "does not meet it",
            "light 1    triangle",
            "environment",
            "ray        to a mesh that emits, distance ",
            "occluded by triangle ",
            "of box 2 at 0, 2, 0 at distance",
        ] {
            assert!(text.contains(words), "{words}\n{text}");
        }
        let object: serde_json::Value =
            serde_json::from_slice(&place.succeeds(&format!("{line} --json")).stdout).unwrap();
        let beside = object["beside"].as_array().unwrap();
        assert!(beside.iter().any(|ray| !ray["blocked_by"].is_null()), "{beside:?}");
    }
}

/// The first two spheres are one in single precision; the third has the number of the file all the same.
#[test]
fn spheres_have_the_numbers_of_the_file_where_two_are_one() {
    let place = Place::new();
    let sphere = |x: f64, y: f64| format!("[[spheres]]\ncenter = [{x}, {y}, 0]\nradius = 0.5\nemission = [1, 1, 1]\n");
    let spheres = [sphere(2.0, 2.0), sphere(2.0 + 1e-12, 2.0), sphere(-2.0, 2.0)].concat();
    let rest = LIGHTS.split("[environment]").next().unwrap();
    let floor = "[[boxes]]\ncenter = [0, -0.5, 0]\nsize = [9, 1, 9]\nmaterial = \"grey\"\n";
    fs::write(place.path().join("in/twice.toml"), format!("{rest}{spheres}{floor}")).unwrap();
    let text = stdout(&place.succeeds("render in/twice.toml --replay 4,3,0 --estimator light"));
    assert!(text.contains("sphere 3 at -2, 2, 0"), "{text}");
    assert!(text.contains(" at 2, 2, 0"), "{text}");
}
