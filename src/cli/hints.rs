//! Hints for options of other programs and for missing commands.

use clap::error::{ContextKind, ContextValue, ErrorKind};

/// Options of other renderers, and their names here.
const KNOWN_ELSEWHERE: [(&str, &str); 22] = [
    ("samples", "--spp N"),
    ("sample-count", "--spp N"),
    ("passes", "--spp N"),
    ("width", "--size WIDTHxHEIGHT"),
    ("height", "--size WIDTHxHEIGHT"),
    ("resolution", "--size WIDTHxHEIGHT"),
    ("res", "--size WIDTHxHEIGHT"),
    ("out", "-o FILE"),
    ("outfile", "-o FILE"),
    ("output-file", "-o FILE"),
    ("integrator", "--estimator NAME"),
    ("method", "--estimator NAME"),
    ("technique", "--estimator NAME"),
    ("seconds", "--time TIME"),
    ("timeout", "--time TIME"),
    ("budget", "--time TIME"),
    ("jobs", "--threads N"),
    ("nthreads", "--threads N"),
    ("cores", "--threads N"),
    ("noise", "--target-error E"),
    ("error", "--target-error E"),
    ("eye", "--origin X,Y,Z"),
];

/// Adds a hint to the error if the intention can be guessed.
pub fn with_hint(mut error: clap::Error) -> clap::Error {
    let said = |kind: ContextKind| match error.get(kind) {
        Some(ContextValue::String(text)) => text.clone(),
        _ => String::new(),
    };
    let hint = match error.kind() {
        ErrorKind::UnknownArgument => {
            let argument = said(ContextKind::InvalidArg);
            let name = argument.trim_start_matches('-').split('=').next().unwrap_or_default();
            let known = KNOWN_ELSEWHERE.iter().find(|(other, _)| *other == name);
            known.map(|(_, own)| format!("here it is '{own}'"))
        }
        ErrorKind::InvalidSubcommand => {
            let command = said(ContextKind::InvalidSubcommand);
            let scene = command.ends_with(".toml") || std::path::Path::new(&command).is_file();
            scene.then(|| format!("to render a scene: octolux render {command}"))
        }
        _ => None,
    };
    // clap's tip to write `-- -x` is about scenes whose names begin with a dash: hardly what was meant.
    if error.kind() == ErrorKind::UnknownArgument {
        error.remove(ContextKind::Suggested);
    }
    if let Some(hint) = hint {
        error.remove(ContextKind::SuggestedArg);
        error.remove(ContextKind::SuggestedSubcommand);
        error.insert(ContextKind::Suggested, ContextValue::StyledStrs(vec![hint.into()]));
    }
    error
}
