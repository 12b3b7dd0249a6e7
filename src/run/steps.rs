//! One render, step by step.

mod replicated;

use std::sync::Arc;
use std::time::{Duration, Instant};

use super::MOST_SPP;
use super::goal::{self, Goal, Work};
use super::halves::Halves;
use super::replicates;
use crate::embree::EmbreeError;
use crate::film::{Film, Picture};
use crate::pipeline::{Counters, Prepared, Progress, Renderer};

/// The result of a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[must_use = "a run that is not asked whether there is more never ends"]
pub enum Step {
    /// There is more to do.
    More,
    /// The goal is reached; further steps do nothing.
    Done,
    /// A stop was requested before, or a query [failed](Run::failure); further steps do nothing.
    Stopped,
}

impl Step {
    /// Whether there is more to do.
    pub fn is_more(self) -> bool {
        self == Self::More
    }
}

/// A target error and the outcome.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reached {
    /// The target error.
    pub asked: f64,
    /// The error measured at the last look, or at the end.
    pub error: f64,
    /// Whether the run ended before the error was certain: by its time limit, or by a stop.
    pub early: bool,
}

/// One render of a [`Prepared`] scene towards a [`Goal`]. The picture is unbiased after every step. None of its bits depend on
/// the division into steps, on threads or on lanes.
#[derive(Debug)]
pub struct Run {
    prepared: Prepared,
    goal: Goal,
    /// Samples of every pixel to extend to after the goal is reached.
    then: Option<u32>,
    /// One film per replicate; a single one unless an error is the goal.
    films: Vec<Renderer>,
    /// Samples per pixel of each film's adaptive render to an error; 0 in other renders.
    levels: Vec<u32>,
    /// Ray counts of films that were discarded.
    spent: Counters,
    /// The mean of the replicates so far, if the run ended before its halves had an error.
    interim: Option<Picture>,
    progress: Arc<Progress>,
    /// The first pass.
    first: u32,
    /// The stopping rule over replicates.
    halves: Option<Halves>,
    reached: Option<Reached>,
    ended: Option<Step>,
    render_time: Duration,
    /// Time until the first block was complete.
    first_block_time: Option<Duration>,
    /// Seconds of the current block, which may be paused.
    block_s: f64,
    /// Seconds per pass of the last block.
    pass_s: f64,
}

impl Run {
    pub(super) fn new(prepared: Prepared, goal: Goal) -> Self {
        let progress = Arc::<Progress>::default();
        let first = goal.range(prepared.settings().film).start;
        let film = Renderer::new(prepared.clone(), progress.clone(), first);
        Self::with_film(prepared, goal, film, progress)
    }

    /// Resumes from a film, with its ray counts and render time.
    pub(super) fn resumed(prepared: Prepared, goal: Goal, film: Film, counters: Counters, render_s: f64) -> Self {
        let progress = Arc::<Progress>::default();
        let film = Renderer::resumed(prepared.clone(), progress.clone(), film, counters);
        Self {
            render_time: Duration::try_from_secs_f64(render_s).unwrap_or_default(),
            first_block_time: Some(Duration::ZERO),
            ..Self::with_film(prepared, goal, film, progress)
        }
    }

    fn with_film(prepared: Prepared, goal: Goal, film: Renderer, progress: Arc<Progress>) -> Self {
        let run = Self {
            first: goal.range(prepared.settings().film).start,
            films: vec![film],
            levels: vec![0],
            spent: Counters::default(),
            interim: None,
            progress,
            halves: match goal.work {
                Work::Error(asked, adaptive) => Some(Halves::new(asked, adaptive)),
                _ => None,
            },
            reached: None,
            ended: None,
            render_time: Duration::ZERO,
            first_block_time: None,
            block_s: 0.0,
            pass_s: 0.0,
            prepared,
            goal,
            then: None,
        };
        run.expect(match goal.work {
            Work::Error(..) => run.halves.as_ref().map_or(0, Halves::samples),
            _ => goal.spp().map_or(0, |_| run.passes_wanted().into()),
        });
        run
    }

    /// Renders the next block: up to 1, 2, 4, 8, … samples per pixel and then leaf by leaf.
    pub fn step(&mut self) -> Step {
        self.step_until(None)
    }

    /// Like [`Self::step`], but pauses between two tiles at the given time. At least one tile is rendered, so repeated steps
    /// terminate.
    pub fn step_until(&mut self, pause: Option<Instant>) -> Step {
        if let Some(ended) = self.ended {
            return ended;
        }
        if !self.progress.stop_requested() {
            let started = Instant::now();
            let done = match self.goal.work {
                Work::Passes(..) => self.step_passes(pause, started),
                Work::Adaptive(spp) => self.step_adaptive(spp, pause, started),
                Work::Error(asked, adaptive) => self.step_replicates(asked, adaptive, pause, started),
            };
            self.render_time += started.elapsed();
            if self.passes() > self.first {
                self.first_block_time.get_or_insert(self.render_time);
            }
            if done && self.failure().is_none() {
                match self.then.take() {
                    Some(spp) => self.extend(spp),
                    None => return self.end(Step::Done),
                }
            }
        }
        if self.progress.stop_requested() || self.failure().is_some() {
            return self.end(Step::Stopped);
        }
        Step::More
    }

    /// Extends the goal to more samples of every pixel. Has no effect on a run that was stopped, is adaptive, or has an error
    /// as its goal.
    pub fn extend(&mut self, spp: u32) {
        if let Work::Passes(had, None) = self.goal.work
            && spp > had
        {
            self.goal.work = Work::Passes(spp.min(MOST_SPP), None);
            self.ended = self.ended.filter(|&ended| ended == Step::Stopped);
            self.expect(self.passes_wanted().into());
        }
    }

