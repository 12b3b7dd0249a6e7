//! Builds the tree top-down, by the split of least variance, in `f64`.

use super::{LEAF, LEAST_POWER, LEAST_VARIANCE, LightTree, Node};

/// A light as input to the tree.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Emitter {
    /// Light index.
    pub light: u32,
    /// Center.
    pub mean: [f32; 3],
    /// Variance of its surface around the center, along each axis.
    pub variance: [f32; 3],
    /// The directions of its emission.
    pub emission: Emission,
    /// Its intensity along the normal, or anywhere. Positive and finite.
    pub intensity: f64,
}

/// The directions in which a light emits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Emission {
    /// Equally in all directions.
    Round,
    /// Flat, with a unit normal: as the cosine on both sides.
    BothSides([f32; 3]),
    /// As the cosine on the side of a unit normal alone.
    OneSide([f32; 3]),
}

impl Emission {
    /// The power of a light for its intensity, so that [`Node`]'s importance is right for a single light of any kind. Powers are
    /// proportional to the light that is sent out, within 25 %.
    pub(super) fn power(self) -> f64 {
        use std::f64::consts::PI;
        match self {
            Self::Round => (6.0 * PI).sqrt(),
            Self::BothSides(_) => (2.0 * PI).sqrt(),
            Self::OneSide(_) => 1.0,
        }
    }
}

impl Emitter {
    fn power(&self) -> f64 {
        self.emission.power() * self.intensity
    }
}

/// Number of candidate split positions.
const BINS: usize = 12;

/// From this depth on, nodes are split by count. This bounds the depth to this plus 32 for any lights.
const DEEPEST: u32 = 40;

/// If both children of a node have more lights than this, they are built in parallel. Does not affect the result.
const ALONE: usize = 1 << 13;

/// Moments of a set of lights.
#[derive(Clone, Copy, Default)]
struct Moments {
    power: f64,
    mean: [f64; 3],
    variance: [f64; 3],
    normals: [f64; 5],
    facing: [f64; 3],
}

impl Moments {
    fn of(emitter: &Emitter, total: f64) -> Self {
        let squares = |[x, y, z]: [f64; 3]| [x * x, y * y, x * y, x * z, y * z];
        let (normals, facing) = match emitter.emission {
            Emission::Round => ([1.0 / 3.0, 1.0 / 3.0, 0.0, 0.0, 0.0], [0.0; 3]),
            Emission::BothSides(n) => (squares(n.map(f64::from)), [0.0; 3]),
            Emission::OneSide(n) => (squares(n.map(f64::from)), n.map(f64::from)),
        };
        Self {
            power: f64::from(LightTree::share(emitter.power(), total)),
            mean: emitter.mean.map(f64::from),
            variance: emitter.variance.map(f64::from),
            normals,
            facing,
        }
    }

    fn and(&self, other: &Self) -> Self {
        let power = self.power + other.power;
        let (a, b) = (self.power / power, other.power / power);
        let mean: [f64; 3] = std::array::from_fn(|k| a * self.mean[k] + b * other.mean[k]);
        let around = |m: &Self, k: usize| m.variance[k] + (m.mean[k] - mean[k]).powi(2);
        Self {
            power,
            mean,
            variance: std::array::from_fn(|k| a * around(self, k) + b * around(other, k)),
            normals: std::array::from_fn(|k| a * self.normals[k] + b * other.normals[k]),
            facing: std::array::from_fn(|k| a * self.facing[k] + b * other.facing[k]),
        }
    }

    fn node(&self, link: u32) -> Node {
        // The upper half of the digits, rounded up so that what is positive stays so.
        let upper = |x: f64, least: f32| (((x as f32).max(least).to_bits() + 0xffff) >> 16) as u16;
        let byte = |x: f64| (x * 127.0).round() as i8;
        Node {
            mean: self.mean.map(|x| x as f32),
            power: upper(self.power, LEAST_POWER),
            variance: self.variance.map(|v| upper(v, LEAST_VARIANCE)),
            normals: self.normals.map(byte),
            facing: self.facing.map(byte),
            link,
        }
    }
}

/// The element that is reordered during the build.
#[derive(Clone, Copy)]
struct Item {
    mean: [f32; 3],
    power: f32,
    emitter: u32,
}

/// Data that is constant during the build.
struct All<'a> {
    emitters: &'a [Emitter],
    total: f64,
}

impl LightTree {
    /// Builds a tree over lights in the given order. The tree is the same for any number of threads.
    pub fn new(emitters: &[Emitter]) -> Self {
        if emitters.is_empty() {
            return Self::default();
        }
        let total = emitters.iter().map(Emitter::power).sum();
        let all = All { emitters, total };
        let mut items: Vec<Item> = (0..)
            .zip(emitters)
            .map(|(i, emitter)| Item {
                mean: emitter.mean,
                power: Self::share(emitter.power(), total),
                emitter: i,
            })
            .collect();
        let nothing = Moments::default().node(LEAF);
        let mut nodes = vec![nothing; 2 * emitters.len()];
        let (root, below) = nodes.split_at_mut(2);
        let (link, moments) = all.build(&mut items, below, 2, 0, 0);
        root[0] = moments.node(link);
        let lights = items.iter().map(|item| emitters[item.emitter as usize].light).collect();
        let powers = items.iter().map(|item| item.power).collect();
        Self { nodes, lights, powers }
    }
}

