//! The observer of commands with a time budget.

use std::io::{self, IsTerminal};
use std::sync::Arc;
use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use super::interrupt::Interrupt;
use super::report;
use octolux::pipeline::Progress;
use octolux::run::Observer;

/// The progress bar and ctrl-c.
pub struct BudgetBar {
    interrupt: Interrupt,
    bar: ProgressBar,
}

impl BudgetBar {
    /// Starts the bar of the command `name`; draws nothing if standard error is no terminal.
    pub fn new(name: &str, interrupt: Interrupt, quiet: bool) -> Self {
        let bar = if quiet || !io::stderr().is_terminal() {
            ProgressBar::hidden()
        } else {
            ProgressBar::with_draw_target(Some(1000), ProgressDrawTarget::stderr_with_hz(20))
        };
        let blocks = if report::unicode() {
            "█▉▊▋▌▍▎▏ "
        } else {
            "##-"
        };
        if let Ok(style) = ProgressStyle::with_template("{prefix} [{wide_bar}] {elapsed}, {msg}") {
            bar.set_style(style.progress_chars(blocks));
        }
        bar.set_prefix(name.to_owned());
        bar.enable_steady_tick(Duration::from_millis(200));
        Self { interrupt, bar }
    }

    /// Removes the bar.
    pub fn clear(&self) {
        self.bar.finish_and_clear();
    }
}

impl Observer for BudgetBar {
    fn begins(&self, progress: &Arc<Progress>) {
        self.interrupt.watch(progress.clone());
    }

    fn stopped(&self) -> bool {
        self.interrupt.asked()
    }

    fn doing(&self, share: f64, what: &str) {
        self.bar.set_position((share * 1000.0) as u64);
        self.bar.set_message(what.to_owned());
    }
}
