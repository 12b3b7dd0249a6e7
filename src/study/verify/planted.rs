//! Eight kinds of faults, planted one at a time: `verify` on one small scene finds each of them.
//!
//! | kind | what is planted |
//! | --- | --- |
//! | coordinates | Embree's hits without `u`, `v`, as if the triangles were too small for them |
//! | widths | packets that add contributions to the next lane's rays |
//! | reflection | Phong's lobe without the cosine |
//! | visibility | shadow rays that are never occluded |
//! | lights | one light that is counted twice |
//! | environment | a texel with the density of its neighbour |
//! | normals | smooth normals with two corners swapped |
//! | culling | triangles culled for a tile when one corner is out of view |
//!
//! The plan would not choose a picture that shows the first fault for so small a scene; the check of both intersectors finds
//! it.

use std::path::Path;
use std::process::Command;

use rayon::prelude::*;

use super::{Bench, Options, Verdict, exact, run};
use crate::mutant::Mutant;
use crate::pipeline::Settings;
use crate::scene::{EstimatorKind, Features, Scene};
use crate::study::hunt::recipe;

const KINDS: [Mutant; 8] = [
    Mutant::BarycentricsLost,
    Mutant::LaneShift,
    Mutant::MissingCosine,
    Mutant::ShadowsSkipped,
    Mutant::LightTwice,
    Mutant::DensityOfTheNextTexel,
    Mutant::CornersSwapped,
    Mutant::OneCornerBehind,
];

/// A smooth, textured ridge on a glossy floor, a sphere, two lights and a sun.
const SCENE: &str = "\
[camera]\norigin = [0.3, 2.5, 4]\ntarget = [0, 0.2, 0]\nup = [0, 1, 0]\nfov_x = 40\n[film]\nwidth = 24\nheight = 16\n\
[materials.cloth]\ndiffuse = [0.8, 0.7, 0.6]\ntexture = \"hunt-cloth.exr\"\n\
[materials.floor]\nphong = [0.6, 0.5, 0.4]\nexponent = 8\n[materials.grey]\ndiffuse = [0.5, 0.5, 0.5]\n\
[[meshes]]\nmaterial = \"floor\"\nvertices = [[-9, 0, 9], [9, 0, 9], [9, 0, -9], [-9, 0, -9]]\nfaces = [[0, 1, 2, 3]]\n\
[[meshes]]\nmaterial = \"cloth\"\nnormals = \"smooth\"\nvertices = [[-1.2, 0.1, 0.9], [0, 1, 0.7], [0.9, 0.1, 0.8], [-1.1, 0.1, -0.8], \
[0.1, 0.9, -0.9], [1, 0.1, -0.7]]\nuvs = [[0, 0], [0.5, 0], [1, 0], [0, 1], [0.5, 1], [1, 1]]\nfaces = [[0, 1, 4, 3], [1, 2, 5, 4]]\n\
[[spheres]]\nmaterial = \"grey\"\ncenter = [1.2, 0.4, 0.6]\nradius = 0.4\n\
[[spheres]]\nemission = [9, 9, 9]\ncenter = [-1.5, 2.5, 1]\nradius = 0.4\n\
[[spheres]]\nemission = [6, 5, 4]\ncenter = [2, 2, -1]\nradius = 0.5\n\
[environment]\nfile = \"hunt-sun.exr\"\n";

/// Seconds for a verification. A fault that is not found gets a second and a third attempt: on a busy machine the first has
/// fewer samples, and may report no power.
const BUDGETS: [f64; 3] = [3.0, 15.0, 60.0];

/// The environment variable with the time limit of a mutant's process.
const SECONDS: &str = "OCTOLUX_PLANTED_SECONDS";

