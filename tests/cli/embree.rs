//! The program and Embree's library: found wherever the program is, missing with a sentence, and with what packets it has.

use std::fs;
use std::path::PathBuf;
use std::process::{Command, Output};

use octolux::lane::has_avx512;

use crate::place::{Place, stderr, stdout};

const RENDER: &str = "render in/small.toml --accel embree -o small.npy";

/// A copy of the program in a folder of the place, to be run in the place.
fn installed(place: &Place, folder: &str, arguments: &str) -> (PathBuf, Command) {
    let bin = place.path().join(folder);
    fs::create_dir_all(&bin).unwrap();
    let program = bin.join("octolux");
    fs::copy(env!("CARGO_BIN_EXE_octolux"), &program).unwrap();
    let mut command = Command::new(program);
    command.args(arguments.split_whitespace()).current_dir(place.path());
    (bin, command)
}

/// A failure of the machine: exit code 1, one sentence and a remedy, no picture.
#[track_caller]
fn sentence(place: &Place, output: &Output) -> String {
    let said = stderr(output);
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.starts_with("error: ") && !said.contains("panicked"), "{said}");
    assert!(said.contains("help: "), "{said}");
    assert!(!place.path().join("small.npy").exists());
    said
}

#[test]
fn a_program_that_was_moved_renders_the_same_bits() {
    let place = Place::new();
    place.succeeds(&RENDER.replace("small.npy", "expected.npy"));
    let (_, mut command) = installed(&place, "prefix/bin", RENDER);
    let output = command.output().unwrap();
    assert!(output.status.success(), "{}", stderr(&output));
    let bytes = |name: &str| fs::read(place.path().join(name)).unwrap();
    assert_eq!(bytes("small.npy"), bytes("expected.npy"));
}

/// What lies beside a program comes before what its build knew; here it is no library.
#[test]
fn a_library_beside_the_program_is_the_one_that_is_opened() {
    for folder in ["prefix/bin", "prefix/lib"] {
        let place = Place::new();
        let (bin, mut command) = installed(&place, "prefix/bin", RENDER);
        let library = bin.join("../..").join(folder).join("libembree4.so.4");
        fs::create_dir_all(library.parent().unwrap()).unwrap();
        fs::write(&library, "no library").unwrap();
        let said = sentence(&place, &command.env_remove("EMBREE_DIR").output().unwrap());
        let named = library.canonicalize().unwrap();
        assert!(said.contains(named.to_str().unwrap()), "{said}");
    }
}

#[test]
fn a_folder_of_embree_without_a_library_is_named() {
    let place = Place::new();
    let mut command = place.command(RENDER);
    let said = sentence(&place, &command.env("EMBREE_DIR", "/no/such/folder").output().unwrap());
    assert!(said.contains("EMBREE_DIR is /no/such/folder"), "{said}");
}

/// Embree reads `.embree4` in the home folder: `isa=avx2` leaves it no packets of sixteen rays, `isa=sse2` none of eight either.
#[test]
fn a_width_is_taken_that_embree_has() {
    let place = Place::new();
    let with_isa = |isa: &str, arguments: &str| {
        place
            .command(arguments)
            .env("OCTOLUX_EMBREE", format!("isa={isa}"))
            .output()
            .unwrap()
    };
    for (isa, together) in [("avx2", 8), ("sse2", 1)] {
        let output = with_isa(isa, &format!("{RENDER} --json"));
        assert!(output.status.success(), "{isa}: {}", stderr(&output));
        let figures: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!(
            (&figures["lanes"], &figures["rays_together"]),
            (&8.into(), &together.into()),
            "{isa}"
        );

        // Who needs no packets of Embree takes what the processor has.
        let output = with_isa(isa, "render in/small.toml --accel linear --json -o line.npy");
        let figures: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        let widest = if has_avx512() { 16 } else { 8 };
        assert_eq!(
            (&figures["lanes"], &figures["rays_together"]),
            (&widest.into(), &widest.into()),
            "{isa}"
        );

        let output = with_isa(isa, "render in/small.toml --accel embree --lanes 16 -o refused.npy");
        assert_eq!(output.status.code(), Some(2), "{isa}: {}", stderr(&output));
        assert!(!place.path().join("refused.npy").exists());
    }
    let text = stdout(&with_isa("sse2", "explain in/small.toml --accel embree"));
    assert!(
        text.contains("8 rays a packet, which Embree takes one by one"),
        "{text}"
    );
    assert!(text.contains("this Embree has no packets of 8 rays"), "{text}");
}

/// The answers do not depend on whether Embree takes packets or single rays.
#[test]
fn without_packets_of_embree_all_widths_have_the_same_bits() {
    let place = Place::new();
    for lanes in [1, 8] {
        let arguments = format!("render in/small.toml --accel embree --lanes {lanes} -o lanes{lanes}.npy");
        let output = place
            .command(&arguments)
            .env("OCTOLUX_EMBREE", "isa=sse2")
            .output()
            .unwrap();
        assert!(output.status.success(), "{}", stderr(&output));
    }
    let bytes = |name: &str| fs::read(place.path().join(name)).unwrap();
    assert_eq!(bytes("lanes1.npy"), bytes("lanes8.npy"));
}
