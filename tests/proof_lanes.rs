//! Exactness, function by function: eight lanes give the bits that one lane gives, whatever the other seven hold and
//! whichever of them are active; NaN and infinities included. Nothing here is statistical.

mod proof;

use octolux::bsdf::Bsdf;
use octolux::estimator::{ShadingPoint, per_light, per_point};
use octolux::lane::{Bits, F32x8, Lane, Mask, Mask8, U32x8, Word};
use octolux::light::SphereLight;
use octolux::math::elementary::{exp, expm1, ln, ln_1m, powcos, sin_cos_turn};
use octolux::math::{Frame, Vec3};
use octolux::sampling::{Pair, PassBlock, warp};
use octolux::scene::SamplerKind;
use rand::{Rng, RngExt, SeedableRng};
use rand_pcg::Pcg64;

/// A function of numbers to numbers in any lane.
trait Numbers {
    fn call<L: Lane>(&self, x: &[L]) -> Vec<L>;
}

/// NaN is one value: which of its bits survive an operation is the compiler's choice in both forms.
fn same(a: f32, b: f32) -> bool {
    a.to_bits() == b.to_bits() || a.is_nan() && b.is_nan()
}

/// What breaks functions: zeros, subnormals, the ends of the range, infinities, NaN.
const HARD: [f32; 14] = [
    0.0,
    -0.0,
    1e-45,
    -1e-45,
    f32::MIN_POSITIVE,
    f32::EPSILON,
    1.0,
    -1.0,
    2.0,
    1.0 - f32::EPSILON / 2.0,
    f32::MAX,
    f32::INFINITY,
    f32::NEG_INFINITY,
    f32::NAN,
];

/// Calls `f` with 20 000 packets of `arity` numbers, one in eight of them hard, and compares lane by lane. Differences
/// go into a table.
fn check(name: &str, arity: usize, f: &impl Numbers, mut number: impl FnMut(&mut Pcg64, usize) -> f32) {
    let mut rng = Pcg64::seed_from_u64(3);
    let mut wrong = String::new();
    for _ in 0..20_000 {
        let columns: Vec<[f32; 8]> = (0..arity)
            .map(|argument| {
                std::array::from_fn(|_| {
                    if rng.random_range(0..8) == 0 {
                        HARD[rng.random_range(0..HARD.len())]
                    } else {
                        number(&mut rng, argument)
                    }
                })
            })
            .collect();
        let wide = f.call(&columns.iter().map(|c| F32x8::load(c)).collect::<Vec<_>>());
        for lane in 0..8 {
            let arguments: Vec<f32> = columns.iter().map(|c| c[lane]).collect();
            for (k, (w, s)) in wide.iter().zip(f.call(&arguments)).enumerate() {
                if !same(w.lane(lane), s) {
                    wrong += &format!(
                        "{name}{arguments:?} result {k}: {:e} in lane {lane}, {s:e} alone\n",
                        w.lane(lane)
                    );
                }
            }
        }
    }
    verdict(name, &wrong);
}

/// Fails with the table of differences, if there are any.
fn verdict(name: &str, wrong: &str) {
    if !wrong.is_empty() {
        let path = proof::artefact(&format!("lanes-{name}.txt"));
        std::fs::write(&path, wrong).expect("a table can be written to the target folder");
        panic!(
            "{name}: {} differences, listed in {}",
            wrong.lines().count(),
            path.display()
        );
    }
}

fn uniform(rng: &mut Pcg64) -> f32 {
    rng.random::<f32>()
}

/// Of any magnitude and sign.
fn any_number(rng: &mut Pcg64) -> f32 {
    f32::from_bits(rng.next_u32())
}

fn vector<L: Copy>(x: &[L]) -> Vec3<L> {
    Vec3 {
        x: x[0],
        y: x[1],
        z: x[2],
    }
}

fn flat<L: Lane>(vectors: &[Vec3<L>]) -> Vec<L> {
    vectors.iter().flat_map(|v| [v.x, v.y, v.z]).collect()
}

