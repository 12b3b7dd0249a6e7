//! The sampling table of lists of lights for a set of points: the expected count of each cluster in a list.
//!
//! A list has a fixed length. A light whose weight gives it an expected count of one or more is in every list. The rest of the list
//! is divided into strata with an expected count of one each. A light with the expected count `n` is then chosen with exactly that
//! probability, and a list is better than as many independent choices.

use super::LightTree;
use super::cut::{Cut, inverses, rms};
use super::few::Few;
use super::importance::{Probes, WIDE};
use super::start::Starts;

/// Fraction of the lists that is distributed by power alone, which no importance or visibility estimate can exclude.
const BY_POWER: f64 = 0.03;

/// Weight of the importance without visibility, relative to that with it: the visibility rays may miss what a pixel sees. With 0.05 and
/// 0.15, a few rare samples make most of the error where walls hide lights (`docs/many-lights.md`).
const UNSEEN: f32 = 0.3;

/// Fraction of power in the choice between two children inside a cluster.
const WITHIN: f64 = 0.05;

/// Clusters below this fraction of the mean importance get no visibility rays.
const NOT_WORTH_A_LOOK: f32 = 0.1;

/// Time of a walk with its ray over that of a ray to a listed light: 8 walks take 1.6 to 3 times as long as a list of 16.
const WALK_COSTS: f32 = 4.0;

/// Relative variance of one walk where all lights are visible.
const WALK_ERRS: f32 = 0.25;

/// Visibility of a light: bit `i` for point `i`.
pub trait Look {
    /// Traces rays from the points to the light.
    fn reaches(&mut self, light: u32, probes: &Probes) -> u32;
}

/// A light on a list.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pick {
    /// The light.
    pub light: u32,
    /// Its expected count in a list, positive: contributions are divided by it.
    pub expected: f64,
    /// An estimate of the expected count, at most 1, without a tree traversal: [`Table::guess`].
    pub guess: f32,
}

/// Expected counts of lights in a list.
#[derive(Clone, Debug, Default)]
pub struct Table {
    /// First leaf index of each cluster, ascending.
    firsts: Vec<u32>,
    /// Root node of each cluster.
    nodes: Vec<u32>,
    /// Expected count of each cluster's lights; 1 for a light on every list.
    expected: Vec<f32>,
    /// The clusters in the order of strata: those that all probes see, that some see, that none sees, and that bring next to nothing. A
    /// stratum has lights of one kind then, and what is spent on the last two kinds makes no noise.
    order: Vec<u32>,
    /// Inclusive prefix sums over the sampled clusters, in that order.
    ends: Vec<f64>,
    /// Single-light clusters that are on every list.
    always: Vec<u32>,
    /// Number of sampled lights per list.
    drawn: u32,
    probes: Probes,
    /// One over what each point receives from all lights: see [`inverses`].
    inverses: [f32; WIDE],
    /// Those of the points that decide inside clusters.
    few: Few,
    /// Where points begin their walks, if they walk.
    starts: Option<Starts>,
}

impl Table {
    /// A table for lists of `length` lights: a cut of at most `most` clusters. With a `look`, all points trace rays to one light of
    /// each cluster. `length` must be positive. Without lights, all lists are empty: the lights of a scene may be 0 in single precision,
    /// or have no area.
    pub fn new(tree: &LightTree, probes: Probes, most: usize, length: u32, look: Option<&mut dyn Look>) -> Self {
        if tree.is_empty() {
            return Self::default();
        }
        let cut = Cut::new(tree, &probes, most);
        let nodes: Vec<u32> = cut.clusters.iter().map(|cluster| cluster.node).collect();
        let mut table = Self {
            firsts: cut.clusters.iter().map(|cluster| cluster.first).collect(),
            expected: vec![0.0; nodes.len()],
            ends: vec![0.0; nodes.len()],
            inverses: inverses(probes.len(), &cut.sums()),
            nodes,
            probes,
            ..Self::default()
        };
        table.few = table.probes.few(&table.inverses);
        let weights = table.weights(tree, &cut, look);
        table.divide(tree, &weights, length);
        table
    }

