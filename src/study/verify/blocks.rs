//! A film cut into blocks. Means of blocks are much closer to normal than pixels.

use crate::scene::FilmSize;

/// Target for the maximum number of blocks: fewer do not localize errors, more only see noise.
const BLOCKS: f64 = 48.0;

/// Square blocks; those at the right and lower edge may be smaller. Three more cells follow: the whole of the blocks;
/// silhouette pixels, which show the edge of an emitter; and pixels left out. Silhouettes are in no block: whether a camera ray
/// hits a light of radiance 900 adds more noise than all reflected light. Left out are pixels whose content the scene does not
/// determine (ties).
#[derive(Clone, Debug)]
pub struct Grid {
    block_of: Vec<u32>,
    pixels: Vec<f64>,
}

impl Grid {
    /// Cuts a film; `silhouettes` marks silhouette pixels.
    pub fn new(film: FilmSize, silhouettes: &[bool]) -> Self {
        Self::without(film, silhouettes, &vec![false; silhouettes.len()])
    }

    /// The same; `left_out` marks pixels that belong to no block and no silhouette.
    pub fn without(film: FilmSize, silhouettes: &[bool], left_out: &[bool]) -> Self {
        let (width, height) = (film.width as usize, film.height as usize);
        let count = |side: usize| width.div_ceil(side) * height.div_ceil(side);
        let most = 1.4 * BLOCKS;
        let mut side = ((width * height) as f64 / BLOCKS).sqrt().ceil().max(1.0) as usize;
        // Films with few rows fit fewer squares side by side.
        while count(side) as f64 > most {
            side += 1;
        }
        let per_row = width.div_ceil(side);
        let blocks = per_row * height.div_ceil(side);
        let cell = |i: usize| {
            if left_out[i] {
                blocks + 2
            } else if silhouettes[i] {
                blocks + 1
            } else {
                (i / width / side) * per_row + i % width / side
            }
        };
        let block_of: Vec<u32> = (0..width * height).map(|i| cell(i) as u32).collect();
        let mut pixels = vec![0.0; blocks + 3];
        for &block in &block_of {
            pixels[block as usize] += 1.0;
        }
        pixels[blocks] = pixels[..blocks].iter().sum();
        Self { block_of, pixels }
    }

    /// Number of blocks; also the index of the whole.
    pub fn blocks(&self) -> usize {
        self.pixels.len() - 3
    }

    /// The cell of the silhouettes.
    pub fn silhouettes(&self) -> usize {
        self.pixels.len() - 2
    }

    /// The cell of pixels left out.
    pub fn left_out(&self) -> usize {
        self.pixels.len() - 1
    }

    /// Number of cells: blocks, the whole, silhouettes and pixels left out.
    pub fn cells(&self) -> usize {
        self.pixels.len()
    }

    /// The block of a pixel, or its cell of silhouettes or of pixels left out.
    pub fn block_of(&self, pixel: usize) -> usize {
        self.block_of[pixel] as usize
    }

    /// Pixels in a cell.
    pub fn pixels(&self, cell: usize) -> f64 {
        self.pixels[cell]
    }

    /// Sums of per-pixel values over each cell.
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

    /// The mean of every cell; 0 for one without pixels.
    pub fn means<T: Copy + Into<f64>>(&self, pixels: &[[T; 3]]) -> Vec<[f64; 3]> {
        let mut means = self.sums(pixels.iter().map(|pixel| pixel.map(Into::into)));
        for (mean, count) in means.iter_mut().zip(&self.pixels) {
            *mean = mean.map(|sum| sum / count.max(1.0));
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
            let pixels = (width * height) as usize;
            let silhouettes: Vec<bool> = (0..pixels).map(|i| i % 7 == 3).collect();
            let left_out: Vec<bool> = (0..pixels).map(|i| i % 11 == 5).collect();
            let grid = Grid::without(FilmSize { width, height }, &silhouettes, &left_out);
            assert!(grid.blocks() >= 1 && grid.blocks() <= 100, "{}", grid.blocks());
            let counted: f64 = (0..grid.blocks()).map(|block| grid.pixels(block)).sum();
            assert_eq!(counted, grid.pixels(grid.blocks()));
            assert_eq!(
                counted + grid.pixels(grid.silhouettes()) + grid.pixels(grid.left_out()),
                pixels as f64
            );
            let means = grid.means(&vec![[1.0_f32, 2.0, 4.0]; pixels]);
            let filled = (0..grid.cells()).filter(|&cell| grid.pixels(cell) > 0.0);
            assert!(
                filled.map(|cell| means[cell]).all(|mean| mean == [1.0, 2.0, 4.0]),
                "{width} x {height}"
            );
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
