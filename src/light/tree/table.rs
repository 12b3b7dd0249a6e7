//! What lists of lights for a set of points are drawn from: how often each cluster is expected in a list.
//!
//! A list has a fixed length. A light with so much weight that it would be expected once or more is in every list; what remains of
//! the list is divided into strata of one expected light each, so that a light with the expectation `n` is drawn with exactly that
//! chance, and a list is worth more than as many single choices.

use super::cut::{Cut, rms};
use super::importance::{Probes, WIDE};
use super::{LEAST_POWER, LightTree};

/// Part of the lists that is divided by power alone: what no point's importance and no look may leave out.
const BY_POWER: f64 = 0.03;

/// Weight of importance without looks, beside that with them: looks may miss what a pixel sees.
const UNSEEN: f32 = 0.15;

/// Part by which power decides between two children of a node inside a cluster.
const WITHIN: f64 = 0.05;

/// Clusters with less than this part of the mean importance of a cluster are not looked at.
const NOT_WORTH_A_LOOK: f32 = 0.1;

/// Which points a light reaches: bit `i` for point `i`.
pub trait Look {
    /// Looks.
    fn reaches(&mut self, light: u32, probes: &Probes) -> u32;
}

/// A light of a list.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pick {
    /// The light.
    pub light: u32,
    /// How often it is expected in a list, above 0: what its contributions are divided by.
    pub expected: f64,
    /// About that, at most 1, without a way down the tree: [`Table::guess`].
    pub guess: f32,
}

/// How often each light is expected in a list.
#[derive(Clone, Debug, Default)]
pub struct Table {
    /// Of each cluster its first place in the order of leaves, ascending.
    firsts: Vec<u32>,
    /// Of each cluster its node.
    nodes: Vec<u32>,
    /// Of each cluster how often its lights are expected; 1 for a light of every list.
    expected: Vec<f32>,
    /// Of each cluster the sum up to and with it, of those that are drawn.
    ends: Vec<f64>,
    /// Clusters of one light that is in every list.
    always: Vec<u32>,
    /// Lights of a list that are drawn.
    drawn: u32,
    probes: Probes,
    /// What each point gets of all lights: importance is compared as a part of it.
    gets: [f32; WIDE],
}

impl Table {
    /// For lists of `length` lights: a cut of at most `most` clusters, each looked at from all points toward one of its lights if
    /// there is a `look`. There must be lights, and a length.
    pub fn new(tree: &LightTree, probes: Probes, most: usize, length: u32, look: Option<&mut dyn Look>) -> Self {
        let cut = Cut::new(tree, &probes, most);
        let nodes: Vec<u32> = cut.clusters.iter().map(|cluster| cluster.node).collect();
        let mut table = Self {
            firsts: nodes.iter().map(|&node| tree.first_leaf(node)).collect(),
            expected: vec![0.0; nodes.len()],
            ends: vec![0.0; nodes.len()],
            gets: cut.sums(),
            nodes,
            probes,
            ..Self::default()
        };
        let weights = table.weights(tree, &cut, look);
        table.divide(tree, &weights, length);
        table
    }

    /// Weights of the clusters, all above 0, of sum 1.
    fn weights(&self, tree: &LightTree, cut: &Cut, look: Option<&mut dyn Look>) -> Vec<f64> {
        let points = self.probes.len();
        let mut weights: Vec<f32> = (cut.clusters.iter())
            .map(|cluster| rms(points, &cluster.importance, &self.gets))
            .collect();
        if let Some(look) = look {
            let least = weights.iter().sum::<f32>() / weights.len() as f32 * NOT_WORTH_A_LOOK;
            let mut seen: Vec<[f32; WIDE]> = cut.clusters.iter().map(|cluster| cluster.importance).collect();
            let mut gets = [0.0; WIDE];
            for ((i, seen), &weight) in seen.iter_mut().enumerate().zip(&weights) {
                if weight > least {
                    // One light for all points: their rays are alike. Which one is a matter of the place in the tree.
                    let number = crate::sampling::hash::mix(self.nodes[i]);
                    let (light, _) = self.descend(tree, self.nodes[i], f64::from(number) / 4_294_967_296.0);
                    let reached = look.reaches(tree.light(light), &self.probes);
                    for (k, seen) in seen.iter_mut().enumerate() {
                        *seen *= ((reached >> k) & 1) as f32;
                    }
                }
                for (gets, seen) in gets.iter_mut().zip(&*seen) {
                    *gets += seen;
                }
            }
            let visible: Vec<f32> = seen.iter().map(|seen| rms(points, seen, &gets)).collect();
            let [all, of_all] = [&visible, &weights].map(|weights| weights.iter().sum::<f32>());
            if all > 0.0 && of_all > 0.0 {
                let both = |(visible, weight): (&f32, &f32)| visible / all + UNSEEN * weight / of_all;
                weights = visible.iter().zip(&weights).map(both).collect();
            }
        }
        let sum: f64 = weights.iter().copied().map(f64::from).sum();
        let power: f64 = self.nodes.iter().map(|&node| f64::from(tree.node(node).power())).sum();
        let by_power = if sum > 0.0 && sum.is_finite() { BY_POWER } else { 1.0 };
        let weight = |(&node, &weight): (&u32, &f32)| {
            let told = if by_power < 1.0 { f64::from(weight) / sum } else { 0.0 };
            by_power * f64::from(tree.node(node).power()) / power + (1.0 - by_power) * told
        };
        self.nodes.iter().zip(&weights).map(weight).collect()
    }

