//! The film: sums of radiance in `f64`, tile by tile.
//!
//! A tile is rendered in chunks of passes. The sum of a chunk starts from 0 and takes contributions in one order; chunks
//! are added in the order of their passes. So no number of threads can change a bit.

use super::{Noise, Picture};
use crate::scene::FilmSize;

/// Pixels along a side of a tile. With 8 passes a tile makes streams of 2048 rays, which stay in the second cache.
pub const TILE: u32 = 16;

/// A part of the film: its pixels in the order in which packets take them.
#[derive(Clone, Debug)]
pub struct Tile {
    /// Column and row of each pixel, in blocks of 4 x 2 so that eight neighbours make a packet.
    pub pixels: Vec<[u32; 2]>,
    number: u32,
    sums: TileSum,
    passes: u32,
    /// Of each pixel, the passes that it takes part in; empty where all take part in all.
    goals: Vec<u32>,
    /// Of each pixel, the squares of its sums over pairs of passes; empty where nobody asks for noise.
    squares: TileSum,
}

/// One sum per pixel of a tile.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TileSum(pub Vec<[f64; 3]>);

impl TileSum {
    /// Zero for `pixels` pixels.
    pub fn new(pixels: usize) -> Self {
        Self(vec![[0.0; 3]; pixels])
    }

    /// Adds one contribution.
    #[inline(always)]
    pub fn add(&mut self, pixel: usize, radiance: [f32; 3]) {
        let sum = &mut self.0[pixel];
        for (s, r) in sum.iter_mut().zip(radiance) {
            *s += f64::from(r);
        }
    }
}

impl Tile {
    fn new(left: u32, top: u32, size: FilmSize) -> Self {
        let right = (left + TILE).min(size.width);
        let bottom = (top + TILE).min(size.height);
        let mut pixels = Vec::with_capacity(((right - left) * (bottom - top)) as usize);
        for y in (top..bottom).step_by(2) {
            for x in (left..right).step_by(4) {
                for row in y..bottom.min(y + 2) {
                    pixels.extend((x..right.min(x + 4)).map(|column| [column, row]));
                }
            }
        }
        Self {
            sums: TileSum::new(pixels.len()),
            pixels,
            number: top / TILE * size.width.div_ceil(TILE) + left / TILE,
            passes: 0,
            goals: Vec::new(),
            squares: TileSum::default(),
        }
    }

    /// Which tile it is, row by row.
    pub fn number(&self) -> u32 {
        self.number
    }

    /// Empty sums for a chunk of `passes` passes: one slot for all of them, or while noise is measured one for each pair of
    /// passes; slot after slot, all pixels in each.
    pub fn empty_sum(&self, passes: u32) -> TileSum {
        TileSum::new(self.pixels.len() * self.slots(passes))
    }

    /// Sums that a pixel has in a chunk: one, or while noise is measured one for each pair of passes.
    fn slots(&self, passes: u32) -> usize {
        if self.measures_noise() { passes as usize / 2 } else { 1 }
    }

    /// Adds the sums of further passes.
    pub fn add(&mut self, chunk: &TileSum, passes: u32) {
        for slot in chunk.0.chunks_exact(self.pixels.len()) {
            for (sum, more) in self.sums.0.iter_mut().zip(slot) {
                for (s, m) in sum.iter_mut().zip(more) {
                    *s += m;
                }
            }
            for (square, more) in self.squares.0.iter_mut().zip(slot) {
                for (s, m) in square.iter_mut().zip(more) {
                    *s += m * m;
                }
            }
        }
        self.passes += passes;
    }

    /// The sum of a pixel, counted as in `pixels`, over all its samples.
    pub fn sum(&self, pixel: usize) -> [f64; 3] {
        self.sums.0[pixel]
    }

    /// Notes passes in which no pixel takes part any more.
    pub fn skip(&mut self, passes: u32) {
        self.passes += passes;
    }

    /// Whether sums over pairs of passes are wanted.
    pub fn measures_noise(&self) -> bool {
        !self.squares.0.is_empty()
    }

    /// Of each pixel, the passes that it takes part in; empty where all take part in all.
    pub fn goals(&self) -> &[u32] {
        &self.goals
    }

    /// Samples that a pixel has: it took part in the first passes, up to its goal.
    fn samples(&self, pixel: usize) -> u32 {
        self.goals.get(pixel).map_or(self.passes, |&goal| goal.min(self.passes))
    }

    /// Mean and variance of a pixel, as its pairs of passes show them.
    fn noise(&self, pixel: usize) -> Noise {
        let pairs = f64::from(self.passes / 2);
        let mut noise = Noise::default();
        for channel in 0..3 {
            let (sum, square) = (self.sums.0[pixel][channel], self.squares.0[pixel][channel]);
            noise.mean[channel] = sum / (2.0 * pairs);
            noise.variance[channel] = ((square - sum * sum / pairs) / (2.0 * (pairs - 1.0))).max(0.0);
        }
        noise
    }

