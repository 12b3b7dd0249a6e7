//! Samples a second of whole renders through [`Prepared`] and its runs: scene x estimator x lanes x threads.
//!
//! Films are small, 96 x 64 with 16 passes, so that the scalar kernel is measured in a second too; a large film gives
//! rather more (fewer waits between blocks of passes). Setting up (threads, BVH) is not in the time, the film and the
//! sums are. One lane is the renderer's own scalar kernel: the same source, one ray a call of Embree. Its loops run
//! through calls and branches, so LLVM does not auto-vectorise them.
//!
//! Rays a second are samples a second times the rays a sample, which are written beside criterion's figures.

mod common;

use std::collections::BTreeMap;

use criterion::{BatchSize, BenchmarkId, Criterion, Throughput};
use octolux::pipeline::{Prepared, Settings, widest_lanes};
use octolux::run::Run;
use octolux::scene::{EstimatorKind, FilmSize, SamplerKind, Scene};
use octolux::settings::Lanes;
use serde_json::{Value, json};

const PASSES: u32 = 16;

const SCENES: [&str; 3] = ["veach-mis.toml", "many-spheres.toml", "knot.toml"];

fn prepared(scene: &Scene, estimator: EstimatorKind, lanes: Lanes, threads: usize) -> Prepared {
    let settings = Settings {
        film: FilmSize { width: 96, height: 64 },
        estimator,
        sampler: SamplerKind::Sobol,
        seed: 1,
        lanes: Some(lanes),
        threads,
        ..Settings::default()
    };
    Prepared::new(scene, settings).unwrap_or_else(|error| panic!("{}: {error}", scene.name()))
}

fn render(prepared: &Prepared) -> Run {
    prepared.passes(PASSES).finish()
}

fn renders(c: &mut Criterion, name: &str, numbers: &mut BTreeMap<String, Value>) {
    let scene = common::scene(name);
    let mut group = c.benchmark_group(format!("pipeline: {}", scene.name()));
    for estimator in EstimatorKind::ALL {
        // Sixteen only where the processor has them.
        for lanes in Lanes::ALL.into_iter().rev().filter(|&lanes| lanes <= widest_lanes()) {
            for threads in [1, 2] {
                let id = BenchmarkId::new(estimator.name(), format!("{lanes} lanes, {threads} threads"));
                let key = format!(
                    "pipeline: {}/{}/{lanes} lanes, {threads} threads",
                    scene.name(),
                    estimator.name()
                );
                let mut counters = None;
                let film = FilmSize { width: 96, height: 64 };
                let samples = film.width * film.height * PASSES;
                group.throughput(Throughput::Elements(samples.into()));
                group.bench_function(id, |b| {
                    b.iter_batched(
                        || prepared(&scene, estimator, lanes, threads),
                        |new| {
                            let done = render(&new);
                            counters = Some(done.counters());
                            done
                        },
                        BatchSize::PerIteration,
                    );
                });
                if let Some(counters) = counters {
                    let rays = (counters.eye_rays + counters.shadow_rays) as f64 / counters.samples as f64;
                    numbers.insert(key, json!({ "rays_per_sample": rays }));
                }
            }
        }
    }
}

fn main() {
    let mut c = common::criterion();
    let mut numbers = BTreeMap::new();
    for scene in SCENES {
        renders(&mut c, scene, &mut numbers);
    }
    c.final_summary();
    common::note_circumstances("pipeline", &numbers);
}
