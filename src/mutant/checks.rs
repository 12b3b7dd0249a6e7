//! The checks that mutants must fail.

use octolux::estimator::density::{Average, ConeOnly};
use octolux::lane::F32x8;
use octolux::pipeline::Settings;
use octolux::proof::{
    self, Family, accelerators, agreement, caps, closed_forms, costs, environments, ggx, many_lights, pictures, rings,
    samplers, strategies, triangles, weights,
};
use octolux::scene::{EstimatorKind, FilmSize, SamplerKind};
use octolux::settings::AccelKind;
use octolux::study::selftest::{Effort, panels, places};

/// The checks of the proof, reduced to a second in total.
pub const CHECKS: [(&str, fn()); 19] = [
    ("density", density),
    ("weight", weight),
    ("rings", rings::both),
    ("tails", rings::a_tail_in_a_picture_is_as_bright_as_by_light_sampling),
    ("ggx", rough),
    ("numbers", || samplers::numbers_of_a_sample(1 << 13)),
    ("closed form", closed_form),
    ("exact", closed_forms::noise_free_scenes),
    ("oracle", oracle),
    ("lanes", lanes),
    ("accelerators", accelerators_agree),
    ("acne", acne),
    ("lists", || {
        many_lights::agree(Family::new("lists"), &many_lights::scene(500, 40), 4, 16, 4)
    }),
    ("lists of lamps", || {
        let lamps = many_lights::under_lamps(&many_lights::scene(0, 0), 300);
        let by = [EstimatorKind::Light, EstimatorKind::Brdf];
        many_lights::agree_by(Family::new("lists of lamps"), &lamps, &by, 4, 16, 4)
    }),
    ("walks", || {
        many_lights::agree(Family::new("walks"), &many_lights::polished(300, 40), 8, 16, 4)
    }),
    ("separate lists", many_lights::apart),
    ("large plates", large_plates),
    ("study", costs::nothing_is_harmful),
    ("target", target_error),
];

fn target_error() {
    costs::target_errors_are_those_of_the_mean();
    crate::run::halves::tests::pictures_are_not_too_dark();
}

fn density() {
    const LIGHTS: [proof::places::Place; 5] = [
        (0.1, 1.5, 0.3, 0.0),
        (0.5, 1.0, 0.0, 1.3),
        (0.5, 1.0, 0.0, 1.8),
        (0.5, 30.0, 0.3, 0.0),
        (0.01, 1.0, 0.0, 1.5608),
    ];
    let mut family = Family::new("density");
    strategies::lobes::<F32x8>(&mut family, &[1.0, 1.5, 300.0], 1 << 14);
    strategies::mixtures::<F32x8, _>(Average, &mut family, &LIGHTS, 1, 1 << 14);
    strategies::mixtures::<F32x8, _>(ConeOnly, &mut family, &LIGHTS, 2, 1 << 14);
    caps::directions::<F32x8>(&mut family, 5, 1 << 13);
    triangles::directions::<F32x8>(&mut family, 3, 1 << 12);
    environments::directions::<F32x8>(&mut family, 4, 1 << 12);
    family.judge();
}

fn weight() {
    weights::samples_of_lights();
    caps::every_sample_is_the_answer();
    weights::samples_of_points();
    weights::nothing_is_dropped();
}

fn rough() {
    let mut family = Family::new("ggx");
    ggx::directions::<F32x8>(&mut family, &[0.01, 0.5], 1 << 14);
    family.judge();
    ggx::every_sample_is_the_answer();
}

fn accelerators_agree() {
    accelerators::random_scenes("random", &[2.0], 6, 1);
    accelerators::a_lamp_through_a_table();
    let normals = proof::runs::leaning_normals();
    let base = proof::runs::settings(12, 9, EstimatorKind::Light);
    let (count, files) = accelerators::compare(&normals, base, 4, "leaning-normals");
    assert_eq!(count, 0, "normals that lean: {}", files.join(", "));
}

fn closed_form() {
    closed_forms::test_scenes(
        "closed-form",
        (SamplerKind::Sobol, AccelKind::Embree),
        10,
        |scene, estimator| {
            let tiny = matches!(scene.name(), "sphere-tiny" | "square-tiny" | "sun-narrow");
            let hopeless = tiny && matches!(estimator, EstimatorKind::Uniform | EstimatorKind::Brdf);
            (!hopeless).then_some(64)
        },
    );
    closed_forms::an_open_light_half_below_the_horizon_of_normals(10, 64);
}

fn acne() {
    let lost = ["mesh", "far floor"].map(|name| {
        places::moved_about(name, &[-6, 0, 5], &[0.0, 1.0, 10.0], Effort { divisor: 2 }).expect("it renders")
    });
    assert_eq!(lost, [0, 0]);
}

fn large_plates() {
    let sigmas = panels::large(Effort { divisor: 32 }).expect("they render");
    assert!(sigmas < 5.5, "{sigmas}");
}

fn oracle() {
    let film = FilmSize { width: 12, height: 9 };
    agreement::agree(
        &proof::runs::leaning_normals(),
        "oracle-normals",
        film,
        10,
        [64, 16, 64, 16],
        256,
    );
    agreement::agree(
        &proof::runs::load("large-lights.toml"),
        "oracle",
        film,
        10,
        [256, 64, 128, 64],
        256,
    );
}

fn lanes() {
    for name in ["tests/two-lights.toml", "large-lights.toml"] {
        let scene = proof::runs::load(name);
        for estimator in EstimatorKind::ALL {
            for (width, height) in [(1, 7), (9, 1), (17, 18)] {
                let eight = proof::runs::settings(width, height, estimator);
                pictures::both(
                    &scene,
                    eight,
                    Settings {
                        lanes: Some(crate::settings::Lanes::One),
                        ..eight
                    },
                    5,
                    &format!("{width}x{height}"),
                );
            }
        }
    }
}
