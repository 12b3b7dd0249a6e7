//! Exactness of the estimators and of random numbers: eight lanes and sixteen give the bits that one lane gives, whatever
//! the others hold and whichever of them are active. Nothing here is statistical.

use crate::proof::lanes::{HARD, InLanes, flat, in_all_widths, uniform, vector, verdict};
use octolux::bsdf::DiffuseOrPhong;
use octolux::embree::TraceLane;
use octolux::estimator::density::{Average, ConeOnly, DiskOrCone, LobeInCap, Mix, Projected};
use octolux::estimator::{ShadingPoint, per_light, per_point, per_triangle};
use octolux::lane::{Bits, Lane, Mask};
use octolux::light::{SphereLight, Triangle};
use octolux::math::Vec3;
use octolux::sampling::{Pair, PassBlock, TechniqueSample};
use octolux::scene::SamplerKind;
use rand::{Rng, RngExt, SeedableRng};
use rand_pcg::Pcg64;

/// A packet of points and numbers, and the scalar view of each of its lanes.
struct Case {
    columns: [[f32; 16]; 13],
    bits: [[u32; 16]; 2],
    mask: u32,
    by_brdf_lanes: u32,
}

impl Case {
    fn random(rng: &mut Pcg64) -> Self {
        let hard = rng.random_range(0..4) == 0;
        let mut columns: [[f32; 16]; 13] = std::array::from_fn(|_| std::array::from_fn(|_| uniform(rng) * 2.0 - 1.0));
        columns[12] = std::array::from_fn(|_| [1.0, 1.0, 1.5, 50.0, 1e4][rng.random_range(0..5)]);
        if hard {
            columns[rng.random_range(0..12)][rng.random_range(0..16)] = HARD[rng.random_range(0..HARD.len())];
        }
        // The ends of the range of random bits, too.
        let bits = |rng: &mut Pcg64| match rng.random_range(0..16) {
            0 => 0,
            1 => u32::MAX,
            _ => rng.next_u32(),
        };
        let bits = std::array::from_fn(|_| std::array::from_fn(|_| bits(rng)));
        let mask = [0, 0xffff, 1, 0x8000, rng.next_u32() & 0xffff][rng.random_range(0..5)];
        // All tails, all heads, a mixture.
        let by_brdf_lanes = [0, 0xffff, rng.next_u32() & 0xffff][rng.random_range(0..3)];
        Self {
            columns,
            bits,
            mask,
            by_brdf_lanes,
        }
    }

    fn inputs<L: Lane>(&self, first: usize) -> Inputs<L> {
        let x: Vec<L> = self.columns.iter().map(|c| L::from_fn(|i| c[first + i])).collect();
        let (n, wo) = (vector(&x[3..]).normalize(), vector(&x[6..]).normalize());
        let n = Vec3::select(n.dot(wo).lt(L::zero()), -n, n);
        let point = ShadingPoint {
            p: vector(&x),
            ng: n,
            bsdf: DiffuseOrPhong::new(n, wo, vector(&x[9..]), x[12]),
        };
        let [a, b] = self.bits.map(|bits| L::Bits::from_fn(|i| bits[first + i]));
        let by_brdf_lanes = lanes_of::<L>(self.by_brdf_lanes, first);
        (
            point,
            TechniqueSample {
                by_brdf_lanes,
                pair: Pair(a, b),
            },
            lanes_of::<L>(self.mask, first),
        )
    }
}

fn lanes_of<L: Lane>(bits: u32, first: usize) -> L::Mask {
    L::Mask::from_bitmask(bits >> first & ((1 << L::N) - 1))
}

/// A point, its random numbers, and the lanes that are active.
type Inputs<L> = (
    ShadingPoint<L, DiffuseOrPhong<L>>,
    TechniqueSample<<L as Lane>::Bits>,
    <L as Lane>::Mask,
);

/// What an estimator says of each lane: nothing, or an active lane's numbers.
type Said = Vec<Option<Vec<u32>>>;

fn said<L: Lane>(active: L::Mask, vectors: &[Vec3<L>], numbers: &[L]) -> Said {
    // NaN is one value, as above.
    let bits = |x: f32| if x.is_nan() { f32::NAN.to_bits() } else { x.to_bits() };
    let mut all = flat(vectors);
    all.extend(numbers);
    (0..L::N)
        .map(|i| (active.to_bitmask() >> i & 1 == 1).then(|| all.iter().map(|x| bits(x.lane(i))).collect()))
        .collect()
}

fn by_light<L: Lane, D: per_light::Directions<L, DiffuseOrPhong<L>>>(
    density: D,
    case: &Case,
    light: &SphereLight,
    first: usize,
) -> Said {
    let (point, technique_sample, active) = case.inputs::<L>(first);
    match per_light::sample(density, &point, light, technique_sample, active) {
        Some(found) => said(found.active, &[found.wi, found.ld], &[found.distance]),
        None => vec![None; L::N],
    }
}

fn by_point<L: Lane, D: per_point::Density>(case: &Case, first: usize) -> Said {
    let (point, technique_sample, active) = case.inputs::<L>(first);
    match per_point::sample::<L, D>(&point, technique_sample.pair, active) {
        Some(found) => said(found.active, &[found.wi, found.throughput], &[]),
        None => vec![None; L::N],
    }
}

fn by_triangle<L: Lane>(case: &Case, triangle: &Triangle, first: usize) -> Said {
    let (point, technique_sample, active) = case.inputs::<L>(first);
    let view = triangle.splat::<L>().seen_from(point.p);
    let worth = (Vec3::splat([3.0, 2.0, 1.0]), L::one());
    match per_triangle::sample(
        Average,
        &point,
        &view,
        worth,
        technique_sample.into(),
        active & view.rises_above(point.bsdf.n),
    ) {
        Some(found) => said(found.active, &[found.wi, found.ld], &[found.distance]),
        None => vec![None; L::N],
    }
}

