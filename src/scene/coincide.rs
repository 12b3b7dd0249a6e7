//! Coincident shapes. Where one certainly hides another, the hidden one is removed here, in `f64`; other coincidences are reported.
//!
//! Where two faces lie in one plane and overlap, rounding decides which of them a ray hits. The tie rule is the same for all
//! packet widths, for both intersectors and for the oracle: the face whose front faces the ray, then the first in the file.

use std::borrow::Borrow;

use glam::{DVec2, DVec3};

use super::{Mesh, Sphere, Surface};

/// A face: indices of its mesh and of the triangle.
type Face = [usize; 2];

/// Two faces with the same corners.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Twins {
    first: Face,
    second: Face,
    /// Whether both have the same front side.
    same_side: bool,
}

/// Pairs of faces with equal corners: each duplicate, with the first face in the file that has these corners.
fn twins<M: Borrow<Mesh>>(meshes: &[M]) -> Vec<Twins> {
    // The addition turns -0 into 0.
    let corner = |v: DVec3| v.to_array().map(|x| (x + 0.0).to_bits());
    let corners = |[mesh, face]: Face| {
        let mesh: &Mesh = meshes[mesh].borrow();
        mesh.triangles[face].map(|i| corner(mesh.vertices[i as usize]))
    };
    let sorted = |face| {
        let mut corners: [[u64; 3]; 3] = corners(face);
        corners.sort_unstable();
        corners
    };
    let mut faces = Vec::new();
    for (mesh, its) in meshes.iter().enumerate() {
        for face in 0..its.borrow().triangles.len() {
            let mixed = sorted([mesh, face]).as_flattened().iter().fold(0_u64, |hash, &bits| {
                (hash ^ bits).wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(29)
            });
            faces.push((mixed, [mesh, face]));
        }
    }
    faces.sort_unstable();
    let mut found = Vec::new();
    for group in faces.chunk_by(|a, b| a.0 == b.0).filter(|group| group.len() > 1) {
        for (i, &(_, second)) in group.iter().enumerate() {
            let Some(&(_, first)) = group[..i].iter().find(|(_, first)| sorted(*first) == sorted(second)) else {
                continue;
            };
            let (a, b) = (corners(first), corners(second));
            let same_side = (0..3).any(|turn| (0..3).all(|k| a[k] == b[(k + turn) % 3]));
            found.push(Twins {
                first,
                second,
                same_side,
            });
        }
    }
    found
}

/// Removes faces that have the corners of an earlier face and are hidden by it: if both have the same front side, if one of them
/// emits, or if both are of one mesh, unless only its front reflects. Returns a note for the user if there are any.
pub fn drop_twins<M: Borrow<Mesh>>(
    meshes: &mut [M],
    one_sided: impl Fn(&Surface) -> bool,
    keep: impl Fn(&mut M, &dyn Fn(usize) -> bool),
) -> Option<String> {
    let emits = |[mesh, _]: Face| matches!(meshes[mesh].borrow().surface, Surface::Emission(_));
    let hidden = |twins: &Twins| {
        let one_mesh = twins.first[0] == twins.second[0];
        let both_sides = !one_sided(&meshes[twins.first[0]].borrow().surface);
        twins.same_side || emits(twins.first) || emits(twins.second) || (one_mesh && both_sides)
    };
    let mut left_out: Vec<Twins> = twins(meshes);
    left_out.retain(hidden);
    let Twins { first, second, .. } = *left_out.first()?;
    let mut gone: Vec<Face> = left_out.iter().map(|twins| twins.second).collect();
    gone.sort_unstable();
    for group in gone.chunk_by(|a, b| a[0] == b[0]) {
        let mesh = group[0][0];
        keep(&mut meshes[mesh], &|face| group.binary_search(&[mesh, face]).is_err());
    }
    Some(format!(
        "{} triangles lie exactly on earlier ones, which hide them: left out (the first: of {} on one of {})",
        gone.len(),
        name(second[0]),
        name(first[0])
    ))
}

