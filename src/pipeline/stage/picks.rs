//! The lights that the points of a chunk sample: the lists of all groups of pixels and passes, sorted by light.
//!
//! A list serves few points, because the pixels of a tile have many lists: else all would share an error, and tiles would show. But
//! lists of one tile have lights in common, so a chunk samples each light once for all points that have it.

use std::ops::Range;

use super::Chunk;
use crate::light::tree::{Pick, Table};
use crate::linear::cull::Bounds;
use crate::pipeline::lists::{Group, ListAddress, Lists, Member, level};
use crate::pipeline::stream::HitStream;
use crate::pipeline::world::World;
use crate::shape::BoundingSphere;

/// Consecutive points of a stream that share a list.
#[derive(Clone, Debug)]
struct Part {
    range: Range<usize>,
    /// Counted from 0.
    pass: u32,
    group: Group,
}

/// A light on the list of a part.
#[derive(Clone, Copy, Debug)]
struct Entry {
    /// Position on the list, place of the light in the tree, and number of the part: in this order they are sampled.
    key: (u32, u32, u32),
    pick: Pick,
}

/// Lights to sample, and the points that sample them.
#[derive(Debug, Default)]
pub struct Picks {
    parts: Vec<Part>,
    entries: Vec<Entry>,
    /// First entry of each run of entries with the same light, and the end.
    runs: Vec<usize>,
    list: Vec<Pick>,
}

impl Picks {
    /// Divides a stream into parts that share lists.
    pub fn divide(&mut self, chunk: &Chunk, stream: &HitStream) {
        self.parts.clear();
        let tile = chunk.tile;
        let [left, top] = tile.corners()[0];
        let of_pixel = |&[x, y]: &[u32; 2]| Group::of(tile, [left + x, top + y]);
        let groups: Vec<Group> = tile.offsets().iter().map(of_pixel).collect();
        for at in 0..stream.len() {
            let (index, pass) = stream.place(at);
            let pass = chunk.numbers.first() + pass;
            let group = groups[index as usize % groups.len()].of_pass(pass);
            match self.parts.last_mut() {
                Some(part) if (part.pass, part.group) == (pass, group) => part.range.end = at + 1,
                _ => self.parts.push(Part {
                    range: at..at + 1,
                    pass,
                    group,
                }),
            }
        }
    }

    /// A pass of each level of tables that the stream needs.
    pub fn levels(&self) -> Vec<u32> {
        let mut passes: Vec<u32> = self.parts.iter().map(|part| part.pass).collect();
        passes.sort_unstable();
        passes.dedup_by_key(|pass| level(*pass));
        passes
    }

    /// The points whose lists are of the table of a pass.
    pub fn points(&self, pass: u32) -> impl Iterator<Item = Range<usize>> {
        let of_level = move |part: &&Part| level(part.pass) == level(pass);
        self.parts.iter().filter(of_level).map(|part| part.range.clone())
    }

    /// The same points, in as few ranges as possible.
    pub fn neighbors(&self, pass: u32) -> Vec<Range<usize>> {
        let mut ranges: Vec<Range<usize>> = Vec::new();
        for part in self.points(pass) {
            match ranges.last_mut() {
                Some(range) if range.end == part.start => range.end = part.end,
                _ => ranges.push(part),
            }
        }
        ranges
    }

    /// Samples the lists of these points, except where `needless` says that no point samples lights.
    pub fn draw(
        &mut self,
        chunk: &Chunk,
        (lists, table): (&Lists, &Table),
        (pass, tossed): (u32, bool),
        needless: impl Fn(Range<usize>) -> bool,
    ) {
        self.entries.clear();
        for (number, part) in (0..).zip(&self.parts) {
            if level(part.pass) != level(pass) || needless(part.range.clone()) {
                continue;
            }
            let address = ListAddress::new(chunk.numbers, chunk.tile, part.group, part.pass, tossed);
            lists.draw(table, &address, &mut self.list);
            let entry = |(i, &pick): (u32, &Pick)| Entry {
                key: (i, lists.place(pick.light), number),
                pick,
            };
            self.entries.extend((0..).zip(&self.list).map(entry));
        }
        self.entries.sort_unstable_by_key(|entry| entry.key);
        self.runs.clear();
        for (at, entry) in self.entries.iter().enumerate() {
            let light = |entry: &Entry| (entry.key.0, entry.key.1);
            if at == 0 || light(&self.entries[at - 1]) != light(entry) {
                self.runs.push(at);
            }
        }
    }

    /// Number of lights to sample. Lights with near numbers are near one another in the tree.
    pub fn lights(&self) -> usize {
        self.runs.len()
    }

    /// A light, and its position on lists.
    pub fn light(&self, run: usize) -> (usize, Pick) {
        let Entry { key, pick } = self.entries[self.runs[run]];
        (key.0 as usize, pick)
    }

    /// The points that sample it.
    pub fn parts(&self, run: usize) -> impl Iterator<Item = Range<usize>> {
        let end = self.runs.get(run + 1).copied().unwrap_or(self.entries.len());
        let entries = self.entries[self.runs[run]..end].iter();
        entries.map(|entry| self.parts[entry.key.2 as usize].range.clone())
    }

    /// Bounds of some lights, of which the first must exist.
    pub fn bounds(&self, world: &World, lists: &Lists, bundle: Range<usize>) -> Bounds {
        let bundle = bundle.start..bundle.end.min(self.lights());
        let ball = |run: usize| match lists.kind(self.light(run).1.light) {
            Member::Sphere(number) => {
                let light = &world.lights[number];
                BoundingSphere {
                    center: light.center,
                    radius: light.radius,
                }
            }
            Member::Triangle(number) => BoundingSphere::around(&world.triangle_lights[number].triangle.corners),
            Member::Delta(number) => world.delta_lights[number].ball(),
        };
        let first = Bounds::of_ball(&ball(bundle.start));
        bundle.fold(first, |bounds, run| bounds.around(&Bounds::of_ball(&ball(run))))
    }
}
