//! Adaptive sampling is unbiased, and the test that says so would find it out if it were not.

use std::path::Path;

use super::*;
use crate::pipeline::stage::grid::Order;

/// A grey ball as large as the ground below a small lamp: of 70 directions one meets it, so samples of the estimator
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

type Allocate = fn(FilmSize, &[Noise], u32) -> Vec<u32>;

/// Mean of the picture for each seed, at 16 samples a pixel; all alike where nothing allocates them.
fn means(sampler: SamplerKind, first_seed: u32, allocate: Option<Allocate>) -> Vec<f64> {
    let scene = Scene::parse(SCENE, Path::new("lamp.toml")).unwrap();
    let mean = |seed| {
        let settings = Settings {
            film: scene.film,
            estimator: EstimatorKind::Uniform,
            sampler,
            seed,
            lanes: 8,
            accel: None,
            robust: true,
            cull: true,
            threads: 1,
        };
        let mut renderer = Renderer::new(&scene, settings).unwrap();
        if let Some(allocate) = allocate {
            renderer.allocate = allocate;
            while renderer.next_adaptive_block(16) {}
        } else {
            while renderer.next_block(16) < 16 {}
        }
        let pixels = renderer.picture().pixels;
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

/// What must not be done: each pixel gets samples after its own noise.
fn own_noise(_: FilmSize, noise: &[Noise], spp: u32) -> Vec<u32> {
    let deviations: Vec<f64> = noise.iter().map(|n| n.variance[0].sqrt()).collect();
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
    // A film of whole and cut tiles, several chunks, an odd number of passes.
    let scene = Scene::parse(SCENE, Path::new("lamp.toml")).unwrap();
    let render = |order: Order, lanes: usize, adaptive: bool| {
        let settings = Settings {
            film: FilmSize { width: 37, height: 19 },
            estimator: EstimatorKind::Mis,
            sampler: SamplerKind::Sobol,
            seed: 3,
            lanes,
            accel: Some(AccelKind::Embree),
            robust: true,
            cull: true,
            threads: 1,
        };
        let mut renderer = Renderer::new(&scene, settings).unwrap();
        renderer.plan.order = order;
        if adaptive {
            while renderer.next_adaptive_block(16) {}
        } else {
            while renderer.next_block(27) < 27 {}
        }
        let bits = renderer
            .picture()
            .pixels
            .into_iter()
            .map(|p| p.map(f32::to_bits))
            .collect::<Vec<_>>();
        (bits, renderer.counters())
    };
    for adaptive in [false, true] {
        let expected = render(Order::Passes, 1, adaptive);
        assert!(expected.0.iter().flatten().any(|&bits| bits != 0));
        for lanes in [1, 8] {
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
        lanes: 8,
        accel: None,
        robust: true,
        cull: true,
        threads: 1,
    };
    let mut hurried = Renderer::new(&scene, settings).unwrap();
    hurried.pause_at(Some(Instant::now()));
    // Six tiles, in blocks that end at 1, 2 and 4 passes.
    let calls = (1..100).find(|_| hurried.next_block(4) == 4);
    assert_eq!(calls, Some(18));
    let mut calm = Renderer::new(&scene, settings).unwrap();
    while calm.next_block(4) < 4 {}
    assert!(hurried.picture().pixels == calm.picture().pixels);
}

/// Embree keeps errors per thread: one that a query left on a thread of the pool must come out.
#[test]
fn a_query_that_fails_is_heard_of() {
    let scene = Scene::parse(SCENE, Path::new("lamp.toml")).unwrap();
    let settings = Settings {
        film: scene.film,
        estimator: EstimatorKind::Mis,
        sampler: SamplerKind::Sobol,
        seed: 0,
        lanes: 8,
        accel: Some(AccelKind::Embree),
        robust: true,
        cull: true,
        threads: 2,
    };
    let mut renderer = Renderer::new(&scene, settings).unwrap();
    renderer.next_block(1);
    assert_eq!(renderer.progress().failure(), None);
    renderer.pool.broadcast(|_| renderer.world.accel.provoke_error());
    renderer.next_block(2);
    assert!(renderer.progress().failure().is_some());
}
