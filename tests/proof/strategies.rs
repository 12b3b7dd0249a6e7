//! Directions of strategies, binned and held against their densities.
//!
//! Directions are binned in `f64` in 24 x 16 equally likely cells about the axis (lobes) or in equal cells of the
//! light's cone (lights), with a further cell for the draws that bring nothing; the counts are held against the
//! quadrature of the renderer's own `f32` density.

use std::f64::consts::TAU;

use glam::DVec3;
use octolux::bsdf::{Brdf, DiffuseOrPhong};
use octolux::estimator::per_light::{self, Directions};
use octolux::lane::{Bits, Lane, Mask};
use octolux::math::Frame;
use octolux::math::elementary::sin_cos_turn;
use octolux::sampling::PassBlock;
use octolux::scene::SamplerKind;

use super::Family;
use super::places::{Place, light, narrow, point, wide};
use super::stats::{chi_square, integrate, integrate_row};

const ROWS: usize = 24;
const COLUMNS: usize = 16;

/// Directions about an axis in `f64`: `1 - cos`, and the azimuth in turns.
struct Polar {
    axis: DVec3,
    tangents: [DVec3; 2],
}

impl Polar {
    fn about(axis: [f32; 3]) -> Self {
        let axis = wide(axis).normalize();
        let (a, b) = axis.any_orthonormal_pair();
        Self { axis, tangents: [a, b] }
    }

    fn of(&self, wi: DVec3) -> (f64, f64) {
        let azimuth = wi.dot(self.tangents[1]).atan2(wi.dot(self.tangents[0]));
        (
            (wi.normalize() - self.axis).length_squared() / 2.0,
            (azimuth / TAU).rem_euclid(1.0),
        )
    }

    fn direction(&self, t: f64, turn: f64) -> DVec3 {
        let (sine, (s, c)) = ((t * (2.0 - t)).max(0.0).sqrt(), (turn * TAU).sin_cos());
        self.axis * (1.0 - t) + (self.tangents[0] * c + self.tangents[1] * s) * sine
    }
}

/// The cell of a direction between rows of `edges`.
fn cell(edges: &[f64], (t, turn): (f64, f64)) -> usize {
    edges[1..ROWS].partition_point(|edge| t >= *edge) * COLUMNS + ((turn * COLUMNS as f64) as usize).min(COLUMNS - 1)
}

/// What the cells expect of so many draws with a density per steradian.
fn expectations(
    polar: &Polar,
    quantile: &dyn Fn(f64) -> f64,
    draws: f64,
    pieces: usize,
    density: impl Fn(DVec3) -> f64,
) -> Vec<f64> {
    let share = |cell: usize| {
        let (row, column) = (cell / COLUMNS, (cell % COLUMNS) as f64);
        integrate_row(row, ROWS, pieces, quantile, &|t| {
            integrate(
                column / COLUMNS as f64,
                (column + 1.0) / COLUMNS as f64,
                pieces,
                |turn| TAU * density(polar.direction(t, turn)),
            )
        })
    };
    (0..ROWS * COLUMNS).map(|i| draws * share(i)).collect()
}