fn name(mesh: usize) -> String {
    format!("mesh {}", mesh + 1)
}

/// Of two spheres with one centre and radii that single precision cannot tell apart from the camera, removes the one that the other
/// hides from the camera. Returns a note for each pair.
pub fn drop_close(spheres: &mut Vec<Sphere>, origin: DVec3) -> Vec<String> {
    let mut order: Vec<usize> = (0..spheres.len()).collect();
    let key = |&i: &usize| {
        let Sphere { center, radius, .. } = spheres[i];
        [center.x, center.y, center.z, radius]
    };
    order.sort_by(|a, b| key(a).partial_cmp(&key(b)).unwrap_or(std::cmp::Ordering::Equal));
    let (mut gone, mut notes) = (Vec::new(), Vec::new());
    for pair in order.windows(2) {
        let (inner, outer) = (pair[0], pair[1]);
        let (a, b) = (&spheres[inner], &spheres[outer]);
        let distance = (a.center - origin).length();
        let bound = ONE_PLACE * (distance + b.radius);
        if a.center != b.center || b.radius - a.radius > bound {
            continue;
        }
        let hidden = if distance > b.radius {
            inner
        } else if distance < a.radius {
            outer
        } else {
            continue;
        };
        gone.push(hidden);
        notes.push(format!(
            "spheres {} and {} have one centre and radii that differ by {:.1e}, less than the {bound:.1e} that single precision tells \
             apart from here: sphere {}, which is behind, is left out",
            inner.min(outer) + 1,
            inner.max(outer) + 1,
            b.radius - a.radius,
            hidden + 1
        ));
    }
    let mut index = 0;
    spheres.retain(|_| {
        index += 1;
        !gone.contains(&(index - 1))
    });
    notes
}

/// Relative distance below which packets cannot distinguish a point from a plane: 16 half-ulps.
const ONE_PLACE: f64 = 16.0 / (1_u64 << 24) as f64;

/// Meshes with more faces than this are not tested for overlaps.
const MOST: usize = 4096;

/// Maximum number of tested face pairs.
const PAIRS: usize = 20_000_000;

/// A face, prepared for overlap tests.
#[derive(Clone, Copy, Debug)]
struct Flat {
    mesh: usize,
    corners: [DVec3; 3],
    normal: DVec3,
    low: DVec3,
    high: DVec3,
    /// Whether each of its edges is shared with another face of its mesh.
    closed: bool,
}

impl Flat {
    /// Whether all corners of another face lie in this one's plane.
    fn holds(&self, other: &Self) -> bool {
        let extent = self.high - self.low;
        other.corners.iter().all(|&p| {
            let size = self.normal.abs().dot(p.abs().max(self.corners[0].abs()) + extent);
            self.normal.dot(p - self.corners[0]).abs() <= ONE_PLACE * size
        })
    }

    /// Whether the two faces, in one plane, overlap: no edge of either separates them.
    fn covers(&self, other: &Self) -> bool {
        let axis = self.normal.abs().max_position();
        let flat = |p: DVec3| DVec2::new(p[(axis + 1) % 3], p[(axis + 2) % 3]);
        let (a, b) = (self.corners.map(flat), other.corners.map(flat));
        let parted = |a: [DVec2; 3], b: [DVec2; 3]| {
            (0..3).any(|i| {
                let (from, edge) = (a[i], a[(i + 1) % 3] - a[i]);
                let inward = edge.perp_dot(a[(i + 2) % 3] - from).signum();
                let margin = 1e-6 * edge.length();
                b.iter()
                    .all(|&p| inward * edge.perp_dot(p - from) <= margin * (p - from).length())
            })
        };
        !parted(a, b) && !parted(b, a)
    }
}

