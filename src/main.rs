//! The `octolux` command.

mod cli;

use std::process::ExitCode;

fn main() -> ExitCode {
    if !octolux::cpu::suffices() {
        return ExitCode::from(2);
    }
    run()
}

/// Separate from `main`, so that none of its code, which may use AVX2 from the first instruction, runs before the check.
#[inline(never)]
fn run() -> ExitCode {
    cli::main()
}
