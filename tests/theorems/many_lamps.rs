//! Lists of points and spots: the mean of all of them under every estimator, the same bits for everyone, and nothing where they are few.

use crate::many_lights::{adaptive, listed, replayed, taken_up_again};
use crate::proof::Family;
use crate::proof::many_lights::{agree_by, dull, polished, scene, under_lamps};
use crate::proof::pictures::{assert_same, both, differences};
use crate::proof::runs::{other_widths, picture, settings};
use octolux::pipeline::{Prepared, Settings};
use octolux::scene::{EstimatorKind, Light, SamplerKind, Scene};
use octolux::settings::LightsAsked;

/// Points and spots alone, beside polished surfaces, and with spheres and triangles.
fn scenes() -> [Scene; 4] {
    [scene(0, 0), polished(0, 0), scene(40, 30), polished(40, 30)].map(|scene| under_lamps(&scene, 90))
}

fn per_light() -> Vec<EstimatorKind> {
    EstimatorKind::ALL
        .into_iter()
        .filter(|estimator| estimator.per_light())
        .collect()
}

/// Welch's tests of 24 seeds, 11 parts of a film, all estimators and two samplers; a family raises a false alarm once in 50 000. The
/// keyhole in the wall hides most of a quarter of the lamps.
#[test]
fn short_lists_have_the_mean_of_all_points_and_spots() {
    let all = EstimatorKind::ALL;
    agree_by(Family::new("lamps-70"), &under_lamps(&scene(0, 0), 70), &all, 4, 24, 8);
    agree_by(
        Family::new("lamps-300"),
        &under_lamps(&scene(0, 0), 300),
        &all,
        16,
        24,
        8,
    );
    agree_by(
        Family::new("lamps-of-1"),
        &under_lamps(&scene(0, 0), 100),
        &all,
        1,
        24,
        16,
    );
}

/// The same with spheres and triangles that emit. By `uniform` and `brdf`, which find these by chance, lists have the lamps alone.
#[test]
fn short_lists_of_all_kinds_have_the_mean_of_all_lights() {
    let by = per_light();
    agree_by(
        Family::new("kinds-130"),
        &under_lamps(&scene(40, 20), 70),
        &by,
        4,
        24,
        8,
    );
    agree_by(
        Family::new("kinds-of-1"),
        &under_lamps(&scene(40, 0), 70),
        &by,
        1,
        24,
        16,
    );
    let by = [EstimatorKind::Uniform, EstimatorKind::Brdf];
    agree_by(Family::new("kinds-met"), &under_lamps(&scene(3, 0), 70), &by, 4, 24, 16);
}

/// Points with lobes walk down the tree by themselves; that has the mean too.
#[test]
fn walks_to_points_and_spots_have_the_mean_of_all_lights() {
    let all = EstimatorKind::ALL;
    agree_by(
        Family::new("lamps-walks"),
        &under_lamps(&polished(0, 0), 120),
        &all,
        16,
        24,
        8,
    );
    agree_by(
        Family::new("kinds-walks"),
        &under_lamps(&polished(30, 20), 60),
        &per_light(),
        8,
        24,
        8,
    );
    agree_by(
        Family::new("lamps-walk-of-1"),
        &under_lamps(&polished(0, 0), 70),
        &all,
        1,
        24,
        16,
    );
}

/// The tests above are about lists and about walks.
#[test]
fn polished_points_walk_to_lamps_and_others_have_lists() {
    for (scene, walks) in [(polished(0, 0), true), (polished(60, 20), true), (dull(0, 0), false)] {
        for estimator in [EstimatorKind::Light, EstimatorKind::Brdf] {
            let prepared = Prepared::new(&under_lamps(&scene, 120), listed(37, 21, estimator)).expect("it renders");
            let _ = prepared.passes(33).finish();
            let [walk, list] = prepared.lists().expect("lists").tables;
            assert!(list + walk > 0 && (walk > 0) == walks, "{walk} and {list} tables");
        }
    }
}

#[test]
fn widths_of_packets_and_threads_change_no_bit_under_lamps() {
    for scene in scenes() {
        for estimator in EstimatorKind::ALL {
            for sampler in SamplerKind::ALL {
                let eight = Settings {
                    sampler,
                    ..listed(37, 21, estimator)
                };
                for lanes in other_widths() {
                    let lanes = Some(lanes);
                    both(&scene, eight, Settings { lanes, ..eight }, 5, "lamps");
                }
                both(&scene, eight, Settings { threads: 3, ..eight }, 5, "lamps, threads");
            }
        }
    }
}

#[test]
fn shards_and_runs_that_are_taken_up_again_have_the_bits_of_one_run_under_lamps() {
    let [lamps, _, _, mixed] = scenes();
    taken_up_again(&lamps);
    taken_up_again(&mixed);
}

#[test]
fn a_sample_by_lists_of_lamps_is_replayed() {
    let [lamps, polished, mixed, mixed_polished] = scenes();
    for scene in [lamps, polished] {
        assert!(replayed(&scene, &EstimatorKind::ALL, true) > 4, "samples with light");
    }
    for scene in [mixed, mixed_polished] {
        replayed(&scene, &EstimatorKind::ALL, false);
    }
}

