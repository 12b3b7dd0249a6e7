//! The rivals of lists (feature `rival`): every lane walks down the tree by itself, by moments or by bounds. For measurements only.

use super::importance::Moments;
use super::{LightTree, Node};
use crate::lane::{Lane, Mask};
use crate::math::Vec3;

/// What decides at each node.
#[derive(Clone, Debug)]
pub enum Guide {
    /// [`Node::importance`].
    Moments,
    /// The importance of pbrt-v4 (`LightBounds::Importance` in `lights.cpp`), of the same nodes.
    Bounds(Vec<Bound>),
}

/// Bounds of a node: a box and a cone of normals.
#[derive(Clone, Copy, Debug)]
pub struct Bound {
    low: [f32; 3],
    high: [f32; 3],
    axis: [f32; 3],
    /// -1 for lights that shine in all directions.
    cos_normals: f32,
}

/// A leaf in each lane, and the probability of reaching it; 0 where no light was found.
pub struct Walked<L> {
    /// Leaves; 0 in lanes that are not active.
    pub leaf: [u32; 16],
    /// Probability.
    pub chance: L,
}

impl LightTree {
    /// Bounds of all nodes, from those of the leaves.
    pub fn bounds(&self, of_leaf: impl Fn(u32) -> ([f32; 3], [f32; 3], Option<[f32; 3]>)) -> Vec<Bound> {
        let nowhere = Bound {
            low: [0.0; 3],
            high: [0.0; 3],
            axis: [0.0; 3],
            cos_normals: -1.0,
        };
        let mut bounds = vec![nowhere; self.nodes.len()];
        // Children come after their parents.
        for (i, node) in self.nodes.iter().enumerate().rev().filter(|&(i, _)| i != 1) {
            bounds[i] = match node.leaf() {
                Some(leaf) => {
                    let (low, high, normal) = of_leaf(leaf);
                    Bound {
                        low,
                        high,
                        axis: normal.unwrap_or([0.0, 0.0, 1.0]),
                        cos_normals: if normal.is_some() { 1.0 } else { -1.0 },
                    }
                }
                None => bounds[node.link as usize].and(&bounds[node.link as usize + 1]),
            };
        }
        bounds
    }

    #[expect(clippy::type_complexity, reason = "position, normal and lobe")]
    /// Walks from the root to a leaf in each active lane. `number` in [0, 1) is used up.
    #[inline(always)]
    pub fn walk<L: Lane>(
        &self,
        guide: &Guide,
        active: L::Mask,
        (p, n, lobe): (Vec3<L>, Vec3<L>, Option<(Vec3<L>, L)>),
        mut number: L,
    ) -> Walked<L> {
        let (mut at, mut leaf) = ([0_u32; 16], [0_u32; 16]);
        let (mut chance, mut open) = (L::one().or_zero(active), active);
        loop {
            // Lanes at a leaf stop.
            let mut still = 0;
            let mut first = [0_u32; 16];
            for lane in open.lanes() {
                let node = self.node(at[lane]);
                match node.leaf() {
                    Some(found) => leaf[lane] = found,
                    None => {
                        first[lane] = node.link;
                        still |= 1 << lane;
                    }
                }
            }
            open = L::Mask::from_bitmask(still);
            if open.none() {
                return Walked { leaf, chance };
            }
            let [a, b] = [0, 1].map(|child| match guide {
                Guide::Moments => self.gather::<L>(open, &first, child).importance(p, n, lobe),
                Guide::Bounds(bounds) => self.bounded::<L>(bounds, open, &first, child, p, n),
            });
            let sum = a + b;
            // Nothing is sampled where both have no importance.
            open = open & sum.gt(L::zero());
            let share = a.div_or_zero(sum, open);
            let left = number.lt(share);
            let taken = L::select(left, share, L::one() - share);
            number = L::select(left, number, number - share).div_or_zero(taken, open);
            number = number.min(L::splat(1.0 - f32::EPSILON / 2.0));
            let walking = L::Mask::from_bitmask(still);
            chance = L::select(walking, (chance * taken).or_zero(open), chance);
            for lane in open.lanes() {
                let second = 1 - ((left.to_bitmask() >> lane) & 1);
                at[lane] = first[lane] + second;
            }
        }
    }

    #[inline(always)]
    fn gather<L: Lane>(&self, open: L::Mask, first: &[u32; 16], child: u32) -> Moments<L> {
        let mut columns = [[0.0_f32; 16]; 13];
        for lane in open.lanes() {
            let node: &Node = self.node(first[lane] + child);
            let spread = node.spread();
            for k in 0..3 {
                columns[k][lane] = node.mean[k];
                columns[4 + k][lane] = spread[k];
            }
            columns[3][lane] = node.power;
            for k in 0..6 {
                columns[7 + k][lane] = f32::from(node.normals[k]) * (1.0 / 127.0);
            }
        }
        let [x, y, z, power, u, v, w, normals @ ..] = columns.map(|column| L::load(&column));
        Moments {
            mean: Vec3::new(x, y, z),
            power,
            variance: Vec3::new(u, v, w),
            normals,
        }
    }

