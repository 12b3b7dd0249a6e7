//! Exactness of the choice of accelerator: shapes in a line, culled by tile and light, and Embree's hierarchy see the same
//! light. Both get the same rays; a pixel counts as different where a channel is by more than 1 %. Nothing here is
//! statistical.

use crate::proof::accelerators::{
    a_lamp_through_a_table, compare, narrow_views, nothing_is_missed, random_scene, random_scenes,
};
use crate::proof::runs::{load, settings};
use octolux::scene::EstimatorKind;
use rand::SeedableRng;
use rand_pcg::Pcg64;

#[test]
fn both_accelerators_paint_the_scenes_alike() {
    for name in [
        "veach-mis.toml",
        "large-lights.toml",
        "many-spheres.toml",
        "tests/two-lights.toml",
    ] {
        let scene = load(name);
        for estimator in EstimatorKind::ALL {
            let what = format!("accel-{}-{}", scene.name(), estimator.name());
            let (count, files) = compare(&scene, settings(72, 48, estimator), 2, &what);
            assert!(
                count * 1000 <= 72 * 48,
                "{what}: {count} pixels differ, {}",
                files.join(", ")
            );
        }
    }
}

/// In the line itself there is no tolerance: a shape that is left out for a tile is met by none of its rays.
#[test]
fn what_is_left_out_for_a_tile_is_met_by_none_of_its_rays() {
    for name in [
        "veach-mis.toml",
        "large-lights.toml",
        "still-life.toml",
        "one-sided.toml",
    ] {
        let scene = load(name);
        for estimator in [EstimatorKind::Mis, EstimatorKind::Brdf] {
            let what = format!("cull-{}-{}", scene.name(), estimator.name());
            nothing_is_missed(&scene, settings(144, 96, estimator), 3, &what);
        }
    }
    for distance in [0.5, 2.0, 6.0, 50.0, 1e3, 1e5] {
        for seed in 0..30 {
            let scene = random_scene(&mut Pcg64::seed_from_u64(seed), distance)
                .build()
                .expect("a scene");
            let base = settings(scene.film().width, scene.film().height, EstimatorKind::Mis);
            nothing_is_missed(&scene, base, 2, &format!("cull-{distance}-{seed}"));
        }
    }
}

/// From among the shapes to fifty times their size away: measured, one pixel of 250 000 differs.
#[test]
fn both_accelerators_paint_random_scenes_alike() {
    random_scenes("random", &[0.5, 2.0, 6.0, 50.0], 30, 1);
}

/// From a thousand times their size: measured, 1 pixel in 20 000 differs, on edges whose vertices single precision
/// rounds to 6e-5 of the scene. (From 1e4 times it is 0.6 in 1000, from 1e5 times 8.)
#[test]
fn both_accelerators_paint_what_is_seen_from_afar_alike() {
    random_scenes("afar", &[1e3], 20, 1);
}

/// What stands between a light and points is not only what stands between its middle and them.
#[test]
fn both_accelerators_see_a_lamp_through_a_table() {
    a_lamp_through_a_table();
}

/// A ball that fills half of ever narrower views: the planes of a tile of 2e-7 degrees are crossed from directions that
/// differ in their last bits.
#[test]
fn both_accelerators_see_what_fills_a_narrow_view() {
    narrow_views(&[10.0, 1.0, 0.1, 0.01, 1e-3, 1e-4, 1e-5]);
}
