//! Lists of lights: the mean of all lights, the same bits for everyone, and nothing at all where lights are few.

use crate::proof::Family;
use crate::proof::many_lights::{agree, apart, closed, dull, polished, scene, under_lamps};
use crate::proof::pictures::{assert_same, both, differences};
use crate::proof::runs::{names, oracle_estimates, other_widths, picture, settings};
use octolux::pipeline::{Prepared, Settings};
use octolux::reference;
use octolux::run::{Goal, Saved, Shard};
use octolux::scene::{Effect, EstimatorKind, FilmSize, SamplerKind, Scene, Surface};
use octolux::settings::{AccelKind, Lanes, LightsAsked};

pub fn listed(width: u32, height: u32, estimator: EstimatorKind) -> Settings {
    Settings {
        lights: LightsAsked::List(8),
        ..settings(width, height, estimator)
    }
}

fn per_light() -> impl Iterator<Item = EstimatorKind> {
    EstimatorKind::ALL.into_iter().filter(|estimator| estimator.per_light())
}

/// Welch's tests of 24 seeds, 11 parts of a film, five estimators and two samplers; a family raises a false alarm once in 50 000.
#[test]
fn short_lists_have_the_mean_of_all_lights() {
    agree(Family::new("lists-100"), &scene(100, 0), 4, 24, 8);
    agree(Family::new("lists-65"), &scene(40, 25), 16, 24, 4);
}

#[test]
fn lists_of_one_light_and_of_two_have_it_too() {
    agree(Family::new("lists-of-1"), &scene(60, 40), 1, 24, 16);
    agree(Family::new("lists-of-2"), &scene(1000, 0), 2, 16, 8);
}

/// Under many lights the oracle of studies samples some of them, by intensity, and points, spots and spheres alike; a light from one direction
/// always. It has the mean of all lights in each part of the film; the family raises a false alarm once in 50 000.
#[test]
fn the_oracle_picks_lights_and_has_the_mean_of_all() {
    let scene = under_lamps(&scene(60, 25), 40);
    let film = FilmSize { width: 40, height: 24 };
    let [all, some] = [
        reference::render(&scene, film, 200, 1, &|_| ()),
        reference::render_picking(&scene, film, 1500, 2),
    ];
    assert!(all.picture != some.picture);
    let mut family = Family::new("picks");
    for ((x, y), name) in (oracle_estimates(&all, 4, 3).iter().zip(&oracle_estimates(&some, 4, 3))).zip(names(4, 3)) {
        family.add(x.p(*y, 1e-5), format!("{name}: {}", x.against(*y)));
    }
    family.judge();
}

/// Of closed meshes, lights are selected by the side that is seen; what is hidden has its share, and the mean is that of all lights.
#[test]
fn closed_meshes_have_the_mean_of_all_their_triangles() {
    agree(Family::new("closed"), &closed(30), 8, 24, 8);
}

/// Points with lobes walk down the tree by themselves; that has the mean too.
#[test]
fn walks_have_the_mean_of_all_lights() {
    agree(Family::new("walks-100"), &polished(100, 0), 16, 24, 8);
    agree(Family::new("walks-65"), &polished(40, 25), 8, 24, 4);
    agree(Family::new("walk-of-1"), &polished(60, 40), 1, 24, 16);
}

/// Diffuse points never walk; polished ones do in some tiles.
#[test]
fn polished_points_walk_and_others_have_lists() {
    for (scene, walks) in [(&polished(120, 30), true), (&dull(120, 30), false)] {
        for passes in [1, 5, 33] {
            let prepared = Prepared::new(scene, listed(37, 21, EstimatorKind::Mis)).expect("it renders");
            let _ = prepared.passes(passes).finish();
            let [walk, list] = prepared.lists().expect("lists").tables;
            assert!(
                walk + list > 0 && (walk > 0) == walks,
                "{passes} passes: {walk} and {list} tables"
            );
        }
    }
}

#[test]
fn colors_and_passes_have_lists_of_their_own() {
    apart();
}

#[test]
fn widths_of_packets_and_threads_change_no_bit_of_a_render_by_lists() {
    for (scene, estimator) in [scene(120, 30), polished(120, 30)]
        .iter()
        .flat_map(|scene| per_light().map(move |estimator| (scene, estimator)))
    {
        for sampler in SamplerKind::ALL {
            let eight = Settings {
                sampler,
                ..listed(37, 21, estimator)
            };
            for lanes in other_widths() {
                let lanes = Some(lanes);
                both(scene, eight, Settings { lanes, ..eight }, 5, "lists");
            }
            both(scene, eight, Settings { threads: 3, ..eight }, 5, "lists, threads");
        }
    }
}