fn indicator<L: Lane>(mask: L::Mask) -> L {
    L::one().or_zero(mask)
}

#[test]
fn elementary_functions_and_warps_give_the_bits_of_one_lane() {
    struct Elementary;
    impl Numbers for Elementary {
        fn call<L: Lane>(&self, x: &[L]) -> Vec<L> {
            let (u, t, alpha) = (x[0], x[1], x[2]);
            // Beyond 2^29 turns a conversion to integers leaves its domain (`Lane::round`); NaN and infinities stay.
            let turns = L::select(u.abs().ge(L::splat(1e8)) & u.abs().le(L::splat(f32::MAX)), L::one(), u);
            let (sine, cosine) = sin_cos_turn(turns);
            vec![
                exp(-t),
                expm1(-t),
                ln(u),
                ln_1m(t),
                sine,
                cosine,
                powcos(L::one() - t, t, alpha),
                warp::sphere(u),
                warp::cone(u, t),
                warp::cone_pdf(t),
                warp::cosine(u),
                warp::cosine_pdf(t),
                warp::power(u, alpha),
                warp::power_pdf(t, alpha),
                t.safe_sqrt(),
                t.div_or_zero(u, t.lt(u)),
            ]
        }
    }
    check("elementary", 3, &Elementary, |rng, argument| match argument {
        0 => uniform(rng),
        1 => uniform(rng).powi(7) * 2.0,
        _ => 10.0_f32.powf(6.0 * uniform(rng)),
    });
}

#[test]
fn vectors_and_frames_give_the_bits_of_one_lane() {
    struct Vectors;
    impl Numbers for Vectors {
        fn call<L: Lane>(&self, x: &[L]) -> Vec<L> {
            let (a, b) = (vector(&x[..3]), vector(&x[3..]));
            let unit = a.normalize();
            let frame = Frame::about(unit);
            let mut results = flat(&[
                unit,
                frame.tangent,
                frame.bitangent,
                frame.direction(x[3].abs(), x[4], x[5]),
                Vec3::select(x[0].lt(x[3]), a, b),
                a.mul_add(x[5], b),
                a.times(b),
            ]);
            results.extend([a.dot(b), a.length(), a.max_abs()]);
            results
        }
    }
    check("vectors", 6, &Vectors, |rng, _| uniform(rng) * 2.0 - 1.0);
    check("vectors-of-any-size", 6, &Vectors, |rng, _| any_number(rng));
}

/// Models of all kinds side by side in one packet: the lanes differ by selections alone.
#[test]
fn models_give_the_bits_of_one_lane() {
    struct Models;
    impl Numbers for Models {
        fn call<L: Lane>(&self, x: &[L]) -> Vec<L> {
            let (n, wo, wi) = (
                vector(x).normalize(),
                vector(&x[3..]).normalize(),
                vector(&x[6..]).normalize(),
            );
            let bsdf = Bsdf::new(n, wo, vector(&x[9..]), x[12]);
            let cosine = n.dot(wi);
            let lobe = bsdf.eval(wi, cosine);
            // Behind the horizon `eval` holds nothing of use; a diffuse packet takes a shortcut there.
            let above = cosine.gt(L::zero());
            let mut results = flat(&[bsdf.wr, bsdf.axis()]);
            results.extend([
                lobe.shape.or_zero(above),
                lobe.pdf.or_zero(above),
                bsdf.weight(cosine),
                bsdf.sample(x[13]),
            ]);
            results.push(indicator(bsdf.phong));
            results
        }
    }
    check("models", 14, &Models, |rng, argument| match argument {
        12 => [1.0, 1.5, 20.0, 1e4, 1e6][rng.random_range(0..5)],
        13 => uniform(rng),
        _ => uniform(rng) * 2.0 - 1.0,
    });
    check("diffuse-models", 14, &Models, |rng, argument| match argument {
        12 => 1.0,
        13 => uniform(rng),
        _ => uniform(rng) * 2.0 - 1.0,
    });
}

