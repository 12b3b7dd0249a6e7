//! The film: sums of radiance in `f64`, tile by tile.
//!
//! A tile is rendered in chunks of passes. The sum of a chunk starts from 0 and adds contributions in a fixed order; chunks are
//! added in the order of their passes to the leaves of a [`Tree`]. So the bits do not depend on the number of threads, nor on a
//! division of the passes between processes.

use std::ops::Range;
use std::sync::Arc;

use rayon::prelude::*;

use super::chunk_sum::ChunkSum;
use super::tree::{TileSum, Tree};
use super::{Noise, Picture};
use crate::scene::FilmSize;

/// Side of a tile in pixels. With 16 passes a tile makes streams of 4096 rays, which fit into the L2 cache.
pub const TILE: u32 = 16;

/// A part of the film: its pixels in packet order.
#[derive(Clone, Debug)]
pub struct Tile {
    corner: [u32; 2],
    /// The pixels relative to the corner, shared by tiles of the same size.
    offsets: Arc<[[u32; 2]]>,
    number: u32,
    /// Passes of a leaf of the tree.
    leaf: u32,
    sums: Tree,
    /// The next pass.
    passes: u32,
    /// Number of passes that each pixel takes part in; empty where all take part in all.
    goals: Vec<u32>,
    /// Squared sums over pairs of passes, per pixel; empty unless noise is measured.
    squares: TileSum,
}

impl Tile {
    /// Sets how many passes each pixel takes part in; ends the measurement of noise.
    pub fn set_goals(&mut self, goal: impl Fn([u32; 2]) -> u32) {
        self.goals = self.pixels().map(goal).collect();
        self.squares = TileSum::default();
    }

    /// Column and row of each pixel, in blocks of 4 x 2, so that eight neighbours form a packet.
    pub fn pixels(&self) -> impl Iterator<Item = [u32; 2]> + Clone {
        let [left, top] = self.corner;
        self.offsets.iter().map(move |[x, y]| [left + x, top + y])
    }

    /// Column and row of each pixel, relative to the first one.
    pub fn offsets(&self) -> &[[u32; 2]] {
        &self.offsets
    }

    /// Column and row of its first pixel and of its last.
    pub fn corners(&self) -> [[u32; 2]; 2] {
        let [left, top] = self.corner;
        let [x, y] = self.offsets.last().copied().unwrap_or_default();
        [self.corner, [left + x, top + y]]
    }

    /// Number of pixels.
    pub fn area(&self) -> usize {
        self.offsets.len()
    }

    /// Index of the tile, row by row.
    pub fn number(&self) -> u32 {
        self.number
    }

    /// Zero sums for a chunk, all pixels in each slot: one slot for all passes, or one per pair while noise is measured.
    pub fn empty_sum(&self, passes: u32) -> ChunkSum {
        ChunkSum::new(self.area() * self.slots(passes))
    }

    /// Slots of a chunk: one, or one per pair of passes while noise is measured.
    fn slots(&self, passes: u32) -> usize {
        if self.measures_noise() { passes as usize / 2 } else { 1 }
    }

    /// Adds the sums of further passes, which must not cross the end of a leaf.
    pub fn add(&mut self, chunk: &ChunkSum, passes: u32) {
        for slot in chunk.0.chunks_exact(self.area()) {
            self.sums.add(slot);
            for (square, more) in self.squares.0.iter_mut().zip(slot) {
                for (s, m) in square.iter_mut().zip(more) {
                    *s += m * m;
                }
            }
        }
        self.skip(passes);
    }

    /// Counts passes whose sums were added, or in which no pixel takes part.
    pub fn skip(&mut self, passes: u32) {
        if passes > 0 {
            self.passes += passes;
            self.sums.count(passes, self.passes, self.leaf);
        }
    }

    /// Whether noise is measured from pairs of passes.
    pub fn measures_noise(&self) -> bool {
        !self.squares.0.is_empty()
    }

    /// Number of passes that each pixel takes part in; empty where all take part in all.
    pub fn goals(&self) -> &[u32] {
        &self.goals
    }

