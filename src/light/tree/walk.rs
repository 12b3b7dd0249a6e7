//! Each lane's own way down the tree, for points that a list for a tile does not suit: those with lobes of their own.

use bytemuck::must_cast;

use super::importance::Moments;
use super::start::{Shares, Starts};
use super::{LEAF, LightTree, Node};
use crate::lane::{Bits, Lane, Mask};
use crate::math::Vec3;
use crate::sampling::Pair;

/// Least probability of a child: what no estimate can exclude. Fifty levels of it would be nothing; in practice few nodes reach it.
const LEAST: f32 = 1.0 / 4096.0;

/// The largest number below 1.
const BELOW_ONE: f32 = 1.0 - f32::EPSILON / 2.0;

/// Numbers of walks at the end of some choices are no coarser than this.
const FINE: f32 = 1.0 / (1 << 18) as f32;

/// Points in units of the tree, their normals, and of Phong lobes the axis and the exponent.
pub type From<L> = (Vec3<L>, Vec3<L>, Option<(Vec3<L>, L)>);

/// A leaf in each lane, and the probability of reaching it.
#[derive(Clone, Copy)]
pub struct Walked<L> {
    /// Leaves; 0 in lanes that are not active.
    pub leaf: [u32; 16],
    /// Probabilities; positive in active lanes.
    pub chance: L,
}

/// A number in [0, 1) that selects a leaf, and digits to come. A way down the tree divides the number by the probability of each child:
/// single precision would run out of digits, and a leaf with a chance of 2^-20 would have 16 numbers.
#[derive(Clone, Copy, Debug)]
pub struct Digits<L: Lane> {
    number: L,
    /// Distance between two possible numbers.
    grain: L,
    more: L::Bits,
}

impl<L: Lane> Digits<L> {
    /// In stratum `i` of `strata`: the first number of the pair places it, the second has the digits to come.
    #[inline(always)]
    pub fn new(pair: Pair<L::Bits>, i: u32, strata: u32) -> Self {
        let (u, _) = pair.unit::<L>();
        let place = (u + L::splat(i as f32)) * L::splat(1.0 / strata as f32);
        Self {
            number: place.min(L::splat(BELOW_ONE)),
            grain: L::splat(f32::EPSILON / 2.0),
            more: pair.1,
        }
    }

    /// Chooses the first of two children with probability `share`. Returns in which lanes, and the probability of the chosen one.
    #[inline(always)]
    fn choose(&mut self, share: L) -> (L::Mask, L) {
        let first = self.number.lt(share);
        let taken = L::select(first, share, L::one() - share);
        let inverse = L::one() / taken;
        self.number = L::select(first, self.number, self.number - share) * inverse;
        self.grain = self.grain * inverse;
        self.refine();
        (first, taken)
    }

    /// The number.
    #[inline(always)]
    pub(super) fn number(&self) -> L {
        self.number
    }

    /// Makes of a number in an interval one of [0, 1). `width` must be positive.
    #[inline(always)]
    pub(super) fn within(&mut self, begin: L, width: L) {
        let inverse = L::one() / width;
        self.number = (self.number - begin) * inverse;
        self.grain = self.grain * inverse;
        // The least interval is so small that its numbers need both.
        self.refine();
        self.refine();
    }

    /// Adds eight more bits where the number is coarse.
    #[inline(always)]
    fn refine(&mut self) {
        let coarse = self.grain.gt(L::splat(FINE));
        if coarse.any() {
            let finer = self.grain * L::splat(1.0 / 256.0);
            let finer_number = L::from_i32(self.more.shr(24)).mul_add(finer, self.number);
            self.number = L::select(coarse, finer_number, self.number);
            self.grain = L::select(coarse, finer, self.grain);
            self.more = L::Bits::select(coarse, self.more.shl(8), self.more);
        }
        self.number = self.number.min(L::splat(BELOW_ONE));
    }
}

