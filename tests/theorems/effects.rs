//! Only what a scene calls for: what the plan holds, and that what it need not hold changes nothing. Nothing here is
//! statistical.

use std::sync::Arc;

use crate::proof::pictures::assert_same;
use crate::proof::runs::{load, picture, settings};
use octolux::pipeline::{Prepared, Settings};
use octolux::scene::{Bsdf, Effect, Effects, EstimatorKind, Features, LightClass, Scene, SceneBuilder, Surface};
use octolux::settings::Lanes;

fn held(scene: &Scene) -> Effects {
    let settings = settings(24, 16, EstimatorKind::Brdf);
    Prepared::new(scene, settings).expect("a scene that renders").held()
}

/// Scenes with one user, or one kind of user, of an effect, and what takes it away.
type Taking = (&'static str, Effect, fn(&mut SceneBuilder));

fn matt(scene: &mut SceneBuilder) {
    for material in &mut scene.materials {
        if let Bsdf::Phong { rho, .. } = material.bsdf {
            material.bsdf = Bsdf::Diffuse { rho };
        }
    }
}

fn smooth_out(scene: &mut SceneBuilder) {
    for material in &mut scene.materials {
        if let Bsdf::Ggx { .. } | Bsdf::Conductor { .. } = material.bsdf {
            material.bsdf = Bsdf::Diffuse { rho: [0.5; 3].into() };
        }
    }
    // Rough surfaces and the environment share a camera stage, so both go.
    scene.environment = None;
}

const TAKEN: [Taking; 10] = [
    ("ggx.toml", Effect::Ggx, smooth_out),
    ("ggx.toml", Effect::Conductor, smooth_out),
    ("veach-mis.toml", Effect::Phong, matt),
    ("knot.toml", Effect::SmoothNormals, |scene| {
        scene
            .meshes
            .iter_mut()
            .for_each(|mesh| Arc::make_mut(mesh).normals = None);
    }),
    ("terminator.toml", Effect::SmoothTerminator, |scene| {
        scene
            .meshes
            .iter_mut()
            .for_each(|mesh| Arc::make_mut(mesh).smooth_terminator = false);
    }),
    ("lens.toml", Effect::Lens, |scene| scene.camera.lens = None),
    ("one-sided.toml", Effect::OneSided, |scene| {
        scene
            .materials
            .iter_mut()
            .for_each(|material| material.one_sided = false);
    }),
    ("textures.toml", Effect::Textures, |scene| {
        scene.materials.iter_mut().for_each(|material| material.texture = None);
    }),
    // Suns and the environment share a camera stage, so both go.
    ("lamps.toml", Effect::Suns, |scene| {
        scene.lights.retain(|light| light.class() != LightClass::Disk);
        scene.environment = None;
    }),
    ("blend.toml", Effect::Blend, |scene| {
        for material in &mut scene.materials {
            if let Bsdf::Blend { specular, alpha, .. } = material.bsdf {
                material.bsdf = Bsdf::Phong { rho: specular, alpha };
            }
        }
    }),
];

#[test]
fn without_its_only_user_an_effect_is_in_no_kernel() {
    for (name, effect, take) in TAKEN {
        let scene = load(name);
        let before = held(&scene);
        assert!(before.has(effect), "{name} calls for {}", effect.name());
        let mut changed = scene.to_builder();
        take(&mut changed);
        let after = held(&changed.build().unwrap());
        assert!(
            !after.has(effect) && before.contains(after),
            "{name} without {}",
            effect.name()
        );
    }
}

#[test]
fn an_absent_effect_that_is_forced_on_changes_no_bit() {
    for name in [
        "veach-mis.toml",
        "knot.toml",
        "mesh-light.toml",
        "lens.toml",
        "one-sided.toml",
    ] {
        let scene = load(name);
        for estimator in EstimatorKind::ALL {
            for lanes in [Lanes::One, Lanes::Eight] {
                let settings = Settings {
                    lanes: Some(lanes),
                    ..settings(33, 20, estimator)
                };
                let plain = picture(&scene, settings, 3);
                let features = Features::of(&scene, settings.film);
                let absent = Effect::ALL.into_iter().filter(|&effect| features.count(effect) == 0);
                for effect in absent {
                    let forced = Prepared::holding(&scene, settings, Effects::of(&[effect])).expect("it renders");
                    let forced = forced.passes(3).finish();
                    let what = format!("{name}, {}, {lanes} lanes, {} forced", estimator.name(), effect.name());
                    assert_same(&what, &forced.picture(), &plain);
                }
            }
        }
    }
}

#[test]
fn what_no_eye_ray_can_meet_calls_for_nothing() {
    let scene = load("veach-mis.toml");
    let seen = Features::of(&scene, scene.film());
    // The camera steps back and turns round: the lights are still lights, and nothing is shaded.
    let mut turned = scene.to_builder();
    let back = turned.camera.origin - turned.camera.target;
    turned.camera.origin += 100.0 * back;
    turned.camera.target = turned.camera.origin + back;
    let scene = turned.build().unwrap();
    let unseen = Features::of(&scene, scene.film());
    assert_eq!(unseen.count(Effect::SphereLights), seen.count(Effect::SphereLights));
    assert_eq!((unseen.count(Effect::Phong), unseen.count(Effect::Diffuse)), (0, 0));
    assert!(unseen.nothing_in_sight() && !seen.nothing_in_sight());

    // The same picture as by tracing: all black, and no ray was traced for it.
    let blank = Prepared::new(&scene, settings(24, 16, EstimatorKind::Mis)).expect("it renders");
    let blank = blank.passes(1).finish();
    assert!(blank.picture().pixels.iter().flatten().all(|&x| x == 0.0));
    let counters = blank.counters();
    assert_eq!(
        (counters.samples, counters.eye_rays, counters.shadow_rays),
        (24 * 16, 0, 0)
    );
}

#[test]
fn an_emission_of_zero_is_no_light() {
    let scene = load("veach-mis.toml");
    let before = Features::of(&scene, scene.film()).count(Effect::SphereLights);
    let mut dark = scene.to_builder();
    assert!(dark.spheres[0].surface.emits());
    dark.spheres[0].surface = Surface::emission([0.0; 3]);
    let scene = dark.build().unwrap();
    assert_eq!(
        Features::of(&scene, scene.film()).count(Effect::SphereLights),
        before - 1
    );
}

/// Lights of every kind in one scene, tiles of several sizes: what a stage leaves behind in a thread's scratch pad would reach
/// other pixels, and depend on which tiles the thread had before.
#[test]
fn no_stage_leaves_rays_to_the_next_tile() {
    let scene = load("still-life.toml");
    let on = |threads| {
        picture(
            &scene,
            Settings {
                threads,
                ..settings(60, 40, EstimatorKind::Mis)
            },
            8,
        )
    };
    let one = on(1);
    assert!(one.pixels.iter().flatten().all(|x| x.is_finite()));
    assert_eq!(one, on(3));
}
