//! The scenes of `scenes/tests` against the answers that they state.

use std::sync::Arc;

use glam::DVec3;
use octolux::pipeline::Settings;
use octolux::scene::{EstimatorKind, FilmSize, SamplerKind, Scene};
use octolux::settings::AccelKind;

use super::Family;
use super::runs::{Estimate, Runs, leave, load, picture, settings};

/// What single precision may lose, relative. `rho`, `Le`, the light's place and radius are rounded (6e-8 each), a weight
/// takes some ten operations, and shading points stand 8 half-ulps of their coordinates off the surface: in
/// `sphere-overhead` 1.4e-6 towards a light at distance 4, whose irradiance is then 7e-7 too large.
pub const ROUNDING: f64 = 1.5e-6;

/// The scenes of `scenes/tests`, with the answer in the first line.
pub fn scenes() -> Vec<(Scene, [f64; 3])> {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/tests");
    let mut paths: Vec<_> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .collect();
    paths.sort();
    paths
        .iter()
        .map(|path| {
            let text = std::fs::read_to_string(path).unwrap();
            let line = text.lines().next().and_then(|line| line.strip_prefix("# expect: "));
            let line = line.unwrap_or_else(|| panic!("{} states no answer", path.display()));
            let answer: Vec<f64> = line.split(' ').map(|number| number.parse().unwrap()).collect();
            let name = path.file_name().unwrap().to_str().unwrap();
            (load(&format!("tests/{name}")), answer.try_into().unwrap())
        })
        .collect()
}

/// Every scene by every estimator that can render it, `seeds` times, against its answer. Scenes that `passes` gives
/// nothing for are left out.
pub fn test_scenes(
    table: &'static str,
    (sampler, accel): (SamplerKind, AccelKind),
    seeds: u32,
    passes: impl Fn(&Scene, EstimatorKind) -> Option<u32>,
) {
    let mut family = Family::new(table);
    for (scene, answer) in scenes() {
        for estimator in EstimatorKind::ALL {
            let Some(passes) = passes(&scene, estimator) else {
                continue;
            };
            let FilmSize { width, height } = scene.film();
            let settings = Settings {
                sampler,
                accel: Some(accel),
                ..settings(width, height, estimator)
            };
            let runs = Runs::new(&scene, settings, passes, 1, seeds);
            for (channel, (found, answer)) in runs.estimates(1, 1).into_iter().zip(answer).enumerate() {
                let answer = Estimate::exact(answer);
                // `projected` has no noise that would hide the offset of the shading point: from the height of 2.9e-6 half a light
                // is 3.2e-6 less. `product` draws that light as `projected` does.
                let exact = matches!(estimator, EstimatorKind::Projected | EstimatorKind::Product);
                let sunk = scene.name() == "sphere-half-sunk" && exact;
                let rounding = if sunk { 4e-6 } else { ROUNDING };
                let what = format!("{} {} channel {channel}", scene.name(), estimator.name());
                family.add(found.p(answer, rounding), format!("{what}: {}", found.against(answer)));
            }
        }
    }
    family.judge();
}

/// The light of `sphere-half-sunk` over its plate, tilted by 39 degrees with the vertex normals kept upright. All of the light is on one side of
/// the plate, so nothing can block it; yet half of it is below the horizon of the normals. The answer is that of `sphere-half-sunk`.
///
/// The picture is 5e-4 high and deep about the middle, and heights average out: what is left is of the order of 1e-7.
pub fn an_open_light_half_below_the_horizon_of_normals(seeds: u32, passes: u32) {
    let sunk = load("tests/sphere-half-sunk.toml");
    let mut scene = sunk.to_builder();
    let plate = Arc::make_mut(&mut scene.meshes[0]);
    for vertex in &mut plate.vertices {
        vertex.y = -0.8 * vertex.x;
    }
    plate.normals = Some(vec![DVec3::Y; plate.vertices.len()]);
    let scene = scene.build().expect("a tilted plate");
    let (_, answer) = scenes()
        .into_iter()
        .find(|(scene, _)| scene.name() == sunk.name())
        .expect("it is one of the scenes");
    let mut family = Family::new("half-sunk-normals");
    for (estimator, accel) in (EstimatorKind::ALL.iter()).flat_map(|e| AccelKind::ALL.map(|accel| (*e, accel))) {
        let FilmSize { width, height } = scene.film();
        let settings = Settings {
            accel: Some(accel),
            ..settings(width, height, estimator)
        };
        let runs = Runs::new(&scene, settings, passes, 1, seeds);
        for (channel, (found, answer)) in runs.estimates(1, 1).into_iter().zip(answer).enumerate() {
            let answer = Estimate::exact(answer);
            let what = format!("{} {} channel {channel}", estimator.name(), accel.name());
            family.add(found.p(answer, 1e-5), format!("{what}: {}", found.against(answer)));
        }
    }
    family.judge();
}

/// No noise is left where the eye sees an emitter or nothing, where a light is hidden, and where the density is
/// proportional to the whole integrand: every pixel of every pass is the answer, to the rounding of single precision.
pub fn noise_free_scenes() {
    use EstimatorKind::{Brdf, Product};
    for (scene, answer) in scenes() {
        let exact: Vec<EstimatorKind> = match scene.name() {
            "emitter-seen" | "miss" | "shadow" | "square-seen" | "sun-seen" | "point-shadow" | "point-behind" => {
                EstimatorKind::ALL.to_vec()
            }
            "furnace-diffuse" | "furnace-mesh" => vec![Brdf],
            // The same light from everywhere: the cosine is the whole product.
            "sky-constant" => vec![Brdf, Product],
            _ => continue,
        };
        for (estimator, accel) in exact.iter().flat_map(|e| AccelKind::ALL.map(|accel| (*e, accel))) {
            let FilmSize { width, height } = scene.film();
            let settings = Settings {
                accel: Some(accel),
                ..settings(width, height, estimator)
            };
            let picture = picture(&scene, settings, 5);
            let wrong = picture.pixels.iter().filter(|pixel| {
                let close = |(x, a): (&f32, f64)| (f64::from(*x) - a).abs() <= 3e-7 * a;
                !pixel.iter().zip(answer).all(close)
            });
            let wrong = wrong.count();
            let name = format!("exact-{}-{}", scene.name(), estimator.name());
            assert!(
                wrong == 0,
                "{wrong} pixels differ from {answer:?}: {}",
                leave(&picture, &name)
            );
        }
    }
}
