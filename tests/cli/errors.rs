//! `--target-error` with a time, with checkpoints, and with adaptive sampling.

use std::fs;
use std::io::Read as _;
use std::process::Stdio;

use serde_json::Value;

use crate::place::{Place, stderr, stdout};
use octolux::film::read_picture;

const BASE: &str = "render in/small.toml --size 24x18 -q --json";

fn figures(place: &Place, arguments: &str) -> Value {
    serde_json::from_str(&stdout(&place.succeeds(arguments))).unwrap()
}

fn bytes(place: &Place, name: &str) -> Vec<u8> {
    fs::read(place.path().join(name)).unwrap()
}

#[test]
fn a_time_that_is_over_first_tells_the_error_that_was_reached() {
    let place = Place::new();
    let stats = figures(&place, &format!("{BASE} --target-error 0.00001 --time 0.4s -o a.npy"));
    assert_eq!(
        (&stats["target_error"], &stats["target_reached"]),
        (&0.00001.into(), &false.into())
    );
    let error = stats["error"].as_f64().unwrap();
    assert!(error > 0.00001 && error < 0.1, "{error}");
    let output = place.succeeds("render in/small.toml --size 24x18 --target-error 0.00001 --time 0.4s -o b.npy");
    let said = stderr(&output);
    assert!(
        said.contains("of the mean when the time was over, 0.001 % was asked for"),
        "{said}"
    );
    // Where the error comes first, the time changes nothing.
    let stats = figures(&place, &format!("{BASE} --target-error 5% --time 1h -o c.npy"));
    assert_eq!(stats["target_reached"], true);
    place.succeeds(&format!("{BASE} --target-error 0.05 -o d.npy"));
    assert!(bytes(&place, "c.npy") == bytes(&place, "d.npy"));
}

/// The error that is told is the spread of such pictures around the truth. Twelve seeds of one error each: the root of the mean of 24 x 18 x 3
/// squares over them is known to some 5 %; a factor of 1.5 either way is passed by chance less than once in a million.
#[test]
fn the_error_at_the_end_of_the_time_is_that_of_the_picture() {
    let place = Place::new();
    place.succeeds("render in/small.toml --size 24x18 --spp 65536 -q -o truth.npy");
    let truth = read_picture(&place.path().join("truth.npy")).unwrap();
    let values = |picture: &octolux::film::Picture| picture.pixels.as_flattened().to_vec();
    let truth = values(&truth);
    let mean = truth.iter().map(|&x| f64::from(x)).sum::<f64>() / truth.len() as f64;
    let (mut is, mut said) = (0.0, 0.0);
    for seed in 0..12 {
        let line = format!("{BASE} --seed {seed} --sampler independent --target-error 0.00001 --time 0.1 -o a.npy");
        said += figures(&place, &line)["error"].as_f64().unwrap().powi(2);
        let picture = values(&read_picture(&place.path().join("a.npy")).unwrap());
        let square = picture.iter().zip(&truth).map(|(x, y)| f64::from(x - y).powi(2));
        is += square.sum::<f64>() / truth.len() as f64 / (mean * mean);
    }
    let ratio = (is / said).sqrt();
    assert!(ratio > 1.0 / 1.5 && ratio < 1.5, "{ratio}");
}

