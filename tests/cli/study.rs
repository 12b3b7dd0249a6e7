//! `octolux study` and `render --target-error` as their users meet them.

use std::fs;
use std::process::Output;

use crate::place::{Place, stderr, stdout};
use octolux::scene::EstimatorKind;
use serde_json::Value;

fn json(place: &Place, name: &str) -> Value {
    serde_json::from_slice(&fs::read(place.path().join(name)).unwrap()).unwrap()
}

/// A study of the small scene, in a cache of its own.
fn study(place: &Place, arguments: &str) -> Output {
    place.succeeds(&format!(
        "study in/small.toml --no-cache --quiet --threads 2 {arguments}"
    ))
}

#[test]
fn the_report_is_whole() {
    let place = Place::new();
    let output = study(&place, "-o report --budget 2s");
    assert!(output.stdout.is_empty() && output.stderr.is_empty());
    assert_eq!(place.files(), ["report"]);
    let report = json(&place, "report/study.json");
    let prices = report["prices"].as_array().unwrap();
    let labels: Vec<&str> = prices.iter().map(|price| price["label"].as_str().unwrap()).collect();
    for label in [
        "default",
        "uniform",
        "light",
        "brdf",
        "independent",
        "adaptive",
        "1 lane",
        "embree",
    ] {
        assert!(labels.contains(&label), "{label}: {labels:?}");
    }
    // One light: lists of lights are no setting here.
    assert!(!labels.iter().any(|label| label.starts_with("lights")), "{labels:?}");
    assert_eq!(report["too_slow"], Value::Array(Vec::new()));
    assert!(report["seeds"].as_u64().unwrap() >= 16);
    for key in ["commit", "cpu", "target_features", "command", "threads", "load"] {
        assert!(!report["circumstances"][key].is_null(), "{key}");
    }
    for price in prices {
        assert!(price["pass_seconds"]["value"].as_f64().unwrap() > 0.0);
        assert!(
            ["default", "free", "paid", "open"].contains(&price["verdict"].as_str().unwrap()),
            "{price}"
        );
        let same = ["1 lane", "8 lanes", "1 thread"].contains(&price["label"].as_str().unwrap());
        assert!(!same || price["same_bits"] == true, "{price}");
    }

    // One line a look at a run, and every setting with as many seeds; what has the bits of the defaults may sit out some.
    let csv = fs::read_to_string(place.path().join("report/study.csv")).unwrap();
    let lines: Vec<Vec<&str>> = csv.lines().map(|line| line.split(',').collect()).collect();
    let looks = prices[0]["points"].as_array().unwrap().len();
    let seeds = report["seeds"].as_u64().unwrap() as usize;
    let mut all = 1;
    for price in prices {
        let count = lines
            .iter()
            .filter(|line| line[0] == price["label"].as_str().unwrap())
            .count();
        let settled = price["same_bits"] == true && count >= 16 * looks && count.is_multiple_of(looks);
        assert!(count == seeds * looks || settled, "{count}: {price}");
        all += count;
    }
    assert_eq!(lines.len(), all);
    assert!(lines.iter().all(|line| line.len() == lines[0].len()));

    let page = fs::read_to_string(place.path().join("report/study.html")).unwrap();
    let sections: Vec<&str> = page
        .split("<section id=\"")
        .skip(1)
        .map(|rest| rest.split('"').next().unwrap())
        .collect();
    let expected = "cheapest error prices strip effects phases circumstances method";
    assert_eq!(sections.join(" "), expected);
    assert!(!page.contains("{{") && !page.contains("NaN"), "a part is missing");
    assert_eq!(page.matches("<svg ").count(), 4);
    // A picture and an error of each estimator, and the scale; the film is too small for crops.
    assert_eq!(
        page.matches("<img src=\"data:image/png;base64,").count(),
        2 * EstimatorKind::ALL.len() + 1
    );
    for word in ["http://", "https://", "src=\"/", "<script", "@import", "url("] {
        let allowed = if word == "http://" {
            page.matches("http://www.w3.org/2000/svg").count()
        } else {
            0
        };
        assert_eq!(
            page.matches(word).count(),
            allowed,
            "{word}: the page needs nothing else"
        );
    }
    for svg in ["error-over-time.svg", "same-picture.svg"] {
        let text = fs::read_to_string(place.path().join("report").join(svg)).unwrap();
        assert!(text.starts_with("<svg ") && text.trim_end().ends_with("</svg>") && text.contains("--paper"));
    }
}

/// All lights and lists of each length, with their time and their error; the default, lists of 8, is the baseline.
#[test]
fn lists_of_many_lights_have_their_prices() {
    let place = Place::new();
    let path = place.path().join("in/small.toml");
    let mut text = fs::read_to_string(&path).unwrap();
    for i in 0..66 {
        let (x, y) = (f64::from(i % 11) * 0.3 - 1.5, f64::from(i / 11) * 0.3 + 1.2);
        text += &format!("[[spheres]]\ncenter = [{x}, {y}, 2.0]\nradius = 0.02\nemission = [9.0, 9.0, 9.0]\n");
    }
    fs::write(path, text).unwrap();
    study(&place, "-o report --budget 2s --estimator light");
    let report = json(&place, "report/study.json");
    let prices = report["prices"].as_array().unwrap();
    let lists: Vec<&Value> = prices.iter().filter(|price| price["knob"] == "lights").collect();
    let mut values: Vec<&str> = lists.iter().map(|price| price["value"].as_str().unwrap()).collect();
    // On a busy machine all lights may be too slow for two seconds, and the report says so.
    if let Some(too_slow) = report["too_slow"].as_array().unwrap().first() {
        assert_eq!(too_slow["label"], "lights all");
        values.insert(0, "all");
    }
    assert_eq!(values, ["all", "4", "16", "32", "64"]);
    for price in lists {
        assert!(price["speed_up"]["value"].as_f64().unwrap() > 0.0, "{price}");
        assert!(price["time_ratio"]["value"].as_f64().unwrap() > 0.0, "{price}");
    }
}