#[test]
fn shards_and_runs_that_are_taken_up_again_have_the_bits_of_one_run_by_lists() {
    taken_up_again(&scene(120, 0));
    taken_up_again(&polished(120, 0));
}

pub fn taken_up_again(scene: &Scene) {
    let prepared = Prepared::new(scene, listed(33, 18, EstimatorKind::Mis)).expect("it renders");
    // Two shards of a leaf each.
    let spp = 1024;
    let film = |number| {
        let run = prepared.shard(Shard { number, of: 2 }, spp).finish();
        run.film().clone()
    };
    let mut both = film(1);
    both.absorb(film(2));
    assert_same("shards", &both.picture(), &prepared.passes(spp).finish().picture());
    let folder = tempfile::tempdir().expect("a folder");
    for stop in [1, 2, 4, 37] {
        let path = folder.path().join("state");
        let run = prepared.passes(stop).finish();
        run.save(&path, Vec::new()).expect("it can be written");
        let other = Prepared::new(scene, listed(33, 18, EstimatorKind::Mis)).expect("it renders");
        let resumed = other.resume(Goal::passes(64), Saved::read(&path).expect("it can be read"));
        let resumed = resumed.expect("it is the same render").finish();
        let straight = prepared.passes(64).finish();
        assert_same(&format!("resumed at {stop}"), &resumed.picture(), &straight.picture());
    }
}

/// A film of 65 lights asks lists, one of 64 all of them.
#[test]
fn up_to_64_lights_are_all_asked() {
    for (lights, lists) in [(64, false), (65, true)] {
        let scene = scene(lights, 0);
        for estimator in per_light() {
            let auto = settings(24, 16, estimator);
            let prepared = Prepared::new(&scene, auto).expect("it renders");
            assert_eq!(prepared.lists().map(|lists| lists.length), lists.then_some(8));
            assert_eq!(prepared.features().effects().has(Effect::ManyLights), lists);
            let all = picture(
                &scene,
                Settings {
                    lights: LightsAsked::All,
                    ..auto
                },
                2,
            );
            assert_eq!(differences(&picture(&scene, auto, 2), &all) > 0, lists);
        }
    }
}

/// With a list as long as there are lights, each is asked in every pass, whoever it is.
#[test]
fn a_list_of_all_lights_sees_what_all_lights_see() {
    let scene = scene(20, 0);
    let light = settings(40, 24, EstimatorKind::Light);
    let asked = |lights| picture(&scene, Settings { lights, ..light }, 256);
    let (lists, all) = (asked(LightsAsked::List(20)), asked(LightsAsked::All));
    let sum = |p: &octolux::film::Picture| p.pixels.iter().flatten().map(|&x| f64::from(x)).sum::<f64>();
    // Other random numbers: 256 passes of 960 pixels leave 1e-4 between them.
    assert!(
        (sum(&lists) / sum(&all) - 1.0).abs() < 2e-3,
        "{} {}",
        sum(&lists),
        sum(&all)
    );
}

/// `uniform` and `brdf` do not look at lists: nothing changes for them.
#[test]
fn estimators_without_directions_of_lights_keep_their_bits() {
    let scene = scene(120, 30);
    for estimator in [EstimatorKind::Uniform, EstimatorKind::Brdf] {
        let base = settings(33, 18, estimator);
        for accel in [AccelKind::Embree, AccelKind::Linear] {
            let [lists, all] = [LightsAsked::List(4), LightsAsked::All].map(|lights| {
                let accel = Some(accel);
                picture(&scene, Settings { lights, accel, ..base }, 4)
            });
            assert_same(estimator.name(), &lists, &all);
        }
    }
}

/// The radiance of a replayed sample is that of a render of one pass, and of what is told of its directions.
#[test]
fn a_sample_by_lists_is_replayed() {
    for scene in [scene, polished] {
        let by: Vec<_> = per_light().collect();
        replayed(&scene(120, 30), &by, false);
        assert!(replayed(&scene(120, 0), &by, true) > 4, "samples with light");
    }
}

