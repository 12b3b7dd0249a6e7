//! What a newcomer mistypes, and what a machine refuses: each answer says what is wrong and what would do.

use std::fs;
use std::io::Read as _;
use std::process::{Command, Stdio};
use std::time::Duration;

use crate::place::{Place, stderr, stdout};

#[test]
fn numbers_below_the_range_are_answered_with_the_range() {
    let place = Place::new();
    for (arguments, words) in [
        (
            "render in/small.toml --lights -1",
            "lights are auto, all or a whole number from 1 to 64",
        ),
        (
            "render in/small.toml --threads -1",
            "threads are a whole number from 1 to 1024",
        ),
        (
            "render in/small.toml --threads 0",
            "threads are a whole number from 1 to 1024",
        ),
        (
            "render in/small.toml --seed -1",
            "a seed is a whole number from 0 to 4294967295",
        ),
        (
            "render in/small.toml --seed x",
            "a seed is a whole number from 0 to 4294967295",
        ),
        (
            "render in/small.toml --spp -4",
            "samples a pixel are a whole number from 1 to 1073741824",
        ),
        ("render in/small.toml --lanes -1", "a packet has 1, 8 or 16 rays"),
        ("render in/small.toml --size -4x4", "a size is WIDTHxHEIGHT"),
        ("render in/small.toml --shard -1/2 -o a.acc", "a shard is I/N"),
        ("render in/small.toml --replay -1,0,0", "a sample is X,Y,PASS"),
        (
            "render in/small.toml --checkpoint a --every -1",
            "a time is a positive number of seconds",
        ),
        ("reference in/small.toml -o a.npy --spp -1", "from 2 to 1073741824"),
        (
            "reference in/small.toml -o a.npy --seed -1",
            "a seed is a whole number from 0 to ",
        ),
        (
            "reference in/small.toml -o a.npy --threads -1",
            "threads are a whole number",
        ),
        (
            "verify in/small.toml --seed -1",
            "a seed is a whole number from 0 to 4294967295",
        ),
        (
            "view in/small.toml --port -1",
            "a port is a whole number from 0 to 65535",
        ),
        (
            "view in/small.toml --port 65536",
            "a port is a whole number from 0 to 65535",
        ),
        ("compare a.npy b.npy --max-relmse -1", "a limit is a number, 0 or above"),
        ("shards in --of -1", "shards are a whole number from 1 to 1000000"),
        ("shards in --of 99999999", "shards are a whole number from 1 to 1000000"),
        ("selftest --case -1", "cases are numbered from 1 to "),
        (
            "batch jobs.toml --threads -1",
            "threads are a whole number from 1 to 1024",
        ),
    ] {
        let said = place.refused(arguments);
        assert!(said.contains(words) && !said.contains("tip:"), "{arguments}: {said}");
    }
    let said = place.refused("render in/small.toml --nonsense");
    assert!(!said.contains("as a value"), "{said}");
}

#[test]
fn words_in_braces_other_than_the_name_are_refused() {
    let place = Place::new();
    for arguments in [
        "render in/small.toml -o {nam}.npy",
        "render in/small.toml --stats {scene}.json",
        "render in/small.toml --checkpoint {Name}.state",
        "view in/small.toml --no-open -o {nam}.npy",
        "explain in/small.toml --noise={nam}.png",
        "reference in/small.toml -o {nam}.npy",
    ] {
        let said = place.refused(arguments);
        assert!(
            said.contains("} is no placeholder\nhelp: the only one is {name}, which stands for the scene's name\n"),
            "{arguments}: {said}"
        );
    }
    // Other braces are part of a name, as ever.
    place.succeeds("render in/small.toml -o {1}{}-{name}.npy -q");
    place.succeeds("reference in/small.toml -o {name}-exact.npy --spp 2 -q");
    let files = place.files();
    assert_eq!(files, ["small-exact.npy", "small-exact_stderr.npy", "{1}{}-small.npy"]);
    let said = place.refused("compare small-exact.npy small-exact.npy --diff {name}.npy");
    assert!(said.contains("{name} is not filled in by this command"), "{said}");
}

#[test]
fn a_reference_is_kept_in_a_format_that_keeps_it() {
    let place = Place::new();
    for outputs in ["-o x.png", "-o x.exr --stderr y.PNG"] {
        let said = place.refused(&format!("reference in/small.toml --spp 2 {outputs}"));
        assert!(
            said.contains("a PNG does not keep radiances") && said.contains("help: write .exr or .npy"),
            "{said}"
        );
    }
}

#[test]
fn an_address_that_is_none_of_this_machine_is_told_apart_from_a_port_in_use() {
    let place = Place::new();
    let said = place.refused("view in/small.toml --no-open --bind localhost");
    assert!(
        said.contains("an address is one of this machine in numbers, such as 127.0.0.1"),
        "{said}"
    );
    // TEST-NET-1 of RFC 5737: no machine has it.
    let said = place.refused("view in/small.toml --no-open --bind 192.0.2.1");
    assert!(said.contains("help: --bind takes an address of this machine"), "{said}");
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let port = taken.local_addr().unwrap().port();
    let said = place.refused(&format!("view in/small.toml --no-open --port {port}"));
    assert!(said.contains("help: choose another --port"), "{said}");
}

