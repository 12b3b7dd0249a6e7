//! The hard cases at a small share of their size; `octolux selftest` runs all of them at full size.
//!
//! Nearly all figures here are counts and largest errors. The means, some forty, are held to 5.5 standard errors, which chance
//! passes once in 26 million: together 1.6e-6. Seeds are fixed.

use std::path::{Path, PathBuf};
use std::process::Command;

use octolux::pipeline::{Prepared, Settings};
use octolux::scene::{EstimatorKind, FilmSize, SamplerKind, Scene};
use octolux::settings::Lanes;
use octolux::study::distributions::z_quantile;
use octolux::study::selftest::{CASES, Check, Effort};
use rayon::prelude::*;

/// Cases that a share of their size says nothing of: bounds at p = 0.01, or shares of rare finds.
const AT_FULL_SIZE_ONLY: [u32; 3] = [2, 12, 38];

/// The case that compares all pairs of estimators in 16 tiles.
const AGREEMENT: u32 = 43;

#[test]
fn every_hard_case_holds_at_a_share_of_its_size() {
    let effort = Effort { divisor: 16 };
    let failed: Vec<String> = CASES
        .par_iter()
        .filter(|case| !AT_FULL_SIZE_ONLY.contains(&case.number))
        .flat_map_iter(|case| {
            let checks = (case.run)(effort).unwrap_or_else(|error| panic!("{} {}: {error}", case.number, case.name));
            assert!(!checks.is_empty(), "{} measures nothing", case.number);
            if case.number == AGREEMENT {
                let estimators = EstimatorKind::ALL.len();
                let tests = 16 * estimators * (estimators - 1) / 2;
                let bound = z_quantile(1e-6 / tests as f64);
                assert!(
                    (checks[0].bound - bound).abs() < 1e-9,
                    "{:?}: {tests} tests share 1e-6",
                    checks[0]
                );
            }
            let bad = checks.into_iter().filter(|check| !check.passes());
            bad.map(move |check| format!("{} {}: {check:?}", case.number, case.name))
        })
        .collect();
    assert!(failed.is_empty(), "{}", failed.join("\n"));
}

#[test]
fn the_table_has_every_case_once() {
    let numbers: Vec<u32> = CASES.iter().map(|case| case.number).collect();
    assert_eq!(numbers, (1..=46).collect::<Vec<_>>());
}

#[test]
fn what_is_not_a_number_does_not_pass() {
    assert!(Check::new("", 1.0, 1.0).passes());
    assert!(!Check::new("", 1.1, 1.0).passes());
    assert!(!Check::new("", f64::NAN, 1.0).passes());
    assert!(!Check::none("", 1).passes());
}

fn selftest(args: &[&str]) -> (Option<i32>, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_octolux"));
    let output = command.arg("selftest").args(args).output().unwrap();
    (output.status.code(), String::from_utf8(output.stdout).unwrap())
}

#[test]
fn the_command_tells_figures_and_bounds() {
    let (code, text) = selftest(&["--case", "3", "--time"]);
    assert_eq!(code, Some(0));
    assert!(text.starts_with(" 3  density without a switch: pass, "), "{text}");
    assert!(text.contains("1 of 1 case passed"), "{text}");
    let (code, json) = selftest(&["--case", "9", "--case", "14", "--json"]);
    assert_eq!(code, Some(0));
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!((&json["cases_passed"], &json["cases_failed"]), (&2.into(), &0.into()));
    assert!(json["cases"][0]["checks"][1]["figure"].as_f64().unwrap() < 5e-7);
    for wrong in ["0", "47", "x", "-1"] {
        assert_eq!(selftest(&["--case", wrong]).0, Some(2), "{wrong}");
    }
}

/// Every scene file of the repository whose meshes are there.
fn scenes() -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let files = [root.clone(), root.join("tests")].map(|folder| std::fs::read_dir(folder).unwrap());
    let mut paths: Vec<_> = files.into_iter().flatten().map(|entry| entry.unwrap().path()).collect();
    paths.retain(|path| path.extension().is_some_and(|ending| ending == "toml"));
    paths.sort();
    paths
}

#[test]
fn no_sample_of_any_scene_is_thrown_away() {
    let mut rendered = 0;
    for path in scenes() {
        // Meshes that a script fetches may be missing.
        let Ok(scene) = Scene::load(&path) else { continue };
        for estimator in EstimatorKind::ALL {
            let settings = Settings {
                film: FilmSize { width: 33, height: 22 },
                estimator,
                sampler: SamplerKind::Sobol,
                seed: 5,
                lanes: Some(Lanes::Eight),
                threads: 1,
                ..Settings::default()
            };
            // Not every estimator can sample every light.
            let Ok(prepared) = Prepared::new(&scene, settings) else {
                continue;
            };
            let run = prepared.passes(8).finish();
            let counters = run.counters();
            let invalid = [counters.invalid_nan, counters.invalid_inf, counters.invalid_negative];
            assert_eq!(invalid, [0; 3], "{} {}", path.display(), estimator.name());
            assert!(
                run.picture()
                    .pixels
                    .iter()
                    .flatten()
                    .all(|x| x.is_finite() && *x >= 0.0)
            );
            rendered += 1;
        }
    }
    assert!(rendered > 50, "only {rendered} renders");
}
