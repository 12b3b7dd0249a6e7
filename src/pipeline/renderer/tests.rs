//! Tests that adaptive sampling is unbiased, and that the test detects bias.

use std::path::Path;

use super::*;
use crate::pipeline::plan::Plan;
use crate::pipeline::stage::Order;
use crate::scene::{EstimatorKind, SamplerKind, Scene};
use crate::settings::{AccelKind, Lanes};

fn begun(prepared: &Prepared) -> Renderer {
    Renderer::new(prepared.clone(), Arc::default(), 0)
}

/// A grey sphere as large as the ground below a small light. One direction in 70 hits the light, so samples of the estimator
/// `uniform` are rare and large.
const SCENE: &str = r#"
[camera]
origin = [0.0, 1.0, 3.0]
target = [0.0, 0.0, 0.0]
up     = [0.0, 1.0, 0.0]
fov_x  = 40.0

[film]
width  = 16
height = 12

[materials.grey]
diffuse = [0.5, 0.5, 0.5]

[[spheres]]
center   = [0.0, -100.0, 0.0]
radius   = 100.0
material = "grey"

[[spheres]]
center   = [0.0, 2.0, 0.0]
radius   = 0.5
emission = [10.0, 10.0, 10.0]
"#;

const SEEDS: u32 = 60;

type Allocate = fn(FilmSize, &[f64], &[Kind], u32) -> Vec<u32>;

/// Mean of the picture for each seed, at 16 samples a pixel; uniform samples if `allocate` is `None`.
fn means(sampler: SamplerKind, first_seed: u32, allocate: Option<Allocate>) -> Vec<f64> {
    let scene = Scene::parse(SCENE, Path::new("lamp.toml")).unwrap();
    let mean = |seed| {
        let settings = Settings {
            film: scene.film(),
            estimator: EstimatorKind::Uniform,
            sampler,
            seed,
            lanes: Some(Lanes::Eight),
            threads: 1,
            ..Settings::default()
        };
        let mut renderer = begun(&Prepared::new(&scene, settings).unwrap());
        if let Some(allocate) = allocate {
            renderer.allocate = allocate;
            while renderer.adaptive_block(16, None) {}
        } else {
            while renderer.block(16, None) < 16 {}
        }
        let pixels = renderer.film().picture().pixels;
        pixels.iter().map(|p| f64::from(p[0])).sum::<f64>() / pixels.len() as f64
    };
    (first_seed..first_seed + SEEDS).map(mean).collect()
}

/// Difference of two means over its standard error.
fn z(a: &[f64], b: &[f64]) -> f64 {
    let moments = |x: &[f64]| {
        let n = x.len() as f64;
        let mean = x.iter().sum::<f64>() / n;
        let variance = x.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0);
        (mean, variance / n)
    };
    let ((a, va), (b, vb)) = (moments(a), moments(b));
    (a - b) / (va + vb).sqrt()
}

/// A biased method: each pixel gets samples according to its own noise.
fn own_noise(_: FilmSize, noise: &[f64], _: &[Kind], spp: u32) -> Vec<u32> {
    let deviations: Vec<f64> = noise.iter().map(|noise| noise.sqrt()).collect();
    let pilot = allocation::pilot(spp);
    let pairs = f64::from((spp - pilot) / 2) * noise.len() as f64 / deviations.iter().sum::<f64>();
    let samples = |deviation| pilot + 2 * (pairs * deviation) as u32;
    deviations.into_iter().map(samples).collect()
}

#[test]
fn allocated_samples_have_the_mean_of_uniform_ones() {
    for sampler in SamplerKind::ALL {
        let uniform = means(sampler, 1000, None);
        let adaptive = z(&means(sampler, 0, Some(allocation::allocate)), &uniform);
        assert!(adaptive.abs() < 4.0, "{sampler:?}: z = {adaptive}");
        let biased = z(&means(sampler, 0, Some(own_noise)), &uniform);
        assert!(biased < -10.0, "{sampler:?}: not found out, z = {biased}");
        println!("{sampler:?}: z = {adaptive:.2} adaptive, {biased:.2} biased");
    }
}

