//! A tree over lights that estimates how much light a point may receive from any subtree. Short lists of lights are sampled from
//! it.
//!
//! A node stores moments instead of bounds: the power-weighted mean position of its lights, the variance around it, and the first and second
//! moments of their normals. The importance of a node (`Node::importance`) is then a closed form that is finite and positive
//! everywhere, even inside a node. So are all sampling probabilities made from it; lists are therefore unbiased whatever the
//! moments are. Accuracy affects only variance, so nodes are rounded: 32 bytes each, 64 per light.
//!
//! Bounds (Conty and Kulla 2018, "Importance Sampling of Many Lights with Adaptive Tree Splitting"; pbrt-v4's `lightsamplers.h`)
//! instead give high variance for points between or inside boxes, where the distance to the lights is unknown. Moments of lights
//! are also used in Tokuyoshi et al. 2024, "Hierarchical Light Sampling with Accurate Spherical Gaussian Lighting".

mod build;
mod cut;
mod few;
mod importance;
#[cfg(feature = "rival")]
pub mod rival;
mod start;
mod table;
mod walk;

pub use build::{Emission, Emitter};
pub use cut::Cut;
pub use importance::{Probes, WIDE};
pub use start::{Shares, Starts};
pub use table::{Look, Pick, Table};
pub use walk::{Digits, From, Walked};

use bytemuck::NoUninit;

/// A set of lights.
#[derive(Clone, Copy, Debug, PartialEq, NoUninit)]
#[repr(C, align(32))]
pub struct Node {
    /// Mean position, weighted by power.
    mean: [f32; 3],
    /// Share of the power of all lights, in (0, 1]: the upper half of an `f32`.
    power: u16,
    /// Variance of positions along each axis, including the extent of the lights: the upper half of an `f32`.
    variance: [u16; 3],
    /// Means of products of two normal components: xx, yy, xy, xz, yz, in 127ths. What is left of 1 is zz.
    normals: [i8; 5],
    /// Mean normal of the lights that emit from one side, in 127ths; of others 0.
    facing: [i8; 3],
    /// Index of the first of two children; with the top bit set, the index of a leaf.
    link: u32,
}

/// The bit that marks a leaf.
const LEAF: u32 = 1 << 31;

/// Minimum share of power: a light with 0 would never be sampled.
const LEAST_POWER: f32 = 1e-30;

/// Minimum variance: without it, the importance at the mean position divides by 0. A length of 1e-12 in tree units.
const LEAST_VARIANCE: f32 = 1e-24;

/// A tree over lights. Lengths should be at most some thousands, so that their powers fit `f32`.
#[derive(Clone, Debug, Default)]
pub struct LightTree {
    /// The root, one unused node, then children in pairs.
    nodes: Vec<Node>,
    /// Light index of each leaf.
    lights: Vec<u32>,
    /// Power of each leaf's light.
    powers: Vec<f32>,
}

impl Node {
    /// The leaf index, if this is a leaf.
    pub fn leaf(&self) -> Option<u32> {
        (self.link & LEAF != 0).then_some(self.link & !LEAF)
    }

    /// Share of the power of all lights, in (0, 1].
    pub fn power(&self) -> f32 {
        f32::from_bits(u32::from(self.power) << 16)
    }

    /// Variance of positions along each axis.
    fn spread(&self) -> [f32; 3] {
        self.variance.map(|upper| f32::from_bits(u32::from(upper) << 16))
    }
}

impl LightTree {
    /// Number of lights.
    pub fn len(&self) -> usize {
        self.lights.len()
    }

    /// Whether there are no lights.
    pub fn is_empty(&self) -> bool {
        self.lights.is_empty()
    }

    /// The light of a leaf.
    pub fn light(&self, leaf: u32) -> u32 {
        self.lights[leaf as usize]
    }

    /// For each of `lights` lights its leaf index, or `u32::MAX`.
    pub fn places(&self, lights: usize) -> Vec<u32> {
        let mut places = vec![u32::MAX; lights];
        for (place, &light) in (0..).zip(&self.lights) {
            places[light as usize] = place;
        }
        places
    }

    /// The power of a leaf's light, relative to all lights.
    fn leaf_power(&self, leaf: u32) -> f32 {
        self.powers[leaf as usize]
    }

    /// The power share of a light in a tree with power `total`.
    fn share(power: f64, total: f64) -> f32 {
        ((power / total) as f32).max(LEAST_POWER)
    }

    /// Memory in bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.nodes) + size_of_val(&*self.lights) + size_of_val(&*self.powers)
    }

    /// The node of all lights.
    pub fn root(&self) -> &Node {
        &self.nodes[0]
    }

    /// A node.
    pub fn node(&self, number: u32) -> &Node {
        &self.nodes[number as usize]
    }

    /// The first leaf below a node.
    fn first_leaf(&self, mut number: u32) -> u32 {
        loop {
            let node = self.node(number);
            match node.leaf() {
                Some(leaf) => return leaf,
                None => number = node.link,
            }
        }
    }
}
