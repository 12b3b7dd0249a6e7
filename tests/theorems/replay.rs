//! A sample that is replayed is the sample of the render: the same radiance to the last bit, made of the steps that are told.

use std::path::Path;
use std::process::Command;

use octolux::pipeline::{Prepared, Settings};
use octolux::scene::{EstimatorKind, FilmSize, SamplerKind, Scene};
use octolux::settings::AccelKind;
use octolux::settings::Lanes;

fn scene(name: &str) -> Scene {
    Scene::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name)).unwrap()
}

#[test]
fn replayed_passes_add_up_to_the_picture() {
    let mut lit = 0;
    for name in [
        "veach-mis.toml",
        "large-lights.toml",
        "tests/two-lights.toml",
        "lamps.toml",
        "ggx.toml",
    ] {
        let scene = scene(name);
        for estimator in EstimatorKind::ALL {
            for (sampler, accel) in [
                (SamplerKind::Sobol, AccelKind::Linear),
                (SamplerKind::Independent, AccelKind::Embree),
            ] {
                let settings = Settings {
                    film: FilmSize { width: 19, height: 18 },
                    estimator,
                    sampler,
                    seed: 4,
                    lanes: Some(Lanes::One),
                    threads: 1,
                    accel: Some(accel),
                    ..Settings::default()
                };
                let fresh = Prepared::new(&scene, settings).unwrap();
                let picture = fresh.passes(6).finish().picture();
                for (x, y) in [(0, 0), (9, 11), (18, 17), (16, 3), (7, 16)] {
                    let mut sum = [0.0; 3];
                    for pass in 0..6 {
                        let replay = fresh.replay([x, y, pass]).unwrap().unwrap();
                        let mut told = replay.seen;
                        for found in replay.asked.iter().filter_map(|asked| asked.found) {
                            if replay.asked[0].light.is_some() && !found.occluded {
                                told = std::array::from_fn(|k| told[k] + f64::from(found.ld[k]));
                            }
                        }
                        if replay.asked.first().is_some_and(|asked| asked.light.is_some()) {
                            // Where nothing can be in the way, the lights of a point are added up in f32 first.
                            let same = |k: usize| (told[k] - replay.radiance[k]).abs() <= 1e-6 * told[k];
                            assert!(
                                (0..3).all(same),
                                "{name} {x},{y},{pass}: the steps make {told:?}, the sample is {:?}",
                                replay.radiance
                            );
                        }
                        assert!(replay.point.is_none() || replay.hit.is_some());
                        // Rays were in packets' units of length: 2^28 to the farthest shape.
                        let at = replay.point.map(|point| point.p);
                        assert!(
                            replay.rays.iter().all(|ray| Some(ray.origin) == at),
                            "{name} {x},{y},{pass}"
                        );
                        sum = std::array::from_fn(|k| sum[k] + replay.radiance[k]);
                    }
                    let mean = sum.map(|x| (x / 6.0) as f32);
                    let found = picture.pixels[(y * 19 + x) as usize];
                    // Sums in another order: one rounding of f32 at most.
                    for k in 0..3 {
                        let off = (mean[k] - found[k]).abs();
                        assert!(off <= mean[k] * f32::EPSILON, "{name} {} {x},{y}", estimator.name());
                    }
                    lit += usize::from(mean[1] > 0.0);
                }
            }
        }
    }
    assert!(lit > 40, "only {lit} pixels with light");
}

fn replay(args: &[&str]) -> (Option<i32>, String, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_octolux"))
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .args(["render", "scenes/veach-mis.toml", "--size", "96x64"])
        .args(args)
        .output()
        .unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    (output.status.code(), text(output.stdout), text(output.stderr))
}

#[test]
fn the_command_prints_every_step() {
    let (code, text, _) = replay(&["--replay", "48,50,3"]);
    assert_eq!(code, Some(0));
    for word in [
        "sample ",
        "camera ray ",
        "hit ",
        "point ",
        "light 0",
        "light 4",
        "cone 1 - cos",
        "radiance ",
    ] {
        assert!(text.contains(word), "{word:?} is not in\n{text}");
    }
    let (_, json, _) = replay(&["--replay", "48,50,3", "--json", "--estimator", "brdf"]);
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(
        (json["sample"][2].as_u64(), json["asked"].as_array().unwrap().len()),
        (Some(3), 1)
    );
}

#[test]
fn what_is_no_sample_is_refused() {
    for wrong in ["96,0,0", "0,64,0", "1,2", "1,2,x", "-1,0,0"] {
        let (code, out, error) = replay(&["--replay", wrong]);
        assert_eq!((code, out.as_str()), (Some(2), ""), "{wrong}: {error}");
    }
}
