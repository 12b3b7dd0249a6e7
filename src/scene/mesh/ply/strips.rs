//! Triangle strips, and their orientation.
//!
//! A strip has one winding, but the format does not require the same winding for all strips. Programs that split a mesh into
//! strips quad by quad write some of them reversed. If the strips of a file form one closed surface, its outside is known, and
//! strips that face inwards are flipped.

use std::ops::Range;

use glam::DVec3;

/// The triangle range of each strip.
type Strips = [Range<usize>];

/// Flips strips that face inwards, where strips form a closed surface; returns how many. Strips of open or non-orientable
/// surfaces stay unchanged.
pub fn face_outwards(strips: &Strips, triangles: &mut [[u32; 3]], vertices: &[DVec3]) -> usize {
    let Some(sides) = sides(strips, triangles) else {
        return 0;
    };
    let six_times_volume = |range: &Range<usize>| {
        let corner = |i: u32| vertices.get(i as usize).copied().unwrap_or_default();
        let of = |[a, b, c]: [u32; 3]| corner(a).dot(corner(b).cross(corner(c)));
        triangles[range.clone()].iter().map(|&t| of(t)).sum::<f64>()
    };
    let mut volumes = vec![0.0; strips.len()];
    for (range, side) in strips.iter().zip(&sides) {
        let volume = six_times_volume(range);
        volumes[side.surface] += if side.turned { -volume } else { volume };
    }
    let mut count = 0;
    for (range, side) in strips.iter().zip(sides) {
        // The strips of a surface all face inwards or all outwards.
        if side.turned != (volumes[side.surface] < 0.0) {
            triangles[range.clone()].iter_mut().for_each(|t| t.swap(1, 2));
            count += 1;
        }
    }
    count
}

/// The surface of a strip, identified by its first strip, and whether the winding is opposite to that one's.
#[derive(Clone, Copy)]
struct Side {
    surface: usize,
    turned: bool,
}

/// The side of each strip; `None` unless every edge belongs to two triangles and each surface is orientable.
fn sides(strips: &Strips, triangles: &[[u32; 3]]) -> Option<Vec<Side>> {
    // Edges by their corners, the smaller one first, with the strip and whether the edge runs from the larger one.
    let mut edges = Vec::new();
    for (strip, range) in strips.iter().enumerate() {
        for [a, b, c] in &triangles[range.clone()] {
            edges.extend([(a, b), (b, c), (c, a)].map(|(a, b)| (*a.min(b), *a.max(b), strip, a > b)));
        }
    }
    edges.sort_unstable();
    let mut neighbours = vec![Vec::new(); strips.len()];
    let mut pairs = edges.chunks_exact(2);
    for pair in &mut pairs {
        let [(a, b, strip, back), (c, d, other, other_back)] = pair else {
            return None;
        };
        if (a, b) != (c, d) {
            return None;
        }
        neighbours[*strip].push((*other, back == other_back));
        neighbours[*other].push((*strip, back == other_back));
    }
    // If an edge occurs three times, some pair has different edges, or one edge is left over.
    if !pairs.remainder().is_empty() {
        return None;
    }
    let mut sides: Vec<Option<Side>> = vec![None; strips.len()];
    for surface in 0..strips.len() {
        if sides[surface].is_some() {
            continue;
        }
        let mut todo = vec![(surface, false)];
        while let Some((strip, turned)) = todo.pop() {
            match sides[strip] {
                Some(known) if known.turned != turned => return None,
                Some(_) => {}
                None => {
                    sides[strip] = Some(Side { surface, turned });
                    todo.extend(
                        neighbours[strip]
                            .iter()
                            .map(|&(other, against)| (other, turned != against)),
                    );
                }
            }
        }
    }
    sides.into_iter().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOX: [[f64; 3]; 8] = [
        [0.0, 0.0, 0.0],
        [2.0, 0.0, 0.0],
        [2.0, 1.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, 0.0, 3.0],
        [2.0, 0.0, 3.0],
        [2.0, 1.0, 3.0],
        [0.0, 1.0, 3.0],
    ];
    /// The sides of the box, one strip each; seen from outside their corners are counter-clockwise, except in flipped strips.
    const STRIPS: [[u32; 4]; 6] = [
        [3, 2, 0, 1],
        [4, 5, 7, 6],
        [0, 1, 4, 5],
        [1, 2, 5, 6],
        [2, 3, 6, 7],
        [3, 0, 7, 4],
    ];

    fn mesh(turned: u32) -> (Vec<Range<usize>>, Vec<[u32; 3]>) {
        let mut triangles = Vec::new();
        for (i, [a, b, c, d]) in STRIPS.into_iter().enumerate() {
            let (b, c) = if turned >> i & 1 == 1 { (c, b) } else { (b, c) };
            triangles.extend([[a, b, c], [c, b, d]]);
        }
        ((0..6).map(|i| 2 * i..2 * i + 2).collect(), triangles)
    }

    /// Whichever sides of a box are flipped, all face outwards afterwards: its volume is 6.
    #[test]
    fn all_sides_of_a_closed_box_face_outwards() {
        let vertices = BOX.map(DVec3::from_array);
        for turned in 0..64_u32 {
            let (strips, mut triangles) = mesh(turned);
            assert_eq!(
                face_outwards(&strips, &mut triangles, &vertices),
                turned.count_ones() as usize
            );
            let volume: f64 = triangles
                .iter()
                .map(|t| {
                    let [a, b, c] = t.map(|i| vertices[i as usize]);
                    a.dot(b.cross(c)) / 6.0
                })
                .sum();
            assert!((volume - 6.0).abs() < 1e-12, "{turned:b}: {volume}");
        }
    }

    #[test]
    fn two_boxes_and_none_are_no_matter() {
        let vertices: Vec<DVec3> = (0..2)
            .flat_map(|i| BOX.map(|v| DVec3::from_array(v) + DVec3::X * 9.0 * f64::from(i)))
            .collect();
        let (mut strips, mut triangles) = mesh(0b00_0100);
        let (more, second) = mesh(0b11_1011);
        strips.extend(more.iter().map(|range| range.start + 12..range.end + 12));
        triangles.extend(second.iter().map(|t| t.map(|i| i + 8)));
        assert_eq!(face_outwards(&strips, &mut triangles, &vertices), 6);
        assert_eq!(face_outwards(&strips, &mut triangles, &vertices), 0);
        assert_eq!(face_outwards(&[], &mut [[0, 1, 2]], &vertices), 0);
    }

    #[test]
    fn what_is_not_closed_stays_as_it_is() {
        let vertices = BOX.map(DVec3::from_array);
        for left_out in 0..6 {
            let (mut strips, mut triangles) = mesh(0b10_1010);
            strips.remove(left_out);
            let before = triangles.clone();
            assert_eq!(face_outwards(&strips, &mut triangles, &vertices), 0);
            assert_eq!(triangles, before);
        }
    }
}