    /// The same, to be extended to more samples of every pixel after the goal.
    pub(super) fn going_on_to(mut self, spp: Option<u32>) -> Self {
        self.then = spp;
        if let Some(spp) = spp {
            self.expect(spp.into());
        }
        self
    }

    /// The prepared scene.
    pub fn prepared(&self) -> &Prepared {
        &self.prepared
    }

    /// The goal.
    pub fn goal(&self) -> &Goal {
        &self.goal
    }

    /// Counts and stop requests, usable from any thread.
    pub fn progress(&self) -> &Arc<Progress> {
        &self.progress
    }

    /// Ends the run at the next tiles, from any thread: see [`Progress::request_stop`].
    pub fn stop(&self) {
        self.progress.request_stop();
    }

    /// Embree's error of the first failed query, if any: then the picture is wrong, and the run has ended.
    pub fn failure(&self) -> Option<&EmbreeError> {
        self.progress.failure()
    }

    /// Whether the goal was reached.
    pub fn is_complete(&self) -> bool {
        self.ended == Some(Step::Done)
    }

    /// The picture so far: the mean of all replicates, or of both halves of them once these have ended.
    pub fn picture(&self) -> Picture {
        if let Some(reached) = self.halves.as_ref().and_then(Halves::picture) {
            return reached;
        }
        match (&self.interim, self.halves.is_some()) {
            (Some(interim), _) => interim.clone(),
            (None, true) => replicates::mean(&self.comparable()),
            (None, false) => self.films[0].film().picture(),
        }
    }

    /// The sums of the first replicate, the only one unless an error is the goal.
    pub fn film(&self) -> &Film {
        self.films[0].film()
    }

    /// Passes of the first replicate: samples of every pixel, unless adaptive. A shard begins at its first pass.
    pub fn passes(&self) -> u32 {
        self.films[0].passes()
    }

    /// Passes rendered, including those of a resumed run.
    pub fn passes_done(&self) -> u32 {
        self.passes() - self.first
    }

    /// Samples of each pixel so far, row by row, in all replicates.
    pub fn samples(&self) -> Vec<u32> {
        let (first, others) = (&self.films[0], &self.films[1..]);
        let mut samples = first.film().samples();
        for other in others {
            samples
                .iter_mut()
                .zip(other.film().samples())
                .for_each(|(sum, n)| *sum += n);
        }
        samples
    }

    /// Minimum, total and maximum samples of the pixels, over all replicates.
    pub fn spread(&self) -> (u32, u64, u32) {
        let each = self.films.iter().map(|film| film.film().spread());
        each.fold((0, 0, 0), |sum, one| (sum.0 + one.0, sum.1 + one.1, sum.2 + one.2))
    }

    /// Ray counts so far.
    pub fn counters(&self) -> Counters {
        self.films.iter().fold(self.spent, |mut sum, film| {
            sum += film.counters();
            sum
        })
    }

    /// Number of films with different seeds.
    pub fn replicates(&self) -> usize {
        let begun = self.films.iter().filter(|film| film.passes() > 0).count();
        begun.max(1)
    }

    /// The error at the last look, if an error is the goal and there was a look.
    pub fn reached(&self) -> Option<Reached> {
        self.reached
    }

    /// Time spent rendering, including a resumed run.
    pub fn render_time(&self) -> Duration {
        self.render_time
    }

    /// The part of it for the first block: one pass, or two if adaptive.
    pub fn first_block_time(&self) -> Duration {
        self.first_block_time.unwrap_or_default()
    }

    fn passes_wanted(&self) -> u32 {
        let range = self.goal.range(self.prepared.settings().film);
        range.end - range.start
    }

    fn expect(&self, spp: u64) {
        let film = self.prepared.settings().film;
        self.progress
            .expect(spp * u64::from(film.width) * u64::from(film.height));
    }

    /// Seconds rendered by now.
    fn spent(&self, started: Instant) -> f64 {
        (self.render_time + started.elapsed()).as_secs_f64()
    }

    fn time_is_over(&self, started: Instant) -> bool {
        let limit = self.goal.time.map(|time| time.as_secs_f64());
        limit.is_some_and(|limit| self.spent(started) >= limit)
    }

    /// Renders the next block, or the part of it until `pause`. Returns whether this was the last step.
    fn step_passes(&mut self, pause: Option<Instant>, started: Instant) -> bool {
        let end = self.goal.range(self.prepared.settings().film).end;
        let time = self.goal.time.map(|time| time.as_secs_f64());
        let (before, stop) = (self.passes(), self.films[0].next_stop());
        let Some(limit) = goal::limit(end, time, before, self.spent(started), self.pass_s) else {
            return true;
        };
        let after = self.films[0].block(limit, pause);
        self.block_s += started.elapsed().as_secs_f64();
        if after > before {
            self.pass_s = self.block_s / f64::from(after - before);
            self.block_s = 0.0;
        }
        // A shortened block has to be the last: sums only agree between runs if their blocks end at the same passes.
        let cut = after == limit && limit < stop;
        cut || goal::limit(end, time, after, self.spent(started), self.pass_s).is_none()
    }

    fn step_adaptive(&mut self, spp: u32, pause: Option<Instant>, started: Instant) -> bool {
        let more = self.films[0].adaptive_block(spp, pause);
        !more || (self.passes() > 0 && self.time_is_over(started))
    }

    fn end(&mut self, step: Step) -> Step {
        self.sum_up();
        self.ended = Some(step);
        step
    }
}