#[test]
fn a_render_to_an_error_that_is_killed_and_taken_up_has_the_bits_of_one_in_one_piece() {
    let place = Place::new();
    for (adaptive, name) in [("", "plain"), (" --adaptive", "adaptive")] {
        let line = format!("render in/small.toml --size 96x72 --threads 1 -q --target-error 0.004{adaptive}");
        place.succeeds(&format!("{line} -o {name}-whole.npy"));
        let state = place.path().join(format!("{name}.state"));
        let broken = format!("{line} --checkpoint {name}.state --every 0.02s --resume -o {name}-broken.npy");
        let mut breaks = 0;
        loop {
            let mut child = place.command(&broken).stderr(Stdio::piped()).spawn().unwrap();
            // Killed soon after it has saved itself, some times: at first as soon as its state is there.
            let pause = std::time::Duration::from_millis(if breaks == 0 { 5 } else { 150 + 60 * breaks });
            std::thread::sleep(pause);
            while breaks == 0 && !state.exists() && child.try_wait().unwrap().is_none() {
                std::thread::sleep(pause);
            }
            if breaks < 4 && child.try_wait().unwrap().is_none() && state.exists() {
                child.kill().unwrap();
                child.wait().unwrap();
                breaks += 1;
                continue;
            }
            let mut said = String::new();
            child.stderr.take().unwrap().read_to_string(&mut said).unwrap();
            assert!(child.wait().unwrap().success(), "{said}");
            break;
        }
        assert!(!state.exists(), "the state of a finished render is removed");
        let same = bytes(&place, &format!("{name}-whole.npy")) == bytes(&place, &format!("{name}-broken.npy"));
        assert!(same, "{name}, after {breaks} breaks");
        assert!(breaks > 0, "{name} was never broken");
    }
}

#[test]
fn a_state_whose_time_was_over_stays_and_goes_on_to_its_error_or_another_one() {
    let place = Place::new();
    // `product` would be done in the time.
    let line = format!("{BASE} --estimator mis --checkpoint a.state --resume -o a.npy");
    let stats = figures(&place, &format!("{line} --target-error 0.002 --time 0.05"));
    assert_eq!(stats["target_reached"], false);
    assert!(place.files().contains(&"a.state".to_owned()));
    let stats = figures(&place, &format!("{line} --target-error 0.01 --keep"));
    assert_eq!(stats["target_reached"], true);
    let coarse = stats["samples"].as_u64().unwrap();
    let stats = figures(&place, &format!("{line} --target-error 0.005"));
    assert_eq!(
        (&stats["target_reached"], &stats["target_error"]),
        (&true.into(), &0.005.into())
    );
    assert!(stats["error"].as_f64().unwrap() <= 0.005 && stats["samples"].as_u64().unwrap() > coarse);
    assert!(!place.files().contains(&"a.state".to_owned()));
}

#[test]
fn an_adaptive_error_is_reached_on_any_number_of_threads_and_lanes() {
    let place = Place::new();
    let line = format!("{BASE} --target-error 0.01 --adaptive");
    let stats = figures(&place, &format!("{line} --threads 1 --lanes 1 -o a.npy"));
    figures(&place, &format!("{line} --threads 3 --lanes 8 -o b.npy"));
    assert!(bytes(&place, "a.npy") == bytes(&place, "b.npy"));
    assert_eq!(
        (&stats["adaptive"], &stats["target_reached"]),
        (&true.into(), &true.into())
    );
    assert!(stats["error"].as_f64().unwrap() <= 0.01);
    assert!(stats["spp_max"].as_u64() > stats["spp_min"].as_u64(), "{stats}");
}

#[test]
fn what_does_not_go_together_is_refused() {
    let place = Place::new();
    for (options, words) in [
        (
            "--adaptive --time 1",
            "cannot be used with --time, unless --target-error is given",
        ),
        (
            "--checkpoint a.state --time 1",
            "cannot be used with --time, unless --target-error is given",
        ),
        ("--target-error 1% --spp 4", "cannot be used with"),
        ("--target-error 1% -o a.acc", "holds the sums of one"),
    ] {
        let said = place.refused(&format!("render in/small.toml {options}"));
        assert!(said.contains(words), "{options}: {said}");
    }
    // A state of another kind, and one where a part is expected.
    let line = format!("{BASE} --checkpoint a.state --resume -o a.npy");
    figures(&place, &format!("{line} --target-error 0.05 --keep"));
    let said = place.refused(&format!("{line} --spp 4"));
    assert!(
        said.contains("belongs to another render than that of in/small.toml: target error is yes here and no there"),
        "{said}"
    );
    let said = place.refused("merge a.state -o b.npy");
    assert!(said.contains("checkpoint of a render to a --target-error"), "{said}");
    let said = place.refused("render in/small.toml -o a.state --spp 2");
    assert!(said.starts_with("error: "), "{said}");
}