/// What decides between two children.
pub(super) trait Weighs<L: Lane> {
    /// In each open lane importance and power of the node `first` and of the next.
    fn weigh(&self, tree: &LightTree, open: L::Mask, first: &[u32; 16]) -> [(L, L); 2];
}

/// The moments of nodes.
pub(super) struct ByMoments<L: Lane>(pub From<L>);

impl<L: Lane> Weighs<L> for ByMoments<L> {
    #[inline(always)]
    fn weigh(&self, tree: &LightTree, _: L::Mask, first: &[u32; 16]) -> [(L, L); 2] {
        let Self((p, n, lobe)) = *self;
        // No loop: the two wait for divisions and roots together.
        let (a, b) = (
            Moments::<L>::gather(tree, first, 0),
            Moments::<L>::gather(tree, first, 1),
        );
        [(a.brief(p, n, lobe), a.power), (b.brief(p, n, lobe), b.power)]
    }
}

impl LightTree {
    /// Walks from a node of `starts` to a leaf in each active lane, by the importance of the children. The tree must not be empty. Several
    /// walks at once do not influence each other, and take less time: two of pbrt's bounds 0.83 of that of one after the other (one run each).
    #[inline(always)]
    pub fn walk<L: Lane, const K: usize>(
        &self,
        active: [L::Mask; K],
        (starts, shares): (&Starts, &Shares<L>),
        from: From<L>,
        mut digits: [Digits<L>; K],
    ) -> [Walked<L>; K] {
        // Loops, here and below, in place of `array::from_fn`: a closure that is not inlined is compiled without AVX-512, and each of its
        // operations on lanes becomes a call. Renders with 16 lanes took 1.7 to 2.1 times as long (docs/performance-log.md).
        let mut begin = [([LEAF; 16], L::one()); K];
        for k in 0..K {
            begin[k] = starts.choose(self, active[k], shares, &mut digits[k]);
        }
        self.way_down(active, begin, digits, &ByMoments(from))
    }

    /// Walks down from links, which were chosen with some probability, by what the guide says of pairs of nodes.
    #[inline(always)]
    pub(super) fn way_down<L: Lane, const K: usize>(
        &self,
        active: [L::Mask; K],
        mut at: [([u32; 16], L); K],
        mut digits: [Digits<L>; K],
        guide: &impl Weighs<L>,
    ) -> [Walked<L>; K] {
        let mut open = active;
        loop {
            // Lanes at a leaf stop; the nodes that they read are the root and the unused one.
            let mut first = [[0_u32; 16]; K];
            for k in 0..K {
                let mut still = 0;
                for lane in open[k].lanes() {
                    let link = at[k].0[lane];
                    if link & LEAF == 0 {
                        first[k][lane] = link;
                        still |= 1 << lane;
                    }
                }
                open[k] = L::Mask::from_bitmask(still);
            }
            if open.iter().all(|open| open.none()) {
                let leaf = [0; 16];
                let mut walked = [Walked { leaf, chance: L::one() }; K];
                for k in 0..K {
                    walked[k].chance = at[k].1;
                    for lane in active[k].lanes() {
                        walked[k].leaf[lane] = at[k].0[lane] & !LEAF;
                    }
                }
                return walked;
            }
            let mut weighed = [[(L::zero(), L::zero()); 2]; K];
            for k in 0..K {
                weighed[k] = guide.weigh(self, open[k], &first[k]);
            }
            for (k, [(a, power), (b, other_power)]) in weighed.into_iter().enumerate() {
                let sum = a + b;
                let sound = sum.gt(L::zero()) & sum.lt(L::splat(f32::INFINITY));
                let share = L::select(sound, a, power) / L::select(sound, sum, power + other_power);
                let (left, taken) = digits[k].choose(share.max(L::splat(LEAST)).min(L::splat(1.0 - LEAST)));
                let (link, chance) = &mut at[k];
                *chance = L::select(open[k], *chance * taken, *chance);
                let left = left.to_bitmask();
                for lane in open[k].lanes() {
                    let second = !left >> lane & 1;
                    link[lane] = self.nodes[(first[k][lane] + second) as usize].link;
                }
            }
        }
    }
}

