//! Which commit is being compiled.

use std::path::Path;
use std::process::Command;

/// What decides the program; changes elsewhere (notes, scenes, tests) do not make a build "dirty".
const SOURCES: [&str; 6] = ["src", "build", "build.rs", "Cargo.toml", "Cargo.lock", ".cargo"];

/// Says what is being compiled where git cannot, such as for a package; while it is set, a commit does not compile everything again.
const NAME: &str = "OCTOLUX_COMMIT";

/// The short hash of the commit, with `-dirty` if the sources differ from it; `unknown` outside a git checkout.
pub fn describe() -> String {
    println!("cargo::rerun-if-env-changed={NAME}");
    if let Ok(name) = std::env::var(NAME) {
        return name;
    }
    // A release unpacked inside someone else's repository must not show that repository's commit: the prefix of the
    // working directory is empty only at the top of a checkout (of a worktree too).
    if git(&["rev-parse", "--show-prefix"]).is_none_or(|prefix| !prefix.is_empty()) {
        return "unknown".to_owned();
    }
    let Some(hash) = git(&["rev-parse", "--short", "HEAD"]) else {
        return "unknown".to_owned();
    };

    // The reflog grows by a line with every commit and checkout; HEAD itself covers repositories without reflogs. The
    // index is left out on purpose: `git status` rewrites it, and each time everything would be compiled again.
    for name in ["HEAD", "logs/HEAD"] {
        // In a worktree these are outside the checkout; git knows where.
        watch(git(&["rev-parse", "--git-path", name]).as_deref());
    }
    for source in SOURCES {
        watch(Some(source));
    }
    let mut diff = vec!["diff", "--quiet", "HEAD", "--"];
    diff.extend(SOURCES);
    if git(&diff).is_some() {
        hash
    } else {
        format!("{hash}-dirty")
    }
}

/// Has Cargo run the script again when the file changes. A missing file would make it run every time.
fn watch(path: Option<&str>) {
    if let Some(path) = path.filter(|path| Path::new(path).exists()) {
        println!("cargo::rerun-if-changed={path}");
    }
}

/// What git prints, or nothing if there is no git or it refuses.
fn git(arguments: &[&str]) -> Option<String> {
    let output = Command::new("git").args(arguments).output().ok()?;
    output
        .status
        .success()
        .then(|| String::from_utf8_lossy(&output.stdout).trim().to_owned())
}
