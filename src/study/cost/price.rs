//! The cost of every setting: its error against time, and whether it is biased.

use std::fmt;

use rayon::prelude::*;
use serde::Serialize;

use super::bias::{self, Bias};
use super::curves::{Curves, Weights, distance, far, variance_figure};
use super::fit::{Power, Spread};
use super::measure::{Run, Runs};
use super::settings::Variant;
use super::statistics::{Estimate, Figure, bootstrap, mean, median};
use super::truth::Truth;
use crate::scene::EstimatorKind;
use crate::study::family::Family;

/// The probability that any unbiased setting is called harmful.
pub const FALSE_ALARMS: f64 = 1e-3;

/// A relative bias below this is reported but counts as unbiased: a step of an 8-bit picture is 40 times as large.
pub const HARMLESS: f64 = 1e-4;

/// A speed-up above this counts as no slow-down.
const FREE: f64 = 0.95;

/// The verdict on a setting.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// The defaults, the baseline of all others.
    Default,
    /// Unbiased as far as seen, and for the same error slower by a twentieth at most, by the lower end of its interval.
    Free,
    /// Unbiased as far as seen, but slower for the same error.
    Paid,
    /// Unbiased as far as seen; the interval leaves open whether it is slower.
    Open,
    /// Biased: its pictures converge to something else.
    Harmful,
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Default => "default",
            Self::Free => "free",
            Self::Paid => "paid",
            Self::Open => "open",
            Self::Harmful => "harmful",
        })
    }
}

/// One point of a curve.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Point {
    /// Samples per pixel.
    pub spp: u32,
    /// Seconds of rendering: median and interval.
    pub seconds: Figure,
    /// The relative mean squared error (see [`Weights`]): half the mean squared distance of two seeds, plus any squared bias.
    pub relative_mse: Figure,
    /// The error that `--target-error` means: root of the mean variance of pixels over the mean of the picture.
    pub error: Figure,
}

/// All results for one setting.
#[derive(Clone, Debug, Serialize)]
pub struct Price {
    /// What was measured.
    #[serde(flatten)]
    pub variant: Variant,
    /// Its name in tables and charts.
    pub label: String,
    /// The arguments to add to `octolux render SCENE`.
    pub arguments: String,
    /// Every picture has the bits of the defaults.
    pub same_bits: bool,
    /// Same noise as the defaults in every picture: the two differ by less than a tenth of it.
    pub same_noise: bool,
    /// Error and time at each look.
    pub points: Vec<Point>,
    /// Exponent of samples in the variance: -1 for independent samples. `None` without noise.
    pub slope: Option<Figure>,
    /// Seconds of one pass.
    pub pass_seconds: Figure,
    /// Rays a second.
    pub rays_per_second: Figure,
    /// Time of a pass over that of the defaults.
    pub time_ratio: Figure,
    /// Relative mean squared error over that of the defaults at the same samples per pixel.
    pub noise_ratio: Figure,
    /// Time that the defaults need for their last error, over the time that this setting needs for it.
    pub speed_up: Figure,
    /// The speed-up is extrapolated beyond the measurements, along the fitted slope, or -1 where that is flatter.
    pub extrapolated: bool,
    /// Relative bias of the mean outside silhouettes, against the defaults (of these, the oracle), with what samples may miss.
    pub bias: Figure,
    /// Upper bound (97.5 %) of the root mean squared bias of pixels, relative to `sqrt(s^2 + m^2)` (see [`Weights`]).
    pub hidden_bias_below: f64,
    /// Samples per pixel at which noise falls to the bias; only where there is one.
    pub bias_equals_noise_at: Option<f64>,
    /// The verdict.
    pub verdict: Verdict,
    /// For `--target-error`.
    #[serde(skip)]
    pub by_error: Option<ByError>,
}

/// Sample count as a function of the error that `--target-error` means.
#[derive(Clone, Copy, Debug)]
pub struct ByError(pub(super) Power);

impl ByError {
    /// Samples per pixel for an error; at least 1.
    pub fn samples(self, error: f64) -> f64 {
        self.0.reaches(error * error).max(1.0)
    }
}

