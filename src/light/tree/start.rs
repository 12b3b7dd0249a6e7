//! Where the walks of single points begin: nodes of a table, which each point weighs once for all of its walks.
//!
//! What the table's probes see of each node counts: walks alone know nothing of visibility. And all lanes weigh the same node there, while
//! below each reads one of its own. That takes the same time as walks from the root: five levels are saved, and 32 nodes weighed.

use super::cut::{Cluster, Cut};
use super::importance::{Probes, WIDE};
use super::walk::{Digits, From};
use super::{LEAF, LightTree};
use crate::lane::{Bits, Lane, Mask};

/// Most nodes from which walks begin. Not measured against other numbers.
const STARTS: usize = 32;

/// Least probability of a node, which nothing may exclude.
const LEAST: f32 = 1.0 / (1 << 15) as f32;

/// Weight of a node that no probe sees, where 1 is the weight that visibility adds. Not measured against other numbers.
const UNSEEN: f32 = 0.15;

/// A node from which walks begin.
#[derive(Clone, Copy, Debug)]
struct Start {
    node: u32,
    /// The first of its leaves.
    first: u32,
    /// Weight of its importance: more where the probes see it.
    factor: f32,
    /// Its share of the power of all.
    power: f32,
}

/// The nodes from which walks begin; they contain every light once.
#[derive(Clone, Debug, Default)]
pub struct Starts(Vec<Start>);

/// The probabilities of these nodes for points: each the distance between two ends.
pub struct Shares<L: Lane> {
    /// The upper end of each node's interval; the last is 1.
    ends: [L; STARTS],
}

impl Starts {
    /// Starts for the points of a tile. `cut` is a finer cut for the same probes, `seen` the importance of its clusters times their
    /// visibility, `inverses` one over what each probe gets from all lights.
    pub fn new(tree: &LightTree, probes: &Probes, cut: &Cut, seen: &[[f32; WIDE]], inverses: &[f32; WIDE]) -> Self {
        // Both cuts open nodes in the same order, so clusters of the finer one are inside those of the other.
        let starts = Cut::new(tree, probes, STARTS.min(cut.clusters.len()));
        let all = tree.root().power();
        let mut finer = cut.clusters.iter().zip(seen).peekable();
        let weigh = |(i, start): (usize, &Cluster)| {
            let end = starts.clusters.get(i + 1).map_or(u32::MAX, |next| next.first);
            let (mut might, mut gets) = (0.0, 0.0);
            while let Some((cluster, seen)) = finer.next_if(|(cluster, _)| cluster.first < end) {
                for (k, inverse) in inverses.iter().enumerate() {
                    might += cluster.importance[k] * inverse;
                    gets += seen[k] * inverse;
                }
            }
            let visible = if might > 0.0 { gets / might } else { 1.0 };
            Start {
                node: start.node,
                first: start.first,
                factor: visible + UNSEEN,
                power: tree.node(start.node).power() / all,
            }
        };
        Self(starts.clusters.iter().enumerate().map(weigh).collect())
    }

    /// The nodes in the order of strata: those that all probes see first, those that none sees last.
    pub(super) fn ordered(mut self) -> Self {
        let kind = |start: &Start| u32::from(start.factor < 0.999 + UNSEEN) + u32::from(start.factor <= UNSEEN);
        self.0.sort_by_key(kind);
        self
    }

    /// The weight of importance in the cluster that begins at a leaf.
    pub(super) fn factor(&self, leaf: u32) -> f32 {
        self.0[self.0.partition_point(|start| start.first <= leaf) - 1].factor
    }

    /// Weighs the nodes for points.
    #[inline(always)]
    pub fn shares<L: Lane>(&self, tree: &LightTree, from: From<L>) -> Shares<L> {
        let mut ends = [L::one(); STARTS];
        let mut sum = L::zero();
        for (weight, start) in ends.iter_mut().zip(&self.0) {
            *weight = tree.node(start.node).brief(from) * L::splat(start.factor);
            sum = sum + *weight;
        }
        let sound = sum.gt(L::zero()) & sum.lt(L::splat(f32::INFINITY));
        let rest = 1.0 - LEAST * self.0.len() as f32;
        let scale = L::splat(rest) / L::select(sound, sum, L::one());
        let (mut end, last) = (L::zero(), self.0.len() - 1);
        for (weight, start) in ends.iter_mut().zip(&self.0[..last]) {
            let share = L::select(sound, *weight * scale, L::splat(start.power * rest));
            end = end + (share + L::splat(LEAST));
            // Multiples of 2^-20, of which the numbers of walks are multiples too: else some intervals had a number more or less.
            *weight = (end + L::splat(8.0)) - L::splat(8.0);
        }
        ends[last] = L::one();
        Shares { ends }
    }

    /// Chooses a node in each active lane: its link, and its probability.
    #[inline(always)]
    pub fn choose<L: Lane>(
        &self,
        tree: &LightTree,
        active: L::Mask,
        shares: &Shares<L>,
        digits: &mut Digits<L>,
    ) -> ([u32; 16], L) {
        let last = self.0.len() - 1;
        let (mut index, one) = (L::Bits::splat(0), L::Bits::splat(1));
        for end in &shares.ends[..last] {
            index = L::Bits::select(digits.number().ge(*end), index + one, index);
        }
        let (mut begins, mut ends, mut link) = ([0.0; 16], [1.0; 16], [LEAF; 16]);
        for lane in active.lanes() {
            let at = index.lane(lane) as usize;
            if at > 0 {
                begins[lane] = shares.ends[at - 1].lane(lane);
            }
            ends[lane] = shares.ends[at].lane(lane);
            link[lane] = tree.node(self.0[at].node).link;
        }
        let (begin, end) = (L::load(&begins), L::load(&ends));
        let chance = end - begin;
        digits.within(begin, chance);
        (link, chance)
    }
}

#[cfg(test)]
impl Starts {
    /// Starts for some points that see every second cluster.
    pub fn of(tree: &LightTree, probes: &Probes) -> Self {
        let cut = Cut::new(tree, probes, 128);
        let seen =
            |(i, cluster): (usize, &Cluster)| cluster.importance.map(|x| if i.is_multiple_of(2) { x } else { 0.0 });
        let seen: Vec<_> = cut.clusters.iter().enumerate().map(seen).collect();
        Self::new(
            tree,
            probes,
            &cut,
            &seen,
            &super::cut::inverses(probes.len(), &cut.sums()),
        )
    }
}
