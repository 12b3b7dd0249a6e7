//! Warps: what is drawn is distributed as the density beside it says, and the density integrates to 1.
//!
//! Counts in 24 x 16 cells of (scaled `t`, azimuth) are held against the quadrature, in `f64`, of the `f32` density. The
//! rows are equally likely in exact arithmetic, so that cones of sin 1e-7 and lobes of exponent 1e6 are looked at as
//! closely as wide ones. 131 072 draws expect 341 in a cell: a density wrong by 2 % over a tenth of the cells, or an
//! overall factor of 1.02, is found nine times in ten.

use crate::proof::Family;
use crate::proof::environments::directions;
use crate::proof::stats::{chi_square, integrate_row};
use octolux::lane::{Bits, F32x8, Lane};
use octolux::math::elementary::{powcos, sin_cos_turn};
use octolux::sampling::{PassBlock, warp};
use octolux::scene::SamplerKind;

const ROWS: usize = 24;
const COLUMNS: usize = 16;
const DRAWS: u32 = 1 << 17;

/// A warp with its density: both as the renderer has them, and the edges of cells as exact arithmetic has them.
struct Case<L> {
    name: String,
    warp: Box<dyn Fn(L) -> L>,
    density: Box<dyn Fn(f64) -> f64>,
    /// `1 - cos` below which a share `s` of the draws lies.
    quantile: Box<dyn Fn(f64) -> f64>,
}

/// Every warp over its range. The density is asked for in a lane of `L` like everything else.
fn cases<L: Lane>() -> Vec<Case<L>> {
    let at = |x: f64| L::splat(x as f32);
    let mut cases = vec![
        Case {
            name: "sphere".into(),
            warp: Box::new(warp::sphere),
            density: Box::new(|_| f64::from(warp::SPHERE_PDF)),
            quantile: Box::new(|s| 2.0 * s),
        },
        Case {
            name: "cosine".into(),
            warp: Box::new(warp::cosine),
            density: Box::new(move |t| f64::from(warp::cosine_pdf(at(1.0 - t)).lane(L::N - 1))),
            quantile: Box::new(|s| s / (1.0 + (1.0 - s).sqrt())),
        },
    ];
    let sines = [1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 0.01, 0.1, 0.5, 0.9, 0.999, 1.0_f64];
    let cones = sines.map(|sine| {
        (
            format!("cone of sin {sine}"),
            sine * sine / (1.0 + (1.0 - sine * sine).sqrt()),
        )
    });
    for (name, one_minus_cos_max) in cones.into_iter().chain([("cone from inside".into(), 2.0)]) {
        cases.push(Case {
            name,
            warp: Box::new(move |u| warp::cone(u, at(one_minus_cos_max))),
            density: Box::new(move |_| 1.0 / f64::from(warp::cone_solid_angle(at(one_minus_cos_max)).lane(0))),
            quantile: Box::new(move |s| s * one_minus_cos_max),
        });
    }
    for alpha in [1.0_f64 + 1e-6, 1.5, 2.0, 5.0, 20.0, 100.0, 1e3, 1e4, 1e5, 1e6] {
        cases.push(Case {
            name: format!("power {alpha}"),
            warp: Box::new(move |u| warp::power(u, at(alpha))),
            density: Box::new(move |t| {
                let lobe = powcos(at(1.0 - t), at(t), at(alpha));
                f64::from(warp::power_pdf(lobe, at(alpha)).lane(0))
            }),
            quantile: Box::new(move |s| -((-s).ln_1p() / (alpha + 1.0)).exp_m1()),
        });
    }
    cases
}

fn distribution<L: Lane>(family: &mut Family, seed: u32) {
    let numbers = PassBlock::new(SamplerKind::Independent, seed, 0, 1, cases::<L>().len() as u32);
    for (pair, case) in cases::<L>().into_iter().enumerate() {
        let edges: Vec<f64> = (0..=ROWS).map(|i| (case.quantile)(i as f64 / ROWS as f64)).collect();
        let mut counts = vec![0.0; ROWS * COLUMNS];
        for first in (0..DRAWS).step_by(L::N) {
            let pixel = L::Bits::from_fn(|lane| first + lane as u32);
            let (u, v) = numbers
                .pair(numbers.key(pixel), L::Bits::splat(0), pair as u32)
                .unit::<L>();
            let (t, (sine, cosine)) = ((case.warp)(u), sin_cos_turn(v));
            for lane in 0..L::N {
                let row = edges[1..ROWS].partition_point(|edge| f64::from(t.lane(lane)) >= *edge);
                let turn = f64::from(sine.lane(lane)).atan2(f64::from(cosine.lane(lane))) / std::f64::consts::TAU;
                let column = (turn.rem_euclid(1.0) * COLUMNS as f64) as usize;
                counts[row * COLUMNS + column.min(COLUMNS - 1)] += 1.0;
            }
        }
        let expected: Vec<f64> = (0..ROWS * COLUMNS)
            .map(|cell| {
                let row = cell / COLUMNS;
                let azimuths = std::f64::consts::TAU / COLUMNS as f64;
                f64::from(DRAWS) * azimuths * integrate_row(row, ROWS, 2, &case.quantile, &case.density)
            })
            .collect();
        let test = chi_square(&counts, &expected);
        family.add(test.p, format!("{} in {} lanes: {test:?}", case.name, L::N));
    }
}

#[test]
fn what_warps_draw_has_the_density_beside_them() {
    let mut family = Family::new("warps");
    distribution::<f32>(&mut family, 11);
    distribution::<F32x8>(&mut family, 12);
    directions::<f32>(&mut family, 13, DRAWS);
    directions::<F32x8>(&mut family, 14, DRAWS);
    family.judge();
}

/// The bound is the error that the functions state: 4e-7 for arithmetic, and for lobes 5e-7 times `|alpha ln cos|`,
/// which is 1 in the mean.
#[test]
fn densities_integrate_to_one() {
    for (scalar, wide) in cases::<f32>().into_iter().zip(cases::<F32x8>()) {
        for (case, density, quantile) in [
            ("1 lane", scalar.density, scalar.quantile),
            ("8", wide.density, wide.quantile),
        ] {
            let total: f64 = (0..100)
                .map(|row| integrate_row(row, 100, 4, &quantile, &density))
                .sum();
            let error = total * std::f64::consts::TAU - 1.0;
            assert!(error.abs() < 1e-6, "{}, {case}: integral off by {error:e}", scalar.name);
        }
    }
}

/// The mean of `1 - cos` is known: a test in one number that needs no cells. 131 072 draws see a relative 1.2 %.
#[test]
fn the_mean_of_a_lobe_is_one_over_alpha_plus_two() {
    let mut family = Family::new("lobe-means");
    for (i, alpha) in [1.5_f32, 10.0, 1e3, 1e6].into_iter().enumerate() {
        let numbers = PassBlock::new(SamplerKind::Independent, 77, 0, 1, 4);
        let draws: Vec<f64> = (0..DRAWS)
            .map(|pixel| {
                numbers.pair(
                    numbers.key(octolux::lane::Word(pixel)),
                    octolux::lane::Word(0),
                    i as u32,
                )
            })
            .map(|pair| f64::from(warp::power(pair.unit::<f32>().0, alpha)))
            .collect();
        let estimate = crate::proof::runs::Estimate::of(&draws);
        let truth = crate::proof::runs::Estimate::exact(1.0 / (f64::from(alpha) + 2.0));
        family.add(
            estimate.p(truth, 0.0),
            format!("alpha {alpha}: {}", estimate.against(truth)),
        );
    }
    family.judge();
}
