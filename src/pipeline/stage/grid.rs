//! The order in which the samples of a chunk are grouped into packets.

use std::ops::Range;

use super::chunk::{Chunk, Order};
use crate::lane::Word;
use crate::pipeline::lists::Group;

/// Maximum number of lanes of a packet. Columns are padded by this much, so that any packet is one load.
const LANES: usize = 16;

/// Source columns of camera packets, relative to the first pixel of the tile and the first pass of the chunk, so tiles of one shape
/// share them. They list the pixels of a tile, reused pass after pass; or every sample of a chunk, if packets mix passes.
#[derive(Debug, Default)]
pub struct Grid {
    pub x: Vec<f32>,
    pub y: Vec<f32>,
    /// Index of the pixel's sum in the chunk.
    pub index: Vec<u32>,
    /// Offset from the film index of the tile's first pixel.
    pub pixel: Vec<u32>,
    /// The pixel's key for random numbers; set by the camera stage for each chunk, unless [`Self::has_keys`].
    pub key: Vec<u32>,
    /// For samples only: the pass, relative to the first of the block.
    pub pass: Vec<u32>,
    /// Position of that pass in the chunk's order.
    turn: Vec<u32>,
    length: usize,
    shape: Option<Shape>,
    /// Whether the active pixels of each pass are listed.
    by_goals: bool,
}

/// Determines the columns if all pixels take part in all passes: offset of the tile's last column and row, film width, and number
/// of passes if samples are listed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Shape {
    size: [u32; 2],
    film_width: u32,
    passes: Option<usize>,
}

impl Grid {
    /// Fills the columns for a chunk; returns the number of its samples.
    pub fn fill(&mut self, chunk: &Chunk) -> usize {
        let tile = chunk.tile;
        self.by_goals = !tile.goals().is_empty() && chunk.order != Order::Neighbours;
        if self.by_goals {
            return self.pass_by_pass(chunk);
        }
        let listed = chunk.order == Order::Neighbours;
        // While noise is measured, pairs of passes have separate sums. With listed samples these indices must be listed too.
        let even = tile.goals().is_empty() && !(listed && tile.measures_noise());
        let [[left, top], [right, bottom]] = tile.corners();
        let shape = (even && chunk.order != Order::Lists).then_some(Shape {
            size: [right - left, bottom - top],
            film_width: chunk.film_width,
            passes: listed.then_some(chunk.pass_order.len()),
        });
        if shape.is_none() || self.shape != shape {
            self.clear();
            match chunk.order {
                Order::Neighbours => self.neighbours(chunk),
                Order::Passes => (0..tile.area()).for_each(|at| self.push(chunk, at)),
                Order::Lists => by_group(chunk).into_iter().for_each(|at| self.push(chunk, at)),
            }
            self.length = self.x.len();
            self.key.resize(self.length.next_multiple_of(LANES) + LANES, 0);
            self.shape = shape;
            for at in 0..LANES {
                let last = self.length - 1;
                self.repeat(if listed { last } else { at % self.length });
                if listed {
                    self.turn.push(self.turn[last]);
                }
            }
        }
        self.pass.clear();
        self.pass
            .extend(self.turn.iter().map(|&turn| chunk.pass_order[turn as usize]));
        if listed {
            self.length
        } else {
            self.length * chunk.pass_order.len()
        }
    }

    /// Pads the keys like the other columns.
    pub fn repeat_keys(&mut self) {
        for at in 0..LANES {
            let row = if self.lists_passes() {
                self.length - 1
            } else {
                at % self.length
            };
            self.key[self.length + at] = self.key[row];
        }
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.length
    }

    /// Whether samples with their passes are listed, instead of pixels.
    pub fn lists_passes(&self) -> bool {
        self.by_goals || !self.turn.is_empty()
    }

    /// Whether [`Self::fill`] has set the keys.
    pub fn has_keys(&self) -> bool {
        self.by_goals
    }