impl All<'_> {
    /// Builds the subtree over `items`, whose first leaf is `leaf`. `nodes` are the subtree's nodes; the first has the number
    /// `first`. Returns the link of the subtree's root and its moments.
    fn build(&self, items: &mut [Item], nodes: &mut [Node], first: u32, leaf: u32, depth: u32) -> (u32, Moments) {
        if let [item] = items {
            let emitter = &self.emitters[item.emitter as usize];
            return (LEAF | leaf, Moments::of(emitter, self.total));
        }
        let cut = split(items, depth);
        let apart = cut.min(items.len() - cut) > ALONE;
        let (left, right) = items.split_at_mut(cut);
        let (pair, below) = nodes.split_at_mut(2);
        let (below_left, below_right) = below.split_at_mut(2 * (cut - 1));
        let (cut, after) = (cut as u32, first + 2);
        let a = || self.build(left, below_left, after, leaf, depth + 1);
        let b = || self.build(right, below_right, after + 2 * (cut - 1), leaf + cut, depth + 1);
        let (a, b) = if apart {
            rayon::join(a, b)
        } else {
            let (mut a, mut b) = (a, b);
            (a(), b())
        };
        pair[0] = a.1.node(a.0);
        pair[1] = b.1.node(b.0);
        (first, a.1.and(&b.1))
    }
}

/// Power, and power-weighted sums of positions and their squares, relative to a nearby point.
#[derive(Clone, Copy, Default)]
struct Sums {
    power: f64,
    first: [f64; 3],
    second: [f64; 3],
}

impl Sums {
    fn add(&mut self, item: &Item, about: [f32; 3]) {
        let power = f64::from(item.power);
        self.power += power;
        for (k, about) in about.into_iter().enumerate() {
            let x = f64::from(item.mean[k] - about);
            self.first[k] += power * x;
            self.second[k] += power * x * x;
        }
    }

    fn and(&self, other: &Self) -> Self {
        Self {
            power: self.power + other.power,
            first: std::array::from_fn(|k| self.first[k] + other.first[k]),
            second: std::array::from_fn(|k| self.second[k] + other.second[k]),
        }
    }

    /// Power times the variance along an axis.
    fn scatter(&self, k: usize) -> f64 {
        if self.power > 0.0 {
            (self.second[k] - self.first[k] * self.first[k] / self.power).max(0.0)
        } else {
            0.0
        }
    }

    fn cost(&self) -> f64 {
        (0..3).map(|k| self.scatter(k)).sum()
    }
}

