//! Which estimator is taken where none is named.

use std::path::Path;

use octolux::pipeline::{Chosen, Settings};
use octolux::run::{RenderOptions, render};
use octolux::scene::{EstimatorKind, FilmSize, Scene};
use octolux::settings::EstimatorAsked;

const VIEW: &str = "[camera]\norigin = [0, 1, 6]\ntarget = [0, 0, 0]\nup = [0, 1, 0]\nfov_x = 40\n\
                    [film]\nwidth = 24\nheight = 16\n";
const BALL: &str = "[[spheres]]\ncenter = [0, 0, 0]\nradius = 1\nmaterial = \"m\"\n";
const LAMP: &str = "[[spheres]]\ncenter = [0, 4, 1]\nradius = 0.5\nemission = [9, 9, 9]\n";
const DARK_LAMP: &str = "[[spheres]]\ncenter = [0, 4, 1]\nradius = 0.5\nemission = [0, 0, 0]\n";
const PANEL: &str = "[[meshes]]\nvertices = [[-1, 4, -1], [1, 4, -1], [1, 4, 1], [-1, 4, 1]]\nfaces = [[0, 1, 2, 3]]\n\
                     emission = [5, 5, 5]\n";
const SKY: &str = "[environment]\nemission = [1, 1, 1]\n";

const DIFFUSE: &str = "[materials.m]\ndiffuse = [0.5, 0.5, 0.5]\n";
const PHONG: &str = "[materials.m]\nphong = [0.5, 0.5, 0.5]\nexponent = 20\n";
const ROUGH: &str = "[materials.m]\nbase_color = [0.5, 0.5, 0.5]\nroughness = 0.3\nmetallic = 1\n";

fn scene(parts: &[&str]) -> Scene {
    let text = [VIEW, &parts.concat()].concat();
    Scene::parse(&text, Path::new("scene.toml")).unwrap_or_else(|error| panic!("{error}"))
}

fn chosen(parts: &[&str]) -> EstimatorKind {
    Settings::of(&scene(parts)).estimator
}

#[test]
fn product_is_taken_where_a_sphere_emits_on_a_diffuse_or_phong_surface() {
    assert_eq!(chosen(&[DIFFUSE, BALL, LAMP]), EstimatorKind::Product);
    assert_eq!(chosen(&[PHONG, BALL, LAMP]), EstimatorKind::Product);
    assert_eq!(chosen(&[DIFFUSE, BALL, LAMP, PANEL, SKY]), EstimatorKind::Product);
}

#[test]
fn mis_is_taken_where_no_sphere_emits_or_all_surfaces_are_rough() {
    assert_eq!(chosen(&[DIFFUSE, BALL, PANEL]), EstimatorKind::Mis);
    assert_eq!(chosen(&[DIFFUSE, BALL, SKY]), EstimatorKind::Mis);
    assert_eq!(chosen(&[ROUGH, BALL, LAMP]), EstimatorKind::Mis);
    // An emission of 0 is no light; a material that no shape has is no surface; and there may be no shape at all.
    assert_eq!(chosen(&[DIFFUSE, BALL, DARK_LAMP, PANEL]), EstimatorKind::Mis);
    let unused = DIFFUSE.replace("materials.m", "materials.unused");
    assert_eq!(chosen(&[&unused, ROUGH, BALL, LAMP]), EstimatorKind::Mis);
    assert_eq!(chosen(&[SKY]), EstimatorKind::Mis);
}

/// What turning the camera, or another film, leaves in sight must not choose another estimator: frames of a flight would differ in
/// their noise.
#[test]
fn the_choice_depends_on_no_camera_and_no_film() {
    for parts in [[DIFFUSE, BALL, LAMP], [ROUGH, BALL, LAMP], [DIFFUSE, BALL, PANEL]] {
        let toward = scene(&parts);
        let mut away = toward.to_builder();
        away.camera.target = [0.0, 1.0, 60.0].into();
        away.film = FilmSize { width: 1, height: 90 };
        let away = away.build().unwrap();
        assert_eq!(Chosen::of(&toward, None), Chosen::of(&away, None));
    }
}

#[test]
fn an_option_comes_before_the_scene_and_the_scene_before_the_rule() {
    let named = "[render]\nestimator = \"light\"\n";
    let automatic = "[render]\nestimator = \"auto\"\n";
    let (silent, light, auto) = (
        scene(&[DIFFUSE, BALL, LAMP]),
        scene(&[named, DIFFUSE, BALL, LAMP]),
        scene(&[automatic, DIFFUSE, BALL, LAMP]),
    );
    let of = |scene: &Scene, asked: Option<EstimatorAsked>| {
        let options = RenderOptions {
            estimator: asked,
            ..Default::default()
        };
        let settings = options.settings(scene);
        assert_eq!(settings.estimator, Chosen::of(scene, asked).estimator);
        settings.estimator
    };
    let brdf = Some(EstimatorKind::Brdf.into());
    for scene in [&silent, &light, &auto] {
        assert_eq!(of(scene, brdf), EstimatorKind::Brdf);
        assert_eq!(of(scene, Some(EstimatorAsked::Auto)), EstimatorKind::Product);
    }
    assert_eq!(of(&light, None), EstimatorKind::Light);
    assert_eq!(of(&silent, None), EstimatorKind::Product);
    assert_eq!(of(&auto, None), EstimatorKind::Product);
    assert_eq!(auto.render(), silent.render());
    assert_eq!(auto.hash(), silent.hash());
}

#[test]
fn auto_silence_and_the_name_itself_give_the_same_bits() {
    for (parts, name) in [
        ([DIFFUSE, BALL, LAMP], EstimatorKind::Product),
        ([DIFFUSE, BALL, PANEL], EstimatorKind::Mis),
    ] {
        let scene = scene(&parts);
        let picture = |estimator: Option<EstimatorAsked>| {
            let options = RenderOptions {
                spp: 8,
                estimator,
                ..Default::default()
            };
            render(&scene, &options).expect("it renders").pixels
        };
        let silent = picture(None);
        assert!(silent == picture(Some(EstimatorAsked::Auto)));
        assert!(silent == picture(Some(name.into())));
        assert!(silent != picture(Some(EstimatorKind::Light.into())));
    }
}
