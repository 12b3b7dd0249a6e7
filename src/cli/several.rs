//! Several pictures of one command: small ones side by side, large ones one by one.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError, RwLock};
use std::time::Instant;

use super::done::Done;
use super::interrupt::Interrupt;
use super::overall::TotalProgress;
use super::picture::Job;
use super::progress::{Bar, clock};
use super::request::Request;
use super::{Exit, report};
use octolux::scene::Scene;

/// Pictures up to so many samples, some five seconds of one core, are rendered by one thread each, as many at once as there
/// are threads: then no thread waits for another one, nor for a file. Beyond, all threads are for one picture.
const SMALL: u64 = 1 << 27;

/// So that pictures side by side do not take more memory than a large one.
const SMALL_PIXELS: u64 = 1 << 21;

/// How the pictures are rendered.
pub struct BatchScheduler<'a> {
    /// What the bar calls them.
    pub name: &'static str,
    pub threads: usize,
    pub quiet: bool,
    pub interrupt: &'a Interrupt,
    /// Where is noted what is done, and whether to do it again.
    pub done: Option<Done>,
    pub again: bool,
}

impl BatchScheduler<'_> {
    /// Renders what is wanted; the errors of each picture are told as they come.
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
                // Small pictures go together, a large one goes alone.
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
                let before = overall.begun();
                let errors = job.run();
                if !errors.is_empty() || overall.begun() == before {
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
                "{name}: {rendered} of {} pictures rendered{counts}, {seconds:.1} s\n",
                requests.len()
            ));
        }
        let exit = exit.into_inner().unwrap_or_else(PoisonError::into_inner);
        if interrupt.asked() { Exit::Interrupted } else { exit }
    }
}

/// How much work a picture is.
#[derive(Clone, Copy, Debug, Default)]
struct Size {
    pixels: u64,
    samples: u64,
    /// Something else than samples ends it: a time, an error.
    open_ended: bool,
}

impl Size {
    /// By the head of its scene; nothing where that cannot be read, which its turn will tell.
    fn of(request: &Request) -> Self {
        let Ok((film, render)) = Scene::outline(&request.scene) else {
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

/// Pictures that are finished, and the time that the samples of all others will take at the speed so far.
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