#[test]
fn files_of_other_scenes_are_named_with_both_scenes() {
    let place = Place::new();
    let text = fs::read_to_string(place.path().join("in/small.toml")).unwrap();
    fs::write(
        place.path().join("in/other.toml"),
        text.replace("radius   = 0.5", "radius   = 0.7"),
    )
    .unwrap();
    place.succeeds("render in/small.toml -q -o a.acc");
    place.succeeds("render in/other.toml -q -o b.acc");
    let said = place.refused("merge a.acc b.acc -o x.png");
    let words = "error: b.acc: belongs to another render than a.acc: scene is in/other.toml (";
    assert!(
        said.starts_with(words) && said.contains(") here and in/small.toml ("),
        "{said}"
    );
    place.succeeds("render in/small.toml -q -o a.npy --checkpoint state --keep");
    let said = place.refused("render in/other.toml -o b.npy --checkpoint state --resume");
    let words = "error: state: belongs to another render than that of in/other.toml: scene is in/small.toml (";
    assert!(
        said.starts_with(words) && said.contains("help: render that scene with"),
        "{said}"
    );
}

#[test]
fn one_of_a_kind_is_not_many() {
    let place = Place::new();
    let text = stdout(&place.succeeds("explain in/small.toml --threads 1"));
    for words in [
        "spheres    2, 1 of them a light\n",
        "diffuse           1 of 1 material, on 1 shape in sight\n",
        "note       the camera does not see 1 of the 2 spheres and meshes",
        ", 1 thread\n",
        "every light in each pass: 1 sphere or triangle that emits is not more than 64\n",
    ] {
        assert!(text.contains(words), "{words}\n{text}");
    }
}

#[test]
fn memory_that_is_not_there_is_no_abort() {
    let place = Place::new();
    for command in [
        "reference in/small.toml -o a.npy",
        "explain in/small.toml",
        "view in/small.toml",
    ] {
        let said = place.refused(&format!("{command} --size 65536x65536"));
        assert!(said.contains("GiB of memory, more than is free"), "{command}: {said}");
    }
}

/// Address space, not memory, is short: 144 million pixels of 44 bytes.
#[cfg(target_os = "linux")]
#[test]
fn a_limit_of_the_address_space_counts_as_memory() {
    let place = Place::new();
    let program = env!("CARGO_BIN_EXE_octolux");
    let command = format!("ulimit -v 4000000; exec '{program}' render in/small.toml --spp 1 --size 12000x12000");
    let output = Command::new("sh")
        .args(["-c", &command])
        .current_dir(place.path())
        .output()
        .unwrap();
    let said = stderr(&output);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(said.contains("GiB of memory"), "{said}");
}

#[test]
fn text_of_another_encoding_is_named() {
    let place = Place::new();
    let text = fs::read_to_string(place.path().join("in/small.toml")).unwrap();
    let utf16: Vec<u8> = text.encode_utf16().flat_map(u16::to_le_bytes).collect();
    fs::write(place.path().join("in/utf16.toml"), utf16).unwrap();
    let said = place.refused("render in/utf16.toml");
    assert!(said.contains("the text holds zero bytes, as UTF-16 does"), "{said}");
    // A mark of the byte order and carriage returns do no harm.
    fs::write(
        place.path().join("in/marked.toml"),
        format!("\u{feff}{}", text.replace('\n', "\r\n")),
    )
    .unwrap();
    place.succeeds("render in/marked.toml -q -o a.npy");
    place.succeeds("render in/small.toml -q -o b.npy");
    let bytes = |name: &str| fs::read(place.path().join(name)).unwrap();
    assert!(bytes("a.npy") == bytes("b.npy"));
}

/// A scene through a pipe that nobody writes to: opening it waits. Only commands with a handler of their own are tried: behind
/// `nohup` the others are started with the signal ignored, as they should be.
#[cfg(unix)]
#[test]
fn ctrl_c_ends_a_command_that_waits_for_its_scene() {
    let place = Place::new();
    let pipe = place.path().join("in/pipe");
    assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    for arguments in [
        "render in/pipe -o a.npy",
        "render in/pipe in/small.toml -o {name}.npy",
        "verify in/pipe",
        "study in/pipe -o study",
    ] {
        let mut command = place.command(arguments);
        let mut child = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
        let wait = || std::thread::sleep(Duration::from_millis(500));
        wait();
        // The other scene is rendered meanwhile.
        while arguments.contains("small") && !place.files().contains(&"small.npy".to_owned()) {
            wait();
        }
        wait();
        assert!(child.try_wait().unwrap().is_none(), "{arguments}");
        let kill = format!("kill -INT {}", child.id());
        assert!(Command::new("sh").args(["-c", &kill]).status().unwrap().success());
        let waited = (0..60).find(|_| {
            wait();
            child.try_wait().unwrap().is_some()
        });
        if waited.is_none() {
            child.kill().unwrap();
            panic!("{arguments}: goes on after ctrl-c");
        }
        let status = child.wait().unwrap();
        let mut said = String::new();
        child.stderr.take().unwrap().read_to_string(&mut said).unwrap();
        assert_eq!(status.code(), Some(130), "{arguments}: {said}");
    }
    assert_eq!(place.files(), ["small.npy"]);
}
