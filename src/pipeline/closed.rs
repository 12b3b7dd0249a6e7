//! Which side of each triangle of an emissive mesh can be seen.
//!
//! A triangle emits from both sides, but of a closed surface the camera sees one side alone, and so does every point that it sees: nothing
//! between them is transparent. Lights are selected for the side that is seen. That is an estimate: where it is wrong, noise is larger.

use rayon::prelude::*;

/// Cells along the longest side of a mesh: vertices in one cell are one, for files repeat vertices at seams and round them.
const CELLS: f64 = (1 << 20) as f64;

/// How far from a whole number a winding number may be by rounding.
const WHOLE: f64 = 0.1;

/// For each triangle, three indices of vertices, 1 if the side of its normal `(b - a) x (c - a)` is seen from the origin's part of space, -1
/// if the other side is, and 0 if the triangle belongs to no closed surface. A part of the mesh that hangs together is closed if each edge has
/// two triangles, which pass it in opposite directions.
pub fn sides(vertices: &[[f32; 3]], triangles: &[[u32; 3]]) -> Vec<i8> {
    let numbers = weld(vertices);
    let (mut sets, open) = sets(&numbers, triangles);
    let mut parts: Vec<Part> = triangles.iter().map(|_| Part::default()).collect();
    for (i, triangle) in (0..).zip(triangles) {
        let part = &mut parts[sets.of(i) as usize];
        part.open |= open[i as usize];
        part.add(triangle.map(|corner| vertices[corner as usize]));
    }
    (0..triangles.len() as u32)
        .map(|i| parts[sets.of(i) as usize].side())
        .collect()
}

/// What decides about a part.
#[derive(Default)]
struct Part {
    open: bool,
    /// Six times the volume, if its normals point outward.
    volume: f64,
    /// The solid angle as seen from the origin, with the sign of the normals.
    solid_angle: f64,
}

impl Part {
    fn add(&mut self, triangle: [[f32; 3]; 3]) {
        let [a, b, c] = triangle.map(|corner| glam::Vec3::from(corner).as_dvec3());
        let product = a.dot(b.cross(c));
        let [la, lb, lc] = [a, b, c].map(glam::DVec3::length);
        self.volume += product;
        // Van Oosterom and Strackee 1983, "The Solid Angle of a Plane Triangle", equation 8.
        let below = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
        self.solid_angle += 2.0 * product.atan2(below);
    }

    fn side(&self) -> i8 {
        let winding = self.solid_angle / (4.0 * std::f64::consts::PI);
        if self.open || self.volume == 0.0 || (winding - winding.round()).abs() > WHOLE {
            return 0;
        }
        let outside = winding.round() == 0.0;
        if outside == (self.volume > 0.0) { 1 } else { -1 }
    }
}

/// For each vertex a number that all vertices at its place have.
fn weld(vertices: &[[f32; 3]]) -> Vec<u32> {
    let end = |most: fn(f32, f32) -> f32, k: usize| vertices.iter().map(|p| p[k]).reduce(most).unwrap_or(0.0);
    let low: [f32; 3] = std::array::from_fn(|k| end(f32::min, k));
    let sizes = (0..3).map(|k| f64::from(end(f32::max, k)) - f64::from(low[k]));
    let size = sizes.fold(0.0, f64::max);
    let scale = if size > 0.0 { CELLS / size } else { 0.0 };
    let cell = |p: &[f32; 3]| {
        (0..3).fold(0, |cell, k| {
            let along = (f64::from(p[k]) - f64::from(low[k])) * scale;
            cell << 21 | along.round() as u64
        })
    };
    let mut cells: Vec<(u64, u32)> = vertices.iter().map(cell).zip(0..).collect();
    cells.par_sort_unstable();
    let mut numbers = vec![0; vertices.len()];
    for same in cells.chunk_by(|a, b| a.0 == b.0) {
        for &(_, vertex) in same {
            numbers[vertex as usize] = same[0].1;
        }
    }
    numbers
}

