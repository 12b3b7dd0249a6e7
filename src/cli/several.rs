//! Several pictures of one command: small ones side by side, large ones one by one.

use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError, RwLock};
use std::time::Instant;

use super::done::Done;
use super::interrupt::Interrupt;
use super::outputs::Targets;
use super::picture::Job;
use super::progress::{Bar, clock};
use super::{CliError, Exit, options, render, report};
use crate::pipeline::Progress;
use crate::scene::Scene;

/// One picture to render.
#[derive(Debug)]
pub struct Wanted {
    /// As the command line of `render` would say it.
    pub args: render::Args,
    /// Its files.
    pub targets: Targets,
}

/// Pictures up to so many samples, some five seconds of one core, are rendered by one thread each, as many at once as there
/// are threads: then no thread waits for another one, nor for a file. Beyond, all threads are for one picture.
const SMALL: u64 = 1 << 27;

/// So that pictures side by side do not take more memory than a large one.
const SMALL_PIXELS: u64 = 1 << 21;

/// What the pictures share.
#[derive(Debug)]
pub struct Overall {
    done: Option<Done>,
    again: bool,
    /// Samples to render in all; pictures that are there, or fail, are taken off.
    total: AtomicU64,
    begun: Mutex<Vec<Arc<Progress>>>,
}

impl Overall {
    /// Has the samples of a render counted.
    pub fn watch(&self, progress: Arc<Progress>) {
        self.begun().push(progress);
    }

    /// Whether these files are there as they would be rendered.
    pub fn is_done(&self, key: &str, files: &[PathBuf]) -> bool {
        !self.again && self.done.as_ref().is_some_and(|done| done.holds(key, files))
    }

    /// Notes that they are.
    ///
    /// # Errors
    /// Notes that cannot be written.
    pub fn note(&self, key: String, files: &[PathBuf]) -> Result<(), CliError> {
        self.done.as_ref().map_or(Ok(()), |done| done.note(key, files))
    }

    fn begun(&self) -> std::sync::MutexGuard<'_, Vec<Arc<Progress>>> {
        self.begun.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn samples(&self) -> u64 {
        self.begun().iter().map(|progress| progress.samples()).sum()
    }
}

/// How the pictures are rendered.
pub struct Crowd<'a> {
    /// What the bar calls them.
    pub name: &'static str,
    pub threads: usize,
    pub quiet: bool,
    pub interrupt: &'a Interrupt,
    /// Where is noted what is done, and whether to do it again.
    pub done: Option<Done>,
    pub again: bool,
}

impl Crowd<'_> {
    /// Renders what is wanted; the errors of each picture are told as they come.
    pub fn render(self, mut wanted: Vec<Wanted>) -> Exit {
        let Self {
            name,
            threads,
            quiet,
            interrupt,
            done,
            again,
        } = self;
        let sizes: Vec<Size> = wanted.iter().map(Size::of).collect();
        for (one, size) in wanted.iter_mut().zip(&sizes) {
            one.args.options.threads = Some(if size.is_small() { 1 } else { threads });
        }
        let overall = Arc::new(Overall {
            done,
            again,
            total: AtomicU64::new(sizes.iter().map(|size| size.samples).sum()),
            begun: Mutex::default(),
        });
        let finished = Arc::new(AtomicUsize::new(0));
        let bar = bar(name, &overall, &finished, wanted.len(), quiet);
        let (next, exit, room) = (AtomicUsize::new(0), Mutex::new(Exit::Well), RwLock::new(()));
        let work = || {
            loop {
                let at = next.fetch_add(1, Ordering::Relaxed);
                let Some((one, size)) = wanted.get(at).zip(sizes.get(at)).filter(|_| !interrupt.asked()) else {
                    return;
                };
                // Small pictures go together, a large one goes alone.
                let (_together, _alone) = if size.is_small() {
                    (Some(room.read()), None)
                } else {
                    (None, Some(room.write()))
                };
                let job = Job {
                    path: &one.args.scenes[0],
                    targets: &one.targets,
                    args: &one.args,
                    interrupt,
                    overall: Some(&overall),
                };
                let before = overall.begun().len();
                let errors = job.run();
                if !errors.is_empty() || overall.begun().len() == before {
                    overall.total.fetch_sub(size.samples, Ordering::Relaxed);
                }
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
    fn of(one: &Wanted) -> Self {
        let render::Args {
            options, spp, scenes, ..
        } = &one.args;
        let Ok((film, render)) = Scene::outline(&scenes[0]) else {
            return Self::default();
        };
        let film = options.size.unwrap_or(film);
        let pixels = u64::from(film.width) * u64::from(film.height);
        let spp = spp.or(render.spp).unwrap_or(options::DEFAULT_SPP);
        let samples = pixels * u64::from(spp);
        let open_ended = one.args.time.is_some() || one.args.target_error.is_some();
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
fn bar(name: &str, overall: &Arc<Overall>, finished: &Arc<AtomicUsize>, pictures: usize, quiet: bool) -> Bar {
    let (overall, finished, started) = (overall.clone(), finished.clone(), Instant::now());
    Bar::watch(name, quiet, move || {
        let (done, total) = (overall.samples() as f64, overall.total.load(Ordering::Relaxed) as f64);
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
