//! Exactness of the estimators and of random numbers: eight lanes give the bits that one lane gives, whatever the other
//! seven hold and whichever of them are active. Nothing here is statistical.

mod proof;

use octolux::bsdf::Bsdf;
use octolux::estimator::{ShadingPoint, per_light, per_point};
use octolux::lane::{Bits, F32x8, Lane, Mask, U32x8, Word};
use octolux::light::SphereLight;
use octolux::math::Vec3;
use octolux::sampling::{Pair, PassBlock, Toss};
use octolux::scene::SamplerKind;
use proof::lanes::{HARD, flat, uniform, vector, verdict};
use rand::{Rng, RngExt, SeedableRng};
use rand_pcg::Pcg64;

/// A packet of points and numbers, and the scalar view of each of its lanes.
struct Case {
    columns: [[f32; 8]; 16],
    bits: [[u32; 8]; 2],
    mask: u32,
    heads: u32,
}

impl Case {
    fn random(rng: &mut Pcg64) -> Self {
        let hard = rng.random_range(0..4) == 0;
        let mut columns: [[f32; 8]; 16] = std::array::from_fn(|_| std::array::from_fn(|_| uniform(rng) * 2.0 - 1.0));
        columns[12] = std::array::from_fn(|_| [1.0, 1.0, 1.5, 50.0, 1e4][rng.random_range(0..5)]);
        if hard {
            columns[rng.random_range(0..12)][rng.random_range(0..8)] = HARD[rng.random_range(0..HARD.len())];
        }
        // The ends of the range of random bits, too.
        let bits = |rng: &mut Pcg64| match rng.random_range(0..16) {
            0 => 0,
            1 => u32::MAX,
            _ => rng.next_u32(),
        };
        let bits = std::array::from_fn(|_| std::array::from_fn(|_| bits(rng)));
        let mask = [0, 0xff, 1, 0x80, rng.next_u32() & 0xff][rng.random_range(0..5)];
        // All tails, all heads, a mixture.
        let heads = [0, 0xff, rng.next_u32() & 0xff][rng.random_range(0..3)];
        Self {
            columns,
            bits,
            mask,
            heads,
        }
    }

    fn inputs<L: Lane>(&self, first: usize) -> (ShadingPoint<L>, Toss<L::Bits>, L::Mask) {
        let x: Vec<L> = self.columns.iter().map(|c| L::from_fn(|i| c[first + i])).collect();
        let (n, wo) = (vector(&x[3..]).normalize(), vector(&x[6..]).normalize());
        let n = Vec3::select(n.dot(wo).lt(L::zero()), -n, n);
        let point = ShadingPoint {
            p: vector(&x),
            ng: n,
            bsdf: Bsdf::new(n, wo, vector(&x[9..]), x[12]),
        };
        let [a, b] = self.bits.map(|bits| L::Bits::from_fn(|i| bits[first + i]));
        let heads = L::Mask::from_bitmask(self.heads >> first);
        (
            point,
            Toss {
                heads,
                pair: Pair(a, b),
            },
            L::Mask::from_bitmask(self.mask >> first),
        )
    }
}

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

fn by_light<L: Lane, D: per_light::Density>(case: &Case, light: &SphereLight, first: usize) -> Said {
    let (point, toss, active) = case.inputs::<L>(first);
    match per_light::sample::<L, D>(&point, light, || toss, active) {
        Some(found) => said(found.active, &[found.wi, found.ld], &[found.distance]),
        None => vec![None; L::N],
    }
}

fn by_point<L: Lane, D: per_point::Density>(case: &Case, first: usize) -> Said {
    let (point, toss, active) = case.inputs::<L>(first);
    match per_point::sample::<L, D>(&point, toss.pair, active) {
        Some(found) => said(found.active, &[found.wi, found.throughput], &[]),
        None => vec![None; L::N],
    }
}

