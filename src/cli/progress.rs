//! The progress bar: passes, rays per second and the time left, on a terminal.

use std::io::{self, IsTerminal};
use std::sync::mpsc::{self, RecvTimeoutError, Sender};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use super::report;
use octolux::run::Run;

const TICK: Duration = Duration::from_millis(100);

/// Resolution of the bar: indicatif counts integers, while a time limit is continuous.
const STEPS: f64 = 10_000.0;

/// A bar that updates itself until it is dropped; nothing if standard error is no terminal.
pub struct Bar(Option<(Sender<()>, JoinHandle<()>)>);

impl Bar {
    /// Starts a bar for a run.
    pub fn start(name: &str, run: &Run, quiet: bool) -> Self {
        let started = Instant::now();
        let progress = run.progress().clone();
        let before = [progress.samples(), progress.rays()];
        let film = run.prepared().settings().film;
        let pixels = u64::from(film.width) * u64::from(film.height);
        let time = run.goal().time_limit().map(|time| time.as_secs_f64());
        Self::watch(name, quiet, move || {
            let goal = match time {
                Some(seconds) => Goal::Seconds(seconds),
                None => Goal::Passes((progress.expected() / pixels) as u32),
            };
            let now = Counts {
                samples: progress.samples(),
                resumed: before[0],
                rays: progress.rays() - before[1],
                seconds: started.elapsed().as_secs_f64(),
            };
            let share = now.share(goal, pixels);
            (share, now.message(goal, pixels, share))
        })
    }

    /// No bar.
    pub fn none() -> Self {
        Self(None)
    }

    /// Repeatedly shows the result of `look`: the finished share, and a text.
    pub fn watch(name: &str, quiet: bool, look: impl Fn() -> (f64, String) + Send + 'static) -> Self {
        if quiet || !io::stderr().is_terminal() {
            return Self(None);
        }
        let bar = ProgressBar::with_draw_target(Some(STEPS as u64), ProgressDrawTarget::stderr_with_hz(20));
        let blocks = if report::unicode() {
            "█▉▊▋▌▍▎▏ "
        } else {
            "##-"
        };
        if let Ok(style) = ProgressStyle::with_template("{prefix} [{wide_bar}] {msg}") {
            bar.set_style(style.progress_chars(blocks));
        }
        bar.set_prefix(name.to_owned());
        report::above(Some(bar.clone()));
        // A separate thread, because a block of passes can take minutes.
        let (stop, stopped) = mpsc::channel();
        let ticker = thread::spawn(move || {
            while stopped.recv_timeout(TICK) == Err(RecvTimeoutError::Timeout) {
                let (share, message) = look();
                bar.set_position((share * STEPS) as u64);
                bar.set_message(message);
            }
            report::above(None);
            bar.finish_and_clear();
        });
        Self(Some((stop, ticker)))
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        if let Some((stop, ticker)) = self.0.take() {
            drop(stop);
            let _ = ticker.join();
        }
    }
}

/// The goal that the bar shows.
#[derive(Clone, Copy)]
enum Goal {
    Passes(u32),
    Seconds(f64),
}

/// The counts at one moment.
struct Counts {
    samples: u64,
    /// Samples from before the run was resumed.
    resumed: u64,
    rays: u64,
    seconds: f64,
}

impl Counts {
    fn share(&self, goal: Goal, pixels: u64) -> f64 {
        let share = match goal {
            Goal::Passes(passes) => self.samples as f64 / (pixels as f64 * f64::from(passes)),
            Goal::Seconds(seconds) => self.seconds / seconds,
        };
        share.min(1.0)
    }

    fn message(&self, goal: Goal, pixels: u64, share: f64) -> String {
        let passes = self.samples as f64 / pixels as f64;
        let spp = match goal {
            Goal::Passes(goal) => format!("{}/{goal} spp", passes as u64),
            Goal::Seconds(_) => format!("{} spp", passes as u64),
        };
        let rate = self.rays as f64 / self.seconds.max(1e-9) * 1e-6;
        let left = match goal {
            Goal::Seconds(goal) => Some(goal - self.seconds),
            // Too early for an estimate.
            Goal::Passes(_) => {
                let done = share * (self.samples - self.resumed) as f64 / (self.samples as f64).max(1.0);
                (done > 0.0).then(|| self.seconds * (1.0 - share) / done)
            }
        };
        let left = left
            .map(|left| format!(", {} left", clock(left.max(0.0))))
            .unwrap_or_default();
        format!("{:.0} %, {spp}, {rate:.1} Mrays/s{left}", share * 100.0)
    }
}

/// `7 s`, `3:05` or `2:03:05`.
pub fn clock(seconds: f64) -> String {
    let whole = seconds.ceil() as u64;
    let (hours, minutes, rest) = (whole / 3600, whole / 60 % 60, whole % 60);
    match (hours, minutes) {
        (0, 0) => format!("{rest} s"),
        (0, _) => format!("{minutes}:{rest:02}"),
        _ => format!("{hours}:{minutes:02}:{rest:02}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_message_tells_passes_speed_and_time() {
        let now = Counts {
            samples: 2_500,
            resumed: 0,
            rays: 8_000_000,
            seconds: 2.0,
        };
        let goal = Goal::Passes(100);
        let share = now.share(goal, 100);
        assert_eq!(now.message(goal, 100, share), "25 %, 25/100 spp, 4.0 Mrays/s, 6 s left");
        assert_eq!(
            now.message(Goal::Seconds(100.0), 100, 0.02),
            "2 %, 25 spp, 4.0 Mrays/s, 1:38 left"
        );
        assert_eq!(clock(7384.2), "2:03:05");
    }
}