    /// Samples of each pixel: all passes so far, up to its goal.
    fn samples(&self) -> impl Fn(usize) -> u32 {
        let passes = self.sums.passes(self.leaf);
        move |pixel| self.goals.get(pixel).map_or(passes, |&goal| goal.min(passes))
    }

    /// Mean and variance of a pixel, estimated from pairs of passes.
    fn noise(&self, pixel: usize) -> Noise {
        let pairs = f64::from(self.passes / 2);
        let mut noise = Noise::default();
        for channel in 0..3 {
            let (sum, square) = (self.sums.total(pixel)[channel], self.squares.0[pixel][channel]);
            noise.mean[channel] = sum / (2.0 * pairs);
            noise.variance[channel] = ((square - sum * sum / pairs) / (2.0 * (pairs - 1.0))).max(0.0);
        }
        noise
    }

    /// The next pass; if none was skipped, the number of passes of the tile.
    pub fn passes(&self) -> u32 {
        self.passes
    }

    /// The tree with its sums.
    pub fn sums(&self) -> &Tree {
        &self.sums
    }

    /// The squared sums over pairs of passes.
    pub(super) fn squares(&self) -> &TileSum {
        &self.squares
    }

    /// Restores the state from a file.
    pub(super) fn restore(&mut self, passes: u32, sums: Tree, goals: Vec<u32>, squares: TileSum) {
        if !goals.is_empty() || !squares.0.is_empty() {
            self.leaf = u32::MAX;
        }
        (self.passes, self.sums, self.goals, self.squares) = (passes, sums, goals, squares);
    }
}

/// All tiles of a picture, row by row.
#[derive(Clone, Debug)]
pub struct Film {
    size: FilmSize,
    tiles: Vec<Tile>,
}

/// Maximum passes of a leaf, which limits the memory of random number tables.
pub(super) const MOST_LEAF: u32 = 4096;

/// Passes of a leaf, and of a block between two barriers: 16, and more for small films, to keep threads busy.
pub fn leaf_passes(FilmSize { width, height }: FilmSize) -> u32 {
    let pixels = u64::from(width) * u64::from(height);
    ((1 << 18) / pixels).clamp(16, MOST_LEAF.into()).next_power_of_two() as u32
}

impl Film {
    /// An empty film.
    pub fn new(size: FilmSize) -> Self {
        let shape = |width: u32, height: u32| -> Arc<[[u32; 2]]> {
            let rows = (0..height).step_by(2);
            let blocks = rows.flat_map(|y| (0..width).step_by(4).map(move |x| [x, y]));
            let pixels = blocks.flat_map(|[left, top]| {
                let rows = top..height.min(top + 2);
                rows.flat_map(move |y| (left..width.min(left + 4)).map(move |x| [x, y]))
            });
            pixels.collect()
        };
        let sides = |length: u32| {
            (0..length)
                .step_by(TILE as usize)
                .map(move |at| (at, TILE.min(length - at)))
        };
        let widths = [TILE, size.width % TILE];
        let heights = [TILE, size.height % TILE];
        let shapes = heights.map(|height| widths.map(|width| shape(width, height)));
        let leaf = leaf_passes(size);
        let tile = |number: usize, (top, height): (u32, u32), (left, width): (u32, u32)| Tile {
            corner: [left, top],
            offsets: shapes[usize::from(height < TILE)][usize::from(width < TILE)].clone(),
            number: number as u32,
            leaf,
            sums: Tree::default(),
            passes: 0,
            goals: Vec::new(),
            squares: TileSum::default(),
        };
        let places = sides(size.height).flat_map(|row| sides(size.width).map(move |column| (row, column)));
        let tiles = places
            .enumerate()
            .map(|(number, (row, column))| tile(number, row, column));
        Self {
            size,
            tiles: tiles.collect(),
        }
    }

    /// Memory of a film and its picture for the given number of passes, in bytes: 24 per pixel and node, 20 per pixel for the picture, its
    /// first samples and output; if adaptive, also 24 for the squares and 120 for noise, kinds, weights and goals.
    pub fn bytes(size: FilmSize, passes: u32, adaptive: bool) -> u64 {
        let pixels = u64::from(size.width) * u64::from(size.height);
        let nodes = passes.div_ceil(leaf_passes(size)).max(1).ilog2() + 1;
        let nodes = if adaptive { 1 } else { u64::from(nodes) };
        pixels * (24 * nodes + 20 + if adaptive { 144 } else { 0 })
    }

