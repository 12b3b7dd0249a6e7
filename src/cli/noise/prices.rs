//! The cost of settings: each estimator, the other sampler, and adaptive sampling, rendered alternately on the same film.

use serde::Serialize;

use super::parts::{covariances, jackknife};
use super::{Ended, SEEDS, SPP, render};
use crate::cli::budget_bar::BudgetBar;
use octolux::film::Picture;
use octolux::pipeline::{Prepared, Settings};
use octolux::run::{Goal, replicates};
use octolux::scene::{EstimatorKind, SamplerKind, Scene};

/// The error for which costs are given.
pub const ASKED: f64 = 0.01;

/// The cost of a setting: the relative variance of a render times its seconds, over the square of [`ASKED`]. This is the time
/// for the mean of enough such renders to reach this error.
#[derive(Clone, Debug, Serialize)]
pub struct Price {
    /// The arguments to add to the command line; empty for the current settings.
    pub arguments: String,
    /// Its name in text.
    pub name: String,
    /// Seconds of a render.
    pub seconds: f64,
    /// The variance of a render over the square of the picture's mean.
    pub variance: f64,
    /// Seconds on this film to an error of 1 %, and their standard error.
    pub seconds_to_1_percent: f64,
    pub uncertainty: f64,
    /// relMSE of a render times its seconds, and its standard error.
    pub relmse_seconds: f64,
    pub relmse_uncertainty: f64,
}

/// The measure of noise for a cost.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Of {
    /// The mean variance, as for `--target-error`.
    Error,
    /// relMSE.
    RelMse,
}

impl Price {
    /// The cost and its standard error.
    pub fn of(&self, what: Of) -> (f64, f64) {
        match what {
            Of::Error => (self.seconds_to_1_percent, self.uncertainty),
            Of::RelMse => (self.relmse_seconds, self.relmse_uncertainty),
        }
    }

    /// Whether the ratio to another cost may be chance: its logarithm is less than two standard errors from 0.
    pub fn ties(&self, other: &Self, what: Of) -> bool {
        let ((a, da), (b, db)) = (self.of(what), other.of(what));
        (a / b).ln().abs() <= 2.0 * (da / a).hypot(db / b)
    }
}

struct Candidate {
    arguments: String,
    name: String,
    prepared: Prepared,
    goal: Goal,
    pictures: Vec<Picture>,
    seconds: Vec<f64>,
}

/// The costs, the cheapest first, and the pictures of the current settings.
pub fn measure<'l>(
    scene: &Scene,
    settings: Settings,
    begins: &dyn Fn(usize) -> &'l BudgetBar,
) -> Result<(Vec<Price>, Vec<Picture>), Ended> {
    let prepared = Prepared::new(scene, settings)?;
    let mut all = candidates(&prepared)?;
    for seed in 0..SEEDS {
        let observer = begins(seed);
        // Alternates them, so that other load on the machine affects all alike.
        for one in &mut all {
            if seed == 0 {
                // The first pass includes page faults for new memory.
                let _ = render(&one.prepared, Goal::passes(1), SEEDS, observer)?;
            }
            let (picture, seconds) = render(&one.prepared, one.goal, seed, observer)?;
            one.pictures.push(picture);
            one.seconds.push(seconds);
        }
    }
    let mut prices: Vec<Price> = all.iter().map(Candidate::price).collect();
    prices.sort_by(|a, b| a.seconds_to_1_percent.total_cmp(&b.seconds_to_1_percent));
    Ok((prices, all.swap_remove(0).pictures))
}

fn candidates(prepared: &Prepared) -> Result<Vec<Candidate>, Ended> {
    let now = prepared.settings();
    let candidate = |name: &str, arguments: String, settings: Settings, goal: Goal| {
        Ok(Candidate {
            arguments,
            name: name.to_owned(),
            prepared: prepared.with_settings(settings)?,
            goal,
            pictures: Vec::new(),
            seconds: Vec::new(),
        })
    };
    let now_name = format!("{}, {} (as now)", now.estimator.name(), now.sampler.name());
    let mut all = vec![candidate(&now_name, String::new(), now, Goal::passes(SPP))];
    for estimator in EstimatorKind::ALL.into_iter().filter(|&kind| kind != now.estimator) {
        let arguments = format!("--estimator {}", estimator.name());
        let settings = Settings { estimator, ..now };
        all.push(candidate(estimator.name(), arguments, settings, Goal::passes(SPP)));
    }
    for sampler in SamplerKind::ALL.into_iter().filter(|&kind| kind != now.sampler) {
        let arguments = format!("--sampler {}", sampler.name());
        let settings = Settings { sampler, ..now };
        all.push(candidate(sampler.name(), arguments, settings, Goal::passes(SPP)));
    }
    let adaptive = "--adaptive".to_owned();
    all.push(candidate("adaptive", adaptive, now, Goal::adaptive(SPP)));
    all.into_iter().collect()
}

impl Candidate {
    fn price(&self) -> Price {
        let (n, shown) = (self.seconds.len() as f64, replicates::error(&self.pictures));
        let variance = n * shown.error * shown.error;
        let seconds = self.seconds.iter().sum::<f64>() / n;
        let spread = self.seconds.iter().map(|s| (s - seconds).powi(2)).sum::<f64>() / (n * (n - 1.0));
        let price = variance * seconds / (ASKED * ASKED);
        // The relative error of a variance is twice that of its root; for a product the squares of both add up.
        let of_time = spread.sqrt() / seconds.max(1e-9);
        let [_, (sum, error)] = jackknife(&covariances(&self.pictures, &self.pictures));
        let values = self.pictures[0].pixels.as_flattened().len() as f64;
        let relmse_seconds = sum / values * seconds;
        Price {
            arguments: self.arguments.clone(),
            name: self.name.clone(),
            variance,
            seconds,
            seconds_to_1_percent: price,
            uncertainty: price * (2.0 * shown.uncertainty).hypot(of_time),
            relmse_seconds,
            relmse_uncertainty: relmse_seconds * (error / sum.max(f64::MIN_POSITIVE)).hypot(of_time),
        }
    }
}
