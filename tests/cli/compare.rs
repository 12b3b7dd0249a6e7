//! `octolux compare` as its users meet it.

use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use octolux::film::{Attributes, Picture, write_picture};

fn compare(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_octolux"))
        .arg("compare")
        .args(args)
        .output()
        .unwrap()
}

fn picture(folder: &Path, name: &str, width: u32, height: u32, value: impl Fn(usize) -> f32) -> PathBuf {
    let pixels = (0..(width * height) as usize).map(|i| [value(i); 3]).collect();
    let path = folder.join(name);
    write_picture(&path, &Picture { width, height, pixels }, &Attributes::default()).unwrap();
    path
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

/// Half of the pixels are 1.5 instead of 1, half are exact.
#[test]
fn figures_as_table_and_as_json_across_formats() {
    let folder = tempfile::tempdir().unwrap();
    let a = picture(folder.path(), "a.exr", 20, 10, |i| if i % 2 == 0 { 1.5 } else { 1.0 });
    let b = picture(folder.path(), "b.npy", 20, 10, |_| 1.0);
    let stderr = picture(folder.path(), "e.npy", 20, 10, |_| 0.25);
    let [a, b, stderr] = [&a, &b, &stderr].map(|path| path.to_str().unwrap());

    let result = compare(&[a, b]);
    assert_eq!(result.status.code(), Some(0), "{}", text(&result.stderr));
    let table = text(&result.stdout);
    assert!(
        table.contains("relmse           1.2499e-1") && table.contains("+25.0000 %"),
        "{table}"
    );
    assert!(!table.contains("z of"), "{table}");

    let result = compare(&[a, b, "--stderr", stderr, "--json"]);
    let json: serde_json::Value = serde_json::from_slice(&result.stdout).unwrap();
    let number = |path: &str| json.pointer(path).and_then(serde_json::Value::as_f64).unwrap();
    assert_eq!(number("/mean"), 1.25);
    assert!((number("/rmse") - 0.125_f64.sqrt()).abs() < 1e-12);
    assert!((number("/relmse_net") - (0.125 - 0.0625) / 1.0001).abs() < 1e-12);
    assert!((number("/significance/pixels/max") - 2.0).abs() < 1e-5);
    // 200 pixels, a mean difference of 0.25 = 1 s.
    assert!((number("/significance/z_mean/0") - 200.0_f64.sqrt()).abs() < 1e-4);
    assert_eq!(json["noise_of_both"], false);
    assert_eq!(json["significance"]["blocks"]["count"], 18);

    let result = compare(&[a, b, "--stderr", stderr, "--stderr-a", stderr, "--json"]);
    let json: serde_json::Value = serde_json::from_slice(&result.stdout).unwrap();
    assert_eq!(json["noise_of_both"], true);
    let z = json["significance"]["pixels"]["max"].as_f64().unwrap();
    assert!((z - 2.0_f64.sqrt()).abs() < 1e-5, "{z}");
}

#[test]
fn the_table_says_what_its_z_scores_lack() {
    let folder = tempfile::tempdir().unwrap();
    let a = picture(folder.path(), "a.npy", 20, 10, |i| if i % 2 == 0 { 1.5 } else { 1.0 });
    let b = picture(folder.path(), "b.npy", 20, 10, |_| 1.0);
    let even = picture(folder.path(), "e.npy", 20, 10, |_| 0.25);
    // One pixel whose few samples agree: its score is 20 000, that of its block less than 20.
    let few = picture(folder.path(), "f.npy", 20, 10, |i| if i == 0 { 2.5e-5 } else { 0.25 });
    let [a, b, even, few] = [&a, &b, &even, &few].map(|path| path.to_str().unwrap());
    let table = |args: &[&str]| text(&compare(&[&[a, b], args].concat()).stdout);
    let one_sided = "one picture's standard errors are not known: its noise is in the z-scores";
    let too_small = "standard errors of pixels are too small: blocks and the mean tell more";
    for (args, lacks, doubtful) in [
        (&[][..], false, false),
        (&["--stderr", even][..], true, false),
        (&["--stderr-a", even], true, false),
        (&["--stderr", even, "--stderr-a", even], false, false),
        (&["--stderr", few, "--stderr-a", few], false, true),
    ] {
        let table = table(args);
        assert_eq!(table.contains(one_sided), lacks, "{args:?}: {table}");
        assert_eq!(table.contains(too_small), doubtful, "{args:?}: {table}");
        assert_eq!(table.contains("z of pixels"), !args.is_empty(), "{table}");
    }
}

#[test]
fn the_exit_code_follows_the_limit() {
    let folder = tempfile::tempdir().unwrap();
    let a = picture(folder.path(), "a.npy", 4, 4, |_| 1.1);
    let b = picture(folder.path(), "b.npy", 4, 4, |_| 1.0);
    let nan = picture(folder.path(), "nan.npy", 4, 4, |i| if i == 3 { f32::NAN } else { 1.0 });
    let [a, b, nan] = [&a, &b, &nan].map(|path| path.to_str().unwrap());
    assert_eq!(compare(&[a, b, "--max-relmse", "0.02"]).status.code(), Some(0));
    let above = compare(&[a, b, "--max-relmse", "0.005"]);
    assert_eq!(above.status.code(), Some(1));
    assert_eq!(text(&above.stderr), "error: relmse 9.9990e-3 is above 5e-3\n");
    let invalid = compare(&[nan, b, "--max-relmse", "1"]);
    assert_eq!(invalid.status.code(), Some(1));
    // With a limit or without, as the judged picture, the reference or its standard errors: no figure of NaN is printed.
    for args in [
        &[nan, b][..],
        &[b, nan],
        &[a, b, "--stderr", nan],
        &[a, b, "--stderr-a", nan, "--json"],
    ] {
        let invalid = compare(args);
        assert_eq!(invalid.status.code(), Some(1));
        let expected =
            "3 of its values are NaN or infinite, the first of them in pixel 3,0, so there is no error to speak of";
        assert_eq!(text(&invalid.stderr), format!("error: {nan}: {expected}\n"));
        assert!(invalid.stdout.is_empty());
    }
    assert_eq!(compare(&[a, b, "--max-relmse", "nan"]).status.code(), Some(2));
}

#[test]
fn different_sizes_are_a_sentence() {
    let folder = tempfile::tempdir().unwrap();
    let a = picture(folder.path(), "a.npy", 4, 4, |_| 1.0);
    let b = picture(folder.path(), "b.npy", 8, 2, |_| 1.0);
    let [a, b] = [&a, &b].map(|path| path.to_str().unwrap());
    for args in [&[a, b][..], &[a, a, "--stderr", b], &[a, a, "--stderr-a", b]] {
        let result = compare(args);
        assert_eq!(result.status.code(), Some(2));
        assert_eq!(
            text(&result.stderr),
            format!("error: the sizes differ: {a} is 4x4, {b} is 8x2\n")
        );
        assert!(result.stdout.is_empty());
    }
}

/// `octolux compare ... | head -0`
#[test]
fn a_closed_pipe_is_no_panic() {
    let folder = tempfile::tempdir().unwrap();
    let a = picture(folder.path(), "a.npy", 4, 4, |_| 1.0);
    let mut child = Command::new(env!("CARGO_BIN_EXE_octolux"))
        .arg("compare")
        .args([&a, &a])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let result = child.wait_with_output().unwrap();
    assert!(text(&result.stderr).is_empty(), "{}", text(&result.stderr));
    assert!(result.status.code() != Some(101));
}
