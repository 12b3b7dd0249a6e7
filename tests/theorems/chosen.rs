//! Which estimator is taken where none is named.

use std::path::Path;

use octolux::pipeline::{Chosen, Settings};
use octolux::run::{RenderOptions, render};
use octolux::scene::{EstimatorKind, Scene};
use octolux::settings::EstimatorAsked;

const VIEW: &str = "[camera]\norigin = [0, 1, 6]\ntarget = [0, 0, 0]\nup = [0, 1, 0]\nfov_x = 40\n\
                    [film]\nwidth = 24\nheight = 16\n";
const BALL: &str = "[[spheres]]\ncenter = [0, 0, 0]\nradius = 1\nmaterial = \"m\"\n";
const LAMP: &str = "[[spheres]]\ncenter = [0, 4, 1]\nradius = 0.5\nemission = [9, 9, 9]\n";
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

/// By the table of `docs/product.md`, for every kind of light and surface.
#[test]
fn product_is_taken_where_nobody_names_an_estimator() {
    let scenes: [&[&str]; 5] = [
        &[DIFFUSE, BALL, LAMP],
        &[PHONG, BALL, LAMP, PANEL, SKY],
        &[DIFFUSE, BALL, PANEL],
        &[ROUGH, BALL, SKY],
        &[SKY],
    ];
    for parts in scenes {
        assert_eq!(chosen(parts), EstimatorKind::Product, "{parts:?}");
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
        ([DIFFUSE, BALL, PANEL], EstimatorKind::Product),
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
