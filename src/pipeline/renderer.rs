//! The film of one seed during rendering, block by block. [`crate::run`] decides when it ends.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use rayon::prelude::*;

use super::job::Job;
use super::outlook::{self, SPLIT_FROM};
use super::prepared::Prepared;
use super::progress::{Counters, Progress};
use super::settings::Settings;
use crate::film::allocation::{self, Kind};
use crate::film::{Film, Tile, leaf_passes};
use crate::sampling::PassBlock;
use crate::scene::FilmSize;

/// A film during rendering.
#[derive(Debug)]
pub(crate) struct Renderer {
    prepared: Prepared,
    film: Film,
    progress: Arc<Progress>,
    counters: Counters,
    passes: u32,
    /// The random numbers of the current block and its last pass. A paused block resumes with them.
    numbers: Option<(Arc<PassBlock>, u32)>,
    /// Computes the samples of every pixel from the relative variance of every pixel and the average samples per pixel.
    allocate: fn(FilmSize, &[f64], &[Kind], u32) -> Vec<u32>,
    /// Maximum samples of any pixel, once samples are allocated.
    most: Option<u32>,
}

/// Maximum passes per block; limits the memory of the tables of random numbers.
const MOST_PASSES: u32 = 4096;

impl Renderer {
    /// An empty film that begins at pass `first`, which is the start of a leaf.
    pub fn new(prepared: Prepared, progress: Arc<Progress>, first: u32) -> Self {
        let mut film = Film::new(prepared.settings.film);
        film.begin_at(first);
        Self {
            prepared,
            film,
            progress,
            counters: Counters::default(),
            passes: first,
            numbers: None,
            allocate: allocation::allocate,
            most: None,
        }
    }

    /// Resumes from a film of the same render and its counters.
    pub fn resumed(prepared: Prepared, progress: Arc<Progress>, film: Film, counters: Counters) -> Self {
        progress.add(counters.samples, counters.eye_rays + counters.shadow_rays);
        Self {
            passes: film.passes().end,
            most: film.most_samples(),
            film,
            counters,
            ..Self::new(prepared, progress, 0)
        }
    }

    /// The film so far.
    pub fn film(&self) -> &Film {
        &self.film
    }

    /// Counts so far.
    pub fn counters(&self) -> Counters {
        self.counters
    }

    /// Passes so far. Every pixel took part in each, unless samples are allocated.
    pub fn passes(&self) -> u32 {
        self.passes
    }

    /// Number of passes after the next block. Blocks end at 1, 2, 4, 8, … passes up to the leaf size of the film, then at the ends
    /// of leaves. Block ends do not depend on the caller, so the bits of a picture do not depend on when it was read.
    pub fn next_stop(&self) -> u32 {
        let block = leaf_passes(self.prepared.settings.film);
        if self.passes < block {
            (self.passes * 2).max(1)
        } else {
            (self.passes / block + 1).saturating_mul(block)
        }
    }

    /// Renders up to `min(limit, next_stop())` passes, until a stop is requested, or until `pause`. Returns the number of passes
    /// that every pixel then has. Renders at least one tile, unless a stop is requested or nothing is left. Finished tiles keep
    /// their passes: each pixel is divided by its own pass count, and the next call resumes where this one ended.
    pub fn block(&mut self, limit: u32, pause: Option<Instant>) -> u32 {
        let (first, end) = (self.passes, self.next_stop().min(limit));
        if first < end {
            self.render(first, end, pause);
        }
        self.passes
    }

    /// Renders the next part of an adaptive render with `spp` samples per pixel on average: first pilot passes, then the allocated
    /// samples of each pixel (see [`allocation`]). Returns whether more remains. The picture is unbiased after every part. `spp`
    /// must be the same in all calls, and [`Self::block`] must not be called in between.
    ///
    /// Pilot blocks double the passes. Each later block has up to three times the samples of all blocks before it. Blocks are few
    /// and large because every block leaves one partly filled chunk per tile.
    pub fn adaptive_block(&mut self, spp: u32, pause: Option<Instant>) -> bool {
        let (first, pilot) = (self.passes, allocation::pilot(spp));
        let steered = pilot < spp;
        if first == 0 && steered && !self.film.measures_noise() {
            self.film.measure_noise();
        }
        if first == pilot && steered && self.most.is_none() {
            let size = self.prepared.settings.film;
            let kinds = outlook::kinds(&self.prepared);
            self.most = self.prepared.pool.install(|| {
                let goals = (self.allocate)(size, &self.film.noise(), &kinds, spp);
                self.film.set_goals(&goals);
                goals.into_iter().max()
            });
        }
        let last = self.most.unwrap_or(pilot);
        let end = match self.most {
            Some(_) => allocation::next_stop(self.film.tiles().iter().flat_map(Tile::goals).copied(), first),
            None => (first * 2).max(2),
        };
        let end = end.min(first + MOST_PASSES).min(last);
        if first < end {
            self.render(first, end, pause);
        }
        self.passes < last || (steered && self.most.is_none())
    }

    /// Renders the passes `first..end`, each for the pixels that take part.
    fn render(&mut self, first: u32, end: u32, pause: Option<Instant>) {
        let Prepared {
            settings,
            plan,
            world,
            pool,
            scratch,
            ..
        } = &self.prepared;
        let Settings {
            sampler,
            seed,
            film: size,
            ..
        } = *settings;
        let kept = self.numbers.take();
        let numbers = match kept.filter(|(numbers, last)| (numbers.first(), *last) == (first, end)) {
            Some((numbers, _)) => numbers,
            None => Arc::new(PassBlock::new(sampler, seed, first, end - first, plan.pairs)),
        };
        let job = Job {
            plan,
            world,
            numbers: &numbers,
            scratch,
            progress: &self.progress,
            partly: if end > SPLIT_FROM { self.prepared.partly() } else { None },
            film: size,
            passes: end - first,
            pause,
            begun: AtomicBool::new(false),
        };
        let tiles = self.film.tiles_mut();
        let counters = pool.install(|| tiles.par_iter_mut().map(|tile| job.render(tile)).collect::<Vec<_>>());
        counters.into_iter().for_each(|c| self.counters += c);
        self.passes = self.film.passes().end;
        self.numbers = (self.passes < end).then_some((numbers, end));
    }
}

#[cfg(test)]
mod tests;
