//! Runs to an error: several films of different seeds, and their saved state.

use std::time::{Duration, Instant};

use super::{Reached, Run};
use crate::film::{Film, Picture};
use crate::pipeline::{Counters, Prepared, Renderer};
use crate::run::checkpoint::Saved;
use crate::run::goal::{Goal, Work};
use crate::run::halves::Halves;
use crate::run::record::Replicates;
use crate::run::{MOST_SPP, replicates};

impl Run {
    /// Resumes from the films and pictures of a run to an error.
    pub(in crate::run) fn resumed_replicates(prepared: Prepared, goal: Goal, saved: Saved, kept: Replicates) -> Self {
        let Saved { record, film, others } = saved;
        let mut run = Self::new(prepared, goal);
        let seed = run.prepared.settings().seed;
        let films = std::iter::once(film).chain(others.0).enumerate();
        let renderer = |(replicate, film): (usize, Film)| {
            let prepared = run.prepared.with_seed(replicates::seed(seed, replicate));
            Renderer::resumed(prepared, run.progress.clone(), film, Counters::default())
        };
        run.films = films.map(renderer).collect();
        run.levels = kept.levels;
        run.levels.resize(run.films.len(), 0);
        run.halves = match goal.work {
            Work::Error(asked, adaptive) => Some(Halves::resumed(asked, adaptive, kept.halves, others.1)),
            _ => None,
        };
        run.spent = record.counters;
        let Counters {
            samples,
            eye_rays,
            shadow_rays,
            ..
        } = record.counters;
        run.progress.add(samples, eye_rays + shadow_rays);
        run.render_time = Duration::try_from_secs_f64(record.render_s).unwrap_or_default();
        run.first_block_time = Some(Duration::ZERO);
        run.expect_replicates();
        run
    }

    /// Expects the work up to the next look, and the samples of films that were discarded on the way.
    fn expect_replicates(&self) {
        let film = self.prepared.settings().film;
        let pixels = u64::from(film.width) * u64::from(film.height);
        let ahead = self.halves.as_ref().map_or(0, Halves::samples).min(MOST_SPP.into());
        let held: u64 = self.films.iter().map(|film| film.film().spread().1).sum();
        let discarded = self.counters().samples.saturating_sub(held);
        self.progress.expect(ahead * pixels + discarded);
    }

    /// The saved state of a run: its replicates, films, and pictures.
    pub(in crate::run) fn kept(&self) -> (Option<Replicates>, Vec<&Film>, Vec<&Picture>) {
        let films = self.films.iter().map(Renderer::film).collect();
        let Some((halves, pictures)) = self.halves.as_ref().map(Halves::state) else {
            return (None, films, Vec::new());
        };
        let levels = self.levels.clone();
        (Some(Replicates { levels, halves }), films, pictures)
    }

    /// Pictures of the replicates so far, leaving out those with less than half of the maximum passes. The plain mean of the others
    /// is a picture, and their spread estimates its error without bias even if their passes differ.
    pub(super) fn comparable(&self) -> Vec<Picture> {
        let latest = self.halves.as_ref().filter(|_| self.goal.is_adaptive());
        let latest = latest.map(Halves::latest).unwrap_or_default();
        if !latest.is_empty() {
            return latest;
        }
        let most = self.films.iter().map(Renderer::passes).max().unwrap_or(0);
        let films = self.films.iter().filter(|film| film.passes() * 2 >= most);
        let films = films.take(if self.goal.is_adaptive() { 1 } else { usize::MAX });
        films.map(|film| film.film().picture()).collect()
    }

    /// Renders the next picture that the halves want, and lets them decide once they have all. Returns whether this was the last step.
    pub(super) fn step_replicates(
        &mut self,
        asked: f64,
        adaptive: bool,
        pause: Option<Instant>,
        started: Instant,
    ) -> bool {
        let Some(halves) = &mut self.halves else {
            return true;
        };
        if let Some(&(replicate, wanted)) = halves.wanted().first() {
            let seed = self.prepared.settings().seed;
            let empty = |replicate| {
                let prepared = self.prepared.with_seed(replicates::seed(seed, replicate));
                Renderer::new(prepared, self.progress.clone(), 0)
            };
            while self.films.len() <= replicate {
                self.films.push(empty(self.films.len()));
                self.levels.push(0);
            }
            let (film, level) = (&mut self.films[replicate], &mut self.levels[replicate]);
            let there = if adaptive {
                if *level != wanted && *level > 0 {
                    self.spent += film.counters();
                    *film = empty(replicate);
                }
                *level = wanted;
                !film.adaptive_block(wanted, pause)
            } else {
                film.passes() >= wanted || film.block(wanted, pause) >= wanted
            };
            if there && !self.progress.stop_requested() {
                halves.take(replicate, wanted, film.film().picture());
            }
            if !halves.wanted().is_empty() {
                return self.time_is_over(started) && self.passes() > 0;
            }
        }
        let done = halves.decide();
        let (samples, error) = (halves.samples(), halves.error());
        let reached = |error| Reached {
            asked,
            error,
            early: false,
        };
        self.reached = error.map(reached).or(self.reached);
        self.expect_replicates();
        done || samples > MOST_SPP.into() || self.time_is_over(started)
    }

    /// For a run that ended before its halves had an error: computes the picture so far, and its error.
    pub(super) fn sum_up(&mut self) {
        if let Work::Error(asked, _) = self.goal.work
            && self.halves.as_ref().is_some_and(|halves| halves.error().is_none())
        {
            let pictures = self.comparable();
            if pictures.len() > 1 {
                let error = replicates::error(&pictures).error;
                let early = true;
                self.reached = Some(Reached { asked, error, early });
            }
            self.interim = Some(replicates::mean(&pictures));
        }
    }
}
