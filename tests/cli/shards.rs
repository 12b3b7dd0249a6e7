//! Shards, checkpoints and merges through the real binary: whatever divides or breaks a render, its bits are the same.

use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use crate::place::{Place, stderr, stdout};

/// 13 leaves of 64 passes, the last one of 5: 64 x 64 pixels.
const RENDER: &str = "render in/small.toml --size 64x64 --spp 773 -q";

fn bytes(place: &Place, name: &str) -> Vec<u8> {
    fs::read(place.path().join(name)).unwrap()
}

/// Renders the shards 1 to `of` into a folder and returns their names.
fn shards(place: &Place, of: u32) -> Vec<String> {
    let folder = format!("parts{of}");
    fs::create_dir(place.path().join(&folder)).unwrap();
    let names: Vec<String> = (1..=of).map(|i| format!("{folder}/{i}.acc")).collect();
    for (i, name) in (1..).zip(&names) {
        let threads = 1 + i % 2;
        place.succeeds(&format!("{RENDER} --threads {threads} --shard {i}/{of} -o {name}"));
    }
    names
}

#[test]
fn any_division_into_shards_makes_the_same_bits() {
    let place = Place::new();
    place.succeeds(&format!("{RENDER} -o whole.npy -o whole.acc"));
    for of in [1, 2, 7, 20] {
        let mut names = shards(&place, of);
        names.sort_by_key(|name| name.bytes().rev().collect::<Vec<_>>()); // not in their order
        let repeated = names[0].clone();
        names.push(repeated);
        let output = place.succeeds(&format!("merge {} -o {of}.npy", names.join(" ")));
        let said = stderr(&output);
        assert!(
            said.contains("note: 1 repeated file was left out") || of == 20,
            "{said}"
        );
        assert!(
            bytes(&place, "whole.npy") == bytes(&place, &format!("{of}.npy")),
            "{of} shards"
        );
    }
    place.succeeds("merge whole.acc -o again.npy");
    assert!(bytes(&place, "whole.npy") == bytes(&place, "again.npy"));
}

#[test]
fn parts_that_do_not_fit_are_refused() {
    let place = Place::new();
    let (halves, thirds) = (shards(&place, 2), shards(&place, 3));
    place.succeeds(&format!("{RENDER} --seed 9 --shard 2/2 -o foreign.acc"));
    let says = |parts: &str, words: &str| {
        let said = place.refused(&format!("merge {parts} -o x.png"));
        assert!(said.contains(words), "{parts}: {said}");
    };
    says(
        &format!("{} foreign.acc", halves[0]),
        "foreign.acc: belongs to another render than parts2/1.acc: seed is 9 here and 0 there",
    );
    says(&format!("{} {}", halves[0], thirds[1]), "some would count twice");
    let plain = "--accel embree --robust off";
    place.succeeds(&format!("{RENDER} --accel embree --shard 1/2 -o robust.acc"));
    place.succeeds(&format!("{RENDER} {plain} --shard 2/2 -o plain.acc"));
    says(
        "robust.acc plain.acc",
        "plain.acc: belongs to another render than robust.acc: rays answered by is embree, not robust here and embree there",
    );
    says(&halves[1], "shard 1 of 2 (passes 0 to 383) is missing");
    says(&halves[0], "shard 2 of 2 (passes 384 to 772) is missing");
    says(
        &format!("{} {}", thirds[0], thirds[2]),
        "shard 2 of 3 (passes 256 to 511) is missing",
    );
    says("in/small.toml", "holds no sums of Octolux");
    says("nowhere.acc", "cannot be read");
    let mut damaged = bytes(&place, &halves[0]);
    let middle = damaged.len() / 2;
    damaged[middle] ^= 1;
    fs::write(place.path().join("damaged.acc"), &damaged).unwrap();
    says(
        &format!("damaged.acc {}", halves[1]),
        "damaged.acc: is cut short or damaged",
    );
    fs::write(place.path().join("cut.acc"), &damaged[..middle]).unwrap();
    says(&format!("cut.acc {}", halves[1]), "cut.acc: is cut short or damaged");
    place.succeeds(&format!(
        "merge {} {} -o partial.npy --partial -q",
        thirds[0], thirds[2]
    ));
    assert_eq!(bytes(&place, "partial.npy").len(), 64 * 64 * 12 + 128);
}

/// Its pixels have different numbers of samples, so no number of passes says that it is whole.
#[test]
fn the_sums_of_an_adaptive_render_make_its_picture() {
    let place = Place::new();
    place.succeeds("render in/small.toml --size 20x12 --quiet --spp 64 --adaptive -o a.acc -o a.npy");
    place.succeeds("merge a.acc -o b.npy");
    assert!(bytes(&place, "a.npy") == bytes(&place, "b.npy"));
    let said = stdout(&place.succeeds("info a.acc"));
    assert!(said.contains("sums of Octolux, whole"), "{said}");
}

#[test]
fn missing_shards_are_named_for_a_job_array() {
    let place = Place::new();
    shards(&place, 4);
    assert_eq!(stdout(&place.succeeds("shards parts4 --of 4 --missing")), "");
    fs::remove_file(place.path().join("parts4/2.acc")).unwrap();
    fs::write(place.path().join("parts4/4.acc"), "cut").unwrap();
    let output = place.succeeds("shards parts4 --of 4 --missing");
    assert_eq!(stdout(&output), "2,4\n");
    assert!(stderr(&output).contains("4.acc: holds no sums"), "{}", stderr(&output));
    let lines = stdout(&place.succeeds("shards parts4 --of 4"));
    assert!(
        lines.starts_with("1/4 passes 0 to 192 parts4/1.acc\n2/4 missing\n"),
        "{lines}"
    );
}

