//! Strips of triangles, and which side of them is the front.
//!
//! A strip has one winding, but nothing in the format says that two strips have the same. Programs that cut a mesh into strips
//! quad by quad write some of them the other way round. Where the strips of a file make one closed surface, its outside is known,
//! and strips that face inwards are turned.

use std::ops::Range;

use glam::DVec3;

/// Each strip's place among the triangles.
type Strips = [Range<usize>];

/// Turns the strips of a closed surface that face inwards; returns how many. Strips that do not close a surface, or only one that
/// has no outside, stay as they are.
pub fn face_outwards(strips: &Strips, triangles: &mut [[u32; 3]], vertices: &[DVec3]) -> usize {
    let Some(turned) = sides(strips, triangles) else {
        return 0;
    };
    let volume = |range: &Range<usize>| {
        let corner = |i: u32| vertices.get(i as usize).copied().unwrap_or_default();
        let six_times = |[a, b, c]: [u32; 3]| corner(a).dot(corner(b).cross(corner(c)));
        triangles[range.clone()].iter().map(|&t| six_times(t)).sum::<f64>()
    };
    let signed = strips
        .iter()
        .zip(&turned)
        .map(|(range, &turned)| if turned { -volume(range) } else { volume(range) });
    // The sides that were found are all inside or all outside.
    let inwards = signed.sum::<f64>() < 0.0;
    let mut count = 0;
    for (range, turned) in strips.iter().zip(turned) {
        if turned != inwards {
            triangles[range.clone()].iter_mut().for_each(|t| t.swap(1, 2));
            count += 1;
        }
    }
    count
}

/// Of each strip, whether it must be turned to have the winding of the first; `None` unless the strips make one closed surface, in
/// which every edge belongs to two triangles, and can have one winding.
fn sides(strips: &Strips, triangles: &[[u32; 3]]) -> Option<Vec<bool>> {
    // Edges by their corners, the smaller one first, with the strip and whether it goes from the larger one.
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
    // Three of one edge in a row leave a pair of different ones, or one over.
    if !pairs.remainder().is_empty() {
        return None;
    }
    let mut turned = vec![None; strips.len()];
    let mut todo = vec![(0, false)];
    while let Some((strip, side)) = todo.pop() {
        match turned[strip] {
            Some(known) if known != side => return None,
            Some(_) => {}
            None => {
                turned[strip] = Some(side);
                todo.extend(
                    neighbours[strip]
                        .iter()
                        .map(|&(other, against)| (other, side != against)),
                );
            }
        }
    }
    turned.into_iter().collect()
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
    /// The sides of the box, each a strip; seen from outside their corners go round counter-clockwise, but for those that are turned.
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

    /// Whichever sides of a box are turned, all face outwards in the end: its volume is 6.
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