/// As in `many_lights`: 300 seeds, 5 standard errors, once in 1.7 million each.
#[test]
fn adaptive_renders_by_lists_of_lamps_are_unbiased() {
    for scene in [scene(0, 0), polished(20, 20)] {
        adaptive(&under_lamps(&scene, 100));
    }
}

/// With a list as long as there are lamps, each of them is in every list: the picture is that of all lamps, but for the order of sums.
#[test]
fn a_list_of_all_lamps_sees_what_all_lamps_see() {
    let scene = under_lamps(&dull(0, 0), 20);
    for estimator in EstimatorKind::ALL {
        let of = |lights| {
            let base = settings(40, 24, estimator);
            picture(&scene, Settings { lights, ..base }, 4)
        };
        let (lists, all) = (of(LightsAsked::List(20)), of(LightsAsked::All));
        for (x, y) in lists.pixels.iter().flatten().zip(all.pixels.iter().flatten()) {
            assert!((x - y).abs() <= 2e-6 * y, "{}: {x}, not {y}", estimator.name());
        }
    }
}

/// 64 lights are all sampled, with the bits of `--lights all`; 65 are not. Points and spots count as spheres and triangles do; for
/// `uniform` and `brdf` they count alone.
#[test]
fn points_and_spots_count_as_lights() {
    for (spheres, lamps) in [(0, 64), (0, 65), (40, 24), (40, 25), (70, 64), (3, 65)] {
        let scene = under_lamps(&scene(spheres, 0), lamps);
        for estimator in EstimatorKind::ALL {
            let auto = settings(24, 16, estimator);
            let lights = if estimator.per_light() { spheres + lamps } else { lamps };
            let what = format!("{} {spheres} {lamps}", estimator.name());
            let prepared = Prepared::new(&scene, auto).expect("it renders");
            let lists = prepared.lists();
            assert_eq!(lists.map(|lists| lists.length), (lights > 64).then_some(8), "{what}");
            assert!(lists.is_none_or(|lists| lists.lights == lights as usize), "{what}");
            let all = Settings {
                lights: LightsAsked::All,
                ..auto
            };
            let differ = differences(&picture(&scene, auto, 2), &picture(&scene, all, 2)) > 0;
            assert_eq!(differ, lights > 64, "{what}");
        }
    }
}

/// `product` is itself where lists have no light that a ray could meet.
#[test]
fn product_stays_product_where_lists_have_lamps_alone() {
    for (spheres, same) in [(0, EstimatorKind::Product), (1, EstimatorKind::Mis2Power)] {
        let scene = under_lamps(&scene(spheres, 0), 80);
        let prepared = Prepared::new(&scene, listed(24, 16, EstimatorKind::Product)).expect("it renders");
        assert_eq!(prepared.estimator(), same);
    }
}

/// Estimators share a prepared scene, though some draw from lists of all kinds and others from lists of lamps alone.
#[test]
fn another_estimator_of_a_prepared_scene_has_the_bits_of_its_own() {
    let scene = under_lamps(&scene(80, 10), 80);
    let kinds = [EstimatorKind::Brdf, EstimatorKind::Light, EstimatorKind::Uniform];
    let first = Prepared::new(&scene, listed(33, 18, EstimatorKind::Mis)).expect("it renders");
    for estimator in kinds {
        let other = first.with_settings(listed(33, 18, estimator)).expect("it renders");
        let own = picture(&scene, listed(33, 18, estimator), 5);
        assert_same(estimator.name(), &other.passes(5).finish().picture(), &own);
    }
}

/// Lamps that coincide, one at the camera, one in the floor, one of a million times the power, one of none in single precision, and a
/// spot in a sphere.
#[test]
fn odd_lamps_make_numbers() {
    for spheres in [0, 70] {
        let mut odd = under_lamps(&polished(spheres, 0), 90).to_builder();
        let eye = odd.camera.origin;
        for (i, light) in odd.lights.iter_mut().enumerate() {
            let [x, y, z] = [f64::from(i as u32), 3.0, 1.0];
            match i {
                0 => *light = Light::point(eye, [1.0; 3]),
                1..20 => *light = Light::point([1.0, y, z], [0.01 * x; 3]),
                20 => *light.power_mut() *= 1e8,
                21 => *light = Light::point([0.3, 0.0, 0.7], [1.0; 3]),
                22 => *light.power_mut() *= 1e-60,
                23 => *light = Light::spot([1.2, 0.8, 0.0], [1.2, 0.0, 0.0], [1.0; 3], [5.0, 5.0]),
                _ => {}
            }
        }
        let odd = odd.build().expect("a scene");
        for estimator in EstimatorKind::ALL {
            picture(&odd, listed(32, 20, estimator), 8);
            let prepared = Prepared::new(&odd, listed(32, 20, estimator)).expect("it renders");
            assert!(prepared.lists().is_some());
        }
    }
}

/// Lamps that are all 0 in single precision make a black picture.
#[test]
fn lamps_that_are_none_in_single_precision_are_black() {
    let mut dim = under_lamps(&scene(0, 0), 70).to_builder();
    for light in &mut dim.lights {
        *light.power_mut() *= 1e-60;
    }
    let dim = dim.build().expect("a scene");
    for estimator in EstimatorKind::ALL {
        let film = picture(&dim, listed(24, 16, estimator), 4);
        assert!(film.pixels.iter().flatten().all(|&x| x == 0.0), "{}", estimator.name());
    }
}
