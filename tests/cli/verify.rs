//! `octolux verify` as its users meet it.

use std::fs;
use std::time::Instant;

use crate::place::{Place, stderr, stdout};

/// The small scene with something else in the place of `from`.
fn changed(place: &Place, from: &str, to: &str) {
    let path = place.path().join("in/small.toml");
    let text = fs::read_to_string(&path).unwrap();
    assert!(text.contains(from));
    fs::write(path, text.replace(from, to)).unwrap();
}

#[test]
fn a_sound_scene_passes_and_the_table_can_be_read() {
    let place = Place::new();
    let started = Instant::now();
    let output = place.succeeds("verify in/small.toml --budget 3 --stats v.json -o proof --quiet");
    // Debug builds on a busy machine: the budget is kept, loading and eight rounds at least aside.
    assert!(started.elapsed().as_secs_f64() < 30.0);
    assert!(stderr(&output).is_empty());
    assert_eq!(place.files(), ["v.json"], "nothing failed, so there is nothing to show");
    let table = stdout(&output);
    let lines: Vec<&str> = table.lines().collect();
    assert!(
        lines[0].starts_with("check") && lines[0].ends_with("verdict"),
        "{table}"
    );
    let verdict = lines[0].find("verdict").unwrap();
    let rows: Vec<&&str> = lines[2..].iter().take_while(|line| !line.is_empty()).collect();
    assert!(rows.len() > 25, "{table}");
    for row in rows {
        let word: String = row.chars().skip(verdict).collect();
        assert!(["pass", "no power"].contains(&word.as_str()), "{row}");
    }
    for check in ["lanes", "threads", "looks", "estimators", "oracle", "samplers", "seeds"] {
        assert!(lines.iter().any(|line| line.starts_with(check)), "{check}: {table}");
    }

    let json: serde_json::Value = serde_json::from_slice(&fs::read(place.path().join("v.json")).unwrap()).unwrap();
    assert_eq!(json["passed"], true);
    assert_eq!(json["scene"], "in/small.toml");
    for key in ["commit", "cpu", "embree_version", "target_features"] {
        assert!(json[key].is_string(), "{key}");
    }
    for key in [
        "threads",
        "spp",
        "replicates",
        "oracle_spp",
        "seconds",
        "seed",
        "false_alarm_rate",
    ] {
        assert!(json[key].is_number(), "{key}");
    }
    assert!(json["replicates"].as_u64().unwrap() >= 8);
    let rows = json["rows"].as_array().unwrap();
    let means = rows.iter().filter(|row| row["check"] == "estimators");
    assert!(means.clone().count() >= 6);
    for row in means {
        assert!(row["numbers"]["visible_bias"].is_number() && row["numbers"]["worst_over_bound"].is_number());
    }
    // Every test has a chance of a false alarm, and together they keep what is stated (Boole's inequality).
    let chances = rows.iter().filter_map(|row| {
        let numbers = &row["numbers"];
        Some(numbers["tests"].as_f64()? * numbers["false_alarm_rate"].as_f64()?)
    });
    let (count, together) = chances.fold((0, 0.0), |(count, sum), chance| (count + 1, sum + chance));
    assert!(count > 25, "{count} rows about means");
    assert!(
        together <= json["false_alarm_rate"].as_f64().unwrap() * (1.0 + 1e-9),
        "{together:e}"
    );
}

#[test]
fn a_scene_without_light_is_black_and_that_is_no_fault() {
    let place = Place::new();
    changed(&place, "emission = [10.0, 10.0, 10.0]", "material = \"grey\"");
    let table = stdout(&place.succeeds("verify in/small.toml --budget 1 --quiet"));
    assert!(
        table.contains("warn: lights (0 emitters): nothing emits light, so the picture is black, and all means are 0"),
        "{table}"
    );
    assert!(!table.contains("FAIL"), "{table}");
}

#[test]
fn energy_gain_fails_by_name() {
    let place = Place::new();
    changed(&place, "diffuse = [0.5, 0.5, 0.5]", "diffuse = [0.5, 1.25, 0.5]");
    let output = place.octolux("verify in/small.toml --budget 1 --json --seed 5");
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((&json["passed"], &json["seed"]), (&false.into(), &5.into()));
    let failed: Vec<_> = json["rows"]
        .as_array()
        .unwrap()
        .iter()
        .filter(|row| row["verdict"] == "FAIL")
        .collect();
    assert_eq!(failed.len(), 1, "{json}");
    let sentence = failed[0]["sentence"].as_str().unwrap();
    assert!(sentence.contains("\"grey\" (1.25)"), "{sentence}");
}

#[test]
fn an_emitter_inside_out_is_a_warning() {
    let place = Place::new();
    changed(&place, "radius   = 0.5", "radius   = 5.0");
    let output = place.succeeds("verify in/small.toml --budget 1 --quiet");
    let table = stdout(&output);
    assert!(
        table.contains("warn: inside out") && table.contains("sphere 2"),
        "{table}"
    );
}

#[test]
fn wrong_usage_is_told_before_the_work() {
    let place = Place::new();
    for arguments in [
        "verify in/none.toml",
        "verify in/small.toml --budget 0",
        "verify in/small.toml --stats v.txt",
        "verify in/small.toml --stats no/v.json",
        "verify in/small.toml -o in/small.toml",
        "verify in/small.toml -o no/such/folder",
    ] {
        place.refused(arguments);
    }
}
