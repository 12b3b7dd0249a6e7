//! Whatever a scene says that loads, rules hold that need no truth beside it: its picture is finite and not negative, no contribution
//! is invalid, and packets of every width, kernels with every effect, culling or none and other scales give the same bits. Ordinary
//! scenes also agree with the oracle, by every estimator. `octolux::study::hunt` draws the scenes, looks at them, and makes small
//! what fails.
//!
//! Wild scenes have no false alarm: ties are told from faults in `f64`. The means of all ordinary scenes here raise one with a
//! probability of 1e-3 (`FALSE_ALARMS`); seeds are fixed, so they pass or fail for good.
//!
//! `OCTOLUX_PROPERTY_CASES=100000 cargo test --release --test theorems properties` is the nightly form of the wild ones, `octolux hunt
//! --scenes 2000 --seed N -o DIR` that of the ordinary ones.

use octolux::study::hunt::draw::Kind;
use octolux::study::hunt::{Options, hunt, recipe};

/// Wild scenes in the short form, each in 16 pictures.
const CASES: u64 = 400;

/// Ordinary scenes, each in 20 pictures and 112 replicates.
const SCENES: u64 = 60;

fn cases() -> u64 {
    let asked = std::env::var("OCTOLUX_PROPERTY_CASES");
    asked.map_or(CASES, |cases| {
        cases.parse().expect("OCTOLUX_PROPERTY_CASES is a whole number")
    })
}

fn nothing_is_found(options: Options) {
    let folder = tempfile::tempdir().unwrap();
    recipe::write_pictures(folder.path()).unwrap();
    let bag = hunt(&options, folder.path(), |_, _| true).unwrap();
    assert!(bag.scenes > options.scenes / 2, "{} drafts were no scene", bag.none);
    let told = |caught: &octolux::study::hunt::Catch| {
        format!(
            "scene {}: {:?}\n{}",
            caught.number,
            caught.faults,
            caught.small.toml(1.0)
        )
    };
    let all: Vec<String> = bag.catches.iter().map(told).collect();
    assert!(
        all.is_empty(),
        "{} of {} scenes:\n{}",
        all.len(),
        bag.scenes,
        all.join("\n")
    );
}

#[test]
fn every_wild_picture_is_finite_not_negative_and_the_same_in_all_widths() {
    nothing_is_found(Options {
        kind: Kind::Wild,
        seed: 7,
        first: 0,
        scenes: cases(),
    });
}

#[test]
fn every_ordinary_picture_is_also_the_oracles_and_the_same_at_every_scale() {
    nothing_is_found(Options {
        kind: Kind::Ordinary,
        seed: 7,
        first: 0,
        scenes: SCENES,
    });
}
