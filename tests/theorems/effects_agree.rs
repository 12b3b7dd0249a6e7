//! Each effect against the oracle: all estimators agree with it and with each other, in whole and in parts.
//!
//! Welch's test on the means of 16 seeds; false alarms 1e-6 a scene. What is found: a difference of eight standard errors with
//! even odds. Lights are made larger and lobes duller, so that all can be held against each other with few samples.

use crate::proof::runs::load;
use crate::proof::{Family, agreement};
use octolux::pipeline::{Prepared, Settings};
use octolux::scene::{Bsdf, EstimatorKind, FilmSize, Lens, Light, Scene, SceneBuilder, Sphere, Surface};
use octolux::settings::AccelKind;
use octolux::study::error::Errors;

const FILM: FilmSize = FilmSize { width: 24, height: 16 };
const ALPHA: f64 = 1e-6;

fn softened(scene: &Scene) -> SceneBuilder {
    let mut scene = scene.to_builder();
    for material in &mut scene.materials {
        if let Bsdf::Phong { alpha, .. } | Bsdf::Blend { alpha, .. } = &mut material.bsdf {
            *alpha = alpha.min(30.0);
        }
        if let Bsdf::Ggx { roughness, .. } | Bsdf::Conductor { roughness, .. } = &mut material.bsdf {
            *roughness = roughness.max(0.4);
        }
    }
    for sphere in &mut scene.spheres {
        if matches!(sphere.surface, Surface::Emission(_)) {
            sphere.radius = sphere.radius.max(1.5);
        }
    }
    scene
}

fn agrees(name: &str, table: &'static str) {
    let scene = softened(&load(name)).build().unwrap();
    let family = Family::rarely(table, ALPHA);
    agreement::judge(family, table, &scene, FILM, 16, [256, 32, 128, 32], 512);
}

#[test]
fn a_lens_shows_what_the_oracle_sees_through_it() {
    agrees("lens.toml", "agree-lens");
}

#[test]
fn a_lens_under_a_sky_shows_what_the_oracle_sees_through_it() {
    let mut scene = softened(&load("sky.toml"));
    let focus = (scene.camera.target - scene.camera.origin).length();
    let radius = 0.05 * focus;
    scene.camera.lens = Some(Lens { radius, focus });
    let scene = scene.build().unwrap();
    let table = "agree-lens-sky";
    let family = Family::rarely(table, ALPHA);
    agreement::judge(family, table, &scene, FILM, 16, [256, 64, 128, 64], 512);
}

#[test]
fn a_blend_is_the_sum_of_its_lobes() {
    agrees("blend.toml", "agree-blend");
}

#[test]
fn rough_surfaces_reflect_what_the_oracle_says() {
    agrees("ggx.toml", "agree-ggx");
}

#[test]
fn backs_of_one_sided_surfaces_are_black_and_still_in_the_way() {
    agrees("one-sided.toml", "agree-one-sided");
}

#[test]
fn textures_show_what_the_oracle_sees_in_them() {
    agrees("textures.toml", "agree-textures");
}

/// A globe that is half as wide as the picture, a floor that is a sphere, and a ball of tiles, turned up and down.
#[test]
fn textures_on_spheres_show_what_the_oracle_sees_in_them_and_both_intersectors_agree() {
    let mut scene = softened(&load("textures.toml"));
    let tiles = scene.material_named("tiles").unwrap();
    let poster = scene.material_named("poster").unwrap();
    scene.sphere(Sphere::new([-0.9, 0.9, 1.2], 0.9, tiles));
    scene.sphere(Sphere::new([1.7, 0.55, 1.0], 0.6, poster));
    scene.sphere(Sphere::new([0.0, 3.4, -0.5], 1.0, poster));
    let scene = scene.build().unwrap();
    let table = "agree-textured-spheres";
    let family = Family::rarely(table, ALPHA);
    agreement::judge(family, table, &scene, FILM, 16, [256, 32, 128, 32], 512);
    // The same rays: but for the rounding of a hit, the same picture.
    let pictures = AccelKind::ALL.map(|accel| {
        let settings = Settings {
            film: FILM,
            estimator: EstimatorKind::Mis,
            accel: Some(accel),
            ..Settings::of(&scene)
        };
        Prepared::new(&scene, settings).unwrap().passes(64).finish().picture()
    });
    let errors = Errors::between(&pictures[0].pixels, &pictures[1].pixels);
    assert!(errors.relative.abs() < 1e-4 && errors.relmse < 1e-4, "{errors:?}");
}

#[test]
fn a_smooth_terminator_shows_what_the_oracle_sees() {
    agrees("terminator.toml", "agree-terminator");
}

#[test]
fn points_spots_and_suns_show_what_the_oracle_sees() {
    let mut scene = softened(&load("lamps.toml"));
    // Directions of `uniform` must meet it.
    for light in &mut scene.lights {
        if let Light::Directional { angular_radius, .. } = light {
            *angular_radius = 15.0;
        }
    }
    let scene = scene.build().unwrap();
    let family = Family::rarely("agree-lamps", ALPHA);
    agreement::judge(family, "agree-lamps", &scene, FILM, 16, [256, 64, 128, 64], 512);
}

#[test]
fn all_effects_at_once_are_what_the_oracle_sees() {
    agrees("still-life.toml", "agree-still-life");
}
