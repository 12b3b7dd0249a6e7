//! The cost of robust formulas and of Embree's robust flag: nanoseconds per value and errors, against the textbook formulas and
//! against no flag.

use std::f64::consts::PI;
use std::hint::black_box;
use std::time::Instant;

use serde::Serialize;

use super::bench::SelftestError;
use super::{flag, truth};
use crate::lane::{F32x8, Lane};
use crate::math::elementary::{exp, ln, powcos};
use crate::sampling::warp;

/// One formula on one range of arguments.
#[derive(Clone, Debug, Serialize)]
pub struct Price {
    /// The computed quantity.
    pub quantity: &'static str,
    /// The formula.
    pub form: &'static str,
    /// The range of arguments.
    pub range: String,
    /// Nanoseconds per value or ray, in packets of 8; the minimum of 15 batches.
    pub nanoseconds: f64,
    /// Nanoseconds relative to the textbook formula, or relative to no flag.
    pub ratio: f64,
    /// Largest relative error against `f64`; 1 where a ray missed what it must hit.
    pub largest: f64,
    /// Root mean square of the relative error.
    pub rms: f64,
}

/// A function of packets; each is a separate type, so that it is inlined into the timed loop.
trait Form: Fn(F32x8, F32x8) -> F32x8 + Copy {}
impl<F: Fn(F32x8, F32x8) -> F32x8 + Copy> Form for F {}

/// Arguments of a quantity and their true values.
struct Sweep {
    quantity: &'static str,
    range: String,
    x: Vec<f32>,
    y: Vec<f32>,
    truth: Vec<f64>,
}

const COUNT: usize = 4096;

/// Every row of the table.
///
/// # Errors
/// Errors from Embree.
pub fn measure() -> Result<Vec<Price>, SelftestError> {
    let mut rows = Vec::new();
    for power in [1, 3, 5, 7] {
        let sine = 10.0_f64.powi(-power);
        let near = |i: usize| sine * (1.0 + 0.5 * i as f64 / COUNT as f64);
        let x: Vec<f32> = (0..COUNT).map(|i| near(i) as f32).collect();
        let truth = x
            .iter()
            .map(|&s| 1.0 / (2.0 * PI * truth::cone(f64::from(s)).0))
            .collect();
        let y = vec![1.0; COUNT];
        let range = format!("sin = 1e-{power}");
        rows.extend(
            Sweep {
                quantity: "density of a cone",
                range,
                x,
                y,
                truth,
            }
            .compare(naive_cone, robust_cone),
        );
    }
    for power in [1, 2, 4, 6] {
        let alpha = 10.0_f64.powi(power);
        // alpha ln cos runs from -10 to 0, the cosine given as 1 - cos.
        let x: Vec<f32> = (0..COUNT)
            .map(|i| (-(-10.0 * (i as f64 + 0.5) / COUNT as f64 / alpha).exp_m1()) as f32)
            .collect();
        let truth = x.iter().map(|&t| (alpha * (-f64::from(t)).ln_1p()).exp()).collect();
        let y = vec![alpha as f32; COUNT];
        let range = format!("n = 1e{power}");
        rows.extend(
            Sweep {
                quantity: "Phong: value",
                range,
                x,
                y,
                truth,
            }
            .compare(naive_power, robust_power),
        );
    }
    for power in [1, 2, 4, 6] {
        let alpha = 10.0_f64.powi(power);
        let x: Vec<f32> = (0..COUNT).map(|i| ((i as f64 + 0.5) / COUNT as f64) as f32).collect();
        let truth = x
            .iter()
            .map(|&u| -((-f64::from(u)).ln_1p() / (alpha + 1.0)).exp_m1())
            .collect();
        let y = vec![alpha as f32; COUNT];
        let range = format!("n = 1e{power}");
        rows.extend(
            Sweep {
                quantity: "Phong: sampled 1 - cos",
                range,
                x,
                y,
                truth,
            }
            .compare(naive_lobe, robust_lobe),
        );
    }
    rows.extend(flag::measure()?);
    Ok(rows)
}

