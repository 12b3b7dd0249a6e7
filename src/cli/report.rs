//! Output on standard error: errors with the lines of the scene in question, warnings and notes.
//!
//! Colours only on a terminal and without `NO_COLOR`; box-drawing characters only on a UTF-8 terminal, so a log file stays
//! plain ASCII around the scene's own text.

use std::fmt;
use std::io::{self, IsTerminal, Write};
use std::sync::{Mutex, PoisonError};

use indicatif::ProgressBar;
use miette::{
    Diagnostic, GraphicalReportHandler, GraphicalTheme, LabeledSpan, NamedSource, SourceCode, ThemeCharacters,
    ThemeStyles,
};

use super::CliError;
use super::error::Quote;

/// `error: ...`, the lines in question, `help: ...`.
pub fn error(error: &CliError) {
    let mut text = format!("{} {error}\n", styled("error:", "1;31"));
    if let Some(quote) = error.quote() {
        text.push_str(&snippet(quote));
    }
    if let Some(help) = error.help() {
        text.push_str(&format!("{} {help}\n", styled("help:", "1;36")));
    }
    print(&text);
}

/// `warning: ...`
pub fn warning(what: &str) {
    print(&format!("{} {what}\n", styled("warning:", "1;33")));
}

/// `note: ...`
pub fn note(what: &str) {
    print(&format!("{} {what}\n", styled("note:", "1")));
}

/// The bar on standard error, if any: lines are printed above it.
static BAR: Mutex<Option<ProgressBar>> = Mutex::new(None);

/// Prints all further lines above this bar; `None` after it is gone.
pub fn above(bar: Option<ProgressBar>) {
    *BAR.lock().unwrap_or_else(PoisonError::into_inner) = bar;
}

/// Writes with the bar suspended.
fn beside_the_bar<R>(write: impl FnOnce() -> R) -> R {
    match &*BAR.lock().unwrap_or_else(PoisonError::into_inner) {
        Some(bar) => bar.suspend(write),
        None => write(),
    }
}

/// Prints text. A closed standard error is no reason to stop a render.
pub fn print(text: &str) {
    let _ = beside_the_bar(|| io::stderr().write_all(text.as_bytes()));
}

/// Prints one line of data on standard output. Ignores a closed pipe (`octolux ... | head`).
///
/// # Errors
/// All other errors of standard output, such as a full disk.
pub fn data(line: &str) -> Result<(), CliError> {
    let write = || {
        let mut out = io::stdout().lock();
        out.write_all(line.as_bytes())?;
        out.write_all(b"\n")?;
        out.flush()
    };
    match beside_the_bar(write) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            Err(CliError::failed(format!("standard output: {error}")))
        }
        _ => Ok(()),
    }
}

fn colours() -> bool {
    // https://no-color.org: any nonempty value.
    io::stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty())
}

fn styled(words: &str, code: &str) -> String {
    if colours() {
        format!("\x1b[{code}m{words}\x1b[0m")
    } else {
        words.to_owned()
    }
}

/// Whether standard error can show characters beyond ASCII. The first of the three variables that is set decides, as in
/// setlocale(3).
pub fn unicode() -> bool {
    let locale = ["LC_ALL", "LC_CTYPE", "LANG"]
        .iter()
        .find_map(|name| std::env::var(name).ok().filter(|value| !value.is_empty()))
        .unwrap_or_default()
        .to_ascii_uppercase();
    io::stderr().is_terminal() && (locale.contains("UTF-8") || locale.contains("UTF8"))
}

/// The lines of source with the label below them.
fn snippet(quote: Quote) -> String {
    let (span, label) = quote.label;
    let place = Place {
        source: NamedSource::new(quote.name, quote.text),
        label: LabeledSpan::at(span, label),
    };
    let theme = GraphicalTheme {
        characters: if unicode() {
            ThemeCharacters::unicode()
        } else {
            ThemeCharacters::ascii()
        },
        styles: if colours() {
            ThemeStyles::ansi()
        } else {
            ThemeStyles::none()
        },
    };
    let handler = GraphicalReportHandler::new_themed(theme)
        .with_links(false)
        .with_context_lines(1)
        .with_width(120)
        .without_cause_chain();
    let mut text = String::new();
    if handler.render_report(&mut text, &place).is_err() {
        return String::new();
    }
    // The handler's first line is the message (empty here, because it was printed before).
    text.split_once('\n')
        .map(|(_, lines)| format!("{}\n", lines.trim_end()))
        .unwrap_or_default()
}

/// An error without its message: only its place.
#[derive(Debug)]
struct Place {
    source: NamedSource<String>,
    label: LabeledSpan,
}

impl fmt::Display for Place {
    fn fmt(&self, _: &mut fmt::Formatter<'_>) -> fmt::Result {
        Ok(())
    }
}

impl std::error::Error for Place {}

impl Diagnostic for Place {
    fn source_code(&self) -> Option<&dyn SourceCode> {
        Some(&self.source)
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        Some(Box::new(std::iter::once(self.label.clone())))
    }
}