impl Price {
    /// The name of a figure that is NaN, if any: nothing can be concluded from it.
    pub fn not_a_number(&self) -> Option<&'static str> {
        let of =
            |name: &'static str, figure: Figure| [figure.value, figure.low, figure.high].map(|value| (name, value));
        let points = self.points.iter().flat_map(|point| {
            let figures = [
                of("time", point.seconds),
                of("relative mean squared error", point.relative_mse),
                of("error", point.error),
            ];
            figures.into_iter().flatten()
        });
        let figures = [
            of("slope", self.slope.unwrap_or(Figure::exact(-1.0))),
            of("time of a pass", self.pass_seconds),
            of("number of rays a second", self.rays_per_second),
            of("ratio of times", self.time_ratio),
            of("ratio of noise", self.noise_ratio),
            of("speed-up", self.speed_up),
            of("bias", self.bias),
        ];
        let single = [
            ("hidden bias", self.hidden_bias_below),
            (
                "number of samples at which noise falls to the bias",
                self.bias_equals_noise_at.unwrap_or(1.0),
            ),
        ];
        let mut all = figures.into_iter().flatten().chain(single).chain(points);
        all.find(|(_, value)| value.is_nan()).map(|(name, _)| name)
    }

    /// Seconds until the error that `--target-error` means is reached; at least one pass.
    pub fn seconds_for_error(&self, error: f64) -> f64 {
        self.pass_seconds.value * self.by_error.map_or(1.0, |law| law.samples(error))
    }

    /// Seconds until a relative mean squared error is reached; infinite where bias prevents it.
    pub fn seconds_for_mse(&self, mse: f64) -> f64 {
        let (Some(last), Some(slope)) = (self.points.last(), self.slope) else {
            return self.pass_seconds.value;
        };
        let bias = if self.verdict == Verdict::Harmful {
            self.bias.value * self.bias.value
        } else {
            0.0
        };
        let law = Power::through((f64::from(last.spp), last.relative_mse.value - bias), far(slope.value));
        self.pass_seconds.value * law.reaches(mse - bias).max(1.0)
    }
}

fn estimator(variant: &Variant) -> EstimatorKind {
    variant.choice.settings.estimator
}

/// Costs of all variants, the defaults first. `false_alarms` is the probability that any unbiased variant is called harmful.
pub fn prices(variants: &[Variant], all: &[Runs], truth: &Truth, false_alarms: f64) -> Vec<Price> {
    let weights = Weights::new(truth);
    let curves: Vec<Curves> = all
        .par_iter()
        .enumerate()
        .map(|(i, runs)| {
            // Variants with the same bits have the same distances, computed only for the first.
            let same = runs.iter().all(|run| run.same_bits);
            Curves::new(if same { &all[0] } else { &all[i] }, &weights)
        })
        .collect();
    // Two tests per variant: brightness and hidden bias.
    let (alpha, _) = Family::of(false_alarms, variants.iter().flat_map(|variant| [variant; 2])).close();
    let price = |(i, variant): (usize, &Variant)| {
        let bias = if i == 0 {
            bias::of_defaults((&all[0], estimator(variant)), &weights.well_sampled, truth, alpha)
        } else {
            bias::of_variant(
                (&all[i], estimator(variant)),
                (&all[0], estimator(&variants[0])),
                &weights.well_sampled,
                truth,
                alpha,
            )
        };
        Judged {
            variant,
            runs: &all[i],
            defaults: &all[0],
            curves: &curves[i],
            plain: &curves[0],
            bias,
            weights: &weights.well_sampled,
            alpha,
        }
        .price(i == 0)
    };
    variants.iter().enumerate().map(price).collect()
}

/// The inputs of a price.
struct Judged<'a> {
    variant: &'a Variant,
    runs: &'a Runs,
    defaults: &'a Runs,
    curves: &'a Curves,
    /// The curves of the defaults.
    plain: &'a Curves,
    bias: Bias,
    weights: &'a [[f64; 3]],
    alpha: f64,
}