/// The estimators at sixteen points.
struct Estimates<'a>(&'a Case, &'a SphereLight, &'a Triangle);

impl InLanes for Estimates<'_> {
    type Said = [Option<Vec<u32>>; 9];
    fn run<L: TraceLane>(&self, first: usize) -> Vec<Self::Said> {
        let Self(case, light, triangle) = *self;
        let mut said = [
            by_light::<L, _>(ConeOnly, case, light, first),
            by_light::<L, _>(Average, case, light, first),
            by_light::<L, _>(Mix::Power, case, light, first),
            by_light::<L, _>(Projected, case, light, first),
            by_light::<L, _>(DiskOrCone, case, light, first),
            by_light::<L, _>(LobeInCap, case, light, first),
            by_point::<L, per_point::Sphere>(case, first),
            by_point::<L, per_point::Lobe>(case, first),
            by_triangle::<L>(case, triangle, first),
        ];
        (0..L::N).map(|i| said.each_mut().map(|s| s[i].take())).collect()
    }
}

/// 10 000 packets with masks of none, all, the first, the last and any lanes. At least a twentieth of the lanes must say
/// something, or the test would be empty.
#[test]
fn estimators_give_the_bits_of_one_lane_under_partial_masks() {
    let lights = [
        SphereLight {
            center: [0.5, 0.25, 3.0],
            radius: 1.0,
            le: [3.0, 2.0, 1.0],
            sphere: 0,
            origin_power: None,
        },
        SphereLight {
            center: [0.0, 0.1, 0.0],
            radius: 0.8,
            le: [3.0, 2.0, 1.0],
            sphere: 1,
            origin_power: None,
        },
        SphereLight {
            center: [9.0, -40.0, 3.0],
            radius: 1e-3,
            le: [1e6, 2.0, 1e-6],
            sphere: 2,
            origin_power: None,
        },
    ];
    // Wide, touched by some points, and tiny.
    let triangles = [(2.0, 1.5), (1.5, 0.5), (0.01, -3.0)].map(|(size, z)| {
        crate::proof::triangles::light([
            glam::DVec3::new(-size, -size, z),
            glam::DVec3::new(size, -0.5 * size, z),
            glam::DVec3::new(0.0, size, z + 0.3 * size),
        ])
    });
    let mut rng = Pcg64::seed_from_u64(17);
    let (mut wrong, mut heard) = (String::new(), [0; 9]);
    for trial in 0..10_000 {
        let case = Case::random(&mut rng);
        let said = in_all_widths(&Estimates(&case, &lights[trial % 3], &triangles[trial % 3]));
        let alone = &said[0].1;
        for one in alone {
            (0..9).for_each(|k| heard[k] += usize::from(one[k].is_some()));
        }
        for (width, wide) in &said[1..] {
            for (lane, (w, s)) in wide.iter().zip(alone).enumerate().filter(|(_, (w, s))| w != s) {
                wrong += &format!("trial {trial}, lane {lane} of {width}: {w:x?}, alone {s:x?}\n");
            }
        }
    }
    verdict("estimators", &wrong);
    assert!(
        heard.iter().all(|&h| h > 8_000),
        "too few lanes said anything: {heard:?} of 160 000"
    );
}

/// Random numbers at sixteen addresses.
struct Draws<'a> {
    block: &'a PassBlock,
    pixels: [u32; 16],
    passes: [u32; 16],
    pair: u32,
    group: u32,
}

impl InLanes for Draws<'_> {
    type Said = ([u32; 4], bool, [u32; 2]);
    fn run<L: TraceLane>(&self, first: usize) -> Vec<Self::Said> {
        let [pixel, pass] = [self.pixels, self.passes].map(|numbers| L::Bits::from_fn(|i| numbers[first + i]));
        let key = self.block.key(pixel);
        let Pair(a, b) = self.block.pair(key, pass, self.pair);
        let technique_sample = self.block.technique_sample(key, pass, self.pair, self.group);
        let (u, v) = technique_sample.pair.unit::<L>();
        let said = |i: usize| {
            let bits = [a, b, technique_sample.pair.0, technique_sample.pair.1].map(|bits| bits.lane(i));
            (
                bits,
                technique_sample.by_brdf_lanes.to_bitmask() >> i & 1 == 1,
                [u, v].map(|x| x.lane(i).to_bits()),
            )
        };
        (0..L::N).map(said).collect()
    }
}

/// Packets that straddle two passes or several pixels take each lane's own number.
#[test]
fn random_numbers_give_the_bits_of_one_lane() {
    let mut rng = Pcg64::seed_from_u64(5);
    for kind in SamplerKind::ALL {
        for first in [0, 8] {
            let block = PassBlock::new(kind, 3, first, 16, 5);
            for trial in 0..3_000 {
                let one_pass = rng.random_range(0..16);
                let passes = std::array::from_fn(|_| {
                    if trial % 2 == 0 {
                        one_pass
                    } else {
                        rng.random_range(0..16)
                    }
                });
                let draws = Draws {
                    block: &block,
                    pixels: std::array::from_fn(|_| rng.next_u32()),
                    passes,
                    pair: rng.random_range(0..5),
                    group: rng.next_u32(),
                };
                let said = in_all_widths(&draws);
                for (width, wide) in &said[1..] {
                    assert_eq!(wide, &said[0].1, "{kind:?} in {width} lanes");
                }
            }
        }
    }
}
