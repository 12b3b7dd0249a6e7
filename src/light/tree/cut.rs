//! A cut through the tree for a set of points: the clusters that separate the lights best for these points.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use super::importance::{Probes, WIDE};
use super::{LightTree, Node};

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

/// Root mean square of shares: what a cluster contributes to each of the first `points` points, relative to what the point
/// receives. Points that receive nothing are ignored.
pub(super) fn rms(points: usize, brings: &[f32; WIDE], gets: &[f32; WIDE]) -> f32 {
    let mut sum = 0.0;
    for (brings, gets) in brings.iter().zip(gets).take(points) {
        let share = if *gets > 0.0 { brings / gets } else { 0.0 };
        sum += share * share;
    }
    sum.sqrt()
}

/// Priority for splitting a cluster: its share of the light, times the angular spread of its lights as seen from the points. The
/// sharper a lobe, the more the spread counts.
fn gain(node: &Node, probes: &Probes, importance: &[f32; WIDE], sums: &[f32; WIDE]) -> f32 {
    let [x, y, z] = node.spread();
    if probes.is_empty() {
        return node.power() * (x + y + z);
    }
    let mut apart = *importance;
    for (i, apart) in apart.iter_mut().enumerate().take(probes.len()) {
        let place = probes.place(i);
        let d2: f32 = (0..3).map(|k| (node.mean[k] - place[k]).powi(2)).sum();
        let spread = (x + y + z) * probes.sharpness(i);
        *apart *= (spread / (spread + d2)).sqrt();
    }
    rms(probes.len(), &apart, sums)
}