/// Points far away, close by, inside and on the light, in one packet.
#[test]
fn cones_of_lights_give_the_bits_of_one_lane() {
    struct Cones;
    impl Numbers for Cones {
        fn call<L: Lane>(&self, x: &[L]) -> Vec<L> {
            let light = SphereLight {
                center: [0.25, -0.5, 1.0],
                radius: 0.5,
                le: [1.0; 3],
                sphere: 0,
            };
            let cone = light.cone(vector(x));
            let t = cone.t(vector(&x[3..]).normalize());
            let inner = warp::cone(x[6], cone.omc);
            let mut results = flat(&[cone.axis]);
            results.extend([
                cone.omc,
                cone.pdf(),
                t,
                indicator(cone.contains(t)),
                cone.distance(inner),
            ]);
            results
        }
    }
    let mut scale = 1.0;
    check("cones", 7, &Cones, |rng, argument| {
        if argument == 0 {
            scale = 10.0_f32.powf(8.0 * uniform(rng) - 3.0);
        }
        match argument {
            6 => uniform(rng),
            3..6 => uniform(rng) * 2.0 - 1.0,
            // The centre, the surface, then ever farther.
            _ => [0.25, -0.5, 1.0][argument] + scale * (uniform(rng) - 0.5) * [0.0, 1.0, 1.0][rng.random_range(0..3)],
        }
    });
}

/// A packet of points and numbers, and the scalar view of each of its lanes.
struct Case {
    columns: [[f32; 8]; 16],
    bits: [[u32; 8]; 2],
    mask: u32,
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
        Self { columns, bits, mask }
    }

    fn inputs<L: Lane>(&self, first: usize) -> (ShadingPoint<L>, Pair<L::Bits>, L::Mask) {
        let x: Vec<L> = self.columns.iter().map(|c| L::from_fn(|i| c[first + i])).collect();
        let (n, wo) = (vector(&x[3..]).normalize(), vector(&x[6..]).normalize());
        let n = Vec3::select(n.dot(wo).lt(L::zero()), -n, n);
        let point = ShadingPoint {
            p: vector(&x),
            ng: n,
            bsdf: Bsdf::new(n, wo, vector(&x[9..]), x[12]),
        };
        let [a, b] = self.bits.map(|bits| L::Bits::from_fn(|i| bits[first + i]));
        (point, Pair(a, b), L::Mask::from_bitmask(self.mask >> first))
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
    let (point, numbers, active) = case.inputs::<L>(first);
    match per_light::sample::<L, D>(&point, light, numbers, active) {
        Some(found) => said(found.active, &[found.wi, found.ld], &[found.distance]),
        None => vec![None; L::N],
    }
}

fn by_point<L: Lane, D: per_point::Density>(case: &Case, first: usize) -> Said {
    let (point, numbers, active) = case.inputs::<L>(first);
    match per_point::sample::<L, D>(&point, numbers, active) {
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
            let pair = rng.random_range(0..5);
            let Pair(a, b) = block.pair(U32x8::from_fn(|i| pixels[i]), U32x8::from_fn(|i| passes[i]), pair);
            let (heads, rest) = Pair(a, b).coin();
            for lane in 0..8 {
                let one = block.pair(Word(pixels[lane]), Word(passes[lane]), pair);
                assert_eq!((a.lane(lane), b.lane(lane)), (one.0.0, one.1.0), "{kind:?} lane {lane}");
                let (head, rest_of_one) = one.coin();
                assert_eq!(
                    (Mask8::to_bitmask(heads) >> lane & 1 == 1, rest.0.lane(lane)),
                    (head, rest_of_one.0.0)
                );
                let (wide, alone) = (rest.unit::<F32x8>(), rest_of_one.unit::<f32>());
                assert_eq!((wide.0.lane(lane), wide.1.lane(lane)), alone);
            }
        }
    }
}