/// `1 / 2 pi (1 - sqrt(1 - s^2))`.
#[inline(always)]
fn naive_cone(s: F32x8, _: F32x8) -> F32x8 {
    F32x8::one() / (F32x8::splat(2.0 * std::f32::consts::PI) * (F32x8::one() - (F32x8::one() - s * s).sqrt()))
}

/// The formula of `Cone`, for a sphere at distance 1.
#[inline(always)]
fn robust_cone(s: F32x8, d: F32x8) -> F32x8 {
    let cosine = ((d - s) * (d + s)).safe_sqrt();
    warp::cone_pdf(s * s / (d + cosine))
}

/// The power of the cosine.
#[inline(always)]
fn naive_power(t: F32x8, alpha: F32x8) -> F32x8 {
    exp(ln((F32x8::one() - t).max(F32x8::splat(f32::MIN_POSITIVE))) * alpha)
}

#[inline(always)]
fn robust_power(t: F32x8, alpha: F32x8) -> F32x8 {
    powcos(F32x8::one() - t, t, alpha)
}

/// `1 - (1 - u)^(1 / (n + 1))`.
#[inline(always)]
fn naive_lobe(u: F32x8, alpha: F32x8) -> F32x8 {
    F32x8::one() - exp(ln(F32x8::one() - u) / (alpha + F32x8::one()))
}

#[inline(always)]
fn robust_lobe(u: F32x8, alpha: F32x8) -> F32x8 {
    warp::power(u, alpha)
}

impl Sweep {
    /// Two rows: the textbook formula and the robust one.
    fn compare(&self, naive: impl Form, robust: impl Form) -> [Price; 2] {
        // Alternates the two, so that both see the same machine state.
        let mut best = [f64::INFINITY; 2];
        for _ in 0..15 {
            best = [best[0].min(self.time(naive)), best[1].min(self.time(robust))];
        }
        let row = |form, nanoseconds, (largest, rms)| Price {
            quantity: self.quantity,
            form,
            range: self.range.clone(),
            nanoseconds,
            ratio: nanoseconds / best[0],
            largest,
            rms,
        };
        [
            row("textbook", best[0], self.errors(naive)),
            row("robust", best[1], self.errors(robust)),
        ]
    }

    fn packets<F: Form>(&self, form: F) -> impl Iterator<Item = F32x8> + use<'_, F> {
        (0..COUNT)
            .step_by(8)
            .map(move |at| form(F32x8::load(&self.x[at..]), F32x8::load(&self.y[at..])))
    }

    /// Nanoseconds per value.
    fn time(&self, form: impl Form) -> f64 {
        let rounds = 20;
        let started = Instant::now();
        for _ in 0..rounds {
            black_box(self.packets(form).fold(F32x8::zero(), |sum, x| sum + x));
        }
        started.elapsed().as_secs_f64() * 1e9 / (rounds * COUNT) as f64
    }

    fn errors(&self, form: impl Form) -> (f64, f64) {
        let values = self
            .packets(form)
            .flat_map(|packet| (0..8).map(move |lane| f64::from(packet.lane(lane))));
        let errors: Vec<f64> = values
            .zip(&self.truth)
            .map(|(value, truth)| (value / truth - 1.0).abs())
            .collect();
        let squares: f64 = errors.iter().map(|e| e * e).sum();
        (
            // `f64::max` would drop NaN.
            errors
                .iter()
                .fold(0.0, |most, &e| if e.is_nan() || e > most { e } else { most }),
            (squares / COUNT as f64).sqrt(),
        )
    }
}

/// The rows as a table.
pub fn text(rows: &[Price]) -> String {
    let head = format!(
        "{:<22}  {:<10}  {:<8}  {:>9}  {:>6}  {:>9}  {:>9}",
        "quantity", "range", "form", "ns/value", "ratio", "largest", "rms"
    );
    let line = |row: &Price| {
        format!(
            "{:<22}  {:<10}  {:<8}  {:>9.3}  {:>6.2}  {:>9.1e}  {:>9.1e}",
            row.quantity, row.range, row.form, row.nanoseconds, row.ratio, row.largest, row.rms
        )
    };
    std::iter::once(head)
        .chain(rows.iter().map(line))
        .collect::<Vec<_>>()
        .join("\n")
}
