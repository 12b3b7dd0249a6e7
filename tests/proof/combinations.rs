//! Two samples against one of the average density: what is equal, and what is not.
//!
//! With `g = f / (p + q)`: `mis2-balance` is `g(X) + g(Y)`, `X` of `p` and `Y` of `q`; two passes of `mis` have the mean of
//! `2 g(Z)` and `2 g(Z')`, each of `p` or of `q` by a coin. So a direction counts the same in both, and so do means. Variances are not
//! the same: that of `mis` is larger by `(E_p g - E_q g)^2 / 2`, which is what not knowing how often each technique comes costs
//! (Veach 1997, "Robust Monte Carlo Methods for Light Transport Simulation", section 9.2).

use octolux::estimator::density::{Average, Mix};
use octolux::estimator::per_light;
use octolux::lane::Word;
use octolux::sampling::{Pair, PassBlock, TechniqueSample};
use octolux::scene::SamplerKind;

use super::Family;
use super::places::{Place, light, point};

/// Lights and lobes for which the techniques differ most, and least.
const PLACES: [Place; 5] = [
    (0.5, 1.0, 0.0, 0.4),
    (0.9, 8.0, 0.3, 0.3),
    (0.1, 30.0, 0.5, 0.0),
    (0.3, 1.0, 0.0, 1.4),
    (1.2, 12.0, 0.4, 0.0),
];

/// Every direction counts twice as much in `mis` as in `mis2-balance`, to the last bit; returns how many were compared.
pub fn directions_count_the_same() -> usize {
    let numbers = PassBlock::new(SamplerKind::Independent, 3, 0, 1, 1);
    let mut compared = 0;
    for (sine, alpha, off, dip) in PLACES {
        let point = point::<f32>(alpha, 0.5);
        let light = light(&point, sine, off, dip);
        for pixel in 0..4096 {
            let technique_sample = numbers.technique_sample(Word(pixel), Word(0), 0, 0);
            let one = per_light::sample(Average, &point, &light, technique_sample, true);
            let two = per_light::sample(Mix::Balance, &point, &light, technique_sample, true);
            assert_eq!(one.is_some(), two.is_some());
            let (Some(one), Some(two)) = (one, two) else { continue };
            assert_eq!(one.wi.lane(0), two.wi.lane(0));
            assert_eq!(one.ld.lane(0), two.ld.lane(0).map(|x| 2.0 * x));
            compared += 1;
        }
    }
    compared
}

/// Adds a test of the means and one of the variances for each place: `2^18` pairs of directions of `mis` and of both heuristics,
/// against the moments of `g` by midpoints of 512 x 512 cells of numbers.
pub fn means_agree_and_variances_differ_by_the_coin(family: &mut Family) {
    const PAIRS: u32 = 1 << 18;
    let numbers = PassBlock::new(SamplerKind::Independent, 9, 0, 1, 4);
    for (place, (sine, alpha, off, dip)) in PLACES.into_iter().enumerate() {
        let point = point::<f32>(alpha, 0.5);
        let light = light(&point, sine, off, dip);
        let green = |mix: Mix, by_brdf_lanes: bool, pair: Pair<Word>| {
            let found = per_light::sample(mix, &point, &light, TechniqueSample { by_brdf_lanes, pair }, true);
            found.map_or(0.0, |found| f64::from(found.ld.lane(0)[1]))
        };
        let middle = |i: u32| Word((i << 23) | (1 << 22));
        let cells = (0..512).flat_map(|i| (0..512).map(move |j| Pair(middle(i), middle(j))));
        let moments = |by_brdf_lanes| {
            let values = cells.clone().map(|pair| green(Mix::Balance, by_brdf_lanes, pair));
            let (sum, squares) = values.fold((0.0, 0.0), |(a, b), x| (a + x, b + x * x));
            (sum / 262_144.0, squares / 262_144.0)
        };
        let ((p, p2), (q, q2)) = (moments(false), moments(true));
        let stratified = p2 - p * p + q2 - q * q;
        let expected = [stratified + (p - q).powi(2) / 2.0, stratified];
        let pair = |pixel: u32, i: u32| numbers.pair(Word(pixel), Word(0), i);
        let coin = |pixel: u32, i: u32| numbers.by_brdf_lanes(Word(pixel), Word(0), i, 0);
        let one = |pixel: u32, i: u32| green(Mix::Average, coin(pixel, i + 2), pair(pixel, i));
        let two = |mix, pixel| green(mix, false, pair(pixel, 0)) + green(mix, true, pair(pixel, 1));
        let draws: [Vec<f64>; 3] = [
            (0..PAIRS).map(|pixel| (one(pixel, 0) + one(pixel, 1)) / 2.0).collect(),
            (0..PAIRS).map(|pixel| two(Mix::Balance, pixel)).collect(),
            (0..PAIRS).map(|pixel| two(Mix::Power, pixel)).collect(),
        ];
        for (which, values) in draws.iter().enumerate() {
            let n = f64::from(PAIRS);
            let mean = values.iter().sum::<f64>() / n;
            let central = |power: i32| values.iter().map(|x| (x - mean).powi(power)).sum::<f64>() / n;
            let (variance, fourth) = (central(2), central(4));
            let what = format!("place {place}, {}", ["mis", "mis2-balance", "mis2-power"][which]);
            let z = (mean - p - q) / (variance / n).sqrt();
            family.add(
                super::stats::p_student(z, n - 1.0),
                format!("{what}: mean {mean:.5}, {:.5} by midpoints, z {z:.2}", p + q),
            );
            if let Some(expected) = expected.get(which) {
                let z = (variance - expected) / ((fourth - variance * variance) / n).sqrt();
                family.add(
                    super::stats::p_student(z, n - 1.0),
                    format!("{what}: variance {variance:.5e}, {expected:.5e} expected, z {z:.2}"),
                );
            }
        }
        // The difference is no matter of chance where techniques bring different shares.
        assert!(
            place > 1 || expected[0] > 1.02 * expected[1],
            "place {place}: {expected:?}"
        );
    }
}
