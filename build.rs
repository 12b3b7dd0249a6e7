//! Finds Embree 4 (or fetches it), tells the program where it is, and records what this build is made of.
//!
//! Needs nothing that a user would have to install first: no cmake, no pkg-config, no libclang. Python with pip is
//! needed only where there is no Embree yet.

#[path = "build/commit.rs"]
mod commit;
#[path = "build/embree.rs"]
mod embree;
#[path = "build/wheel.rs"]
mod wheel;

use std::env;

/// Code-generation features worth publishing beside a timing, in the order in which they are listed.
const FEATURES: [&str; 10] = [
    "avx2", "fma", "bmi1", "bmi2", "f16c", "avx512f", "avx512vl", "avx512bw", "avx512dq", "avx512cd",
];

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-changed=build");
    if let Err(sentences) = run() {
        // `cargo::error` (Cargo 1.84) fails the build and shows these lines alone, without the script's whole output.
        for line in sentences.lines() {
            println!("cargo::error={line}");
        }
    }
}

fn run() -> Result<(), String> {
    let (arch, os) = (cargo_var("CARGO_CFG_TARGET_ARCH"), cargo_var("CARGO_CFG_TARGET_OS"));
    if (arch.as_str(), os.as_str()) != ("x86_64", "linux") {
        return Err(format!(
            "Octolux runs on x86_64 Linux only, and this build is for {arch} {os}"
        ));
    }
    let features = target_features();
    if !features.contains(&"avx2") || !features.contains(&"fma") {
        return Err(
            "Octolux needs AVX2 and FMA at compile time, and this build has neither -C target-cpu=x86-64-v3 nor better.\n\
             A RUSTFLAGS variable replaces the flags of .cargo/config.toml, and so does a build from another directory:\n\
             unset RUSTFLAGS, add `-C target-cpu=x86-64-v3` to it, or run cargo inside the checkout (from elsewhere:\n\
             cargo --config CHECKOUT/.cargo/config.toml build --manifest-path CHECKOUT/Cargo.toml)."
                .to_owned(),
        );
    }
    println!("cargo::rustc-env=OCTOLUX_TARGET_FEATURES={}", features.join(","));
    println!("cargo::rustc-env=OCTOLUX_COMMIT={}", commit::describe());
    avx512()?;
    // docs.rs has no network, and documentation needs no Embree.
    if env::var_os("DOCS_RS").is_some() {
        return Ok(());
    }
    if let Some(library) = embree::find()? {
        library.announce()?;
    }
    Ok(())
}

/// The variable that decides whether kernels for AVX-512 are compiled; the program heeds it too.
const AVX512: &str = "OCTOLUX_AVX512";

/// Compiles kernels for AVX-512 where this machine has it: they take about a third of the library's compile time. `on` compiles them anyway,
/// for a program that is to run elsewhere; `off` leaves them out.
fn avx512() -> Result<(), String> {
    println!("cargo::rerun-if-env-changed={AVX512}");
    println!("cargo::rustc-check-cfg=cfg(avx512_kernels)");
    let there = || is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx512bw");
    let wanted = match env::var(AVX512).as_deref() {
        Ok("on") => true,
        Ok("off") => false,
        Ok("") | Err(env::VarError::NotPresent) => there(),
        other => return Err(format!("{AVX512} is {other:?}; use \"on\", \"off\", or leave it out")),
    };
    if wanted {
        println!("cargo::rustc-cfg=avx512_kernels");
    }
    Ok(())
}

fn target_features() -> Vec<&'static str> {
    let all = cargo_var("CARGO_CFG_TARGET_FEATURE");
    FEATURES
        .into_iter()
        .filter(|wanted| all.split(',').any(|has| has == *wanted))
        .collect()
}

/// A variable that Cargo sets for build scripts; empty if it does not.
fn cargo_var(name: &str) -> String {
    env::var(name).unwrap_or_default()
}
