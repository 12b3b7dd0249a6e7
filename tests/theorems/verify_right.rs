//! `verify` on scenes that are right and look odd: ties, black environments, lamps that enclose things. No fault is seen in them.
//!
//! The 20 runs together raise a false alarm with a probability of 20 x 1e-4 by their means; seeds are fixed, budgets are seconds,
//! so how many samples there are depends on the machine.

use std::fmt::Write;
use std::path::Path;

use octolux::film::{Attributes, Picture, write_picture};
use octolux::scene::Scene;
use octolux::study::verify::{self, Options, Verdict};

const VIEW: &str = "[camera]\norigin = [0.3, 2, 4]\ntarget = [0, 0.3, 0]\nup = [0, 1, 0]\nfov_x = 40\n\
                    [film]\nwidth = 16\nheight = 16\n\
                    [materials.a]\ndiffuse = [0.8, 0.2, 0.2]\n[materials.b]\ndiffuse = [0.2, 0.2, 0.8]\n\
                    [materials.p]\nphong = [0.5, 0.6, 0.7]\nexponent = 40\n";
const LAMP: &str = "[[spheres]]\ncenter = [1, 3, 1]\nradius = 0.5\nemission = [20, 20, 20]\n";
const BLACK: &str = "[environment]\nfile = \"black.exr\"\n";

fn sphere(center: [f64; 3], radius: f64, surface: &str) -> String {
    format!("[[spheres]]\ncenter = {center:?}\nradius = {radius:?}\n{surface}\n")
}

/// A level square about `center` with sides of twice `half`.
fn square(center: [f64; 3], half: f64, faces: &str, surface: &str) -> String {
    let [x, y, z] = center;
    let corners = [[-half, half], [half, half], [half, -half], [-half, -half]];
    let vertices: Vec<[f64; 3]> = corners.iter().map(|[dx, dz]| [x + dx, y, z + dz]).collect();
    format!("[[meshes]]\nvertices = {vertices:?}\nfaces = {faces}\n{surface}\n")
}

const WHOLE: &str = "[[0, 1, 2, 3]]";
const A: &str = "material = \"a\"";
const B: &str = "material = \"b\"";
const P: &str = "material = \"p\"";
const BRIGHT: &str = "emission = [2, 2, 2]";

fn floor(surface: &str) -> String {
    square([0.0; 3], 9.0, WHOLE, surface)
}

fn chest(low: [f64; 3], high: [f64; 3], surface: &str) -> String {
    let corner = |i: usize| -> [f64; 3] { std::array::from_fn(|k| if i >> k & 1 == 1 { high[k] } else { low[k] }) };
    let vertices: Vec<[f64; 3]> = (0..8).map(corner).collect();
    let faces = "[[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]";
    format!("[[meshes]]\nvertices = {vertices:?}\nfaces = {faces}\n{surface}\n")
}

/// So many small spheres far away that Embree is chosen.
fn far_spheres() -> String {
    let mut text = String::new();
    for i in 0..140 {
        _ = write!(text, "{}", sphere([1000.0 + f64::from(i), 1000.0, 1000.0], 0.1, B));
    }
    text
}