    /// Passes that the tile has.
    pub fn passes(&self) -> u32 {
        self.passes
    }
}

/// All tiles of a picture, row by row.
#[derive(Clone, Debug)]
pub struct Film {
    size: FilmSize,
    tiles: Vec<Tile>,
}

impl Film {
    /// A film with nothing on it.
    pub fn new(size: FilmSize) -> Self {
        let tops = (0..size.height).step_by(TILE as usize);
        let tiles = tops
            .flat_map(|top| {
                (0..size.width)
                    .step_by(TILE as usize)
                    .map(move |left| Tile::new(left, top, size))
            })
            .collect();
        Self { size, tiles }
    }

    /// A tile of one pixel, without sums, that goes by the number of the tile which the pixel is of.
    pub fn pixel(&self, x: u32, y: u32) -> Tile {
        let of = |tile: &&Tile| tile.pixels.contains(&[x, y]);
        let mut one = Tile::new(
            x,
            y,
            FilmSize {
                width: x + 1,
                height: y + 1,
            },
        );
        one.number = self.tiles.iter().find(of).map_or(0, |tile| tile.number);
        one
    }

    /// The tiles.
    pub fn tiles(&self) -> &[Tile] {
        &self.tiles
    }

    /// The tiles, to be added to.
    pub fn tiles_mut(&mut self) -> &mut [Tile] {
        &mut self.tiles
    }

    /// Has the noise of each pixel measured from here on, over pairs of passes: blocks and chunks must then be of even
    /// numbers of passes. To be called before the first.
    pub fn measure_noise(&mut self) {
        for tile in &mut self.tiles {
            tile.squares = TileSum::new(tile.pixels.len());
        }
    }

    /// The noise of each pixel, row by row; at least four passes must be there.
    pub fn noise(&self) -> Vec<Noise> {
        self.rows(Tile::noise)
    }

    /// Sets how many passes each pixel, row by row, takes part in; measures noise no more.
    pub fn set_goals(&mut self, goals: &[u32]) {
        let width = self.size.width as usize;
        for tile in &mut self.tiles {
            let pixels = tile.pixels.iter();
            tile.goals = pixels.map(|[x, y]| goals[*y as usize * width + *x as usize]).collect();
            tile.squares = TileSum::default();
        }
    }

    /// Samples of each pixel, row by row.
    pub fn samples(&self) -> Vec<u32> {
        self.rows(Tile::samples)
    }

    /// The mean radiance of each pixel; 0 where there is no pass yet. Pixels may have different numbers of samples.
    pub fn picture(&self) -> Picture {
        let FilmSize { width, height } = self.size;
        let mean = |tile: &Tile, pixel| {
            let samples = tile.samples(pixel);
            let samples = f64::from(mutate!(samples.max(1), OnePassOff => samples + 1));
            tile.sums.0[pixel].map(|sum| (sum / samples) as f32)
        };
        let pixels = self.rows(mean);
        Picture { width, height, pixels }
    }

    /// Something of every pixel, row by row.
    fn rows<T: Clone + Default>(&self, of: impl Fn(&Tile, usize) -> T) -> Vec<T> {
        let width = self.size.width as usize;
        let mut all = vec![T::default(); width * self.size.height as usize];
        for tile in &self.tiles {
            for (pixel, [x, y]) in tile.pixels.iter().enumerate() {
                all[*y as usize * width + *x as usize] = of(tile, pixel);
            }
        }
        all
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
            for [x, y] in film.tiles().iter().flat_map(|t| &t.pixels) {
                assert!(!std::mem::replace(&mut seen[(y * width + x) as usize], true));
            }
            assert!(seen.iter().all(|&s| s), "{width} x {height}");
        }
    }

    #[test]
    fn a_picture_is_the_mean_of_what_each_tile_has() {
        let mut film = Film::new(FilmSize { width: 20, height: 3 });
        let mut chunk = TileSum::new(film.tiles()[0].pixels.len());
        chunk.add(0, [1.0, 2.0, 4.0]);
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
            chunk.add(slot, [radiance, 0.0, radiance]);
        }
        tile.add(&chunk, 4);
        let noise = film.noise();
        assert_eq!(noise[0], Noise::default());
        // Pairs of 2 and 6: a mean of 2 a pass, a variance of 8 a pair, 4 a pass.
        assert_eq!((noise[1].mean, noise[1].variance), ([2.0, 0.0, 2.0], [4.0, 0.0, 4.0]));
        film.set_goals(&[4, 6, 8]);
        film.tiles_mut()[0].skip(3);
        assert_eq!(film.samples(), [4, 6, 7]);
        assert_eq!(film.picture().pixels[1][0], 8.0 / 6.0);
    }
}
