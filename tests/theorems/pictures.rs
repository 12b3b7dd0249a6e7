//! Exactness, picture by picture: a picture's bits depend on what is asked for and on nothing else. Not on the width of
//! packets, not on the number of threads, not on when it was looked at. Nothing here is statistical.

use std::time::Instant;

use crate::proof::pictures::{assert_same, both, differences};
use crate::proof::runs::{load, other_widths, rendered, settings};
use octolux::pipeline::{Prepared, Settings};
use octolux::scene::{EstimatorKind, FilmSize, SamplerKind};
use octolux::settings::Lanes;

/// Scenes that between them have diffuse and Phong surfaces, spheres and meshes that reflect and that emit, smooth
/// normals, one light and twelve, and a picture of a sky.
const SCENES: [&str; 7] = [
    "knot.toml",
    "many-spheres.toml",
    "mesh-light.toml",
    "sky.toml",
    "veach-mis.toml",
    "tests/two-lights.toml",
    "tests/furnace-phong.toml",
];

/// Films whose tiles have 1, 7, 9, 16 x 16, 1 x 16, 16 x 1 and 1 x 1 pixels: with 1, 2 and 5 passes the tails of
/// streams have every length from 0 to 15, and packets straddle passes.
#[test]
fn all_widths_of_packets_paint_the_same_bits() {
    let mut shadow_rays = 0;
    for name in SCENES {
        let scene = load(name);
        for estimator in EstimatorKind::ALL {
            for sampler in SamplerKind::ALL {
                for (width, height) in [(1, 1), (1, 7), (8, 1), (9, 1), (17, 33)] {
                    for passes in [1, 2, 5] {
                        let eight = Settings {
                            sampler,
                            ..settings(width, height, estimator)
                        };
                        for lanes in other_widths() {
                            let what = format!("{width}x{height} {passes} passes, 8 lanes and {lanes}");
                            let counters = both(
                                &scene,
                                eight,
                                Settings {
                                    lanes: Some(lanes),
                                    ..eight
                                },
                                passes,
                                &what,
                            );
                            shadow_rays += counters.shadow_rays;
                        }
                    }
                }
            }
        }
    }
    assert!(
        shadow_rays > 100_000,
        "only {shadow_rays} shadow rays: the films show nothing"
    );
}

/// 48 x 40 pixels are nine tiles, enough to go around; the widths of packets in turn.
#[test]
fn threads_change_no_bit() {
    for name in SCENES {
        let scene = load(name);
        for estimator in EstimatorKind::ALL {
            for (i, threads) in [2, 3, 8].into_iter().enumerate() {
                let one = Settings {
                    lanes: Some(
                        [
                            Lanes::Eight,
                            Lanes::One,
                            *other_widths().last().unwrap_or(&Lanes::Eight),
                        ][i],
                    ),
                    ..settings(48, 40, estimator)
                };
                both(
                    &scene,
                    one,
                    Settings { threads, ..one },
                    9,
                    &format!("1 thread and {threads}"),
                );
            }
        }
    }
}

/// A render stops at 1, 2, 4, 8, … passes whoever asks; someone who looks at each of them, with limits far and near,
/// sees on the way what a render of so many passes shows, and ends with the same bits.
#[test]
fn looking_at_a_render_changes_no_bit() {
    for name in ["knot.toml", "tests/two-lights.toml"] {
        let scene = load(name);
        for estimator in EstimatorKind::ALL {
            for (width, height) in [(5, 3), (40, 30)] {
                let settings = settings(width, height, estimator);
                let mut watched = Prepared::new(&scene, settings).unwrap().passes(64);
                for look in 0.. {
                    // Whole blocks, and parts of a tile each, in turn.
                    let step = watched.step_until((look % 2 == 1).then(Instant::now));
                    let name = format!("{} {} {width}x{height}", scene.name(), estimator.name());
                    let (least, _, most) = watched.spread();
                    if least == most && most <= 8 {
                        let so_far = rendered(&scene, settings, watched.passes()).picture();
                        assert_same(&format!("{name} half way"), &watched.picture(), &so_far);
                    }
                    if !step.is_more() {
                        break;
                    }
                }
                let name = format!("{} {} {width}x{height} watched", scene.name(), estimator.name());
                assert_same(&name, &watched.picture(), &rendered(&scene, settings, 64).picture());
            }
        }
    }
}

/// The seed is heard, and nothing else: no clock, no address in memory.
#[test]
fn a_seed_decides_the_picture_and_another_seed_another_one() {
    let scene = load("tests/two-lights.toml");
    let film = FilmSize { width: 9, height: 5 };
    for estimator in EstimatorKind::ALL {
        let first = Settings {
            film,
            ..settings(9, 5, estimator)
        };
        let picture = rendered(&scene, first, 64).picture();
        assert_same("the same seed", &picture, &rendered(&scene, first, 64).picture());
        let other = rendered(&scene, Settings { seed: 2, ..first }, 64).picture();
        assert!(
            differences(&picture, &other) > 0,
            "{}: the seed is not heard",
            estimator.name()
        );
    }
}