/// Adds a test for each lobe: `draws` directions of `DiffuseOrPhong::sample` against `DiffuseOrPhong::eval`.
pub fn lobes<L: Lane>(family: &mut Family, alphas: &[f64], draws: u32) {
    for (i, alpha) in alphas.iter().copied().enumerate() {
        for (j, tilt) in [0.0, 0.6, 1.4].into_iter().enumerate() {
            let bsdf = point::<L>(alpha, tilt).bsdf;
            let polar = Polar::about(bsdf.axis().lane(0));
            let numbers = PassBlock::new(SamplerKind::Independent, (40 + i) as u32, 0, 1, 6);
            let quantile = |s: f64| -((-s).ln_1p() / (alpha + 1.0)).exp_m1();
            let edges: Vec<f64> = (0..=ROWS).map(|i| quantile(i as f64 / ROWS as f64)).collect();
            let mut counts = vec![0.0; ROWS * COLUMNS];
            for first in (0..draws).step_by(L::N) {
                let pixel = L::Bits::from_fn(|lane| first + lane as u32);
                let pair = (2 * j + usize::from(L::N > 1)) as u32;
                let (u, v) = numbers.pair(numbers.key(pixel), L::Bits::splat(0), pair).unit::<L>();
                let (sine, cosine) = sin_cos_turn(v);
                let wi = Frame::about(bsdf.axis()).direction(bsdf.sample(u), sine, cosine);
                (0..L::N).for_each(|lane| counts[cell(&edges, polar.of(wide(wi.lane(lane))))] += 1.0);
            }
            let expected = expectations(&polar, &quantile, f64::from(draws), 1, |wi| {
                let wi = narrow::<L>(wi);
                f64::from(bsdf.eval(wi, bsdf.n.dot(wi)).pdf.lane(L::N - 1))
            });
            let test = chi_square(&counts, &expected);
            family.add(
                test.p,
                format!("alpha {alpha} seen at {tilt} in {} lanes: {test:?}", L::N),
            );
        }
    }
}

/// Adds a test for each light: `draws` samples of an estimator against its density, and those that bring nothing.
pub fn mixtures<L: Lane, D: Directions<L, DiffuseOrPhong<L>>>(
    density: D,
    family: &mut Family,
    lights: &[Place],
    seed: u32,
    draws: u32,
) {
    let mixed = density.mix().mixed();
    for (i, (sine, alpha, off, dip)) in lights.iter().copied().enumerate() {
        let point = point::<L>(alpha, 0.5);
        let light = light(&point, sine, off, dip);
        let cone = light.cone(point.p);
        let (one_minus_cos_max, polar) = (
            f64::from(cone.one_minus_cos_max.lane(0)),
            Polar::about(cone.axis.lane(0)),
        );
        let numbers = PassBlock::new(SamplerKind::Independent, seed, 0, 1, lights.len() as u32);
        let quantile = |s: f64| s * one_minus_cos_max;
        let edges: Vec<f64> = (0..=ROWS).map(|i| quantile(i as f64 / ROWS as f64)).collect();
        let mut counts = vec![0.0; ROWS * COLUMNS];
        let all = L::Mask::splat(true);
        for first in (0..draws).step_by(L::N) {
            let pixel = L::Bits::from_fn(|lane| first + lane as u32);
            let technique_sample = numbers.technique_sample(numbers.key(pixel), L::Bits::splat(0), i as u32, first);
            if let Some(found) = per_light::sample(density, &point, &light, technique_sample, all) {
                let directions = found.active.lanes().map(|lane| wide(found.wi.lane(lane)));
                directions.for_each(|wi| counts[cell(&edges, polar.of(wi))] += 1.0);
            }
        }
        let mut expected = expectations(&polar, &quantile, f64::from(draws), 4, |wi| {
            let wi = narrow::<L>(wi);
            let (cos_theta, above) = point.above(wi);
            let lobe = point.bsdf.eval(wi, cos_theta);
            if (above & lobe.shape.gt(L::zero())).none() {
                return 0.0;
            }
            let cone = 1.0 / (TAU * one_minus_cos_max);
            if mixed {
                (cone + f64::from(lobe.pdf.lane(0))) / 2.0
            } else {
                cone
            }
        });
        // What brings nothing is a cell too: below the horizon, beside the light.
        counts.push(f64::from(draws) - counts.iter().sum::<f64>());
        expected.push(f64::from(draws) - expected.iter().sum::<f64>());
        let test = chi_square(&counts, &expected);
        let what = format!("sin {sine}, alpha {alpha}, off {off}, dip {dip}, mixed {mixed}");
        family.add(test.p, format!("{what} in {} lanes: {test:?}", L::N));
    }
}
