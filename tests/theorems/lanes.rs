//! Exactness, function by function: eight lanes and sixteen give the bits that one lane gives, NaN and infinities
//! included. Nothing
//! here is statistical.

use crate::proof::lanes::{HARD, InLanes, any_number, flat, in_all_widths, indicator, same, uniform, vector, verdict};
use octolux::bsdf::{Brdf, DiffuseOrPhong};
use octolux::embree::TraceLane;
use octolux::lane::Lane;
use octolux::light::SphereLight;
use octolux::math::elementary::{exp, expm1, ln, ln_1m, powcos, sin_cos_turn};
use octolux::math::{Frame, Vec3};
use octolux::sampling::warp;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

/// A function of numbers to numbers in any lane.
trait Numbers {
    fn call<L: Lane>(&self, x: &[L]) -> Vec<L>;
}

/// Sixteen calls of a function: `columns[argument][lane]`.
struct Calls<'a, F>(&'a F, Vec<[f32; 16]>);

impl<F: Numbers> InLanes for Calls<'_, F> {
    type Said = Vec<f32>;
    fn run<L: TraceLane>(&self, first: usize) -> Vec<Vec<f32>> {
        let arguments: Vec<L> = self.1.iter().map(|column| L::load(&column[first..])).collect();
        let results = self.0.call(&arguments);
        (0..L::N).map(|i| results.iter().map(|x| x.lane(i)).collect()).collect()
    }
}

/// Calls `f` with 10 000 packets of `arity` numbers, one in eight of them hard, in all widths, and compares lane by lane.
/// Differences go into a table.
fn check(name: &str, arity: usize, f: &impl Numbers, mut number: impl FnMut(&mut Pcg64, usize) -> f32) {
    let mut rng = Pcg64::seed_from_u64(3);
    let mut wrong = String::new();
    for _ in 0..10_000 {
        let mut argument = |argument| {
            std::array::from_fn(|_| match rng.random_range(0..8) {
                0 => HARD[rng.random_range(0..HARD.len())],
                _ => number(&mut rng, argument),
            })
        };
        let calls = Calls(f, (0..arity).map(&mut argument).collect());
        let results = in_all_widths(&calls);
        for (width, wide) in &results[1..] {
            for (lane, (w, s)) in wide.iter().zip(&results[0].1).enumerate() {
                if !w.iter().zip(s).all(|(w, s)| same(*w, *s)) {
                    let arguments: Vec<f32> = calls.1.iter().map(|column| column[lane]).collect();
                    wrong += &format!("{name}{arguments:?}: {w:?} in lane {lane} of {width}, {s:?} alone\n");
                }
            }
        }
    }
    verdict(name, &wrong);
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
                warp::cone_solid_angle(t),
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
            let bsdf = DiffuseOrPhong::new(n, wo, vector(&x[9..]), x[12]);
            let cosine = n.dot(wi);
            let lobe = bsdf.eval(wi, cosine);
            // Behind the horizon `eval` holds nothing of use; a diffuse packet takes a shortcut there.
            let above = cosine.gt(L::zero());
            let mut results = flat(&[bsdf.wr, bsdf.axis()]);
            results.extend([
                lobe.shape.or_zero(above),
                lobe.pdf.or_zero(above),
                bsdf.weight(wi, cosine),
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
                origin_power: None,
            };
            let cone = light.cone(vector(x));
            let t = cone.t(vector(&x[3..]).normalize());
            let inner = warp::cone(x[6], cone.one_minus_cos_max);
            let mut results = flat(&[cone.axis]);
            results.extend([
                cone.one_minus_cos_max,
                indicator(cone.inside),
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