impl Judged<'_> {
    fn price(&self, default: bool) -> Price {
        let same_bits = self.runs.iter().all(|run| run.same_bits) && !default;
        let log_times: Vec<f64> = self
            .runs
            .iter()
            .zip(self.defaults)
            .map(|(run, plain)| (run.pass_seconds() / plain.pass_seconds()).ln())
            .collect();
        let log_time = mean(&log_times);
        let log_samples = if same_bits || default {
            exactly(0.0)
        } else {
            self.log_samples()
        };
        let log_cost = log_time.plus(log_samples).figure();
        let speed_up = Figure {
            value: -log_cost.value,
            low: -log_cost.high,
            high: -log_cost.low,
        }
        .exp();
        let same_noise = default || same_bits || self.same_noise();
        // With the same random numbers both miss the same light, so none of it is in the difference.
        let hidden = if same_noise && !default { 0.0 } else { self.bias.hidden };
        let bias = Bias { hidden, ..self.bias };
        let biased = bias.is_real(self.alpha, HARMLESS);
        let verdict = match (default, biased) {
            (_, true) => Verdict::Harmful,
            (true, _) => Verdict::Default,
            _ if speed_up.high < 1.0 => Verdict::Paid,
            _ if speed_up.low > FREE => Verdict::Free,
            _ => Verdict::Open,
        };
        let squared_bias = if biased {
            bias.squared.value.max(bias.brightness.value.powi(2))
        } else {
            0.0
        };
        let figure = |of: &dyn Fn(&Run) -> f64| median(&self.runs.iter().map(of).collect::<Vec<f64>>());
        let last = self.runs[0].looks.last().map_or(1, |look| look.spp);
        Price {
            variant: self.variant.clone(),
            label: self.variant.label(),
            arguments: self.variant.arguments(),
            same_bits,
            same_noise,
            points: self.points(squared_bias),
            slope: self.curves.well_sampled.slope().map(Estimate::figure),
            pass_seconds: figure(&Run::pass_seconds),
            rays_per_second: figure(&Run::rays_per_second),
            time_ratio: {
                let ratios: Vec<f64> = log_times.iter().map(|log| log.exp()).collect();
                median(&ratios)
            },
            noise_ratio: if same_bits || default {
                Figure::exact(1.0)
            } else {
                self.noise_ratio()
            },
            speed_up,
            extrapolated: log_samples.value > 0.0 && !same_bits,
            bias: bias.figure(),
            hidden_bias_below: bias.squared.figure().high.max(0.0).sqrt() + bias.hidden,
            bias_equals_noise_at: biased
                .then(|| {
                    let all: Vec<usize> = (0..self.curves.well_sampled.seeds()).collect();
                    self.curves
                        .well_sampled
                        .samples_for(squared_bias, self.curves.slope(&all), &all)
                })
                .filter(|n| n.is_finite()),
            verdict,
            by_error: self.by_error(last),
        }
    }

    /// Whether pictures differ from those of the defaults with the same seed by less than a tenth of the noise (rms over seeds).
    fn same_noise(&self) -> bool {
        let apart: f64 = self
            .runs
            .iter()
            .zip(self.defaults)
            .filter_map(|(run, plain)| Some((run.looks.last()?, plain.looks.last()?)))
            .map(|(a, b)| distance(&a.pixels, &b.pixels, self.weights))
            .sum();
        let noise = self
            .plain
            .well_sampled
            .points
            .last()
            .map_or(0.0, |(_, spread)| spread.variance());
        apart < 0.01 * noise * self.runs.len() as f64
    }

    /// Logarithm of the ratio of samples that this setting and the defaults need for the defaults' last error.
    fn log_samples(&self) -> Estimate {
        let (curve, plain) = (&self.curves.well_sampled, &self.plain.well_sampled);
        let Some((n, spread)) = plain.points.last() else {
            return exactly(0.0);
        };
        let noisy = curve.points.last().is_some_and(|(_, spread)| spread.variance() > 0.0);
        match (spread.variance() > 0.0, noisy) {
            (true, true) => {}
            (false, false) | (true, false) => return exactly(0.0),
            (false, true) => return exactly(f64::INFINITY),
        }
        bootstrap(curve.seeds(), |drawn| {
            let slope = self.curves.slope(drawn);
            (curve.samples_for(spread.variance_of(drawn), slope, drawn) / f64::from(*n)).ln()
        })
    }

    fn noise_ratio(&self) -> Figure {
        let (Some((_, own)), Some((_, plain))) = (
            self.curves.well_sampled.points.last(),
            self.plain.well_sampled.points.last(),
        ) else {
            return Figure::exact(1.0);
        };
        if !(own.variance() > 0.0 && plain.variance() > 0.0) {
            return Figure::exact(own.variance() / plain.variance());
        }
        bootstrap(own.seeds(), |drawn| {
            (own.variance_of(drawn) / plain.variance_of(drawn)).ln()
        })
        .figure()
        .exp()
    }

    fn points(&self, squared_bias: f64) -> Vec<Point> {
        let point = |(look, (spp, spread)): (usize, &(u32, Spread))| {
            let seconds: Vec<f64> = self.runs.iter().map(|run| run.looks[look].seconds).collect();
            let error = variance_figure(&self.curves.error.points[look].1);
            let spread = variance_figure(spread);
            let root = |x: f64| x.max(0.0).sqrt();
            Point {
                spp: *spp,
                seconds: median(&seconds),
                relative_mse: Figure {
                    value: spread.value + squared_bias,
                    low: spread.low + squared_bias,
                    high: spread.high + squared_bias,
                },
                error: Figure {
                    value: root(error.value),
                    low: root(error.low),
                    high: root(error.high),
                },
            }
        };
        self.curves.well_sampled.points.iter().enumerate().map(point).collect()
    }

    fn by_error(&self, last: u32) -> Option<ByError> {
        let law = self.curves.error.law()?;
        let here = self.curves.error.points.last()?.1.variance();
        Some(ByError(Power::through((f64::from(last), here), far(law.slope))))
    }
}

fn exactly(value: f64) -> Estimate {
    Estimate {
        value,
        stderr: 0.0,
        dof: f64::INFINITY,
    }
}