    /// Pass by pass, and in each the active pixels in tile order. Returns the number of samples.
    fn pass_by_pass(&mut self, chunk: &Chunk) -> usize {
        let (goals, first) = (chunk.tile.goals(), chunk.numbers.first());
        let [[left, top], _] = chunk.tile.corners();
        let first_pixel = top.wrapping_mul(chunk.film_width).wrapping_add(left);
        // The columns of the pixels: a sample's key is copied, not hashed again.
        let rows: Vec<(f32, f32, u32)> = (chunk.tile.offsets().iter())
            .map(|&[x, y]| {
                let pixel = first_pixel.wrapping_add(y.wrapping_mul(chunk.film_width).wrapping_add(x));
                (x as f32, y as f32, chunk.numbers.key(Word(pixel)).0)
            })
            .collect();
        let all: Vec<u32> = match chunk.order {
            Order::Lists => by_group(chunk).into_iter().map(|at| at as u32).collect(),
            _ => (0..goals.len() as u32).collect(),
        };
        // If all goals are even, the passes 2k and 2k + 1 have the same pixels, and the second is a copy.
        let twins = goals.iter().all(|goal| goal.is_multiple_of(2));
        let mut listed = vec![0..0; chunk.pass_order.len() / 2 + 2];
        let (mut members, mut reached, mut last) = (all.clone(), 0, 0..0);
        self.clear();
        self.key.clear();
        self.pass.clear();
        self.shape = None;
        for &pass in chunk.pass_order {
            let begin = self.x.len();
            let twin = &mut listed[((first + pass) / 2 - (first + chunk.first) / 2) as usize];
            if twins && twin.start < twin.end {
                self.repeat_range(twin.clone());
            } else {
                // Passes mostly ascend, and then pixels only drop out.
                if first + pass < reached {
                    members.clone_from(&all);
                }
                reached = first + pass;
                let (before, mut count) = (members.len(), 0);
                for i in 0..before {
                    // Writes unconditionally and advances only if active: a branch would be mispredicted.
                    let at = members[i];
                    members[count] = at;
                    count += usize::from(goals[at as usize] > reached);
                }
                members.truncate(count);
                if count == before && last.len() == count {
                    self.repeat_range(last);
                } else {
                    self.x.extend(members.iter().map(|&at| rows[at as usize].0));
                    self.y.extend(members.iter().map(|&at| rows[at as usize].1));
                    self.key.extend(members.iter().map(|&at| rows[at as usize].2));
                    self.index.extend_from_slice(&members);
                }
                *twin = begin..self.x.len();
                last = twin.clone();
            }
            self.pass.resize(self.x.len(), pass);
        }
        self.length = self.x.len();
        for _ in 0..LANES {
            let last = self.length - 1;
            self.repeat_range(last..last + 1);
            self.pass.push(self.pass[last]);
        }
        self.length
    }

    /// Appends rows again.
    fn repeat_range(&mut self, rows: Range<usize>) {
        self.x.extend_from_within(rows.clone());
        self.y.extend_from_within(rows.clone());
        self.index.extend_from_within(rows.clone());
        self.key.extend_from_within(rows);
    }

    /// By squares of 2 x 2 pixels along a Morton curve, and in each square pass by pass.
    fn neighbours(&mut self, chunk: &Chunk) {
        let pixels = chunk.tile.offsets();
        let spread = |x: u32| (x & 1) | (x & 2) << 1 | (x & 4) << 2;
        let square = |at: &usize| {
            let [x, y] = pixels[*at];
            spread(x / 2) | spread(y / 2) << 1
        };
        let mut order: Vec<usize> = (0..pixels.len()).collect();
        order.sort_by_key(square);
        for four in order.chunk_by(|a, b| square(a) == square(b)) {
            for (turn, &pass) in (0..).zip(chunk.pass_order) {
                for &at in four.iter().filter(|&&at| takes_part(chunk, at, pass)) {
                    self.push(chunk, at);
                    *self.index.last_mut().expect("just pushed") += slot(chunk, pass);
                    self.turn.push(turn);
                }
            }
        }
    }

    fn clear(&mut self) {
        self.x.clear();
        self.y.clear();
        self.index.clear();
        self.pixel.clear();
        self.turn.clear();
    }

    fn push(&mut self, chunk: &Chunk, at: usize) {
        let [x, y] = chunk.tile.offsets()[at];
        self.x.push(x as f32);
        self.y.push(y as f32);
        self.index.push(at as u32);
        self.pixel.push(y.wrapping_mul(chunk.film_width).wrapping_add(x));
    }

    fn repeat(&mut self, row: usize) {
        self.x.push(self.x[row]);
        self.y.push(self.y[row]);
        self.index.push(self.index[row]);
        self.pixel.push(self.pixel[row]);
    }
}

/// The pixels of a tile, group by group.
fn by_group(chunk: &Chunk) -> Vec<usize> {
    let offsets = chunk.tile.offsets();
    let [left, top] = chunk.tile.corners()[0];
    let mut order: Vec<usize> = (0..offsets.len()).collect();
    order.sort_by_cached_key(|&at| {
        let [x, y] = offsets[at];
        Group::of(chunk.tile, [left + x, top + y]).rank()
    });
    order
}

/// Whether a pixel takes part in a pass, relative to the first of the block.
fn takes_part(chunk: &Chunk, at: usize, pass: u32) -> bool {
    let pass = chunk.numbers.first() + pass;
    chunk.tile.goals().get(at).is_none_or(|&goal| goal > pass)
}

/// Offset of a pass's sums: while noise is measured, every pair of passes has separate sums.
fn slot(chunk: &Chunk, pass: u32) -> u32 {
    if chunk.tile.measures_noise() {
        (pass - chunk.first) / 2 * chunk.tile.area() as u32
    } else {
        0
    }
}
