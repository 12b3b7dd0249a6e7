//! Renders one block of passes for all tiles, chunk by chunk, on the free threads.

use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use rayon::prelude::*;

use super::columns::CAPACITY;
use super::outlook::{Partly, SPLIT_FROM};
use super::plan::Plan;
use super::progress::{Counters, Progress};
use super::stage::{Chunk, Scratch};
use super::world::World;
use crate::film::{ChunkSum, Tile, leaf_passes};
use crate::sampling::PassBlock;
use crate::scene::FilmSize;

/// The inputs of a block besides its tiles.
pub struct Job<'a> {
    pub plan: &'a Plan,
    pub world: &'a World,
    pub numbers: &'a PassBlock,
    pub scratch: &'a Mutex<Vec<Scratch>>,
    pub progress: &'a Progress,
    /// Which lights each pixel sees partially, if the estimator uses it.
    pub partly: Option<&'a Partly>,
    pub film: FilmSize,
    pub passes: u32,
    /// No further tile starts after this time.
    pub pause: Option<Instant>,
    /// Whether a tile has started. One tile always renders, even after `pause`: otherwise a block whose random numbers take that
    /// long to generate would never finish.
    pub begun: AtomicBool,
}

impl Job<'_> {
    /// Renders a tile and adds its chunks in order. Does nothing if a stop was requested, the pause is due, or the tile already has
    /// this block from before a pause.
    pub fn render(&self, tile: &mut Tile) -> Counters {
        let mut counters = Counters::default();
        let paused = || self.begun.swap(true, Ordering::Relaxed) && self.pause.is_some_and(|at| Instant::now() >= at);
        if tile.passes() > self.numbers.first() || self.progress.stop_requested() || paused() {
            return counters;
        }
        let ranges = if tile.goals().is_empty() {
            self.even_chunks(tile)
        } else {
            self.full_chunks(tile)
        };
        let chunks: Vec<_> = ranges.par_iter().map(|range| self.chunk(tile, range.clone())).collect();
        for (range, (sum, chunk)) in ranges.iter().zip(&chunks) {
            tile.add(sum, range.len() as u32);
            counters += *chunk;
        }
        tile.skip(self.passes - ranges.last().map_or(0, |range| range.end));
        counters
    }

    /// The passes of each chunk, relative to the first pass of the block, when every pixel takes part in every pass. Chunks end at
    /// multiples of a power of two, which include the leaf boundaries, so chunks do not depend on the block.
    fn even_chunks(&self, tile: &Tile) -> Vec<Range<u32>> {
        let most = 1 << (CAPACITY / tile.area()).max(1).ilog2();
        let per_chunk = leaf_passes(self.film).min(most);
        let (mut chunks, mut start) = (Vec::new(), 0);
        while start < self.passes {
            let first = self.numbers.first() + start;
            let mut end = start + per_chunk - first % per_chunk;
            if self.partly.is_some() && first < SPLIT_FROM {
                end = end.min(start + SPLIT_FROM - first);
            }
            chunks.push(start..end.min(self.passes));
            start = end;
        }
        chunks
    }

    /// Puts as many passes into each chunk as its streams can hold, up to the last pass in which any pixel takes part.
    fn full_chunks(&self, tile: &Tile) -> Vec<Range<u32>> {
        let first = self.numbers.first();
        let last = tile
            .goals()
            .iter()
            .max()
            .map_or(0, |goal| goal.saturating_sub(first).min(self.passes));
        if last == 0 {
            return Vec::new();
        }
        let mut goals = tile.goals().to_vec();
        goals.sort_unstable();
        let (mut chunks, mut start, mut sum, mut done) = (Vec::new(), 0, 0, 0);
        for pass in 0..last {
            while goals[done] <= first + pass {
                done += 1;
            }
            let more = goals.len() - done;
            if sum + more > CAPACITY {
                chunks.push(start..pass);
                (start, sum) = (pass, 0);
            }
            sum += more;
        }
        chunks.push(start..last);
        chunks
    }

    fn chunk(&self, tile: &Tile, range: Range<u32>) -> (ChunkSum, Counters) {
        let mut sum = tile.empty_sum(range.len() as u32);
        let mut counters = Counters::default();
        // Scratch pads hold nothing between chunks, so they stay valid after a panic elsewhere poisons the lock.
        let scratches = || self.scratch.lock().unwrap_or_else(PoisonError::into_inner);
        let mut scratch = scratches().pop().unwrap_or_default();
        let mut chunk = Chunk {
            world: self.world,
            numbers: self.numbers,
            tile,
            film_width: self.film.width,
            first: range.start,
            pass_order: &self.numbers.by_technique(range.clone()),
            order: self.plan.order,
            mix: self.plan.mix,
            product: self.plan.product,
            lists: self.world.lists_of(self.plan.draws),
            handler: self.plan.handler,
            partly: match self.partly {
                Some(partly) if self.numbers.first() + range.start >= SPLIT_FROM => &partly[tile.number() as usize],
                _ => &[],
            },
            sum: &mut sum,
            counters: &mut counters,
            log: None,
        };
        (self.plan.camera)(&mut chunk, &mut scratch);
        for shade in &self.plan.shade {
            shade(&mut chunk, &mut scratch);
        }
        scratches().push(scratch);
        // Embree stores query errors per thread, so they must be read here, on the thread that traced.
        if let Err(error) = self.world.accel.check() {
            self.progress.fail(error);
        }
        self.progress
            .add(counters.samples, counters.eye_rays + counters.shadow_rays);
        (sum, counters)
    }
}
