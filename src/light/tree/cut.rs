//! A cut through the tree for a set of points: the clusters that separate the lights best for these points.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use super::importance::{Probes, WIDE};
use super::{LightTree, Node};
use crate::lane::{F32x8, Lane, Mask};

/// A set of lights with a single weight in a table.
#[derive(Clone, Copy, Debug)]
pub struct Cluster {
    /// The root node of its lights.
    pub node: u32,
    /// The first of its lights in the order of leaves.
    pub first: u32,
    /// Its importance for each point.
    pub importance: [f32; WIDE],
}

/// Clusters that contain every light once, in the order of leaves.
#[derive(Clone, Debug, Default)]
pub struct Cut {
    /// The clusters.
    pub clusters: Vec<Cluster>,
}

/// A cluster that can be split. The one whose lights differ most in their possible contribution is split first.
struct Open {
    gain: f32,
    at: usize,
    node: u32,
}

impl PartialEq for Open {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}
impl Eq for Open {}
impl PartialOrd for Open {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}
impl Ord for Open {
    fn cmp(&self, other: &Self) -> Ordering {
        self.gain.total_cmp(&other.gain).then(other.node.cmp(&self.node))
    }
}

impl Cut {
    /// Splits clusters one by one until there are `most`, or all are single lights. Without points, power decides.
    pub fn new(tree: &LightTree, probes: &Probes, most: usize) -> Self {
        let root = Cluster {
            node: 0,
            first: 0,
            importance: probes.importance(tree.root()),
        };
        let (mut clusters, mut heap) = (vec![root], BinaryHeap::new());
        let mut sums = root.importance;
        let offer = |heap: &mut BinaryHeap<Open>, clusters: &[Cluster], sums: &[f32; WIDE], at: usize| {
            let Cluster { node, importance, .. } = &clusters[at];
            if tree.node(*node).leaf().is_none() {
                let gain = gain(tree.node(*node), probes, importance, sums);
                heap.push(Open { gain, at, node: *node });
            }
        };
        offer(&mut heap, &clusters, &sums, 0);
        while clusters.len() < most
            && let Some(Open { at, node, .. }) = heap.pop()
        {
            let first = tree.node(node).link;
            // The first child begins where its parent does.
            let begins = [clusters[at].first, tree.first_leaf(first + 1)];
            let [a, b] = [0, 1].map(|i| Cluster {
                node: first + i as u32,
                first: begins[i],
                importance: probes.importance(tree.node(first + i as u32)),
            });
            for (k, sum) in sums.iter_mut().enumerate() {
                *sum += a.importance[k] + b.importance[k] - clusters[at].importance[k];
            }
            clusters[at] = a;
            clusters.push(b);
            offer(&mut heap, &clusters, &sums, at);
            offer(&mut heap, &clusters, &sums, clusters.len() - 1);
        }
        clusters.sort_unstable_by_key(|cluster| cluster.first);
        Self { clusters }
    }

    /// The importance of all clusters together, for each point.
    pub fn sums(&self) -> [f32; WIDE] {
        let mut sums = [0.0; WIDE];
        for cluster in &self.clusters {
            for (sum, more) in sums.iter_mut().zip(&cluster.importance) {
                *sum += more;
            }
        }
        sums
    }
}

/// For each of the first `points` points one over what it receives; 0 for points that receive nothing, which are ignored.
pub(super) fn inverses(points: usize, gets: &[f32; WIDE]) -> [f32; WIDE] {
    let mut inverses = [0.0; WIDE];
    for at in (0..points).step_by(F32x8::N) {
        let gets = F32x8::load(&gets[at..]);
        let counts = <F32x8 as Lane>::Mask::first(points - at) & gets.ge(F32x8::splat(f32::MIN_POSITIVE));
        F32x8::one().div_or_zero(gets, counts).store(&mut inverses[at..]);
    }
    inverses
}

/// Root of the sum of squared shares: what a cluster contributes to each point, relative to what the point receives.
pub(super) fn rms(brings: &[f32; WIDE], inverses: &[f32; WIDE]) -> f32 {
    let share = |at: usize| F32x8::load(&brings[at..]) * F32x8::load(&inverses[at..]);
    let (a, b) = (share(0), share(F32x8::N));
    let mut squares = [0.0; F32x8::N];
    a.mul_add(a, b * b).store(&mut squares);
    squares.iter().sum::<f32>().sqrt()
}

/// Priority for splitting a cluster: its share of the light, times the angular spread of its lights as seen from the points. The
/// sharper a lobe, the more the spread counts.
fn gain(node: &Node, probes: &Probes, importance: &[f32; WIDE], sums: &[f32; WIDE]) -> f32 {
    if probes.is_empty() {
        return node.power() * node.spread().iter().sum::<f32>();
    }
    rms(&probes.apart(node, importance), &inverses(probes.len(), sums))
}
