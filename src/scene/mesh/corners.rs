//! Splits vertices of files whose corners have normals or texture coordinates: each distinct set at a position becomes a
//! vertex. Corners without a set only share vertices with each other.

use std::collections::HashMap;

use super::Problem;

/// "No normal" or "no texture coordinates".
pub const NONE: u32 = u32::MAX;

/// From here on, a normal index is a smoothing group: corners with the same number share a computed normal.
pub const SMOOTHING: u32 = 1 << 31;

/// Vertices beyond the file's positions are numbered from here until the number of positions is known.
const EXTRA: u32 = 1 << 31;

/// The attributes of a corner besides its position.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Set {
    /// Index of a normal, [`SMOOTHING`] or more for a smoothing group, or [`NONE`].
    pub normal: u32,
    /// Index of texture coordinates, or [`NONE`].
    pub uv: u32,
}

impl Set {
    pub const EMPTY: Self = Self { normal: NONE, uv: NONE };
    const UNUSED: Self = Self {
        normal: NONE,
        uv: NONE - 1,
    };
}

/// Maps corners to vertices. The first set of a position keeps the position's index; most positions have only one, so lookups
/// are rare.
#[derive(Debug)]
pub struct Corners {
    first: Vec<Set>,
    others: Vec<(u32, Set)>,
    found: HashMap<(u32, Set), u32>,
}

impl Corners {
    /// Continues after these triangles, whose corners only have positions.
    pub fn after(triangles: &[[u32; 3]]) -> Self {
        let mut corners = Self {
            first: Vec::new(),
            others: Vec::new(),
            found: HashMap::new(),
        };
        if let Some(&last) = triangles.iter().flatten().max() {
            corners.first.resize(last as usize + 1, Set::UNUSED);
        }
        for &corner in triangles.iter().flatten() {
            corners.first[corner as usize] = Set::EMPTY;
        }
        corners
    }

    /// The vertex of a corner at `position`, out of `positions`.
    pub fn vertex(&mut self, position: u32, set: Set, positions: usize) -> Result<u32, Problem> {
        if self.first.len() <= position as usize {
            self.first.resize(positions, Set::UNUSED);
        }
        let first = &mut self.first[position as usize];
        if *first == Set::UNUSED {
            *first = set;
        }
        if *first == set {
            return Ok(position);
        }
        let next = EXTRA + self.others.len() as u32;
        let vertex = *self.found.entry((position, set)).or_insert(next);
        if vertex == next {
            if self.others.len() + positions >= EXTRA as usize {
                return Err(too_many());
            }
            self.others.push((position, set));
        }
        Ok(vertex)
    }

    /// Assigns final vertex indices to the triangles; the `positions` of the file come first.
    pub fn finish(mut self, positions: usize, triangles: &mut [[u32; 3]]) -> Self {
        self.found = HashMap::new();
        self.first.resize(positions, Set::UNUSED);
        for corner in triangles.iter_mut().flatten().filter(|corner| **corner >= EXTRA) {
            *corner = *corner - EXTRA + positions as u32;
        }
        self
    }

    /// Gives each corner whose set satisfies `alone` a separate vertex; call after [`finish`](Self::finish).
    pub fn part(&mut self, triangles: &mut [[u32; 3]], alone: fn(Set) -> bool) -> Result<(), Problem> {
        let positions = self.first.len();
        for corner in triangles.iter_mut().flatten() {
            let vertex = *corner as usize;
            let (position, set) = match vertex.checked_sub(positions) {
                None => (*corner, self.first[vertex]),
                Some(other) => self.others[other],
            };
            if alone(set) {
                let next = u32::try_from(positions + self.others.len()).map_err(|_| too_many())?;
                self.others.push((position, set));
                *corner = next;
            }
        }
        Ok(())
    }

    /// Extends a list by position with the additional vertices.
    pub fn extend<T: Copy>(&self, values: &mut Vec<T>) {
        values.reserve_exact(self.others.len());
        for &(position, _) in &self.others {
            values.push(values[position as usize]);
        }
    }

    /// Looks up the value of `number` for each vertex; `none` where there is none.
    pub fn gather<T: Copy>(&self, values: &[T], none: T, number: fn(Set) -> u32) -> Vec<T> {
        let sets = self.first.iter().chain(self.others.iter().map(|(_, set)| set));
        let mut gathered = Vec::with_capacity(self.first.len() + self.others.len());
        gathered.extend(sets.map(|&set| values.get(number(set) as usize).copied().unwrap_or(none)));
        gathered
    }
}

fn too_many() -> Problem {
    Problem::new("has more vertices than 31 bits can count", "use a smaller mesh")
}
