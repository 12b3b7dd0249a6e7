//! The `octolux` command.

fn main() -> std::process::ExitCode {
    octolux::cli::main()
}