/// Asserts that the scene passes without a fault. Also what a mutant's process runs; it then prints which rows failed.
#[test]
fn the_scene_has_no_fault_of_its_own() {
    let folder = tempfile::tempdir().unwrap();
    recipe::write_pictures(folder.path()).unwrap();
    let scene = Scene::parse(SCENE, &folder.path().join(Path::new("scene.toml"))).unwrap();
    let seconds = std::env::var(SECONDS).ok().and_then(|seconds| seconds.parse().ok());
    let options = Options {
        budget: seconds.unwrap_or(BUDGETS[0]),
        threads: 1,
        seed: 3,
    };
    let report = run(&scene, options, &()).unwrap();
    let failed = report.rows.iter().filter(|row| row.verdict == Verdict::Fail);
    let failed: Vec<String> = failed.map(|row| format!("{} ({})", row.check, row.compared)).collect();
    println!("\nfound by: {}", failed.join("; "));
    assert!(failed.is_empty(), "{failed:?}");
}

/// A textured rug that lies in the floor, before it in the file, so that it is what is seen.
const RUG: &str = "[[meshes]]\nmaterial = \"cloth\"\nvertices = [[-2, 0, 2], [2, 0, 2], [2, 0, 1], [-2, 0, 1]]\n\
    uvs = [[0, 0], [1, 0], [1, 1], [0, 1]]\nfaces = [[0, 1, 2, 3]]\n[[meshes]]\n";

/// The same for the bits of one estimator where meshes overlap: all rays to the rug are ties.
#[test]
fn overlapping_meshes_have_no_fault_of_their_own() {
    let folder = tempfile::tempdir().unwrap();
    recipe::write_pictures(folder.path()).unwrap();
    let text = SCENE.replacen("[[meshes]]\n", RUG, 1);
    let scene = Scene::parse(&text, &folder.path().join(Path::new("scene.toml"))).unwrap();
    assert_eq!(scene.overlapping_meshes(), [[0, 1]]);
    let settings = Settings {
        film: scene.film(),
        estimator: EstimatorKind::Mis,
        threads: 1,
        ..Settings::default()
    };
    let shapes = Features::of(&scene, scene.film()).shapes;
    let mut bench = Bench::new(&scene, settings, f64::INFINITY, &());
    let rows = exact::widths(&mut bench, settings, shapes).unwrap();
    let failed = rows.iter().filter(|row| row.verdict == Verdict::Fail);
    let failed: Vec<&str> = failed.map(|row| row.check).collect();
    println!("\nfound by: {}", failed.join("; "));
    assert!(failed.is_empty(), "{failed:?}");
}

/// A pair of overlapping meshes had excused every difference between the intersectors, anywhere in the picture.
#[test]
fn faults_are_found_where_meshes_overlap() {
    let test = "study::verify::planted::overlapping_meshes_have_no_fault_of_their_own";
    for mutant in [Mutant::BarycentricsLost, Mutant::OneCornerBehind] {
        let found = found(test, mutant, 0.0);
        assert!(found.contains("intersectors"), "{mutant:?}: {found}");
    }
}

const PLAIN: &str = "study::verify::planted::the_scene_has_no_fault_of_its_own";

/// The failures that a process of a test with this fault reports.
fn found(test: &str, mutant: Mutant, seconds: f64) -> String {
    let output = Command::new(std::env::current_exe().unwrap())
        .args(["--exact", test, "--nocapture"])
        .env("OCTOLUX_MUTANT", format!("{mutant:?}"))
        .env(SECONDS, seconds.to_string())
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stdout);
    let found = said.lines().find_map(|line| line.strip_prefix("found by: "));
    found.unwrap_or("no answer").to_owned()
}

#[test]
fn every_kind_of_fault_is_found() {
    let missed: Vec<String> = KINDS
        .into_par_iter()
        .filter_map(|mutant| {
            let mut last = String::new();
            for seconds in BUDGETS {
                last = found(PLAIN, mutant, seconds);
                // Only the barycentric fault has to be found where the plan would not look.
                let where_it_is = mutant != Mutant::BarycentricsLost || last.contains("intersectors");
                if !last.is_empty() && last != "no answer" && where_it_is {
                    return None;
                }
            }
            Some(format!("{mutant:?}: {last}"))
        })
        .collect();
    assert!(missed.is_empty(), "{}", missed.join("\n"));
}
