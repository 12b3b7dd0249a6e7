//! Shapes that coincide: what hides the other for certain is decided here, in `f64`; the rest is named.
//!
//! Where two faces lie in one plane and cover each other, rounding decides which of them a ray meets. The rule is the same for every
//! width of packets, for both intersectors and for the oracle: the face that looks at the ray, then the first in the file.

use std::borrow::Borrow;

use glam::{DVec2, DVec3};

use super::{Mesh, Sphere, Surface};

/// A face: number of its mesh, and its own.
type Face = [usize; 2];

/// Two faces with the same corners.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Twins {
    first: Face,
    second: Face,
    /// Whether both look to the same side.
    same_side: bool,
}

/// Faces whose corners are the same numbers; each second one once, with the first of its place in the file.
fn twins<M: Borrow<Mesh>>(meshes: &[M]) -> Vec<Twins> {
    // The sum makes one zero of the two.
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

/// Leaves out faces that lie exactly on an earlier one that hides them: those that look to the same side, those beside one that
/// emits, and those of one mesh unless only its front reflects. Returns a sentence if there are any.
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

/// Leaves out spheres that have the centre of another one and a radius that packets do not tell from its, on the side that the
/// camera does not see: nothing of them can be seen. A sentence names each pair.
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

/// What is nearer to a plane than this part of the numbers involved is in it, as far as packets can tell: 16 half-ulps.
const ONE_PLACE: f64 = 16.0 / (1_u64 << 24) as f64;

/// Meshes with more faces than this are not asked whether they overlap others.
const MOST: usize = 4096;

/// So many pairs of faces are looked at, at most.
const PAIRS: usize = 20_000_000;

/// A face in the plane of others.
#[derive(Clone, Copy, Debug)]
struct Flat {
    mesh: usize,
    corners: [DVec3; 3],
    normal: DVec3,
    low: DVec3,
    high: DVec3,
    /// Whether another face of its mesh is at each of its edges.
    closed: bool,
}

impl Flat {
    /// Whether all corners of another face are in this one's plane.
    fn holds(&self, other: &Self) -> bool {
        let extent = self.high - self.low;
        other.corners.iter().all(|&p| {
            let size = self.normal.abs().dot(p.abs().max(self.corners[0].abs()) + extent);
            self.normal.dot(p - self.corners[0]).abs() <= ONE_PLACE * size
        })
    }

    /// Whether the two, in one plane, cover a common part: no edge of either has them on its two sides.
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

/// Pairs of meshes, by their numbers, that have faces in one plane which cover each other and may be seen there; and whether all
/// were looked at. The bottom of a body that stands on a floor is none: it looks down, and its body hides it.
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
    // Those of two meshes are found above; in one mesh both sides of a sheet may be needed.
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
mod tests {
    use super::*;

    fn mesh(vertices: &[[f64; 3]], triangles: &[[u32; 3]], surface: Surface) -> Mesh {
        Mesh {
            vertices: vertices.iter().copied().map(DVec3::from_array).collect(),
            triangles: triangles.to_vec(),
            normals: None,
            uvs: None,
            surface,
        }
    }

    const FLOOR: [[f64; 3]; 4] = [[-9.0, 0.0, 9.0], [9.0, 0.0, 9.0], [9.0, 0.0, -9.0], [-9.0, 0.0, -9.0]];
    const CAMERA: DVec3 = DVec3::new(0.3, 2.0, 4.0);

    fn floor(triangles: &[[u32; 3]], material: usize) -> Mesh {
        mesh(&FLOOR, triangles, Surface::Material(material))
    }

    /// A box of side 1 around `(x, y, 0)`.
    fn body(x: f64, y: f64) -> Mesh {
        let corner = |i: u32| [x + f64::from(i & 1), y + f64::from(i >> 1 & 1), f64::from(i >> 2 & 1)];
        let vertices: Vec<[f64; 3]> = (0..8).map(corner).collect();
        let sides = [
            [0, 2, 3, 1],
            [4, 5, 7, 6],
            [0, 1, 5, 4],
            [2, 6, 7, 3],
            [0, 4, 6, 2],
            [1, 3, 7, 5],
        ];
        let triangles: Vec<[u32; 3]> = sides.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
        mesh(&vertices, &triangles, Surface::Material(0))
    }

    fn pairs(meshes: &[Mesh]) -> Vec<[usize; 2]> {
        overlaps(meshes, CAMERA).0
    }

    #[test]
    fn what_lies_exactly_on_an_earlier_face_is_left_out() {
        let keep = |mesh: &mut Mesh, kept: &dyn Fn(usize) -> bool| {
            let mut numbers = 0..;
            mesh.triangles.retain(|_| numbers.next().is_some_and(kept));
        };
        let (up, down) = ([[0, 1, 2], [0, 2, 3]], [[2, 1, 0], [0, 3, 2]]);
        let glow = || mesh(&FLOOR, &[[2, 1, 0], [0, 3, 2]], Surface::Emission(DVec3::ONE));
        // Meshes, whether only fronts reflect, and how many faces are left of the second.
        for (mut meshes, one_sided, left) in [
            (vec![floor(&up, 0), floor(&[[1, 2, 0], [3, 0, 2]], 1)], false, 0),
            (vec![floor(&up, 0), floor(&[[0, 1, 2], [0, 1, 3]], 1)], false, 1),
            (vec![floor(&up, 0), floor(&down, 1)], true, 2),
            (vec![floor(&up, 0), glow()], false, 0),
            (vec![glow(), floor(&up, 0)], false, 0),
        ] {
            let said = drop_twins(&mut meshes, |_| one_sided, keep);
            assert_eq!((meshes[0].triangles.len(), meshes[1].triangles.len()), (2, left));
            assert_eq!(said.is_some(), left < 2);
        }
        // Both sides of a sheet in one mesh: needed where only fronts reflect.
        for (one_sided, left) in [(true, 4), (false, 2)] {
            let mut meshes = vec![floor(&[up, down].concat(), 0)];
            drop_twins(&mut meshes, |_| one_sided, keep);
            assert_eq!(meshes[0].triangles.len(), left);
        }
    }

    #[test]
    fn meshes_that_cover_each_other_in_a_plane_are_found_and_others_are_not() {
        let up = [[0, 1, 2], [0, 2, 3]];
        let rug = |y: f64, triangles: &[[u32; 3]]| {
            mesh(
                &[[-1.0, y, 1.0], [1.0, y, 1.0], [0.0, y, -1.0]],
                triangles,
                Surface::Material(1),
            )
        };
        let beside = mesh(
            &[[9.0, 0.0, 9.0], [20.0, 0.0, 9.0], [9.0, 0.0, -9.0]],
            &[[0, 1, 2]],
            Surface::Material(1),
        );
        assert_eq!(pairs(&[floor(&up, 0), rug(0.0, &[[0, 1, 2]])]), [[0, 1]]);
        assert_eq!(
            pairs(&[floor(&up, 0), rug(1e-9, &[[0, 1, 2]])]),
            [[0, 1]],
            "as far as packets tell"
        );
        assert_eq!(
            pairs(&[floor(&up, 0), rug(0.0, &[[0, 2, 1]])]),
            [[0, 1]],
            "an open sheet, wound the other way"
        );
        assert!(pairs(&[floor(&up, 0), rug(1e-3, &[[0, 1, 2]])]).is_empty());
        assert!(pairs(&[floor(&up, 0), beside]).is_empty(), "they share an edge");
        assert!(
            pairs(&[floor(&up, 0), body(0.0, 0.0)]).is_empty(),
            "a box that stands on the floor hides its bottom"
        );
        assert!(
            pairs(&[body(0.0, 0.0), body(1.0, 0.0)]).is_empty(),
            "boxes side by side hide what touches"
        );
        assert_eq!(
            pairs(&[body(0.0, 0.0), body(0.5, 0.0)]),
            [[0, 1]],
            "boxes in each other have tops in one plane"
        );
    }

    #[test]
    fn of_spheres_with_one_centre_the_one_behind_goes() {
        let sphere = |radius: f64| Sphere {
            center: DVec3::ZERO,
            radius,
            surface: Surface::Material(0),
        };
        for (camera, kept) in [(DVec3::X * 5.0, 1.0 + 1e-9), (DVec3::X * 0.5, 1.0)] {
            for order in [[1.0, 1.0 + 1e-9], [1.0 + 1e-9, 1.0]] {
                let mut spheres = order.map(sphere).to_vec();
                let notes = drop_close(&mut spheres, camera);
                assert_eq!((spheres.len(), spheres[0].radius, notes.len()), (1, kept, 1));
            }
        }
        let mut apart = vec![sphere(1.0), sphere(1.001)];
        assert!(drop_close(&mut apart, DVec3::X * 5.0).is_empty() && apart.len() == 2);
    }
}
