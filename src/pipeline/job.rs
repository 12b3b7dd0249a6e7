//! One block of passes for all tiles, chunk by chunk on as many threads as are free.

use std::ops::Range;
use std::sync::{Mutex, PoisonError};

use rayon::prelude::*;

use super::plan::Plan;
use super::stage::{Chunk, Scratch};
use super::stream::CAPACITY;
use super::world::World;
use super::{Counters, Progress};
use crate::film::{Tile, TileSum};
use crate::sampling::PassBlock;
use crate::scene::FilmSize;

/// What a block needs besides its tiles.
pub struct Job<'a> {
    pub plan: &'a Plan,
    pub world: &'a World,
    pub numbers: &'a PassBlock,
    pub scratch: &'a Mutex<Vec<Scratch>>,
    pub progress: &'a Progress,
    pub film: FilmSize,
    pub passes: u32,
}

impl Job<'_> {
    /// Renders a tile and adds its chunks in order; nothing at all if a stop was asked for.
    pub fn render(&self, tile: &mut Tile) -> Counters {
        let mut counters = Counters::default();
        if self.progress.stop_requested() {
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

    /// The passes of each chunk, counted from the block's first, where all pixels take part in all.
    fn even_chunks(&self, tile: &Tile) -> Vec<Range<u32>> {
        // A power of two, so that chunks are the same whatever the block.
        let most = (CAPACITY / tile.pixels.len()).max(1);
        let per_chunk = if most.is_power_of_two() {
            most
        } else {
            most.next_power_of_two() / 2
        };
        let starts = (0..self.passes).step_by(per_chunk);
        starts
            .map(|start| start..self.passes.min(start + per_chunk as u32))
            .collect()
    }

    /// As many passes in each chunk as its streams can take, up to the last in which a pixel takes part.
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
        let samples = |pass: u32| goals.len() - goals.partition_point(|&goal| goal <= first + pass);
        let (mut chunks, mut start, mut sum) = (Vec::new(), 0, 0);
        for pass in 0..last {
            let more = samples(pass);
            if sum + more > CAPACITY {
                chunks.push(start..pass);
                (start, sum) = (pass, 0);
            }
            sum += more;
        }
        chunks.push(start..last);
        chunks
    }

    fn chunk(&self, tile: &Tile, range: Range<u32>) -> (TileSum, Counters) {
        let passes = range.len() as u32;
        let mut sum = tile.empty_sum(passes);
        let mut counters = Counters::default();
        // A panic elsewhere leaves whole scratch pads behind: they hold nothing between chunks.
        let pads = || self.scratch.lock().unwrap_or_else(PoisonError::into_inner);
        let mut scratch = pads().pop().unwrap_or_default();
        let mut chunk = Chunk {
            world: self.world,
            numbers: self.numbers,
            tile,
            film_width: self.film.width,
            first: range.start,
            passes,
            sum: &mut sum,
            counters: &mut counters,
        };
        (self.plan.eye)(&mut chunk, &mut scratch);
        for shade in &self.plan.shade {
            shade(&mut chunk, &mut scratch);
        }
        pads().push(scratch);
        self.progress
            .add(counters.samples, counters.eye_rays + counters.shadow_rays);
        (sum, counters)
    }
}