    /// Its size.
    pub fn size(&self) -> FilmSize {
        self.size
    }

    /// Begins at the given pass, the start of a leaf. Call before the first pass.
    pub fn begin_at(&mut self, pass: u32) {
        self.tiles.iter_mut().for_each(|tile| tile.passes = pass);
    }

    /// The passes of the film: from the first pass of any tile to the first that a tile lacks.
    pub fn passes(&self) -> Range<u32> {
        let first = |tile: &Tile| tile.passes - tile.sums.passes(tile.leaf).min(tile.passes);
        let firsts = self.tiles.iter().map(first);
        let ends = self.tiles.iter().map(Tile::passes);
        firsts.min().unwrap_or(0)..ends.min().unwrap_or(0)
    }

    /// The tile of a pixel, cut down to that pixel; `None` outside the film.
    pub fn pixel(&self, x: u32, y: u32) -> Option<Tile> {
        let of = |tile: &&Tile| tile.pixels().any(|pixel| pixel == [x, y]);
        let mut tile = self.tiles.iter().find(of)?.clone();
        (tile.corner, tile.offsets) = ([x, y], Arc::new([[0, 0]]));
        Some(tile)
    }

    /// The tiles.
    pub fn tiles(&self) -> &[Tile] {
        &self.tiles
    }

    /// Mutable access to the tiles.
    pub fn tiles_mut(&mut self) -> &mut [Tile] {
        &mut self.tiles
    }

    /// Enables measuring noise from pairs of passes: blocks and chunks must then be even. Call before the first pass.
    pub fn measure_noise(&mut self) {
        for tile in &mut self.tiles {
            tile.squares = TileSum::new(tile.area());
            // Chunks then end where streams are full. An adaptive render is never split between processes, so it is one leaf.
            tile.leaf = u32::MAX;
        }
    }

    /// Whether noise is measured.
    pub fn measures_noise(&self) -> bool {
        self.tiles.first().is_some_and(Tile::measures_noise)
    }

    /// [`Noise::relative`] of each pixel, row by row; needs at least four passes. Parallel: to be called in the pool of a render.
    pub fn noise(&self) -> Vec<f64> {
        let width = self.size.width as usize;
        let mut all = vec![0.0; width * self.size.height as usize];
        let rows = all.par_chunks_mut(width * TILE as usize);
        let tiles = self.tiles.par_chunks(width.div_ceil(TILE as usize));
        rows.zip(tiles)
            .for_each(|(row, tiles)| place(row, width, tiles, |tile| |pixel| tile.noise(pixel).relative()));
        all
    }

    /// Merges the sums of another film of the same size whose passes do not overlap.
    pub fn absorb(&mut self, other: Self) {
        for (tile, other) in self.tiles.iter_mut().zip(other.tiles) {
            tile.sums.absorb(other.sums);
        }
    }

    /// Minimum, total and maximum samples of the pixels.
    pub fn spread(&self) -> (u32, u64, u32) {
        // Where all pixels take part in all passes, one pixel represents the tile.
        let tiles = self.tiles.iter().flat_map(|tile| {
            let told = if tile.goals.is_empty() { 1 } else { tile.area() };
            (0..told).map(tile.samples()).map(move |n| (n, tile.area() / told))
        });
        tiles.fold((u32::MAX, 0, 0), |(least, all, most), (n, pixels)| {
            (least.min(n), all + u64::from(n) * pixels as u64, most.max(n))
        })
    }

    /// Sets how many passes each pixel, row by row, takes part in; ends the measurement of noise. Parallel, as [`Self::noise`].
    pub fn set_goals(&mut self, goals: &[u32]) {
        let width = self.size.width as usize;
        let goal = |[x, y]: [u32; 2]| goals[y as usize * width + x as usize];
        self.tiles.par_iter_mut().for_each(|tile| tile.set_goals(goal));
    }

