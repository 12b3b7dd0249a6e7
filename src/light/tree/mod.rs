//! A tree over lights that tells how much of their light a point may get from any part of it: what short lists of lights are
//! drawn from.
//!
//! A node holds moments, not bounds: the mean place of its lights, weighted by power, the variance around it, and the second moments
//! of their normals. The importance of a node ([`Node::importance`]) is then a closed form that is finite and above 0 everywhere, also
//! inside of a node, and so is every chance that is made of it: lists are unbiased whatever the moments are. How good they are is a
//! matter of variance alone, so nodes are rounded: 32 bytes each, 64 a light.
//!
//! Bounds instead (Conty and Kulla 2018, "Importance Sampling of Many Lights with Adaptive Tree Splitting"; pbrt-v4's
//! `lightsamplers.h`) have the variance of points between or inside of boxes, whose distance they do not know. Moments of lights are
//! also in Tokuyoshi et al. 2024, "Hierarchical Light Sampling with Accurate Spherical Gaussian Lighting".

mod build;
mod cut;
mod importance;
mod table;

pub use build::Emitter;
pub use cut::Cut;
pub use importance::{Probes, WIDE};
pub use table::{Look, Pick, Table};

/// A part of the lights.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(32))]
pub struct Node {
    /// Mean place, weighted by power.
    mean: [f32; 3],
    /// Share of the power of all lights, in (0, 1].
    power: f32,
    /// Variance of places along each axis, the extent of lights themselves included: the upper half of an `f32`.
    variance: [u16; 3],
    /// Means of products of two components of normals: xx, yy, zz, xy, xz, yz, in 127ths.
    normals: [i8; 6],
    /// The first of two children, or with the top bit a place in the order of leaves.
    link: u32,
}

/// The bit by which a leaf is told from a node with children.
const LEAF: u32 = 1 << 31;

/// The least power, as a share of all: 0 would be a light that is never drawn.
const LEAST_POWER: f32 = 1e-30;

/// The least variance: a place without any would divide by 0 on itself. A length of 1e-12 in the unit of the tree.
const LEAST_VARIANCE: f32 = 1e-24;

/// A tree over lights. Lengths should be at most some thousands, so that their powers are numbers of single precision.
#[derive(Clone, Debug, Default)]
pub struct LightTree {
    /// The root, one that is not used, then children two by two.
    nodes: Vec<Node>,
    /// The light at each place in the order of leaves.
    lights: Vec<u32>,
    /// The power of each, in the same order.
    powers: Vec<f32>,
}

impl Node {
    /// The place of a leaf in the order of leaves.
    pub fn leaf(&self) -> Option<u32> {
        (self.link & LEAF != 0).then_some(self.link & !LEAF)
    }

    /// Share of the power of all lights, in (0, 1].
    pub fn power(&self) -> f32 {
        self.power
    }

    /// Variance of places along each axis.
    fn spread(&self) -> [f32; 3] {
        self.variance.map(|upper| f32::from_bits(u32::from(upper) << 16))
    }
}

impl LightTree {
    /// Lights in it.
    pub fn len(&self) -> usize {
        self.lights.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.lights.is_empty()
    }

    /// The light at a place in the order of leaves.
    pub fn light(&self, leaf: u32) -> u32 {
        self.lights[leaf as usize]
    }

    /// For each of `lights` lights its place in the order of leaves, or `u32::MAX`.
    pub fn places(&self, lights: usize) -> Vec<u32> {
        let mut places = vec![u32::MAX; lights];
        for (place, &light) in (0..).zip(&self.lights) {
            places[light as usize] = place;
        }
        places
    }

    /// The power of the light at a place in the order of leaves, as a share of all.
    fn leaf_power(&self, leaf: u32) -> f32 {
        self.powers[leaf as usize]
    }

    /// The share of the power of all lights that a light of this power has in a tree over `total`.
    fn share(power: f64, total: f64) -> f32 {
        ((power / total) as f32).max(LEAST_POWER)
    }

    /// Bytes that it takes.
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.nodes) + size_of_val(&*self.lights) + size_of_val(&*self.powers)
    }

    /// The node that all lights are in.
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
