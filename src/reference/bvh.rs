//! A simple bounding volume hierarchy, sufficient for meshes of a million triangles.

use super::geometry::{Bounds, Meeting, Ray, Shape};

/// A leaf holds at most this many shapes.
const LEAF: usize = 4;

/// Shapes sorted into a binary tree by their centres, split at the median of the longest side at every level: the depth is
/// log2(n / LEAF) for any scene.
#[derive(Debug)]
pub struct Bvh {
    nodes: Vec<Node>,
    /// Indices of shapes, ordered so that those of a leaf are contiguous.
    order: Vec<u32>,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    bounds: Bounds,
    content: Content,
}

/// The left child of a branch is the node after it.
#[derive(Clone, Copy, Debug)]
enum Content {
    Branch { right: u32 },
    Leaf { first: u32, count: u32 },
}

impl Bvh {
    /// Builds the hierarchy.
    pub fn new(shapes: &[Shape]) -> Self {
        let bounds: Vec<Bounds> = shapes.iter().map(Shape::bounds).collect();
        let mut order: Vec<u32> = (0..shapes.len() as u32).collect();
        let mut nodes = Vec::with_capacity(shapes.len());
        build(&bounds, &mut order, 0, &mut nodes);
        Self { nodes, order }
    }

    /// The index and hit of the shape that the ray hits first, nearer than `far`, ignoring the shape `except`.
    ///
    /// Of shapes at equal distance, within the rounding error, a front face wins, then the first in the scene.
    pub fn nearest(&self, shapes: &[Shape], ray: &Ray, far: f64, except: Option<u32>) -> Option<(u32, Meeting)> {
        let inverse = ray.direction.recip();
        let enter = |node: u32, far| self.nodes[node as usize].bounds.enter(ray.origin, inverse, far);
        let mut best: Option<(u32, Meeting)> = None;
        let end = far;
        let mut far = far;
        let mut todo = Vec::with_capacity(64);
        todo.extend(enter(0, far).map(|distance| (0, distance)));
        while let Some((node, distance)) = todo.pop() {
            if distance > far {
                continue;
            }
            match self.nodes[node as usize].content {
                Content::Leaf { first, count } => {
                    for &index in &self.order[first as usize..(first + count) as usize] {
                        if Some(index) != except
                            && let Some(meeting) = shapes[index as usize].meet(ray, far)
                            && best.is_none_or(|first| wins(shapes, ray, (index, meeting), first))
                        {
                            // Hits slightly farther may still count as equally near.
                            far = (meeting.distance + error(&shapes[index as usize], &meeting)).min(end);
                            best = Some((index, meeting));
                        }
                    }
                }
                Content::Branch { right } => {
                    let mut children = [node + 1, right].map(|child| enter(child, far).map(|at| (child, at)));
                    // The nearer child goes on top of the stack.
                    children.sort_by(|a, b| {
                        b.map_or(f64::INFINITY, |(_, at)| at)
                            .total_cmp(&a.map_or(f64::INFINITY, |(_, at)| at))
                    });
                    todo.extend(children.into_iter().flatten());
                }
            }
        }
        best
    }
}

impl Bvh {
    /// Calls `visit` with the index of every shape whose box, grown by `margin` on all sides, the ray enters before `far` and
    /// before the last distance that `visit` returned.
    pub fn near(&self, ray: &Ray, far: f64, margin: &dyn Fn(&Bounds) -> f64, visit: &mut dyn FnMut(u32) -> f64) {
        let (inverse, mut limit) = (ray.direction.recip(), far);
        let mut todo = vec![0];
        while let Some(node) = todo.pop() {
            let Node { bounds, content } = self.nodes[node as usize];
            if bounds.min.x > bounds.max.x {
                continue;
            }
            let margin = margin(&bounds);
            let grown = Bounds {
                min: bounds.min - margin,
                max: bounds.max + margin,
            };
            if grown.enter(ray.origin, inverse, limit).is_none() {
                continue;
            }
            match content {
                Content::Leaf { first, count } => {
                    for &index in &self.order[first as usize..(first + count) as usize] {
                        limit = limit.min(visit(index));
                    }
                }
                Content::Branch { right } => todo.extend([right, node + 1]),
            }
        }
    }
}

/// The rounding error of a distance.
fn error(shape: &Shape, meeting: &Meeting) -> f64 {
    shape.offset() + 1e-12 * meeting.distance
}

