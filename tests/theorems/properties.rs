//! Whatever a scene says that loads: its picture is finite and not negative, no contribution was invalid, and packets of
//! every width give the same bits. Scenes are drawn over many orders of magnitude: sizes, places, lights that touch,
//! enclose or overlap, exponents from next to 1 up to a million.
//!
//! `OCTOLUX_PROPERTY_CASES=100000 cargo test --release --test theorems properties` is the nightly form.

use std::fmt::Write;
use std::path::Path;
use std::sync::atomic::{AtomicU32, Ordering};

use crate::proof::runs::other_widths;
use octolux::pipeline::{Prepared, Settings};
use octolux::scene::{EstimatorKind, FilmSize, SamplerKind, Scene};
use octolux::settings::{AccelKind, Lanes};
use proptest::prelude::*;
use proptest::test_runner::{RngSeed, TestRunner};

/// Scenes in the short form, which keeps the suite short.
const CASES: u32 = 2000;

fn cases() -> u32 {
    let asked = std::env::var("OCTOLUX_PROPERTY_CASES");
    asked.map_or(CASES, |cases| {
        cases.parse().expect("OCTOLUX_PROPERTY_CASES is a whole number")
    })
}

/// A number of random sign between ten to the `low` and ten to the `high`, alike in each order of magnitude; or 0.
fn magnitude(low: f64, high: f64) -> impl Strategy<Value = f64> {
    prop_oneof![
        1 => Just(0.0),
        8 => (low..high, any::<bool>()).prop_map(|(power, up)| 10_f64.powf(power) * if up { 1.0 } else { -1.0 }),
    ]
}

fn point() -> impl Strategy<Value = [f64; 3]> {
    prop_oneof![
        3 => [-2.0..2.0, -2.0..2.0, -2.0..2.0_f64],
        1 => [magnitude(-6.0, 3.0), magnitude(-6.0, 3.0), magnitude(-6.0, 3.0)],
        1 => [-2..3, -2..3, -2..3].prop_map(|whole| whole.map(f64::from)),
    ]
}

fn colour(low: f64, high: f64) -> impl Strategy<Value = [f64; 3]> {
    prop_oneof![
        6 => (low..high).prop_map(|power| [10_f64.powf(power); 3]),
        2 => [(low..high), (low..high), (low..high)].prop_map(|powers| powers.map(|power| 10_f64.powf(power))),
        1 => Just([0.0, 1.0, 0.0]),
    ]
}

/// Text of a surface: a light, or one of the two materials.
fn surface() -> impl Strategy<Value = String> {
    prop_oneof![
        2 => colour(-20.0, 20.0).prop_map(|le| format!("emission = {le:?}")),
        1 => Just("material = \"diffuse\"".to_owned()),
        1 => Just("material = \"phong\"".to_owned()),
    ]
}

fn sphere() -> impl Strategy<Value = String> {
    let radius = prop_oneof![
        (-7.0..2.0).prop_map(|power: f64| 10_f64.powf(power)),
        Just(1.0),
        Just(1000.0)
    ];
    (point(), radius, surface()).prop_map(|(center, radius, surface)| {
        format!("[[spheres]]\ncenter = {center:?}\nradius = {radius:?}\n{surface}\n")
    })
}

/// Two triangles with a shared edge; seldom an emitter.
fn mesh() -> impl Strategy<Value = String> {
    let material = prop_oneof![
        8 => Just("material = \"diffuse\"".to_owned()),
        8 => Just("material = \"phong\"".to_owned()),
        1 => colour(-3.0, 3.0).prop_map(|le| format!("emission = {le:?}")),
    ];
    ([point(), point(), point(), point()], material, any::<bool>()).prop_map(|(corners, material, smooth)| {
        let normals = if smooth { "smooth" } else { "flat" };
        format!(
            "[[meshes]]\nvertices = {corners:?}\nfaces = [[0, 1, 2], [0, 2, 3]]\n{material}\nnormals = \"{normals}\"\n"
        )
    })
}