    /// Weights of the clusters, all positive, with sum 1.
    fn weights(&mut self, tree: &LightTree, cut: &Cut, look: Option<&mut dyn Look>) -> Vec<f64> {
        let mut weights: Vec<f32> = (cut.clusters.iter())
            .map(|cluster| rms(&cluster.importance, &self.inverses))
            .collect();
        let mut seen: Vec<[f32; WIDE]> = cut.clusters.iter().map(|cluster| cluster.importance).collect();
        let mut visible_inverses = self.inverses;
        let least = weights.iter().sum::<f32>() / weights.len() as f32 * NOT_WORTH_A_LOOK;
        let dark: Vec<bool> = weights.iter().map(|&weight| weight <= least).collect();
        if let Some(look) = look {
            let mut gets = [0.0; WIDE];
            for (i, seen) in seen.iter_mut().enumerate() {
                if !dark[i] {
                    // One light for all points makes their rays coherent. The node index selects the light.
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
            visible_inverses = inverses(self.probes.len(), &gets);
            let visible: Vec<f32> = seen.iter().map(|seen| rms(seen, &visible_inverses)).collect();
            let [all, of_all] = [&visible, &weights].map(|weights| weights.iter().sum::<f32>());
            if all > 0.0 && of_all > 0.0 {
                let both = |(visible, weight): (&f32, &f32)| visible / all + UNSEEN * weight / of_all;
                weights = visible.iter().zip(&weights).map(both).collect();
            }
        }
        self.order = self.by_visibility(cut, &seen, &dark);
        let sum: f64 = weights.iter().copied().map(f64::from).sum();
        let power: f64 = self.nodes.iter().map(|&node| f64::from(tree.node(node).power())).sum();
        let by_power = if sum > 0.0 && sum.is_finite() { BY_POWER } else { 1.0 };
        let weight = |(&node, &weight): (&u32, &f32)| {
            let told = if by_power < 1.0 { f64::from(weight) / sum } else { 0.0 };
            by_power * f64::from(tree.node(node).power()) / power + (1.0 - by_power) * told
        };
        let weights: Vec<f64> = self.nodes.iter().zip(&weights).map(weight).collect();
        if self.probes.is_phong() {
            let starts = Starts::new(tree, &self.probes, cut, &seen, &self.inverses);
            let walked = self.forecast(cut, &starts, &seen, &visible_inverses, &weights);
            #[cfg(feature = "rival")]
            let walked = std::env::var("OCTOLUX_WALK").map_or(walked, |forced| forced == "on");
            self.starts = walked.then(|| starts.ordered());
        }
        weights
    }

    /// The clusters in the order of strata.
    fn by_visibility(&self, cut: &Cut, seen: &[[f32; WIDE]], dark: &[bool]) -> Vec<u32> {
        let kind = |&i: &u32| {
            let (all, seen) = (&cut.clusters[i as usize].importance, &seen[i as usize]);
            let mut of_probes = (0..self.probes.len()).filter(|&k| all[k] > 0.0);
            if dark[i as usize] {
                3
            } else if of_probes.clone().all(|k| seen[k] == 0.0) {
                2
            } else {
                u8::from(of_probes.any(|k| seen[k] == 0.0))
            }
        };
        let mut order: Vec<u32> = (0..seen.len() as u32).collect();
        order.sort_by_key(kind);
        order
    }

    /// Whether walks of single points are expected to have a smaller variance in the same time than a list. A light of a list has a
    /// variance because its table is one for all points; a walk, because it knows little of visibility. Of these variances, relative
    /// to what a point gets, each counts by what the point gets: points that see next to nothing would decide for all.
    fn forecast(
        &self,
        cut: &Cut,
        starts: &Starts,
        seen: &[[f32; WIDE]],
        visible: &[f32; WIDE],
        weights: &[f64],
    ) -> bool {
        let gets: f32 = visible.iter().filter(|&&one| one > 0.0).map(|one| one.recip()).sum();
        let mut squares = 0.0;
        // Of each probe, the weights of all clusters in its walk, and the squares of what it gets over these weights.
        let (mut weighed, mut over) = ([0.0; WIDE], [0.0; WIDE]);
        for ((cluster, seen), &weight) in cut.clusters.iter().zip(seen).zip(weights) {
            let square = |(seen, visible): (&f32, &f32)| seen * (seen * visible);
            squares += f64::from(seen.iter().zip(visible).map(square).sum::<f32>() / gets) / weight;
            let factor = starts.factor(cluster.first);
            for k in 0..WIDE {
                weighed[k] += cluster.importance[k] * factor;
                over[k] += seen[k] / factor;
            }
        }
        let mut walked = 0.0;
        for ((weighed, over), visible) in weighed.iter().zip(&over).zip(visible) {
            walked += weighed * over * visible;
        }
        let (listed, walked) = (squares as f32 - 1.0, walked / gets - 1.0);
        listed > WALK_COSTS * (walked.max(0.0) + WALK_ERRS)
    }

    /// Where points begin to walk down the tree by themselves, if they do so instead of sharing lists.
    pub fn starts(&self) -> Option<&Starts> {
        self.starts.as_ref()
    }

    /// Distributes a list over clusters: single-light clusters with an expected count of one or more are on every list, and the
    /// rest of the list is for the others, repeated until none of these has one or more.
    fn divide(&mut self, tree: &LightTree, weights: &[f64], length: u32) {
        let single = |node: u32| tree.node(node).leaf().is_some();
        let mut left = length;
        let mut taken = vec![false; weights.len()];
        // In the order of the prefix sums below, so that the last of them is the whole.
        let order = std::mem::take(&mut self.order);
        let sum_of = |taken: &[bool]| -> f64 {
            let others = order.iter().filter(|&&i| !taken[i as usize]);
            others.map(|&i| weights[i as usize]).sum()
        };
        loop {
            let (before, mut rest) = (left, sum_of(&taken));
            for (i, &weight) in weights.iter().enumerate() {
                // If other clusters remain, the last entry of a list is sampled.
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
        for (at, &i) in order.iter().enumerate() {
            let i = i as usize;
            if !taken[i] {
                sum += weights[i];
                let next = f64::from(self.drawn) * (sum / others);
                self.expected[i] = ((next - end) as f32).max(f32::MIN_POSITIVE);
                end = next;
            }
            self.ends[at] = end;
        }
        self.order = order;
    }

    /// Length of a list.
    pub fn length(&self) -> usize {
        self.always.len() + self.drawn as usize
    }

    /// Number of clusters.
    pub fn clusters(&self) -> usize {
        self.nodes.len()
    }

    /// The points.
    pub fn probes(&self) -> &Probes {
        &self.probes
    }

    /// Number of lights on every list.
    pub fn always(&self) -> usize {
        self.always.len()
    }

    /// Samples a list: the lights on every list, then one per stratum by its number in [0, 1).
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
        // The sum may round up to the next stratum.
        let at = (f64::from(stratum) + number).min(f64::from(self.drawn) * BELOW_ONE);
        let last = self.ends.len() - 1;
        let place = self.ends.partition_point(|&end| end <= at).min(last);
        let start = if place == 0 { 0.0 } else { self.ends[place - 1] };
        let width = self.ends[place] - start;
        let cluster = self.order[place] as usize;
        let within = ((at - start) / width).clamp(0.0, BELOW_ONE);
        let (leaf, chance) = self.descend(tree, self.nodes[cluster], within);
        Pick {
            light: tree.light(leaf),
            expected: width * mutate!(chance, WayDownForgotten => 1.0),
            guess: self.guess_in(tree, cluster, tree.leaf_power(leaf)),
        }
    }

    /// Descends from a node to a leaf by the importance of the children for all points; returns the leaf and its probability.
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

    /// The probability of the first of two children, in (0, 1).
    fn first_chance(&self, tree: &LightTree, link: u32) -> f64 {
        let nodes = [tree.node(link), tree.node(link + 1)];
        let power = nodes.map(|node| f64::from(node.power()));
        let by_power = power[0] / (power[0] + power[1]);
        let share = self.few.shares(nodes).map(f64::from);
        let sum = share[0] + share[1];
        let first = if sum > 0.0 && sum.is_finite() {
            WITHIN * by_power + (1.0 - WITHIN) * share[0] / sum
        } else {
            by_power
        };
        first.clamp(1e-12, 1.0 - 1e-12)
    }

    /// An estimate of a light's expected count in a list, in (0, 1]: the weight of its cluster times its share of the cluster's
    /// power. It is the same whether the light was picked or hit, as MIS weights of the two techniques require.
    pub fn guess(&self, tree: &LightTree, leaf: u32) -> f32 {
        let cluster = self.firsts.partition_point(|&first| first <= leaf) - 1;
        self.guess_in(tree, cluster, tree.leaf_power(leaf))
    }

    fn guess_in(&self, tree: &LightTree, cluster: usize, power: f32) -> f32 {
        let node = tree.node(self.nodes[cluster]);
        // The powers of nodes are rounded.
        let share = if node.leaf().is_some() {
            1.0
        } else {
            power / node.power()
        };
        (self.expected[cluster] * share).clamp(1e-12, 1.0)
    }
}

/// The largest number below 1.
const BELOW_ONE: f64 = 1.0 - f64::EPSILON / 2.0;

#[cfg(test)]
mod tests;
