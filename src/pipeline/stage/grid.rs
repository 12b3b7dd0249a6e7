//! The order in which the samples of a chunk are grouped into packets.

use std::ops::Range;

use super::chunk::{Chunk, Order};
use crate::film::TILE;
use crate::lane::{Bits, Lane, Mask};
use crate::pipeline::columns::CAPACITY;
use crate::pipeline::lists::Group;

/// Maximum number of lanes of a packet. Columns are padded by this much, so that any packet is one load.
const LANES: usize = 16;

/// Length of the columns if the active pixels of each pass are listed: one packet is written and one read past the last sample.
const ROOM: usize = CAPACITY + LANES;

/// Maximum number of pixels of a tile.
const PIXELS: usize = (TILE * TILE) as usize;

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
    pub fn fill<L: Lane>(&mut self, chunk: &Chunk) -> usize {
        let tile = chunk.tile;
        self.by_goals = !tile.goals().is_empty() && chunk.order != Order::Neighbours;
        if self.by_goals {
            return self.pass_by_pass::<L::Plain>(chunk);
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
    #[inline(never)]
    fn pass_by_pass<L: Lane>(&mut self, chunk: &Chunk) -> usize {
        self.clear();
        self.shape = None;
        self.length = 0;
        for column in [&mut self.x, &mut self.y] {
            column.resize(ROOM, 0.0);
        }
        for column in [&mut self.index, &mut self.key, &mut self.pass] {
            column.resize(ROOM, 0);
        }
        let all = Members::of::<L>(chunk);
        let mut members = all.clone();
        // If all goals are even, the passes 2k and 2k + 1 have the same pixels, and the second is a copy.
        let twins = chunk.tile.goals().iter().all(|goal| goal.is_multiple_of(2));
        let couple = |pass: u32| (chunk.numbers.first() + pass) / 2;
        let mut listed = vec![0..0; chunk.pass_order.len() / 2 + 2];
        let mut reached = 0;
        for &pass in chunk.pass_order {
            let begin = self.length;
            let twin = &mut listed[(couple(pass) - couple(chunk.first)) as usize];
            if twins && twin.start < twin.end {
                self.append_again::<L>(twin.clone());
            } else {
                // Passes mostly ascend, and then pixels only drop out.
                if pass < reached {
                    members.clone_from(&all);
                }
                reached = pass;
                self.append::<L>(&mut members, pass - chunk.first);
                *twin = begin..self.length;
            }
            for at in (begin..self.length).step_by(L::N) {
                L::Bits::splat(pass).store(&mut self.pass[at..]);
            }
        }
        // Past the last sample, lanes repeat it.
        let (last, ends) = (self.length - 1, self.length..self.length + LANES);
        for column in [&mut self.x, &mut self.y] {
            let last = column[last];
            column[ends.clone()].fill(last);
        }
        for column in [&mut self.index, &mut self.key, &mut self.pass] {
            let last = column[last];
            column[ends.clone()].fill(last);
        }
        self.length
    }

    /// Drops the members that do not take part in a pass, relative to the first of the chunk, and appends the others.
    #[inline(always)]
    fn append<L: Lane>(&mut self, members: &mut Members, pass: u32) {
        let (before, begin) = (members.count, self.length);
        let mut count = 0;
        // Compacts without branches: they would be mispredicted. In place, as a packet is read before it is overwritten.
        for at in (0..before).step_by(L::N) {
            let rest = L::Bits::load(&members.rest[at..]);
            // Both are below 2^31.
            let stays = (L::Bits::splat(pass) - rest).top_bit() & L::Mask::first(before - at);
            let packing = L::packing(stays);
            let x = L::load(&members.x[at..]).pack(packing);
            let y = L::load(&members.y[at..]).pack(packing);
            let index = packed::<L>(&members.index[at..], packing);
            let key = packed::<L>(&members.key[at..], packing);
            let rest = L::from_bits(rest).pack(packing).to_bits();
            x.store(&mut members.x[count..]);
            y.store(&mut members.y[count..]);
            index.store(&mut members.index[count..]);
            key.store(&mut members.key[count..]);
            rest.store(&mut members.rest[count..]);
            let to = begin + count;
            x.store(&mut self.x[to..]);
            y.store(&mut self.y[to..]);
            index.store(&mut self.index[to..]);
            key.store(&mut self.key[to..]);
            count += stays.count();
        }
        members.count = count;
        self.length += count;
    }

    /// Appends earlier rows again, but for their passes.
    #[inline(always)]
    fn append_again<L: Lane>(&mut self, rows: Range<usize>) {
        let (from, to, count) = (rows.start, self.length, rows.len());
        for at in (0..count).step_by(L::N) {
            L::load(&self.x[from + at..]).store(&mut self.x[to + at..]);
            L::load(&self.y[from + at..]).store(&mut self.y[to + at..]);
            L::Bits::load(&self.index[from + at..]).store(&mut self.index[to + at..]);
            L::Bits::load(&self.key[from + at..]).store(&mut self.key[to + at..]);
        }
        self.length += count;
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

/// The pixels of a tile that take part in a pass and in those after it, in columns as those of [`Grid`].
#[derive(Clone)]
struct Members {
    x: [f32; PIXELS + LANES],
    y: [f32; PIXELS + LANES],
    index: [u32; PIXELS + LANES],
    key: [u32; PIXELS + LANES],
    /// Number of passes of the chunk and after it in which the pixel takes part; cut off far above any number of passes.
    rest: [u32; PIXELS + LANES],
    count: usize,
}

impl Members {
    /// All pixels of a tile.
    fn of<L: Lane>(chunk: &Chunk) -> Self {
        let (goals, first) = (chunk.tile.goals(), chunk.numbers.first() + chunk.first);
        let [[left, top], _] = chunk.tile.corners();
        let first_pixel = top.wrapping_mul(chunk.film_width).wrapping_add(left);
        let order = (chunk.order == Order::Lists).then(|| by_group(chunk));
        let mut all = Self {
            x: [0.0; PIXELS + LANES],
            y: [0.0; PIXELS + LANES],
            index: [0; PIXELS + LANES],
            key: [0; PIXELS + LANES],
            rest: [0; PIXELS + LANES],
            count: chunk.tile.area(),
        };
        for row in 0..all.count {
            let at = order.as_ref().map_or(row, |order| order[row]);
            let [x, y] = chunk.tile.offsets()[at];
            (all.x[row], all.y[row], all.index[row]) = (x as f32, y as f32, at as u32);
            all.key[row] = first_pixel.wrapping_add(y.wrapping_mul(chunk.film_width).wrapping_add(x));
            all.rest[row] = goals[at].saturating_sub(first).min(1 << 30);
        }
        // From pixels to keys: a sample's key is copied later, not hashed again.
        for at in (0..all.count).step_by(L::N) {
            let key = chunk.numbers.key(L::Bits::load(&all.key[at..]));
            key.store(&mut all.key[at..]);
        }
        all
    }
}

#[inline(always)]
fn packed<L: Lane>(column: &[u32], packing: L::Packing) -> L::Bits {
    L::from_bits(L::Bits::load(column)).pack(packing).to_bits()
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
