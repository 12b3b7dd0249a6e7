//! No instrument takes NaN for a result: what is not a number is an error, and a black environment makes none.

use std::fs;
use std::path::Path;

use crate::place::{Place, stderr};
use octolux::reference;
use octolux::scene::Scene;

/// A floor under a lamp and a black picture of the sky.
const SCENE: &str = "\
[camera]\norigin = [0, 2, 4]\ntarget = [0, 0, 0]\nup = [0, 1, 0]\nfov_x = 40\n\
[film]\nwidth = 6\nheight = 6\n\
[materials.m]\ndiffuse = [0.5, 0.5, 0.5]\n\
[[meshes]]\nmaterial = \"m\"\nvertices = [[-9, 0, 9], [9, 0, 9], [9, 0, -9], [-9, 0, -9]]\nfaces = [[0, 1, 2, 3]]\n\
[[spheres]]\ncenter = [0, 3, 0]\nradius = 0.5\nemission = [10, 10, 10]\n";

const SKY: &str = "[environment]\nfile = \"black.hdr\"\n";

/// A Radiance picture of 4 x 2 black texels: old, flat pixels of four bytes.
fn black_picture() -> Vec<u8> {
    let mut bytes = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 4\n".to_vec();
    bytes.extend([0; 32]);
    bytes
}

fn place() -> Place {
    let place = Place::new();
    fs::write(place.path().join("in/black.hdr"), black_picture()).unwrap();
    fs::write(place.path().join("in/black.toml"), format!("{SCENE}{SKY}")).unwrap();
    fs::write(place.path().join("in/plain.toml"), SCENE).unwrap();
    place
}

fn load(place: &Place, name: &str) -> Scene {
    Scene::load(&place.path().join("in").join(name)).unwrap()
}

/// The same numbers are drawn but for those of the sky, so the two pictures differ by noise alone; of a mean of 108 values of 4000
/// samples each, 6 standard errors are passed by chance once in 5e8. Before it was mended, every value was NaN.
#[test]
fn the_oracle_sees_a_black_picture_as_no_light() {
    let place = place();
    let [black, plain] = ["black.toml", "plain.toml"].map(|name| {
        let scene = load(&place, name);
        reference::render(&scene, scene.film(), 4000, 1, &|_| {})
    });
    let error = |r: &reference::Reference| r.stderr.iter().map(|e| e[0] * e[0]).sum::<f64>();
    let noise = (error(&black) + error(&plain)).sqrt() / black.picture.len() as f64;
    assert!(black.picture.iter().flatten().all(|x| x.is_finite() && *x > 0.0));
    let difference = black.mean() - plain.mean();
    assert!(difference.abs() < 6.0 * noise, "{difference} of {noise}");
}

#[test]
fn every_instrument_takes_a_black_environment() {
    let place = place();
    place.succeeds("reference in/black.toml -o r.npy --spp 4 -q");
    place.succeeds("render in/black.toml -o p.npy --spp 4 -q");
    place.succeeds("compare p.npy r.npy --stderr r_stderr.npy");
    place.succeeds("render in/black.toml --replay 3,3,0");
    let output = place.octolux("verify in/black.toml --budget 1 -q");
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert!(Path::new(&place.path().join("r_stderr.npy")).exists());
}