impl<L: Lane> Moments<L> {
    /// A node in each lane, counted from `first`.
    #[inline(always)]
    fn gather(tree: &LightTree, first: &[u32; 16], child: u32) -> Self {
        let row = |lane: usize| must_cast::<Node, [u32; 8]>(tree.nodes[(first[lane] + child) as usize]);
        let [x, y, z, pu, vw, normals, rest, _] = L::Bits::transposed(row);
        let upper = |bits: L::Bits| L::from_bits(bits.shr(16).shl(16));
        let lower = |bits: L::Bits| L::from_bits(bits.shl(16));
        // Byte `i` with its sign, in 127ths.
        let sign = L::Bits::splat(128);
        let byte = |bits: L::Bits, i: u32| {
            let byte = bits.shl(24 - 8 * i).shr(24);
            L::from_i32((byte ^ sign) - sign) * L::splat(1.0 / 127.0)
        };
        Self {
            mean: Vec3::new(L::from_bits(x), L::from_bits(y), L::from_bits(z)),
            power: lower(pu),
            variance: Vec3::new(upper(pu), lower(vw), upper(vw)),
            normals: [
                byte(normals, 0),
                byte(normals, 1),
                byte(normals, 2),
                byte(normals, 3),
                byte(rest, 0),
            ],
            facing: Vec3::new(byte(rest, 1), byte(rest, 2), byte(rest, 3)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lane::{F32x8, Word};
    use crate::light::tree::{Emission, Emitter, Probes};
    use crate::sampling::hash::{mix, pcg4d};

    fn unit(i: u32) -> f32 {
        (mix(i) >> 8) as f32 / 16_777_216.0
    }

    /// Lights with powers over eight orders of magnitude in a box; a third of each kind.
    fn tree(number: u32) -> LightTree {
        let n = [0.0, 0.6, 0.8];
        let light = |i: u32| Emitter {
            light: i,
            mean: std::array::from_fn(|k| 10.0 * unit(9 * i + k as u32)),
            variance: [1e-5; 3],
            emission: [Emission::Round, Emission::OneSide(n), Emission::BothSides(n)][i as usize % 3],
            intensity: 10_f64.powf(8.0 * f64::from(unit(9 * i + 5))),
        };
        LightTree::new(&(0..number).map(light).collect::<Vec<_>>())
    }

    fn points<L: Lane>() -> [From<L>; 3] {
        let up = Vec3::splat([0.0, 1.0, 0.0]);
        let at = |p: [f32; 3]| Vec3::splat(p);
        let lobe = |alpha: f32| Some((Vec3::splat([0.6, 0.8, 0.0]), L::splat(alpha)));
        [
            (at([5.0, -1.0, 5.0]), up, None),
            (at([1.0, -2.0, 4.0]), up, lobe(50.0)),
            (at([5.0, 5.0, 5.0]), -up, lobe(2000.0)),
        ]
    }

    /// Starts for other points than those that walk.
    fn starts(tree: &LightTree) -> Starts {
        let mut probes = Probes::new(true);
        for i in 0..5 {
            probes.push([3.0 + i as f32, -2.0, 4.0], [0.0, 1.0, 0.0], [0.6, 0.8, 0.0], 40.0);
        }
        Starts::of(tree, &probes)
    }

    /// 2^18 walks from each point, a fourth of them in each stratum: the lights that are expected more than 30 times by their probability
    /// are found as often as that, the others together too. A pooled chi-square with at most 300 degrees of freedom, five sigmas.
    #[test]
    fn leaves_are_found_as_often_as_walks_tell() {
        let tree = tree(300);
        let starts = starts(&tree);
        for (at, from) in points::<F32x8>().into_iter().enumerate() {
            let shares = starts.shares(&tree, from);
            let (mut counts, mut chances) = (vec![0_u32; 300], vec![0.0_f32; 300]);
            let walks = 1_u32 << 18;
            for i in (0..walks).step_by(8) {
                let number = |k: usize| {
                    <F32x8 as Lane>::Bits::from_fn(|lane| {
                        pcg4d([Word(i + lane as u32), Word(at as u32), Word(0), Word(9)])[k].0
                    })
                };
                let digits = Digits::new(Pair(number(0), number(1)), i / 8 % 4, 4);
                let [walked] = tree.walk([Mask::splat(true)], (&starts, &shares), from, [digits]);
                for lane in 0..8 {
                    let leaf = walked.leaf[lane] as usize;
                    counts[leaf] += 1;
                    let chance = walked.chance.lane(lane);
                    assert!(
                        chance > 0.0 && (chances[leaf] == 0.0 || chances[leaf] == chance),
                        "leaf {leaf}"
                    );
                    chances[leaf] = chance;
                }
            }
            let (mut chi2, mut cells, mut left) = (0.0, 0, (0.0, 1.0));
            for (&count, &chance) in counts.iter().zip(&chances) {
                let expected = f64::from(chance) * f64::from(walks);
                if expected > 30.0 {
                    chi2 += (f64::from(count) - expected).powi(2) / expected;
                    cells += 1;
                    left = (left.0 - f64::from(count), left.1 - f64::from(chance));
                }
            }
            let (few, expected) = (left.0 + f64::from(walks), left.1 * f64::from(walks));
            assert!(
                (few - expected).abs() < 5.0 * expected.max(30.0).sqrt(),
                "point {at}: {few}, not {expected}"
            );
            let sigmas = (chi2 - f64::from(cells)) / (2.0 * f64::from(cells)).sqrt();
            assert!(sigmas < 5.0, "point {at}: chi-square {chi2} of {cells}");
        }
    }

    /// Single lanes find the lights of packets that walk twice at once, with the same bits.
    #[test]
    fn a_lane_walks_alone_as_in_a_packet() {
        let tree = tree(1000);
        let starts = starts(&tree);
        for (wide, one) in points::<F32x8>().into_iter().zip(points::<f32>()) {
            let (shares, own) = (starts.shares(&tree, wide), starts.shares(&tree, one));
            for i in 0..200 {
                let word = |lane: usize, k: u32| mix(16 * i + 2 * lane as u32 + k);
                let pair = Pair(Bits::from_fn(|lane| word(lane, 0)), Bits::from_fn(|lane| word(lane, 1)));
                let active = Mask::from_bitmask(0b1101_1011);
                let both = [i, i + 1].map(|i| Digits::<F32x8>::new(pair, i % 3, 3));
                let [together, _] = tree.walk([active, Mask::splat(true)], (&starts, &shares), wide, both);
                for lane in [0, 1, 3, 4, 6, 7] {
                    let digits = Digits::new(Pair(Word(word(lane, 0)), Word(word(lane, 1))), i % 3, 3);
                    let [alone] = tree.walk::<f32, 1>([true], (&starts, &own), one, [digits]);
                    assert_eq!(alone.leaf[0], together.leaf[lane]);
                    assert_eq!(alone.chance.to_bits(), together.chance.lane(lane).to_bits());
                }
            }
        }
    }

    /// A tree of one light has no pair of nodes, and its walks begin at the leaf.
    #[test]
    fn one_light_is_always_found() {
        let (tree, from) = (tree(1), points()[0]);
        let starts = starts(&tree);
        let shares = starts.shares::<f32>(&tree, from);
        let digits = Digits::new(Pair(Word(7), Word(9)), 0, 1);
        let [walked] = tree.walk([true], (&starts, &shares), from, [digits]);
        assert_eq!((walked.leaf[0], walked.chance), (0, 1.0));
    }
}
