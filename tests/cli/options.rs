//! Options as people type them: units, names from elsewhere, a camera, a difference.

use std::fs;

use octolux::film::read_picture;

use crate::place::{Place, stderr, stdout};

#[test]
fn times_and_errors_have_one_spelling_for_all_commands() {
    let place = Place::new();
    for time in ["0.05", "0.05s", "0.001m"] {
        place.succeeds(&format!("render in/small.toml -o a.npy --quiet --time {time}"));
        place.succeeds(&format!(
            "render in/small.toml -o a.npy --quiet --checkpoint state --every {time}"
        ));
    }
    place.succeeds("render in/small.toml -o a.npy --quiet --target-error 50%");
    for refused in [
        "--time 10x",
        "--time 0s",
        "--every 1s1m --checkpoint state",
        "--target-error 0%",
    ] {
        place.refused(&format!("render in/small.toml -o b.npy {refused}"));
    }
    place.refused("verify in/small.toml --budget tomorrow");
}

#[test]
fn options_of_other_renderers_are_answered_with_our_own() {
    let place = Place::new();
    for (typed, own) in [
        ("--samples 4", "--spp N"),
        ("--samples=4", "--spp N"),
        ("--width 20", "--size WIDTHxHEIGHT"),
        ("--integrator mis", "--estimator NAME"),
    ] {
        let said = place.refused(&format!("render in/small.toml {typed}"));
        assert!(said.contains(own), "{typed}: {said}");
    }
    let said = place.refused("in/small.toml");
    assert!(said.contains("octolux render in/small.toml"), "{said}");
}

/// The scene turned in the file and turned by options are one scene.
#[test]
fn a_camera_on_the_command_line_is_that_of_a_scene() {
    let place = Place::new();
    let text = fs::read_to_string(place.path().join("in/small.toml")).unwrap();
    let turned = text
        .replace("origin = [0.0, 0.0, 6.0]", "origin = [-1.0, 0.5, 5.0]")
        .replace("target = [0.0, 0.0, 0.0]", "target = [0.0, 0.25, 0.0]")
        .replace("fov_x  = 45.0", "fov_x = 30.0");
    assert_ne!(text, turned);
    fs::write(place.path().join("in/turned.toml"), turned).unwrap();
    place.succeeds("render in/turned.toml -o a.npy --quiet");
    place.succeeds("render in/small.toml -o b.npy --quiet --origin -1,0.5,5 --target 0,0.25,0 --fov 30");
    let bytes = |name: &str| fs::read(place.path().join(name)).unwrap();
    assert!(bytes("a.npy") == bytes("b.npy"));
    for refused in [
        "--origin 0,0,0",
        "--origin 1,2",
        "--fov 180",
        "--target a,b,c",
        "--origin nan,0,0",
    ] {
        place.refused(&format!("render in/small.toml -o c.npy {refused}"));
    }
}

#[test]
fn compare_says_what_is_the_same_and_draws_what_is_not() {
    let place = Place::new();
    place.succeeds("render in/small.toml -o a.npy -o c.exr --quiet");
    place.succeeds("render in/small.toml -o b.npy --quiet --seed 7");
    let same = stdout(&place.succeeds("compare a.npy c.exr"));
    assert!(same.contains("the same, bit for bit"), "{same}");
    let other = stdout(&place.succeeds("compare a.npy b.npy --diff d.npy"));
    assert!(!other.contains("bit for bit"), "{other}");
    let [a, b, d] = ["a.npy", "b.npy", "d.npy"].map(|name| read_picture(&place.path().join(name)).unwrap());
    for ((a, b), d) in a.pixels.iter().zip(&b.pixels).zip(&d.pixels) {
        assert_eq!(*d, [0, 1, 2].map(|k| (a[k] - b[k]).abs()));
    }
    let before = fs::read(place.path().join("a.npy")).unwrap();
    let output = place.octolux("compare a.npy b.npy --diff a.npy");
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    assert!(fs::read(place.path().join("a.npy")).unwrap() == before);
}
