//! The rival of moments (feature `rival`): bounds of nodes. For measurements only.

use super::walk::{ByMoments, Digits, From, Walked, Weighs};
use super::{Emission, LightTree};
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
    /// 1 if all emit from one side.
    one_sided: f32,
}

struct ByBounds<'a, L: Lane> {
    bounds: &'a [Bound],
    p: Vec3<L>,
    n: Vec3<L>,
}

impl<L: Lane> Weighs<L> for ByBounds<'_, L> {
    #[inline(always)]
    fn weigh(&self, tree: &LightTree, open: L::Mask, first: &[u32; 16]) -> [(L, L); 2] {
        let &Self { bounds, p, n } = self;
        [
            tree.bounded::<L>(bounds, open, first, 0, p, n),
            tree.bounded::<L>(bounds, open, first, 1, p, n),
        ]
    }
}

impl LightTree {
    /// Bounds of all nodes, from those of the leaves.
    pub fn bounds(&self, of_leaf: impl Fn(u32) -> ([f32; 3], [f32; 3], Emission)) -> Vec<Bound> {
        let nowhere = Bound {
            low: [0.0; 3],
            high: [0.0; 3],
            axis: [0.0; 3],
            cos_normals: -1.0,
            one_sided: 0.0,
        };
        let mut bounds = vec![nowhere; self.nodes.len()];
        // Children come after their parents.
        for (i, node) in self.nodes.iter().enumerate().rev().filter(|&(i, _)| i != 1) {
            bounds[i] = match node.leaf() {
                Some(leaf) => {
                    let (low, high, emission) = of_leaf(leaf);
                    let (axis, cos_normals, one_sided) = match emission {
                        Emission::Round => ([0.0, 0.0, 1.0], -1.0, 0.0),
                        Emission::BothSides(n) => (n, 1.0, 0.0),
                        Emission::OneSide(n) => (n, 1.0, 1.0),
                    };
                    Bound {
                        low,
                        high,
                        axis,
                        cos_normals,
                        one_sided,
                    }
                }
                None => bounds[node.link as usize].and(&bounds[node.link as usize + 1]),
            };
        }
        bounds
    }

    /// Walks from the root to a leaf in each active lane, by what the guide says.
    #[inline(always)]
    pub fn guided<L: Lane>(
        &self,
        guide: &Guide,
        active: [L::Mask; 2],
        from: From<L>,
        digits: [Digits<L>; 2],
    ) -> [Walked<L>; 2] {
        let (p, n, _) = from;
        let root = [([self.nodes[0].link; 16], L::one()); 2];
        match guide {
            Guide::Moments => self.way_down(active, root, digits, &ByMoments(from)),
            Guide::Bounds(bounds) => self.way_down(active, root, digits, &ByBounds { bounds, p, n }),
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
    ) -> (L, L) {
        let mut columns = [[0.0_f32; 16]; 12];
        for lane in open.lanes() {
            let number = first[lane] + child;
            let bound = &bounds[number as usize];
            for k in 0..3 {
                columns[k][lane] = bound.low[k];
                columns[3 + k][lane] = bound.high[k];
                columns[6 + k][lane] = bound.axis[k];
            }
            columns[9][lane] = bound.cos_normals;
            columns[10][lane] = self.node(number).power();
            columns[11][lane] = bound.one_sided;
        }
        let [lx, ly, lz, hx, hy, hz, ax, ay, az, cos_o, power, one_sided] = columns.map(|column| L::load(&column));
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
        let cos_w = axis.dot(wi);
        let cos_w = L::select(one_sided.gt(L::zero()), cos_w, cos_w.abs());
        let cos_x = cosine_less(cos_w, cos_o);
        let sin_x = sine_less(cos_w, cos_o);
        let turned = cos_x * cos_b + sin_x * sine(cos_b);
        let emitted = L::select(cos_x.gt(cos_b), L::one(), turned).max(L::zero());
        let incoming = cosine_less(wi.dot(n).abs(), cos_b).max(L::zero());
        (power * emitted * incoming / d2, power)
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
            one_sided: self.one_sided.min(other.one_sided),
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