/// How many samples have light; `all_told`: whether no triangle emits.
pub fn replayed(scene: &Scene, by: &[EstimatorKind], all_told: bool) -> u32 {
    let mut lights = 0;
    for &estimator in by {
        let one = Settings {
            lanes: Some(Lanes::One),
            ..listed(20, 17, estimator)
        };
        let shown = picture(scene, one, 1);
        let prepared = Prepared::new(scene, one).expect("it renders");
        for [x, y] in [[3, 9], [10, 14], [17, 12], [4, 16]] {
            let replay = prepared
                .replay([x, y, 0])
                .expect("one lane")
                .expect("it is on the film");
            let pixel = shown.pixels[(y * 20 + x) as usize];
            assert_eq!(replay.radiance.map(|x| x as f32), pixel, "{} {x} {y}", estimator.name());
            // Without triangles and MIS each direction is told, but for those of a blend's first model: they add up to the sample.
            let blend = replay.hit.is_some_and(|hit| [hit.geometry, hit.primitive] == [1, 2]);
            let brdf = [
                EstimatorKind::Mis,
                EstimatorKind::Mis2Balance,
                EstimatorKind::Mis2Power,
                EstimatorKind::Product,
            ];
            let told = !brdf.contains(&estimator);
            if all_told && told && !blend {
                let found = replay.asked.iter().filter_map(|asked| asked.found);
                let lit = found.filter(|found| !found.occluded);
                let told = lit.fold(replay.seen, |sum, found| {
                    std::array::from_fn(|k| sum[k] + f64::from(found.ld[k]))
                });
                let same = |k: usize| (told[k] - replay.radiance[k]).abs() <= 1e-5 * told[k];
                assert!(
                    (0..3).all(same),
                    "{} {x} {y}: {told:?}, not {:?}",
                    estimator.name(),
                    replay.radiance
                );
                lights += u32::from(told[1] > 0.0);
            }
        }
    }
    lights
}

/// Lights that are 0 in single precision make a black picture.
#[test]
fn lights_that_are_none_in_single_precision_are_black() {
    let mut dim = scene(70, 0).to_builder();
    for sphere in &mut dim.spheres {
        if let Surface::Emission(le) = &mut sphere.surface {
            *le *= 1e-60;
        }
    }
    let dim = dim.build().expect("a scene");
    for estimator in per_light() {
        let film = picture(&dim, listed(24, 16, estimator), 4);
        assert!(film.pixels.iter().flatten().all(|&x| x == 0.0), "{}", estimator.name());
    }
}

/// Black pixels of a chessboard share no list with white ones: the mean of adaptive renders is that of even ones. 300 seeds of a film of
/// two tiles; 5 standard errors, once in 1.7 million.
#[test]
fn adaptive_renders_by_lists_are_unbiased() {
    adaptive(&scene(150, 0));
    adaptive(&polished(150, 0));
}

pub fn adaptive(scene: &Scene) {
    let base = Settings {
        film: FilmSize { width: 32, height: 16 },
        lights: LightsAsked::List(2),
        ..settings(32, 16, EstimatorKind::Light)
    };
    let means = |adaptive: bool| {
        let prepared = Prepared::new(scene, base).expect("it renders");
        let one = |seed: u32| {
            let prepared = prepared.with_seed(seed + if adaptive { 0 } else { 5000 });
            let run = if adaptive {
                prepared.adaptive(16)
            } else {
                prepared.passes(16)
            }
            .finish();
            run.picture()
                .pixels
                .iter()
                .flatten()
                .map(|&x| f64::from(x))
                .sum::<f64>()
        };
        octolux::study::estimate::Estimate::of(&(0..300).map(one).collect::<Vec<_>>())
    };
    let (adaptive, even) = (means(true), means(false));
    assert!(adaptive.sigmas(even, 1e-5) < 5.0, "{}", adaptive.against(even));
}

#[test]
fn product_by_lists_has_the_bits_of_mis2_power() {
    for (spheres, triangles) in [(120, 30), (30, 120)] {
        let scene = scene(spheres, triangles);
        let of = |estimator| picture(&scene, listed(33, 18, estimator), 5);
        assert_same("product", &of(EstimatorKind::Product), &of(EstimatorKind::Mis2Power));
    }
}

/// Lights that coincide, one at the camera, one of a million times the power, one that is larger than all else.
#[test]
fn odd_lights_make_numbers() {
    let mut odd = scene(70, 0).to_builder();
    let eye = odd.camera.origin;
    let lamps = odd.spheres.len() - 70;
    for (i, sphere) in odd.spheres[lamps..].iter_mut().enumerate() {
        match i {
            0 => sphere.center = eye + glam::DVec3::new(0.0, 0.3, 0.0),
            1..20 => sphere.center = glam::DVec3::new(1.0, 3.0, 1.0),
            20 => sphere.surface = Surface::Emission(glam::DVec3::splat(1e8)),
            21 => (sphere.center, sphere.radius) = (glam::DVec3::new(0.0, 50.0, 0.0), 30.0),
            22 => sphere.radius = 1e-9,
            _ => {}
        }
    }
    let odd: Scene = odd.build().expect("a scene");
    for estimator in per_light() {
        picture(&odd, listed(32, 20, estimator), 8);
    }
}
