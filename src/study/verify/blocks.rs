//! A film cut into blocks, whose means are far nearer to normal than pixels.

use crate::scene::FilmSize;

/// At most about so many blocks: fewer see no place, more see only noise.
const BLOCKS: f64 = 48.0;

/// Square blocks; those at the right and lower edge may be smaller. After the blocks comes one more cell, the whole.
#[derive(Clone, Debug)]
pub struct Grid {
    block_of: Vec<u32>,
    pixels: Vec<f64>,
}

impl Grid {
    /// Cuts a film.
    pub fn new(film: FilmSize) -> Self {
        let (width, height) = (film.width as usize, film.height as usize);
        let side = ((width * height) as f64 / BLOCKS).sqrt().ceil().max(1.0) as usize;
        let per_row = width.div_ceil(side);
        let block_of: Vec<u32> = (0..width * height)
            .map(|i| ((i / width / side) * per_row + i % width / side) as u32)
            .collect();
        let mut pixels = vec![0.0; per_row * height.div_ceil(side) + 1];
        for &block in &block_of {
            pixels[block as usize] += 1.0;
        }
        pixels[per_row * height.div_ceil(side)] = block_of.len() as f64;
        Self { block_of, pixels }
    }

    /// How many blocks there are; this is also the index of the whole.
    pub fn blocks(&self) -> usize {
        self.pixels.len() - 1
    }

    /// Blocks and the whole.
    pub fn cells(&self) -> usize {
        self.pixels.len()
    }

    /// The block of a pixel.
    pub fn block_of(&self, pixel: usize) -> usize {
        self.block_of[pixel] as usize
    }

    /// Pixels in a cell.
    pub fn pixels(&self, cell: usize) -> f64 {
        self.pixels[cell]
    }

    /// The sum of a value of every pixel over each cell, the whole last.
    pub fn sums(&self, values: impl Iterator<Item = [f64; 3]>) -> Vec<[f64; 3]> {
        let mut sums = vec![[0.0; 3]; self.cells()];
        for (value, &block) in values.zip(&self.block_of) {
            for channel in 0..3 {
                sums[block as usize][channel] += value[channel];
            }
        }
        let (blocks, whole) = sums.split_at_mut(self.blocks());
        for block in blocks.iter() {
            for channel in 0..3 {
                whole[0][channel] += block[channel];
            }
        }
        sums
    }

    /// The mean of every cell, the whole last.
    pub fn means<T: Copy + Into<f64>>(&self, pixels: &[[T; 3]]) -> Vec<[f64; 3]> {
        let mut means = self.sums(pixels.iter().map(|pixel| pixel.map(Into::into)));
        for (mean, count) in means.iter_mut().zip(&self.pixels) {
            *mean = mean.map(|sum| sum / count);
        }
        means
    }
}

/// The largest film of the same shape with at most `pixels` pixels, never larger than `film`.
pub fn shrink(film: FilmSize, pixels: f64) -> FilmSize {
    let all = f64::from(film.width) * f64::from(film.height);
    let scale = (pixels / all).sqrt().min(1.0);
    let side = |side: u32| ((f64::from(side) * scale).round() as u32).clamp(1, side);
    FilmSize {
        width: side(film.width),
        height: side(film.height),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pixel_counts_once() {
        for (width, height) in [(1, 1), (8, 6), (96, 64), (101, 7), (1, 500)] {
            let grid = Grid::new(FilmSize { width, height });
            let pixels = (width * height) as usize;
            assert!(grid.blocks() >= 1 && grid.blocks() <= 100, "{}", grid.blocks());
            let counted: f64 = (0..grid.blocks()).map(|block| grid.pixels(block)).sum();
            assert_eq!(counted, pixels as f64);
            let means = grid.means(&vec![[1.0_f32, 2.0, 4.0]; pixels]);
            assert!(means.iter().all(|mean| *mean == [1.0, 2.0, 4.0]), "{width} x {height}");
        }
    }

    #[test]
    fn films_shrink_and_keep_their_shape() {
        let film = FilmSize {
            width: 768,
            height: 512,
        };
        assert_eq!(shrink(film, 6144.0), FilmSize { width: 96, height: 64 });
        assert_eq!(shrink(film, 1e9), film);
        assert_eq!(shrink(FilmSize { width: 1000, height: 1 }, 10.0).height, 1);
    }
}