#[test]
fn the_order_in_which_samples_make_packets_changes_no_bit() {
    // A film with whole and clipped tiles, several chunks and an odd number of passes.
    let scene = Scene::parse(SCENE, Path::new("lamp.toml")).unwrap();
    let render = |order: Order, lanes: Lanes, adaptive: bool| {
        let settings = Settings {
            film: FilmSize { width: 37, height: 19 },
            estimator: EstimatorKind::Mis,
            sampler: SamplerKind::Sobol,
            seed: 3,
            lanes: Some(lanes),
            accel: Some(AccelKind::Embree),
            threads: 1,
            ..Settings::default()
        };
        let mut prepared = Prepared::new(&scene, settings).unwrap();
        prepared.plan = Arc::new(Plan {
            order,
            ..(*prepared.plan).clone()
        });
        let mut renderer = begun(&prepared);
        if adaptive {
            while renderer.adaptive_block(16, None) {}
        } else {
            while renderer.block(27, None) < 27 {}
        }
        let bits = renderer
            .film()
            .picture()
            .pixels
            .into_iter()
            .map(|p| p.map(f32::to_bits))
            .collect::<Vec<_>>();
        (bits, renderer.counters())
    };
    for adaptive in [false, true] {
        let expected = render(Order::Passes, Lanes::One, adaptive);
        assert!(expected.0.iter().flatten().any(|&bits| bits != 0));
        for lanes in [Lanes::One, Lanes::Eight] {
            assert!(
                render(Order::Neighbours, lanes, adaptive) == expected,
                "{lanes} lanes, adaptive: {adaptive}"
            );
        }
    }
}

#[test]
fn a_pause_that_is_over_before_work_begins_lets_a_tile_be_done() {
    let scene = Scene::parse(SCENE, Path::new("lamp.toml")).unwrap();
    let settings = Settings {
        film: FilmSize { width: 48, height: 32 },
        estimator: EstimatorKind::Mis,
        sampler: SamplerKind::Sobol,
        seed: 0,
        lanes: Some(Lanes::Eight),
        threads: 1,
        ..Settings::default()
    };
    let prepared = Prepared::new(&scene, settings).unwrap();
    let mut hurried = begun(&prepared);
    // Six tiles, in blocks that end at 1, 2 and 4 passes.
    let calls = (1..100).find(|_| hurried.block(4, Some(Instant::now())) == 4);
    assert_eq!(calls, Some(18));
    let mut calm = begun(&prepared);
    while calm.block(4, None) < 4 {}
    assert!(hurried.film().picture().pixels == calm.film().picture().pixels);
}

#[test]
fn a_paused_block_keeps_its_random_numbers() {
    let scene = Scene::parse(SCENE, Path::new("lamp.toml")).unwrap();
    let settings = Settings {
        film: FilmSize { width: 48, height: 32 },
        estimator: EstimatorKind::Mis,
        threads: 1,
        ..Settings::default()
    };
    let mut renderer = begun(&Prepared::new(&scene, settings).unwrap());
    renderer.block(1, Some(Instant::now()));
    let numbers = |renderer: &Renderer| renderer.numbers.as_ref().map(|(numbers, _)| numbers.clone());
    let first = numbers(&renderer).expect("kept, as five tiles are left");
    renderer.block(1, Some(Instant::now()));
    assert!(
        numbers(&renderer).is_some_and(|second| Arc::ptr_eq(&first, &second)),
        "made again"
    );
    while renderer.block(1, None) < 1 {}
    assert!(numbers(&renderer).is_none(), "nobody needs them any more");
}

/// Embree stores errors per thread. The error of a query on a pool thread must be reported.
#[test]
fn a_query_that_fails_is_heard_of() {
    let scene = Scene::parse(SCENE, Path::new("lamp.toml")).unwrap();
    let settings = Settings {
        film: scene.film(),
        estimator: EstimatorKind::Mis,
        accel: Some(AccelKind::Embree),
        threads: 2,
        ..Settings::default()
    };
    let prepared = Prepared::new(&scene, settings).unwrap();
    let mut renderer = begun(&prepared);
    renderer.block(1, None);
    assert_eq!(renderer.progress.failure(), None);
    prepared.pool.broadcast(|_| prepared.world.accel.provoke_error());
    renderer.block(2, None);
    assert!(renderer.progress.failure().is_some());
}
