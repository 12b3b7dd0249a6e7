//! Schedules several pictures of one command: small ones in parallel, large ones one after another.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError, RwLock};
use std::time::Instant;

use super::done::Done;
use super::interrupt::Interrupt;
use super::overall::TotalProgress;
use super::picture::{Job, Outcome};
use super::progress::{Bar, clock};
use super::request::Request;
use super::{Exit, report};
use octolux::scene::Scene;
use octolux::study::verify::sanity::plural;

/// Maximum samples of a small picture, some five seconds of one core. Each small picture uses one thread, as many at once as
/// there are threads, so no thread waits for another one or for a file. Larger pictures use all threads, one after another.
const SMALL: u64 = 1 << 27;

/// Maximum pixels of a small picture, so that parallel pictures do not take more memory than a large one.
const SMALL_PIXELS: u64 = 1 << 21;

/// How the pictures are rendered.
pub struct BatchScheduler<'a> {
    /// The name on the bar.
    pub name: &'static str,
    pub threads: usize,
    pub quiet: bool,
    pub interrupt: &'a Interrupt,
    /// The record of finished pictures, and whether to render them again.
    pub done: Option<Done>,
    pub again: bool,
}

impl BatchScheduler<'_> {
    /// Renders all requests; the errors of each picture are reported as they occur.
    pub fn render(self, mut requests: Vec<Request>) -> Exit {
        let Self {
            name,
            threads,
            quiet,
            interrupt,
            done,
            again,
        } = self;
        let sizes: Vec<Size> = requests.iter().map(Size::of).collect();
        for (one, size) in requests.iter_mut().zip(&sizes) {
            one.options.threads = Some(if size.is_small() { 1 } else { threads });
        }
        let total = sizes.iter().map(|size| size.samples).sum();
        let overall = Arc::new(TotalProgress::new(done, again, total));
        let finished = Arc::new(AtomicUsize::new(0));
        let bar = bar(name, &overall, &finished, requests.len(), quiet);
        let (next, exit, room) = (AtomicUsize::new(0), Mutex::new(Exit::Well), RwLock::new(()));
        let (failed, started) = (AtomicUsize::new(0), Instant::now());
        let work = || {
            loop {
                let at = next.fetch_add(1, Ordering::Relaxed);
                let Some((request, size)) = requests.get(at).zip(sizes.get(at)).filter(|_| !interrupt.asked()) else {
                    return;
                };
                // Small pictures share the lock, a large one takes it exclusively.
                let (_together, _alone) = if size.is_small() {
                    (Some(room.read()), None)
                } else {
                    (None, Some(room.write()))
                };
                let job = Job {
                    request,
                    interrupt,
                    overall: Some(&overall),
                };
                let Outcome { began, errors } = job.run();
                if !began {
                    overall.forget(size.samples);
                }
                failed.fetch_add(usize::from(!errors.is_empty()), Ordering::Relaxed);
                let mut exit = exit.lock().unwrap_or_else(PoisonError::into_inner);
                for error in errors {
                    report::error(&error);
                    *exit = exit.and(error.exit());
                }
                finished.fetch_add(1, Ordering::Relaxed);
            }
        };
        std::thread::scope(|scope| (0..threads).for_each(|_| _ = scope.spawn(work)));
        drop(bar);
        if overall.is_batch() && !quiet {
            let [finished, failed] = [&finished, &failed].map(|count| count.load(Ordering::Relaxed));
            let rendered = finished.saturating_sub(failed + overall.there());
            let counts = [
                (overall.there(), "there already"),
                (failed, "failed"),
                (requests.len() - finished, "not begun"),
            ];
            let counts = counts.into_iter().filter(|(count, _)| *count > 0);
            let counts: String = counts.map(|(count, what)| format!(", {count} {what}")).collect();
            let seconds = started.elapsed().as_secs_f64();
            report::print(&format!(
                "{name}: {rendered} of {} rendered{counts}, {seconds:.1} s\n",
                plural(requests.len(), "picture")
            ));
        }
        let exit = exit.into_inner().unwrap_or_else(PoisonError::into_inner);
        if interrupt.asked() { Exit::Interrupted } else { exit }
    }
}

/// The amount of work of a picture.
#[derive(Clone, Copy, Debug, Default)]
struct Size {
    pixels: u64,
    samples: u64,
    /// Whether a time or an error ends it instead of samples.
    open_ended: bool,
}

impl Size {
    /// From the head of its scene; defaults if that cannot be read, which is reported later. What comes through a pipe can be read
    /// only once, and is left to the loader.
    fn of(request: &Request) -> Self {
        let outline = request.scene.is_file().then(|| Scene::outline(&request.scene));
        let Some(Ok((film, render))) = outline else {
            return Self::default();
        };
        let film = request.film(film);
        let pixels = u64::from(film.width) * u64::from(film.height);
        let samples = pixels * u64::from(request.samples(render.spp));
        let open_ended = request.options.time.is_some() || request.options.target_error.is_some();
        Self {
            pixels,
            samples,
            open_ended,
        }
    }

    fn is_small(self) -> bool {
        !self.open_ended && self.samples <= SMALL && self.pixels <= SMALL_PIXELS
    }
}

/// Shows finished pictures, and the remaining time at the average speed.
fn bar(name: &str, overall: &Arc<TotalProgress>, finished: &Arc<AtomicUsize>, pictures: usize, quiet: bool) -> Bar {
    let (overall, finished, started) = (overall.clone(), finished.clone(), Instant::now());
    Bar::watch(name, quiet, move || {
        let (done, total) = (overall.samples() as f64, overall.total() as f64);
        let share = if total > 0.0 { (done / total).min(1.0) } else { 0.0 };
        let left = (share > 0.0).then(|| started.elapsed().as_secs_f64() * (1.0 - share) / share);
        let left = left.map(|left| format!(", {} left", clock(left))).unwrap_or_default();
        let count = finished.load(Ordering::Relaxed);
        (
            share,
            format!("{:.0} %, {count}/{pictures} pictures{left}", share * 100.0),
        )
    })
}