/// The text of a scene. The floor makes sure that most have something to shade.
fn scene() -> impl Strategy<Value = String> {
    let exponent = prop_oneof![
        (1e-7..6.0_f64).prop_map(|power| 10_f64.powf(power)),
        Just(1e6),
        Just(1.0 + 1e-9)
    ];
    // The camera lies on no surface: from there Embree's single rays and its packets may answer differently, as they may for
    // rays that are aimed at a corner (`proof_embree` bounds that).
    let eye = [-2.0..2.0, -2.0..2.0, -2.0..2.0_f64];
    let view = (eye, point(), point(), prop_oneof![1e-3..170.0, Just(40.0)]);
    let shapes = (
        prop::collection::vec(sphere(), 1..5),
        prop::collection::vec(mesh(), 0..3),
        any::<bool>(),
    );
    (view, shapes, exponent, colour(-3.0, 0.0)).prop_map(
        |((origin, target, up, fov), (spheres, meshes, floor), exponent, rho)| {
            let mut text = format!(
                "[camera]\norigin = {origin:?}\ntarget = {target:?}\nup = {up:?}\nfov_x = {fov:?}\n\
                 [film]\nwidth = 5\nheight = 3\n\
                 [materials.diffuse]\ndiffuse = {rho:?}\n[materials.phong]\nphong = {rho:?}\nexponent = {exponent:?}\n"
            );
            if floor {
                let corners = "[[-9, -1, -9], [9, -1, -9], [9, -1, 9], [-9, -1, 9]]";
                let faces = "[[0, 1, 2], [0, 2, 3]]";
                let _ = writeln!(
                    text,
                    "[[meshes]]\nvertices = {corners}\nfaces = {faces}\nmaterial = \"phong\""
                );
            }
            spheres.iter().chain(&meshes).for_each(|shape| text += shape);
            text
        },
    )
}

/// A scene's text, which estimator, whether in a line, whether by `sobol`, the seed.
type Case = (String, prop::sample::Index, bool, bool, u32);

#[test]
fn every_picture_is_finite_not_negative_and_the_same_in_all_widths() {
    let cases = cases();
    let config = ProptestConfig {
        cases,
        failure_persistence: None,
        rng_seed: RngSeed::Fixed(7),
        max_global_rejects: u32::MAX,
        ..Default::default()
    };
    let near_ties = AtomicU32::new(0);
    let case = (
        scene(),
        any::<prop::sample::Index>(),
        any::<bool>(),
        any::<bool>(),
        any::<u32>(),
    );
    let outcome = TestRunner::new(config).run(&case, |case| holds(&case, &near_ties));
    outcome.unwrap_or_else(|error| panic!("{error}"));
    // Where two surfaces are met at the same distance but for a rounding, the boxes around them decide, and Embree tests
    // boxes of single rays and of packets in different arithmetic: 1 pixel in 64 000 scenes of 15 (Embree 4.4.0).
    let near_ties = near_ties.into_inner();
    assert!(
        near_ties <= 1 + cases / 10_000,
        "{near_ties} pixels differ between widths through Embree"
    );
}

fn holds((text, which, linear, sobol, seed): &Case, near_ties: &AtomicU32) -> Result<(), TestCaseError> {
    // What does not load is told from what does by tests of its own.
    let Ok(scene) = Scene::parse(text, Path::new("property.toml")) else {
        return Err(TestCaseError::reject("not a scene"));
    };
    let settings = Settings {
        film: FilmSize { width: 5, height: 3 },
        estimator: *which.get(&EstimatorKind::ALL),
        sampler: if *sobol {
            SamplerKind::Sobol
        } else {
            SamplerKind::Independent
        },
        seed: *seed,
        lanes: Some(Lanes::Eight),
        threads: 1,
        accel: Some(if *linear { AccelKind::Linear } else { AccelKind::Embree }),
        ..Settings::default()
    };
    let eight = bits(&scene, settings)?;
    for lanes in other_widths() {
        let other = bits(
            &scene,
            Settings {
                lanes: Some(lanes),
                ..settings
            },
        )?;
        let different = eight.iter().zip(&other).filter(|(a, b)| a != b).count();
        if !linear && different == 1 {
            near_ties.fetch_add(1, Ordering::Relaxed);
        } else {
            prop_assert_eq!(
                different,
                0,
                "{} lanes against 8, {:?}: {:?}, {:?}",
                lanes,
                settings,
                eight,
                other
            );
        }
    }
    Ok(())
}

/// The bits of a picture of four passes, once nothing in it is out of order.
fn bits(scene: &Scene, settings: Settings) -> Result<Vec<[u32; 3]>, TestCaseError> {
    let prepared = Prepared::new(scene, settings).map_err(|error| TestCaseError::fail(error.to_string()))?;
    let run = prepared.passes(4).finish();
    let counters = run.counters();
    let invalid = [counters.invalid_nan, counters.invalid_inf, counters.invalid_negative];
    prop_assert_eq!(invalid, [0; 3], "NaN, infinite, negative: {:?}", settings);
    let picture = run.picture();
    let sound = |x: &f32| x.is_finite() && *x >= 0.0;
    prop_assert!(
        picture.pixels.iter().flatten().all(sound),
        "{:?} {:?}",
        settings,
        picture.pixels
    );
    Ok(picture.pixels.iter().map(|pixel| pixel.map(f32::to_bits)).collect())
}