    /// Divides a list among clusters: those of one light that would be expected once or more are in every list, and the rest of the
    /// list is for the others, until none of these would be.
    fn divide(&mut self, tree: &LightTree, weights: &[f64], length: u32) {
        let single = |node: u32| tree.node(node).leaf().is_some();
        let mut left = length;
        let mut taken = vec![false; weights.len()];
        let sum_of = |taken: &[bool]| -> f64 {
            let others = weights.iter().zip(taken).filter(|(_, taken)| !**taken);
            others.map(|(weight, _)| weight).sum()
        };
        loop {
            let (before, mut rest) = (left, sum_of(&taken));
            for (i, &weight) in weights.iter().enumerate() {
                // The last light of a list that others wait for is drawn.
                let others = self.always.len() + 1 < weights.len();
                if !taken[i] && single(self.nodes[i]) && weight * f64::from(left) >= rest && (left > 1 || !others) {
                    taken[i] = true;
                    self.always.push(i as u32);
                    self.expected[i] = 1.0;
                    (rest, left) = (rest - weight, left - 1);
                }
            }
            if left == before || left == 0 {
                break;
            }
        }
        self.always.sort_unstable();
        let others = sum_of(&taken);
        self.drawn = if self.always.len() < weights.len() { left } else { 0 };
        let (mut sum, mut end) = (0.0, 0.0);
        for i in 0..weights.len() {
            if !taken[i] {
                sum += weights[i];
                let next = f64::from(self.drawn) * (sum / others);
                self.expected[i] = ((next - end) as f32).max(f32::MIN_POSITIVE);
                end = next;
            }
            self.ends[i] = end;
        }
    }

    /// Lights of a list.
    pub fn length(&self) -> usize {
        self.always.len() + self.drawn as usize
    }

    /// Clusters.
    pub fn clusters(&self) -> usize {
        self.nodes.len()
    }

    /// Lights that are in every list.
    pub fn always(&self) -> usize {
        self.always.len()
    }

    /// Draws a list: lights that are in every list, then one of each stratum by its number in [0, 1).
    pub fn draw(&self, tree: &LightTree, number: impl Fn(u32) -> f64, list: &mut Vec<Pick>) {
        list.clear();
        for &cluster in &self.always {
            let leaf = self.firsts[cluster as usize];
            list.push(Pick {
                light: tree.light(leaf),
                expected: 1.0,
                guess: 1.0,
            });
        }
        for stratum in 0..self.drawn {
            list.push(self.pick(tree, stratum, number(stratum)));
        }
    }

    fn pick(&self, tree: &LightTree, stratum: u32, number: f64) -> Pick {
        let at = f64::from(stratum) + number;
        let last = self.ends.len() - 1;
        let cluster = self.ends.partition_point(|&end| end <= at).min(last);
        let start = if cluster == 0 { 0.0 } else { self.ends[cluster - 1] };
        let width = self.ends[cluster] - start;
        let within = ((at - start) / width).clamp(0.0, BELOW_ONE);
        let (leaf, chance) = self.descend(tree, self.nodes[cluster], within);
        Pick {
            light: tree.light(leaf),
            expected: width * mutate!(chance, WayDownForgotten => 1.0),
            guess: self.guess_in(tree, cluster, tree.leaf_power(leaf)),
        }
    }

    /// Goes down from a node to a leaf, and with which chance: at each node by the importance of its children for all points.
    fn descend(&self, tree: &LightTree, mut number: u32, mut place: f64) -> (u32, f64) {
        let mut chance = 1.0;
        loop {
            let node = tree.node(number);
            if let Some(leaf) = node.leaf() {
                return (leaf, chance);
            }
            let first = self.first_chance(tree, node.link);
            if place < first {
                (number, chance, place) = (node.link, chance * first, place / first);
            } else {
                let second = 1.0 - first;
                (number, chance, place) = (node.link + 1, chance * second, (place - first) / second);
            }
            place = place.min(BELOW_ONE);
        }
    }

    /// The chance of the first of two children, in (0, 1).
    fn first_chance(&self, tree: &LightTree, link: u32) -> f64 {
        let [a, b] = [link, link + 1].map(|number| {
            let node = tree.node(number);
            let brings = self.probes.importance(node);
            (
                f64::from(node.power()),
                f64::from(rms(self.probes.len(), &brings, &self.gets)),
            )
        });
        let by_power = a.0 / (a.0 + b.0);
        let sum = a.1 + b.1;
        let first = if sum > 0.0 && sum.is_finite() {
            WITHIN * by_power + (1.0 - WITHIN) * a.1 / sum
        } else {
            by_power
        };
        first.clamp(1e-12, 1.0 - 1e-12)
    }

    /// About how often a light is expected in a list, in (0, 1]: by the weight of its cluster and its share of the cluster's power.
    /// The same for a light that was picked and one that was met: what weights of two techniques are made of must not differ.
    pub fn guess(&self, tree: &LightTree, leaf: u32) -> f32 {
        let cluster = self.firsts.partition_point(|&first| first <= leaf) - 1;
        self.guess_in(tree, cluster, tree.leaf_power(leaf))
    }

    fn guess_in(&self, tree: &LightTree, cluster: usize, power: f32) -> f32 {
        let all = tree.node(self.nodes[cluster]).power().max(LEAST_POWER);
        (self.expected[cluster] * (power / all)).clamp(1e-12, 1.0)
    }
}

/// The largest number below 1.
const BELOW_ONE: f64 = 1.0 - f64::EPSILON / 2.0;

#[cfg(test)]
mod tests;
