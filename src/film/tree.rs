//! Sums over passes in one fixed order, independent of who adds them.
//!
//! Addition rounds, so the order of the terms affects the bits. Passes are divided into *leaves* of a fixed number of passes.
//! Within a leaf chunks are added in order; two neighbouring nodes of which the left one has an even index are added to their
//! parent, level by level. A node is thus the same sum whichever process computes it, and a render that is split between
//! processes at the ends of leaves combines to the bits of an undivided render.
//!
//! Traversing the leaves in order keeps one node per set bit of a binary counter, at most one per level, so memory grows with
//! the logarithm of the passes. So do rounding errors (pairwise summation, Higham 1993).

/// One sum per pixel of a tile.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TileSum(pub Vec<[f64; 3]>);

impl TileSum {
    /// Zeros for `pixels` pixels.
    pub fn new(pixels: usize) -> Self {
        Self(vec![[0.0; 3]; pixels])
    }
}

/// The sum over the leaves `index << level .. (index + 1) << level`.
#[derive(Clone, Debug, PartialEq)]
pub struct Node {
    /// Its height: a leaf is on level 0.
    pub level: u32,
    /// Its index on its level, from the left.
    pub index: u32,
    /// The sums of every pixel.
    pub sums: TileSum,
}

impl Node {
    /// Its leaves, as a 64-bit range that cannot overflow on any level.
    pub fn leaves(&self) -> std::ops::Range<u64> {
        let (first, end) = (u64::from(self.index), u64::from(self.index) + 1);
        first << self.level..end << self.level
    }
}

/// The sums of a tile.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tree {
    /// Finished nodes from left to right; no two of them have the same parent.
    nodes: Vec<Node>,
    /// The unfinished leaf; empty if there is none.
    open: TileSum,
    open_passes: u32,
}

impl Tree {
    /// From finished nodes and the passes of an unfinished leaf.
    pub fn new(nodes: Vec<Node>, open: TileSum, open_passes: u32) -> Self {
        Self {
            nodes,
            open,
            open_passes,
        }
    }

    /// The finished nodes, from left to right.
    pub fn nodes(&self) -> &[Node] {
        &self.nodes
    }

    /// The sums of the unfinished leaf, and its passes.
    pub fn open(&self) -> (&TileSum, u32) {
        (&self.open, self.open_passes)
    }

    /// Adds the sums of each pixel over passes of the current leaf, in the format of [`ChunkSum`](super::ChunkSum).
    pub fn add(&mut self, sums: &[[f64; 4]]) {
        if self.open.0.is_empty() {
            self.open = TileSum::new(sums.len());
        }
        for (sum, more) in self.open.0.iter_mut().zip(sums) {
            for (s, m) in sum.iter_mut().zip(more) {
                *s += m;
            }
        }
    }

    /// Counts the passes given to [`Self::add`]: `passes` passes that end at pass `end`, in leaves of `leaf` passes. A full
    /// leaf becomes a node.
    pub fn count(&mut self, passes: u32, end: u32, leaf: u32) {
        self.open_passes += passes;
        if end.is_multiple_of(leaf) {
            self.open_passes = 0;
            let sums = std::mem::take(&mut self.open);
            let index = end / leaf - 1;
            self.insert(Node { level: 0, index, sums });
        }
    }

    /// Adds a node that overlaps no other, and merges neighbours into parents while there are any.
    pub fn insert(&mut self, mut node: Node) {
        let mut at = self.nodes.partition_point(|n| n.leaves().start < node.leaves().start);
        loop {
            let sibling = |n: Option<&Node>| n.is_some_and(|n| n.level == node.level && n.index == node.index ^ 1);
            let left = node.index % 2 == 1;
            let beside = if left { at.checked_sub(1) } else { Some(at) };
            let Some(beside) = beside.filter(|&i| sibling(self.nodes.get(i))) else {
                break;
            };
            let other = self.nodes.remove(beside);
            at = at.min(beside);
            let (mut first, second) = if left { (other, node) } else { (node, other) };
            for (sum, more) in first.sums.0.iter_mut().zip(&second.sums.0) {
                for (s, m) in sum.iter_mut().zip(more) {
                    *s += m;
                }
            }
            node = Node {
                level: first.level + 1,
                index: first.index / 2,
                sums: first.sums,
            };
        }
        self.nodes.insert(at, node);
    }