/// Partitions items into two nonempty parts and returns the size of the first: along the axis of largest variance, where the sum of
/// power times variance over both parts is least.
fn split(items: &mut [Item], depth: u32) -> usize {
    if let [a, b] = items {
        // What the rule below finds. Half of all nodes have two lights.
        let apart = |k: usize| (a.mean[k] - b.mean[k]).abs();
        let axis = (0..3).max_by(|&i, &j| apart(i).total_cmp(&apart(j))).unwrap_or(0);
        if a.mean[axis] > b.mean[axis] {
            items.swap(0, 1);
        }
        return 1;
    }
    let half = items.len() / 2;
    let about = items[0].mean;
    let (mut low, mut high, mut sums) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3], Sums::default());
    for item in &*items {
        sums.add(item, about);
        for k in 0..3 {
            (low[k], high[k]) = (low[k].min(item.mean[k]), high[k].max(item.mean[k]));
        }
    }
    let wide = |&k: &usize| high[k] > low[k];
    let Some(axis) = (0..3)
        .filter(wide)
        .max_by(|&a, &b| sums.scatter(a).total_cmp(&sums.scatter(b)))
    else {
        return half;
    };
    if depth >= DEEPEST {
        items.select_nth_unstable_by(half, |a, b| {
            a.mean[axis].total_cmp(&b.mean[axis]).then(a.emitter.cmp(&b.emitter))
        });
        return half;
    }
    let scale = BINS as f32 / (high[axis] - low[axis]);
    let bin = |item: &Item| (((item.mean[axis] - low[axis]) * scale) as usize).min(BINS - 1);
    let (mut bins, mut counts) = ([Sums::default(); BINS], [0; BINS]);
    for item in &*items {
        bins[bin(item)].add(item, about);
        counts[bin(item)] += 1;
    }
    // For each split, the cost of the part behind it; then sums from the front.
    let mut behind = [Sums::default(); BINS + 1];
    for i in (0..BINS).rev() {
        behind[i] = if counts[i] > 0 {
            behind[i + 1].and(&bins[i])
        } else {
            behind[i + 1]
        };
    }
    let (mut front, mut best) = (Sums::default(), (f64::INFINITY, 1));
    // An empty bin changes no cost.
    for i in (1..BINS).filter(|&i| counts[i - 1] > 0) {
        front = front.and(&bins[i - 1]);
        let cost = front.cost() + behind[i].cost();
        if cost < best.0 {
            best = (cost, i);
        }
    }
    let mut cut = 0;
    for i in 0..items.len() {
        // Swapping always is faster: half of the branches would be mispredicted.
        let low = bin(&items[i]) < best.1;
        items.swap(i, cut);
        cut += usize::from(low);
    }
    // The lowest item is in the first bin and the highest in the last, so both parts are nonempty, except for rounding.
    if (1..items.len()).contains(&cut) { cut } else { half }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::hash::mix;

    fn lights(number: u32, flat: bool) -> Vec<Emitter> {
        let unit = |i: u32| f64::from(mix(i)) / 4_294_967_296.0;
        (0..number)
            .map(|i| Emitter {
                light: i,
                mean: std::array::from_fn(|k| 10.0 * unit(7 * i + k as u32) as f32),
                variance: [1e-4; 3],
                emission: if flat {
                    Emission::OneSide([0.6, 0.0, -0.8])
                } else {
                    Emission::Round
                },
                intensity: 1.0 + unit(7 * i + 5),
            })
            .collect()
    }

    /// Every light is one leaf; positions and lights are inverse maps; powers add up; variances are positive.
    #[test]
    fn a_tree_holds_every_light_once() {
        for number in [1, 2, 3, 17, 1000] {
            let emitters = lights(number, false);
            let tree = LightTree::new(&emitters);
            assert_eq!(tree.len(), number as usize);
            let places = tree.places(number as usize);
            let (mut open, mut leaves) = (vec![0], 0);
            while let Some(at) = open.pop() {
                let node = tree.node(at);
                assert!(node.power() > 0.0 && node.spread().iter().all(|&v| v >= LEAST_VARIANCE));
                match node.leaf() {
                    Some(leaf) => {
                        assert_eq!(places[tree.light(leaf) as usize], leaf);
                        assert_eq!(leaf, leaves, "leaves come in their order");
                        leaves += 1;
                    }
                    None => {
                        let [a, b] = [tree.node(node.link), tree.node(node.link + 1)];
                        // Each is rounded up by at most one part in 128.
                        assert!((a.power() + b.power() - node.power()).abs() <= node.power() / 64.0);
                        open.extend([node.link + 1, node.link]);
                    }
                }
            }
            assert_eq!(leaves, number);
        }
    }

    /// Compared with sums over all lights at once.
    #[test]
    fn the_root_has_the_moments_of_all_lights() {
        let emitters = lights(500, true);
        let tree = LightTree::new(&emitters);
        let total: f64 = emitters.iter().map(|e| e.intensity).sum();
        for k in 0..3 {
            let mean = emitters.iter().map(|e| e.intensity * f64::from(e.mean[k])).sum::<f64>() / total;
            let variance = emitters
                .iter()
                .map(|e| e.intensity * (1e-4 + (f64::from(e.mean[k]) - mean).powi(2)));
            let variance = variance.sum::<f64>() / total;
            assert!((f64::from(tree.root().mean[k]) - mean).abs() < 1e-5);
            let spread = f64::from(tree.root().spread()[k]);
            assert!(
                spread >= variance && spread < variance * (1.0 + 1.0 / 128.0),
                "{spread} {variance}"
            );
        }
        assert_eq!(tree.root().normals, [46, 0, 0, -61, 0]);
        assert_eq!(tree.root().facing, [76, 0, -102]);
    }

    #[test]
    fn coincident_lights_and_lights_in_a_line_make_a_tree_of_any_depth() {
        let mut emitters = lights(300, false);
        emitters.iter_mut().take(100).for_each(|e| e.mean = [1.0; 3]);
        // Each is three times as far as the one before, so every split isolates one light.
        for (i, e) in emitters.iter_mut().enumerate().skip(100).take(40) {
            e.mean = [3.0_f32.powi(i as i32 - 120), 0.0, 0.0];
        }
        let tree = LightTree::new(&emitters);
        assert_eq!(tree.len(), 300);
        let depth = |at: u32| {
            let mut deepest = 0;
            let mut open = vec![(at, 0)];
            while let Some((at, depth)) = open.pop() {
                deepest = deepest.max(depth);
                let node = tree.node(at);
                if node.leaf().is_none() {
                    open.extend([(node.link, depth + 1), (node.link + 1, depth + 1)]);
                }
            }
            deepest
        };
        assert!(depth(0) <= DEEPEST as usize + 32);
    }
}