/// Whether a hit takes precedence over another one.
fn wins(shapes: &[Shape], ray: &Ray, (index, new): (u32, Meeting), (first, old): (u32, Meeting)) -> bool {
    let (shape, other) = (&shapes[index as usize], &shapes[first as usize]);
    if (new.distance - old.distance).abs() > error(shape, &new).max(error(other, &old)) {
        return new.distance < old.distance;
    }
    let looks_away = |shape: &Shape, meeting| shape.normal(shape.point(ray, meeting)).dot(ray.direction) > 0.0;
    (looks_away(shape, &new), index) < (looks_away(other, &old), first)
}

/// Appends the subtree of `order`, whose first element has index `first` in the whole.
fn build(bounds: &[Bounds], order: &mut [u32], first: u32, nodes: &mut Vec<Node>) {
    let of = |index: &u32| &bounds[*index as usize];
    let around = order.iter().fold(Bounds::EMPTY, |sum, index| sum.union(*of(index)));
    let here = nodes.len();
    nodes.push(Node {
        bounds: around,
        content: Content::Leaf {
            first,
            count: order.len() as u32,
        },
    });
    if order.len() <= LEAF {
        return;
    }
    let centers = order.iter().map(|index| of(index).center());
    let (low, high) = centers.fold((around.max, around.min), |(low, high), c| (low.min(c), high.max(c)));
    let axis = (high - low).max_position();
    let middle = order.len() / 2;
    order.select_nth_unstable_by(middle, |a, b| of(a).center()[axis].total_cmp(&of(b).center()[axis]));
    let (left, right) = order.split_at_mut(middle);
    build(bounds, left, first, nodes);
    nodes[here].content = Content::Branch {
        right: nodes.len() as u32,
    };
    build(bounds, right, first + middle as u32, nodes);
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64;

    use super::*;

    fn point(rng: &mut Pcg64, scale: f64) -> DVec3 {
        scale * (2.0 * DVec3::new(rng.random(), rng.random(), rng.random()) - 1.0)
    }

    /// Triangles and spheres of very different sizes; every fourth triangle lies in an axis-aligned plane, which gives boxes
    /// without thickness.
    fn shapes(rng: &mut Pcg64, count: usize) -> Vec<Shape> {
        (0..count)
            .map(|i| {
                let (at, size) = (point(rng, 3.0), 10.0_f64.powf(rng.random_range(-3.0..0.3)));
                if i % 3 == 0 {
                    return Shape::Sphere {
                        center: at,
                        radius: 0.5 * size,
                    };
                }
                let flat = if i % 4 == 0 {
                    DVec3::new(1.0, 0.0, 1.0)
                } else {
                    DVec3::ONE
                };
                Shape::Triangle([0, 1, 2].map(|_| at + flat * point(rng, size)))
            })
            .collect()
    }

    #[test]
    fn the_tree_finds_what_trying_every_shape_finds() {
        let mut rng = Pcg64::seed_from_u64(3);
        let mut hits = 0;
        for count in [1, 4, 5, 7, 40, 1000] {
            let shapes = shapes(&mut rng, count);
            let tree = Bvh::new(&shapes);
            for number in 0..2000 {
                let origin = point(&mut rng, 4.0);
                let direction = match number % 5 {
                    0 => DVec3::AXES[number / 5 % 3], // infinite reciprocals
                    1 => point(&mut rng, 1.0),
                    _ => shapes[number % count].bounds().center() - origin,
                };
                let ray = Ray {
                    origin,
                    direction: direction.normalize(),
                };
                let except = (number % 2 == 0).then_some(number as u32 % count as u32);
                let found = tree.nearest(&shapes, &ray, 5.0, except);
                let every = (0..count as u32).filter(|&index| Some(index) != except);
                let expected = every
                    .filter_map(|index| Some((index, shapes[index as usize].meet(&ray, 5.0)?)))
                    .min_by(|a, b| a.1.distance.total_cmp(&b.1.distance));
                assert_eq!(
                    found.map(|(index, meeting)| (index, meeting.distance)),
                    expected.map(|(index, meeting)| (index, meeting.distance)),
                    "{count} shapes, ray {number}"
                );
                hits += u32::from(found.is_some());
            }
        }
        assert!(
            hits > 3000,
            "only {hits} of 12000 rays hit anything: the test tests too little"
        );
    }

    #[test]
    fn a_scene_of_nothing_is_never_hit() {
        let tree = Bvh::new(&[]);
        let ray = Ray {
            origin: DVec3::ZERO,
            direction: DVec3::X,
        };
        assert!(tree.nearest(&[], &ray, f64::INFINITY, None).is_none());
    }
}