fn flats(mesh: usize, its: &Mesh, origin: DVec3) -> Vec<Flat> {
    if its.triangles.len() > MOST {
        return Vec::new();
    }
    let edges = |t: &[u32; 3]| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]].map(|[a, b]| [a.min(b), a.max(b)]);
    let mut all: Vec<[u32; 2]> = its.triangles.iter().flat_map(edges).collect();
    all.sort_unstable();
    let shared = |edge: &[u32; 2]| all.partition_point(|e| e <= edge) - all.partition_point(|e| e < edge) > 1;
    let flat = |t: &[u32; 3]| {
        let corners = t.map(|i| its.vertices[i as usize] - origin);
        let [a, b, c] = corners;
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        let margin = DVec3::splat(ONE_PLACE * low.abs().max(high.abs()).max_element());
        Flat {
            mesh,
            corners,
            normal: (b - a).cross(c - a).normalize_or_zero(),
            low: low - margin,
            high: high + margin,
            closed: edges(t).iter().all(shared),
        }
    };
    its.triangles.iter().map(flat).collect()
}

/// Pairs of meshes, by index, with visible overlapping faces in one plane; a mesh paired with itself has faces back to back. Also
/// returns whether all pairs were tested. The bottom of a body that stands on a floor does not count: it faces down, and its body
/// hides it.
pub fn overlaps<M: Borrow<Mesh>>(meshes: &[M], origin: DVec3) -> (Vec<[usize; 2]>, bool) {
    let numbered = meshes.iter().enumerate();
    let mut faces: Vec<Flat> = numbered.flat_map(|(i, mesh)| flats(i, mesh.borrow(), origin)).collect();
    faces.sort_by(|a, b| a.low.x.total_cmp(&b.low.x));
    let (mut found, mut pairs) = (Vec::new(), 0);
    for (i, a) in faces.iter().enumerate() {
        for b in faces[i + 1..].iter().take_while(|b| b.low.x <= a.high.x) {
            pairs += 1;
            if pairs > PAIRS {
                return (found, false);
            }
            let pair = [a.mesh.min(b.mesh), a.mesh.max(b.mesh)];
            let apart = a.low.y > b.high.y || b.low.y > a.high.y || a.low.z > b.high.z || b.low.z > a.high.z;
            let back_to_back = a.normal.dot(b.normal) < 0.0 && (a.closed || b.closed);
            if a.mesh == b.mesh || apart || back_to_back || found.contains(&pair) {
                continue;
            }
            if a.holds(b) && b.holds(a) && a.covers(b) {
                found.push(pair);
            }
        }
    }
    // Faces of two meshes with equal corners were found above. Those of one mesh are added here: both sides of its surface may be
    // needed.
    let backs = twins(meshes)
        .into_iter()
        .filter(|twins| !twins.same_side && twins.first[0] == twins.second[0]);
    for Twins { first, second, .. } in backs {
        let pair = [first[0], second[0]];
        if !found.contains(&pair) {
            found.push(pair);
        }
    }
    (found, true)
}

/// Sentences that name the meshes of [`overlaps`].
pub fn note_overlaps<M: Borrow<Mesh>>(meshes: &[M], pairs: &[[usize; 2]]) -> Vec<String> {
    let emits = |&mesh: &usize| matches!(meshes[mesh].borrow().surface, Surface::Emission(_));
    let sentence = |pair: &[usize; 2]| {
        let rule = if pair.iter().any(emits) {
            "how much light the covered part gives is a matter of chance; move one of them off the plane"
        } else {
            "there the one that looks at the ray is seen, then the first in the file; move one of them off the plane if that is not \
             what you want"
        };
        format!(
            "faces of {} and {} lie in one plane, as far as single precision tells, and cover each other: {rule}",
            name(pair[0]),
            name(pair[1])
        )
    };
    let mut said: Vec<String> = pairs.iter().filter(|[a, b]| a != b).take(3).map(sentence).collect();
    let more = pairs.iter().filter(|[a, b]| a != b).count().saturating_sub(3);
    if more > 0 {
        said.push(format!(
            "{more} more pairs of meshes have faces that cover each other in one plane"
        ));
    }
    said
}

#[cfg(test)]
mod tests;