    /// Maximum samples of a pixel, once goals are set.
    pub fn most_samples(&self) -> Option<u32> {
        self.tiles.iter().flat_map(|tile| &tile.goals).max().copied()
    }

    /// Samples of each pixel, row by row.
    pub fn samples(&self) -> Vec<u32> {
        self.rows(Tile::samples)
    }

    /// The mean radiance of each pixel; 0 without passes. Pixels may have different sample counts.
    pub fn picture(&self) -> Picture {
        let FilmSize { width, height } = self.size;
        let pixels = self.rows(|tile| {
            let samples = tile.samples();
            move |pixel| {
                let samples = samples(pixel);
                let samples = f64::from(mutate!(samples.max(1), OnePassOff => samples + 1));
                tile.sums.total(pixel).map(|sum| (sum / samples) as f32)
            }
        });
        Picture { width, height, pixels }
    }

    /// Collects a value of every pixel, row by row.
    fn rows<'a, T: Clone + Default, F: Fn(usize) -> T>(&'a self, of: impl Fn(&'a Tile) -> F) -> Vec<T> {
        let width = self.size.width as usize;
        let mut all = vec![T::default(); width * self.size.height as usize];
        place(&mut all, width, &self.tiles, of);
        all
    }
}

/// Writes a value of every pixel of some tiles to its place, row by row; the first row is that of the first tile.
fn place<'a, T, F: Fn(usize) -> T>(rows: &mut [T], width: usize, tiles: &'a [Tile], of: impl Fn(&'a Tile) -> F) {
    let top = tiles.first().map_or(0, |tile| tile.corner[1]);
    for tile in tiles {
        let of = of(tile);
        for (pixel, [x, y]) in tile.pixels().enumerate() {
            rows[(y - top) as usize * width + x as usize] = of(pixel);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_hold_every_pixel_once() {
        for (width, height) in [(1, 1), (1, 70), (70, 1), (16, 16), (17, 33), (128, 85)] {
            let film = Film::new(FilmSize { width, height });
            let mut seen = vec![false; (width * height) as usize];
            for [x, y] in film.tiles().iter().flat_map(Tile::pixels) {
                assert!(!std::mem::replace(&mut seen[(y * width + x) as usize], true));
            }
            assert!(seen.iter().all(|&s| s), "{width} x {height}");
        }
    }

    #[test]
    fn a_picture_is_the_mean_of_what_each_tile_has() {
        let mut film = Film::new(FilmSize { width: 20, height: 3 });
        let mut chunk = ChunkSum::new(film.tiles()[0].area());
        chunk.add(0, &[1.0, 2.0, 4.0, 0.0]);
        film.tiles_mut()[0].add(&chunk, 1);
        film.tiles_mut()[0].add(&chunk, 3);
        let picture = film.picture();
        assert_eq!(picture.pixels[0], [0.5, 1.0, 2.0]);
        assert!(picture.pixels[1..].iter().all(|p| *p == [0.0; 3]));
    }

    #[test]
    fn noise_is_that_of_pairs_of_passes() {
        let mut film = Film::new(FilmSize { width: 3, height: 1 });
        film.measure_noise();
        let tile = &mut film.tiles_mut()[0];
        let mut chunk = tile.empty_sum(4);
        for (slot, radiance) in [(1, 2.0), (4, 6.0)] {
            chunk.add(slot, &[radiance, 0.0, radiance, 0.0]);
        }
        tile.add(&chunk, 4);
        let noise = film.tiles()[0].noise(1);
        // Pairs of 2 and 6: a mean of 2 per pass, a variance of 8 per pair, 4 per pass.
        assert_eq!((noise.mean, noise.variance), ([2.0, 0.0, 2.0], [4.0, 0.0, 4.0]));
        assert_eq!(film.noise(), [0.0, noise.relative(), 0.0]);
        film.set_goals(&[4, 6, 8]);
        film.tiles_mut()[0].skip(3);
        assert_eq!(film.samples(), [4, 6, 7]);
        assert_eq!(film.picture().pixels[1][0], 8.0 / 6.0);
    }
}