    /// Merges another tree. Their leaves must not overlap, and at most one may have an unfinished leaf.
    pub fn absorb(&mut self, other: Self) {
        for node in other.nodes {
            self.insert(node);
        }
        if other.open_passes > 0 {
            (self.open, self.open_passes) = (other.open, other.open_passes);
        }
    }

    /// The sum of a pixel: nodes from left to right, then the unfinished leaf.
    pub fn total(&self, pixel: usize) -> [f64; 3] {
        let parts = self.nodes.iter().map(|node| &node.sums).chain([&self.open]);
        let mut total = [0.0; 3];
        for sum in parts.filter_map(|sums| sums.0.get(pixel)) {
            for (t, s) in total.iter_mut().zip(sum) {
                *t += s;
            }
        }
        total
    }

    /// Number of passes, with leaves of `leaf` passes.
    pub fn passes(&self, leaf: u32) -> u32 {
        let leaves = self.nodes.iter().map(|node| 1 << node.level).sum::<u32>();
        leaves * leaf + self.open_passes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers whose sums need rounding.
    fn leaf(index: u32) -> Node {
        let sum = 1.0 / f64::from(3 * index + 1);
        let sums = TileSum(vec![[sum, -sum, sum * sum]]);
        Node { level: 0, index, sums }
    }

    fn tree(leaves: impl IntoIterator<Item = u32>) -> Tree {
        let mut tree = Tree::default();
        leaves.into_iter().for_each(|index| tree.insert(leaf(index)));
        tree
    }

    #[test]
    fn any_order_and_any_division_of_leaves_makes_the_same_bits() {
        for leaves in 1..70 {
            let whole = tree(0..leaves);
            // 17 is coprime to any number of leaves below 70 except its multiples.
            if leaves % 17 != 0 {
                assert_eq!(tree((0..leaves).map(|i| i * 17 % leaves)), whole, "{leaves} leaves");
            }
            for shards in [1, 2, 3, 7, 64] {
                let mut merged = Tree::default();
                for shard in (0..shards).rev() {
                    merged.absorb(tree(shard * leaves / shards..(shard + 1) * leaves / shards));
                }
                assert_eq!(merged, whole, "{leaves} leaves in {shards} shards");
            }
            assert_eq!(whole.nodes().len(), leaves.count_ones() as usize);
            assert_eq!(whole.passes(16), 16 * leaves);
        }
    }

    /// Shows that order matters; otherwise the test above would prove nothing.
    #[test]
    fn another_order_of_addition_makes_other_bits() {
        let one_by_one = (0..64).map(|i| leaf(i).sums.0[0][0]).sum::<f64>();
        assert_ne!(tree(0..64).total(0)[0], one_by_one);
    }

    #[test]
    fn a_leaf_that_is_full_becomes_a_node_and_the_rest_stays_behind() {
        let mut tree = Tree::default();
        for (passes, end) in [(1, 1), (1, 2), (2, 4), (4, 8), (4, 12)] {
            tree.add(&[[1.0, 0.0, 0.0, 0.0]]);
            tree.count(passes, end, 4);
        }
        assert_eq!(
            tree.nodes().iter().map(|n| (n.level, n.index)).collect::<Vec<_>>(),
            [(1, 0), (0, 2)]
        );
        tree.add(&[[0.5, 0.0, 0.0, 0.0]]);
        tree.count(3, 15, 4);
        assert_eq!((tree.total(0)[0], tree.passes(4)), (5.5, 15));
    }
}