fn scenes() -> Vec<(&'static str, String)> {
    let diagonal =
        |half: f64| square([0.0; 3], half, "[[0, 1, 2]]", A) + &square([0.0; 3], half, "[[0, 2, 3]]", B) + LAMP;
    let fan = |many: usize| {
        let corner = |i: usize| {
            let turn = std::f64::consts::TAU * i as f64 / many as f64;
            [5.0 * turn.cos(), 0.3, 5.0 * turn.sin()]
        };
        (0..many).fold(LAMP.to_owned(), |text, i| {
            let vertices = [[0.0, 0.3, 0.0], corner(i), corner(i + 1)];
            let surface = [A, B][i % 2];
            format!("{text}[[meshes]]\nvertices = {vertices:?}\nfaces = [[0, 2, 1]]\n{surface}\n")
        })
    };
    let ball = sphere([0.0, 0.3, 0.0], 0.3, P);
    vec![
        ("two materials share an edge", diagonal(9.0)),
        (
            "two materials share a long edge, by Embree",
            diagonal(1e4) + &far_spheres(),
        ),
        ("coincident floors", floor(A) + &floor(B) + LAMP),
        (
            "coincident floors by Embree",
            floor(A) + &floor(B) + LAMP + &far_spheres(),
        ),
        (
            "a box whose bottom lies in the floor",
            floor(A) + &chest([-0.5, 0.0, -0.5], [0.5, 0.5, 0.5], B) + LAMP,
        ),
        (
            "a lamp that lies in a ceiling",
            floor(A) + &square([0.0, 4.0, 0.0], 3.0, WHOLE, B) + &square([0.0, 4.0, 0.0], 0.5, WHOLE, BRIGHT) + &ball,
        ),
        ("a fan of materials that meet in the middle of the picture", fan(12)),
        (
            "a ball that touches the floor, and the same ball again",
            floor(A) + &ball + &sphere([0.0, 0.3, 0.0], 0.3, B) + LAMP,
        ),
        (
            "a black picture of the sky, and a lamp",
            floor(A) + &ball + LAMP + BLACK,
        ),
        (
            "a black picture of the sky, and a panel",
            floor(P) + &square([0.0, 3.0, 0.0], 0.5, WHOLE, BRIGHT) + BLACK,
        ),
        (
            "a black picture of the sky around a dome",
            floor(A) + &sphere([0.0, 0.0, 0.0], 30.0, "emission = [1, 1, 1]") + BLACK,
        ),
        (
            "an environment of 0",
            floor(A) + &ball + LAMP + "[environment]\nemission = [0, 0, 0]\n",
        ),
        (
            "a dome around all",
            floor(A) + &ball + &sphere([0.0; 3], 20.0, "emission = [1, 0.9, 0.8]"),
        ),
        (
            "a dome through the floor",
            floor(A) + &ball + &sphere([0.0; 3], 7.0, "emission = [1, 0.9, 0.8]"),
        ),
        (
            "a dome in a dome",
            floor(A) + &sphere([0.0; 3], 20.0, BRIGHT) + &sphere([0.0; 3], 40.0, BRIGHT) + &ball,
        ),
        (
            "a lamp around a ball",
            floor(A) + &ball + &sphere([0.0, 0.3, 0.0], 0.6, BRIGHT),
        ),
        (
            "a lamp around a smaller lamp",
            floor(A) + &sphere([0.0, 2.0, 0.0], 0.6, BRIGHT) + &sphere([0.0, 2.0, 0.0], 0.2, BRIGHT),
        ),
        (
            "a lamp behind a wall all around, and another",
            floor(A) + &sphere([0.0, 1.0, 0.0], 0.2, BRIGHT) + &sphere([0.0, 1.0, 0.0], 0.5, P) + LAMP,
        ),
        (
            "a box that emits around all",
            floor(A) + &ball + &chest([-10.0, -1.0, -10.0], [10.0, 8.0, 10.0], BRIGHT),
        ),
        (
            "a lamp half sunk into the floor",
            floor(A) + &ball + &sphere([1.0, 0.0, 0.5], 0.4, BRIGHT),
        ),
    ]
}

#[test]
fn right_scenes_are_not_accused() {
    let folder = tempfile::tempdir().unwrap();
    let black = Picture {
        width: 4,
        height: 2,
        pixels: vec![[0.0; 3]; 8],
    };
    write_picture(&folder.path().join("black.exr"), &black, &Attributes::default()).unwrap();
    let all = scenes();
    assert_eq!(all.len(), 20);
    let mut accused = Vec::new();
    for (name, text) in all {
        let scene = Scene::parse(&format!("{VIEW}{text}"), &folder.path().join("scene.toml"))
            .unwrap_or_else(|error| panic!("{name}: {error}"));
        let options = Options {
            budget: 1.0,
            threads: 1,
            seed: 1,
        };
        let report = verify::run(&scene, options, &()).unwrap_or_else(|error| panic!("{name}: {error}"));
        for row in report.rows.iter().filter(|row| row.verdict == Verdict::Fail) {
            accused.push(format!(
                "{name}: {}, {}: {}; {}",
                row.check, row.compared, row.figure, row.sentence
            ));
        }
    }
    assert!(accused.is_empty(), "{}", accused.join("\n"));
}

/// Where faces coincide but differ, what is seen is not defined: a row says so and names the meshes.
#[test]
fn coincident_faces_are_named() {
    let text = format!("{VIEW}{}{}{LAMP}", floor(A), square([0.0; 3], 3.0, WHOLE, B));
    let scene = Scene::parse(&text, Path::new("scene.toml")).unwrap();
    let options = Options {
        budget: 1.0,
        threads: 1,
        seed: 1,
    };
    let report = verify::run(&scene, options, &()).unwrap();
    let row = report.rows.iter().find(|row| row.check == "ties").unwrap();
    assert_eq!(row.verdict, Verdict::Warn);
    assert!(row.sentence.contains("mesh 1 and mesh 2"), "{}", row.sentence);
}