/// 20 000 packets with masks of none, all, the first, the last and any lanes. At least a tenth of the lanes must say
/// something, or the test would be empty.
#[test]
fn estimators_give_the_bits_of_one_lane_under_partial_masks() {
    let lights = [
        SphereLight {
            center: [0.5, 0.25, 3.0],
            radius: 1.0,
            le: [3.0, 2.0, 1.0],
            sphere: 0,
        },
        SphereLight {
            center: [0.0, 0.1, 0.0],
            radius: 0.8,
            le: [3.0, 2.0, 1.0],
            sphere: 1,
        },
        SphereLight {
            center: [9.0, -40.0, 3.0],
            radius: 1e-3,
            le: [1e6, 2.0, 1e-6],
            sphere: 2,
        },
    ];
    let mut rng = Pcg64::seed_from_u64(17);
    let (mut wrong, mut heard) = (String::new(), [0, 0, 0, 0]);
    for trial in 0..20_000 {
        let case = Case::random(&mut rng);
        let light = &lights[trial % 3];
        let both = |first: usize, wide: bool| -> [Said; 4] {
            if wide {
                [
                    by_light::<F32x8, per_light::ConeOnly>(&case, light, first),
                    by_light::<F32x8, per_light::Average>(&case, light, first),
                    by_point::<F32x8, per_point::Sphere>(&case, first),
                    by_point::<F32x8, per_point::Lobe>(&case, first),
                ]
            } else {
                [
                    by_light::<f32, per_light::ConeOnly>(&case, light, first),
                    by_light::<f32, per_light::Average>(&case, light, first),
                    by_point::<f32, per_point::Sphere>(&case, first),
                    by_point::<f32, per_point::Lobe>(&case, first),
                ]
            }
        };
        let wide = both(0, true);
        for lane in 0..8 {
            for (k, (eight, one)) in wide.iter().zip(both(lane, false)).enumerate() {
                heard[k] += usize::from(one[0].is_some());
                if eight[lane] != one[0] {
                    wrong += &format!(
                        "trial {trial} estimator {k} lane {lane}: {:x?}, alone {:x?}\n",
                        eight[lane], one[0]
                    );
                }
            }
        }
    }
    verdict("estimators", &wrong);
    assert!(
        heard.iter().all(|&h| h > 8_000),
        "too few lanes said anything: {heard:?} of 160 000"
    );
}

/// Packets that straddle two passes or several pixels take each lane's own number.
#[test]
fn random_numbers_give_the_bits_of_one_lane() {
    let mut rng = Pcg64::seed_from_u64(5);
    for kind in SamplerKind::ALL {
        let block = PassBlock::new(kind, 3, 8, 16, 5);
        for _ in 0..5_000 {
            let pixels: [u32; 8] = std::array::from_fn(|_| rng.next_u32());
            let one_pass = rng.random_range(0..16);
            let mixed = rng.random_range(0..2) == 0;
            let passes: [u32; 8] = std::array::from_fn(|_| if mixed { rng.random_range(0..16) } else { one_pass });
            let row = rng.random_range(0..5);
            let group = rng.next_u32();
            let (key, pass) = (block.key(U32x8::from_fn(|i| pixels[i])), U32x8::from_fn(|i| passes[i]));
            let (pair, toss) = (block.pair(key, pass, row), block.toss(key, pass, row, group));
            for lane in 0..8 {
                let (key, pass) = (block.key(Word(pixels[lane])), Word(passes[lane]));
                let (one, thrown) = (block.pair(key, pass, row), block.toss(key, pass, row, group));
                let bits = |Pair(a, b): Pair<U32x8>| (a.lane(lane), b.lane(lane));
                let alone = |Pair(a, b): Pair<Word>| (a.0, b.0);
                assert_eq!(bits(pair), alone(one), "{kind:?} lane {lane}");
                assert_eq!(bits(toss.pair), alone(thrown.pair), "{kind:?} lane {lane}");
                assert_eq!(
                    toss.heads.to_bitmask() >> lane & 1 == 1,
                    thrown.heads,
                    "{kind:?} lane {lane}"
                );
                let (wide, alone) = (toss.pair.unit::<F32x8>(), thrown.pair.unit::<f32>());
                assert_eq!((wide.0.lane(lane), wide.1.lane(lane)), alone);
            }
        }
    }
}