#[test]
fn a_shard_wants_one_output_for_its_sums() {
    let place = Place::new();
    for arguments in [
        "--shard 1/2",
        "--shard 1/2 -o x.png",
        "--shard 1/2 -o a.acc -o b.acc",
        "--shard 3/2 -o a.acc",
    ] {
        place.refused(&format!("render in/small.toml {arguments}"));
    }
}

/// A render that keeps its state every few milliseconds.
fn start(place: &Path, arguments: &str) -> Child {
    Command::new(env!("CARGO_BIN_EXE_octolux"))
        .args(format!("{RENDER} --checkpoint state --every 0.005 --resume -o a.npy {arguments}").split_whitespace())
        .current_dir(place)
        .stdin(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

/// Kills renders at random moments, `kills` times in all, and takes them up again; each picture must be the undisturbed one.
fn kill_and_resume(kills: u32, arguments: &str) {
    let place = Place::new();
    place.succeeds(&format!("{RENDER} {arguments} -o whole.npy"));
    let (mut random, mut killed, mut finished, mut resumed) = (12345_u32, 0, 0, 0);
    while killed < kills {
        let mut child = start(place.path(), arguments);
        random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        std::thread::sleep(Duration::from_micros(u64::from(random >> 16) * 2));
        if child.try_wait().unwrap().is_none() {
            child.kill().unwrap();
            killed += 1;
            resumed += u32::from(place.path().join("state").exists());
        }
        child.wait().unwrap();
        if place.path().join("a.npy").exists() && !place.path().join("state").exists() {
            assert!(
                bytes(&place, "a.npy") == bytes(&place, "whole.npy"),
                "after {killed} kills"
            );
            fs::remove_file(place.path().join("a.npy")).unwrap();
            finished += 1;
        }
    }
    let output = start(place.path(), arguments).wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert!(bytes(&place, "a.npy") == bytes(&place, "whole.npy"));
    assert!(
        !place.path().join("state").exists(),
        "the checkpoint goes when the picture stands"
    );
    println!(
        "{killed} kills, {resumed} with a state to go on from, {} pictures, equal bits",
        finished + 1
    );
}

#[test]
fn a_render_that_is_killed_and_taken_up_again_has_the_same_bits() {
    kill_and_resume(8, "");
    kill_and_resume(3, "--adaptive");
}

/// `cargo test --release --test cli shards -- --ignored --nocapture`: about a minute.
#[test]
#[ignore = "takes a minute; the suite does the same with fewer kills"]
fn two_hundred_kills_are_survived() {
    kill_and_resume(140, "");
    kill_and_resume(60, "--adaptive");
}

#[test]
fn a_checkpoint_of_something_else_is_refused_and_left_alone() {
    let place = Place::new();
    let begin = "render in/small.toml --size 64x64 --spp 1000000000 -q -o a.npy --checkpoint state --every 0.01";
    let mut child = Command::new(env!("CARGO_BIN_EXE_octolux"))
        .args(begin.split_whitespace())
        .current_dir(place.path())
        .spawn()
        .unwrap();
    while !place.path().join("state").exists() {
        std::thread::sleep(Duration::from_millis(5));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    // What a kill leaves of a file that was being written.
    for name in place.files().iter().filter(|name| name.starts_with(".octolux-")) {
        fs::remove_file(place.path().join(name)).unwrap();
    }
    let state = bytes(&place, "state");
    let says = |arguments: &str, words: &str| {
        let said = place.refused(arguments);
        assert!(said.contains(words), "{arguments}: {said}");
        assert!(bytes(&place, "state") == state, "{arguments}");
    };
    says(begin, "state: a checkpoint is there already");
    says(&format!("{begin} --resume --seed 1"), "seed is 0 here and 1 there");
    says(
        &format!("{begin} --resume --estimator light"),
        "estimator is product here and light there",
    );
    let text = fs::read_to_string(place.path().join("in/small.toml")).unwrap();
    let more = "[[spheres]]\ncenter = [0, 9, 0]\nradius = 0.1\nemission = [1, 1, 1]\n";
    fs::write(place.path().join("in/small.toml"), format!("{text}{more}")).unwrap();
    says(
        &format!("{begin} --resume"),
        "state: belongs to another render than that of in/small.toml: scene is in/small.toml (",
    );
    fs::write(place.path().join("in/small.toml"), text).unwrap();
    let state = [&state[..state.len() - 1], &[state[state.len() - 1] ^ 128]].concat();
    fs::write(place.path().join("state"), &state).unwrap();
    let said = place.refused(&format!("{begin} --resume"));
    assert!(said.contains("state: is cut short or damaged"), "{said}");
    assert!(bytes(&place, "state") == state);
}

#[test]
fn a_finished_render_that_kept_its_state_takes_more_samples() {
    let place = Place::new();
    let render = "render in/small.toml --size 20x12 --quiet --checkpoint state";
    place.succeeds(&format!("{render} --keep --spp 8 -o a.npy"));
    assert!(place.path().join("state").exists());
    place.succeeds(&format!("{render} --resume --spp 32 -o a.npy"));
    assert!(
        !place.path().join("state").exists(),
        "without --keep the state of a finished render goes"
    );
    place.succeeds("render in/small.toml --size 20x12 --quiet --spp 32 -o b.npy");
    assert!(bytes(&place, "a.npy") == bytes(&place, "b.npy"));
    let said = place.refused("render in/small.toml --keep");
    assert!(said.contains("--checkpoint"), "{said}");
}
