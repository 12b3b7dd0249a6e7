//! Build information of this binary.

use std::sync::LazyLock;

/// The version in `Cargo.toml`.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");

/// The commit, found by the build script.
pub const COMMIT: &str = or_unknown(option_env!("OCTOLUX_COMMIT"));

/// The processor features enabled at compile time, from the build script.
pub const TARGET_FEATURES: &str = or_unknown(option_env!("OCTOLUX_TARGET_FEATURES"));

/// What `--version` prints after the name.
pub static VERSION_LINE: LazyLock<String> = LazyLock::new(|| format!("{VERSION} (commit {COMMIT}, {TARGET_FEATURES})"));

const fn or_unknown(value: Option<&'static str>) -> &'static str {
    match value {
        Some(value) => value,
        None => "unknown",
    }
}