    #[inline(always)]
    fn bounded<L: Lane>(
        &self,
        bounds: &[Bound],
        open: L::Mask,
        first: &[u32; 16],
        child: u32,
        p: Vec3<L>,
        n: Vec3<L>,
    ) -> L {
        let mut columns = [[0.0_f32; 16]; 11];
        for lane in open.lanes() {
            let number = first[lane] + child;
            let bound = &bounds[number as usize];
            for k in 0..3 {
                columns[k][lane] = bound.low[k];
                columns[3 + k][lane] = bound.high[k];
                columns[6 + k][lane] = bound.axis[k];
            }
            columns[9][lane] = bound.cos_normals;
            columns[10][lane] = self.node(number).power;
        }
        let [lx, ly, lz, hx, hy, hz, ax, ay, az, cos_o, power] = columns.map(|column| L::load(&column));
        let (low, high, axis) = (Vec3::new(lx, ly, lz), Vec3::new(hx, hy, hz), Vec3::new(ax, ay, az));
        let half = L::splat(0.5);
        let middle = (low + high) * half;
        let apart = p - middle;
        let squared = apart.length_squared();
        let diagonal = high - low;
        let d2 = squared.max(diagonal.length() * half);
        let inverse = L::one() / squared.max(L::splat(f32::MIN_POSITIVE)).sqrt();
        let wi = apart * inverse;
        // The cone of directions to the bounding sphere; all directions inside.
        let radius2 = diagonal.length_squared() * L::splat(0.25);
        let inside = squared.lt(radius2)
            | (p.x.ge(low.x) & p.x.le(high.x) & p.y.ge(low.y) & p.y.le(high.y) & p.z.ge(low.z) & p.z.le(high.z));
        let sin2 = radius2 / squared.max(L::splat(f32::MIN_POSITIVE));
        let cos_b = L::select(inside, -L::one(), (L::one() - sin2).safe_sqrt());
        let sine = |cosine: L| (L::one() - cosine * cosine).safe_sqrt();
        let cosine_less = |cos_a: L, cos_b: L| {
            let turned = cos_a * cos_b + sine(cos_a) * sine(cos_b);
            L::select(cos_a.gt(cos_b), L::one(), turned)
        };
        let sine_less = |cos_a: L, cos_b: L| {
            let turned = sine(cos_a) * cos_b - cos_a * sine(cos_b);
            L::select(cos_a.gt(cos_b), L::zero(), turned)
        };
        let cos_w = axis.dot(wi).abs();
        let cos_x = cosine_less(cos_w, cos_o);
        let sin_x = sine_less(cos_w, cos_o);
        let turned = cos_x * cos_b + sin_x * sine(cos_b);
        let emitted = L::select(cos_x.gt(cos_b), L::one(), turned).max(L::zero());
        let incoming = cosine_less(wi.dot(n).abs(), cos_b).max(L::zero());
        power * emitted * incoming / d2
    }
}

impl Bound {
    /// Around both; cones as in `DirectionCone::Union` of pbrt-v4.
    fn and(&self, other: &Self) -> Self {
        let (axis, cos_normals) = union((self.axis, self.cos_normals), (other.axis, other.cos_normals));
        Self {
            low: std::array::from_fn(|k| self.low[k].min(other.low[k])),
            high: std::array::from_fn(|k| self.high[k].max(other.high[k])),
            axis,
            cos_normals,
        }
    }
}

fn union((a, cos_a): ([f32; 3], f32), (b, cos_b): ([f32; 3], f32)) -> ([f32; 3], f32) {
    if cos_a <= -1.0 || cos_b <= -1.0 {
        return ([0.0, 0.0, 1.0], -1.0);
    }
    let (theta_a, theta_b) = (cos_a.min(1.0).acos(), cos_b.min(1.0).acos());
    let dot: f32 = (0..3).map(|k| a[k] * b[k]).sum();
    let theta_d = dot.clamp(-1.0, 1.0).acos();
    if (theta_d + theta_b).min(std::f32::consts::PI) <= theta_a {
        return (a, cos_a);
    }
    if (theta_d + theta_a).min(std::f32::consts::PI) <= theta_b {
        return (b, cos_b);
    }
    let theta = (theta_a + theta_d + theta_b) / 2.0;
    let across: [f32; 3] = std::array::from_fn(|k| b[k] - dot * a[k]);
    let length = across.iter().map(|x| x * x).sum::<f32>().sqrt();
    if theta >= std::f32::consts::PI || length < 1e-6 {
        return ([0.0, 0.0, 1.0], -1.0);
    }
    let turn = theta - theta_a;
    let axis = std::array::from_fn(|k| a[k] * turn.cos() + across[k] / length * turn.sin());
    (axis, theta.cos())
}
