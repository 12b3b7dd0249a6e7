//! The film: sums of radiance in `f64`, tile by tile.
//!
//! A tile is rendered in chunks of passes. The sum of a chunk starts from 0 and takes contributions in one order; chunks
//! are added in the order of their passes. So no number of threads can change a bit.

use super::Picture;
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
        }
    }

    /// Which tile it is, row by row.
    pub fn number(&self) -> u32 {
        self.number
    }

    /// Adds the sums of further passes.
    pub fn add(&mut self, chunk: &TileSum, passes: u32) {
        for (sum, more) in self.sums.0.iter_mut().zip(&chunk.0) {
            for (s, m) in sum.iter_mut().zip(more) {
                *s += m;
            }
        }
        self.passes += passes;
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

    /// The tiles.
    pub fn tiles(&self) -> &[Tile] {
        &self.tiles
    }

    /// The tiles, to be added to.
    pub fn tiles_mut(&mut self) -> &mut [Tile] {
        &mut self.tiles
    }

    /// The mean radiance of each pixel; 0 where there is no pass yet. Tiles may have different numbers of passes.
    pub fn picture(&self) -> Picture {
        let FilmSize { width, height } = self.size;
        let mut pixels = vec![[0.0; 3]; width as usize * height as usize];
        for tile in &self.tiles {
            let passes = f64::from(mutate!(tile.passes.max(1), OnePassOff => tile.passes + 1));
            for ([x, y], sum) in tile.pixels.iter().zip(&tile.sums.0) {
                pixels[*y as usize * width as usize + *x as usize] = sum.map(|s| (s / passes) as f32);
            }
        }
        Picture { width, height, pixels }
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
}
