//! What eye rays start from: the pixels of a tile, or the samples of a chunk.

use super::Chunk;
use crate::film::Tile;

/// What eye packets are loaded from, in columns, repeated behind the end so that any packet is one load: the pixels of a
/// tile, which serve pass after pass; or where pixels differ in their passes, every sample of a chunk.
#[derive(Debug, Default)]
pub struct Grid {
    /// Column of the pixel.
    pub x: Vec<f32>,
    /// Row of the pixel.
    pub y: Vec<f32>,
    /// Where the pixel sums up in its chunk.
    pub index: Vec<u32>,
    /// Number of the pixel on the film.
    pub pixel: Vec<u32>,
    /// Pass, counted from the block's first; of samples only.
    pub pass: Vec<u32>,
}

impl Grid {
    /// Loads what a chunk needs; returns how many numbers a column holds, and how many samples the chunk has.
    pub fn load(&mut self, chunk: &Chunk, lanes: usize) -> (usize, usize) {
        if lists_samples(chunk.tile) {
            let samples = self.samples(chunk, lanes);
            (samples, samples)
        } else {
            let pixels = self.pixels(chunk.tile, chunk.film_width, lanes);
            (pixels, pixels * chunk.passes as usize)
        }
    }

    /// The pixels of a tile; returns how many.
    fn pixels(&mut self, tile: &Tile, film_width: u32, lanes: usize) -> usize {
        self.clear();
        let indexed = tile.pixels().enumerate();
        for (index, pixel) in indexed.cycle().take(tile.area() + lanes) {
            self.push(index, pixel, film_width);
        }
        tile.area()
    }

    /// The samples of a chunk, pass by pass and in each the pixels that take part, in tile order; returns how many.
    fn samples(&mut self, chunk: &Chunk, lanes: usize) -> usize {
        self.clear();
        let (tile, first) = (chunk.tile, chunk.numbers.first());
        let goals = tile.goals();
        let takes_part = |index: usize, pass: u32| goals.get(index).is_none_or(|&goal| goal > first + pass);
        for (index, pixel) in tile.pixels().enumerate() {
            if takes_part(index, chunk.first) {
                self.push(index, pixel, chunk.film_width);
            }
        }
        let mut before = 0..self.x.len();
        self.pass.resize(before.end, chunk.first);
        for pass in chunk.first + 1..chunk.first + chunk.passes {
            let next = self.x.len();
            // While noise is measured every pair of passes has a slot of its own.
            let slot = if tile.measures_noise() && pass % 2 == 0 {
                tile.area() as u32
            } else {
                0
            };
            if before
                .clone()
                .all(|at| goals.is_empty() || takes_part(self.index[at] as usize, pass))
            {
                self.x.extend_from_within(before.clone());
                self.y.extend_from_within(before.clone());
                self.pixel.extend_from_within(before.clone());
                self.index.extend_from_within(before);
                self.index[next..].iter_mut().for_each(|index| *index += slot);
            } else {
                for at in before {
                    if takes_part(self.index[at] as usize, pass) {
                        self.repeat(at);
                    }
                }
            }
            before = next..self.x.len();
            self.pass.resize(before.end, pass);
        }
        let samples = self.x.len();
        for _ in 0..lanes {
            self.repeat(samples - 1);
            self.pass.push(self.pass[samples - 1]);
        }
        samples
    }

    fn clear(&mut self) {
        self.x.clear();
        self.y.clear();
        self.index.clear();
        self.pixel.clear();
        self.pass.clear();
    }

    fn push(&mut self, index: usize, [x, y]: [u32; 2], film_width: u32) {
        self.x.push(x as f32);
        self.y.push(y as f32);
        self.index.push(index as u32);
        self.pixel.push(y.wrapping_mul(film_width).wrapping_add(x));
    }

    fn repeat(&mut self, at: usize) {
        self.x.push(self.x[at]);
        self.y.push(self.y[at]);
        self.index.push(self.index[at]);
        self.pixel.push(self.pixel[at]);
    }
}

/// Whether pixels of the tile differ in their passes, so that every sample has to be listed.
pub fn lists_samples(tile: &Tile) -> bool {
    tile.measures_noise() || !tile.goals().is_empty()
}