#[test]
fn a_recommendation_is_a_command_line_and_nothing_else() {
    let place = Place::new();
    let output = study(&place, "--recommend 0.02 --budget 1s --size 24x18 --seed 7");
    let said = stdout(&output);
    let line = said.strip_suffix('\n').unwrap();
    assert!(
        !line.contains('\n') && line.starts_with("octolux render in/small.toml --seed 7 --size 24x18"),
        "{line}"
    );
    assert!(
        line.contains("--target-error 0.02") || line.contains("--adaptive --spp "),
        "{line}"
    );
    assert!(place.files().is_empty());
    let loud = "study in/small.toml --no-cache --threads 2 --recommend 0.02 --budget 1s --size 24x18";
    let noted = stderr(&place.succeeds(loud));
    assert!(
        noted.contains("note: this is expected to render for ") && noted.contains(" s on this machine ("),
        "{noted}"
    );
    // It can be typed.
    place.succeeds(&format!("{} -q -o x.npy", line.strip_prefix("octolux ").unwrap()));
    assert_eq!(place.files(), ["x.npy"]);
}

#[test]
fn the_reference_is_kept_and_found_again() {
    let place = Place::new();
    let run = |place: &Place| {
        std::process::Command::new(env!("CARGO_BIN_EXE_octolux"))
            .args(["study", "in/small.toml", "-o", "report", "--budget", "1", "-q"])
            .env("XDG_CACHE_HOME", place.path().join("cache"))
            .current_dir(place.path())
            .status()
            .unwrap()
    };
    assert!(run(&place).success());
    let kept = fs::read_dir(place.path().join("cache/octolux/references"))
        .unwrap()
        .count();
    assert_eq!(kept, 2, "a picture and its errors");
    assert_eq!(json(&place, "report/study.json")["reference"]["cached"], false);
}

#[test]
fn wrong_usage_is_told_before_the_work() {
    let place = Place::new();
    for arguments in [
        "study in/small.toml",
        "study in/none.toml -o report",
        "study in/small.toml -o in/small.toml",
        "study in/small.toml -o no/such/folder",
        "study in/small.toml -o report --budget 0s",
        "study in/small.toml -o report --budget soon",
        "study in/small.toml --recommend 0",
        "study in/small.toml --recommend one",
        "render in/small.toml --target-error 0",
        "render in/small.toml --target-error -1",
        "render in/small.toml --target-error nan",
        "render in/small.toml --target-error 0.1 --spp 4",
        "render in/small.toml --target-error 0.1 --snapshots",
        "render in/small.toml --target-error 0.1 --shard 1/2 -o x.acc",
        "render in/small.toml --target-error 0.1 -o x.acc",
    ] {
        place.refused(arguments);
    }
}

#[test]
fn a_black_picture_has_no_error() {
    let place = Place::new();
    let path = place.path().join("in/small.toml");
    let text = fs::read_to_string(&path).unwrap();
    fs::write(
        path,
        text.replace("emission = [10.0, 10.0, 10.0]", "emission = [0.0, 0.0, 0.0]"),
    )
    .unwrap();
    let said = place.refused("study in/small.toml -o report --budget 1 --no-cache");
    assert!(said.contains("the picture is black"), "{said}");
}

/// The same bits on any number of threads and lanes; the figures say what was done.
#[test]
fn a_target_error_is_reached_and_repeats() {
    let place = Place::new();
    let base = "render in/small.toml --size 24x18 --target-error 0.02 -q --json -o";
    let one: Value =
        serde_json::from_slice(&place.succeeds(&format!("{base} a.npy --threads 1 --lanes 1")).stdout).unwrap();
    place.succeeds(&format!("{base} b.npy --threads 3 --lanes 8"));
    let read = |name: &str| fs::read(place.path().join(name)).unwrap();
    assert!(read("a.npy") == read("b.npy"));
    let error = one["error"].as_f64().unwrap();
    assert!(error <= 0.02 && error > 0.01, "{error}");
    assert_eq!(one["target_error"], 0.02);
    let replicates = one["replicates"].as_u64().unwrap();
    // Two halves of four at least, each with four passes and more.
    assert!(replicates >= 8 && one["spp"].as_u64().unwrap() >= 4 * replicates);
    assert_eq!(one["samples"].as_u64().unwrap(), one["spp"].as_u64().unwrap() * 24 * 18);
    // What was said beside the picture stands in it, too.
    let output = place.succeeds("render in/small.toml --size 24x18 --target-error 0.05 -o a.exr");
    assert!(stderr(&output).contains("5.000 % was asked for"), "{}", stderr(&output));
}