/// Sets of triangles that share edges, and whether a triangle has an edge that closes nothing.
fn sets(numbers: &[u32], triangles: &[[u32; 3]]) -> (Sets, Vec<bool>) {
    // Each edge: its ends, the lesser first, whether it is passed from there, and its triangle.
    let mut edges: Vec<(u64, bool, u32)> = Vec::with_capacity(3 * triangles.len());
    for (i, triangle) in (0..).zip(triangles) {
        let [a, b, c] = triangle.map(|corner| numbers[corner as usize]);
        // A triangle without area has no border.
        if a != b && b != c && c != a {
            let edge = |(a, b): (u32, u32)| (u64::from(a.min(b)) << 32 | u64::from(a.max(b)), a < b, i);
            edges.extend([(a, b), (b, c), (c, a)].map(edge));
        }
    }
    edges.par_sort_unstable();
    let (mut sets, mut open) = (
        Sets((0..triangles.len() as u32).collect()),
        vec![false; triangles.len()],
    );
    for edge in edges.chunk_by(|a, b| a.0 == b.0) {
        let closes = matches!(edge, [first, second] if first.1 != second.1);
        for &(.., triangle) in edge {
            sets.join(triangle, edge[0].2);
            open[triangle as usize] |= !closes;
        }
    }
    (sets, open)
}

/// Disjoint sets of triangles.
struct Sets(Vec<u32>);

impl Sets {
    /// The representative of a triangle's set.
    fn of(&mut self, mut i: u32) -> u32 {
        while self.0[i as usize] != i {
            let above = self.0[self.0[i as usize] as usize];
            self.0[i as usize] = above;
            i = above;
        }
        i
    }

    fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.of(a), self.of(b));
        self.0[a.max(b) as usize] = a.min(b);
    }
}

#[cfg(test)]
mod tests {
    /// A tetrahedron with outward normals around a point.
    fn body(middle: [f32; 3], size: f32) -> Vec<[[f32; 3]; 3]> {
        let corners = [[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]];
        let corner = |i: usize| std::array::from_fn(|k| middle[k] + size * corners[i][k]);
        [[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]]
            .map(|t| t.map(corner))
            .to_vec()
    }

    /// The sides of triangles that share no vertices: these must be welded.
    fn sides(mesh: &[[[f32; 3]; 3]]) -> Vec<i8> {
        let corners: Vec<u32> = (0..3 * mesh.len() as u32).collect();
        super::sides(mesh.as_flattened(), corners.as_chunks().0)
    }

    fn turned(mesh: &[[[f32; 3]; 3]]) -> Vec<[[f32; 3]; 3]> {
        mesh.iter().map(|&[a, b, c]| [a, c, b]).collect()
    }

    #[test]
    fn the_outer_side_is_seen_from_outside_and_the_inner_from_inside() {
        let (far, around) = (body([5.0, 1.0, -2.0], 1.0), body([0.1, 0.0, 0.1], 3.0));
        assert_eq!(sides(&far), [1; 4]);
        assert_eq!(sides(&turned(&far)), [-1; 4]);
        assert_eq!(sides(&around), [-1; 4]);
        assert_eq!(sides(&turned(&around)), [1; 4]);
    }

    /// Parts of one mesh are told apart; an open part has two sides, as has one with a triangle turned.
    #[test]
    fn each_part_of_a_mesh_is_judged_alone() {
        let (mut mesh, far) = (body([5.0, 1.0, -2.0], 1.0), body([-5.0, 1.0, -2.0], 1.0));
        mesh.extend(&turned(&far));
        mesh.extend(&body([0.0, 9.0, 0.0], 1.0)[..3]);
        let mut twisted = body([0.0, -9.0, 0.0], 1.0);
        twisted[2].swap(0, 1);
        mesh.extend(&twisted);
        assert_eq!(sides(&mesh), [1, 1, 1, 1, -1, -1, -1, -1, 0, 0, 0, 0, 0, 0, 0]);
    }

    /// A seam whose vertices differ by rounding, and triangles without area at it.
    #[test]
    fn a_seam_may_be_rounded() {
        let mut mesh = body([5.0, 1.0, -2.0], 1.0);
        mesh[0][1] = mesh[0][1].map(|x| x + 1e-7);
        let [a, b, _] = mesh[1];
        mesh.push([a, b, b]);
        assert_eq!(sides(&mesh)[..4], [1; 4]);
        assert!(sides(&[]).is_empty());
    }
}
