//! Races: two to four settings at equal time on one machine, with their errors against a reference.

use std::sync::Arc;
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use super::board::{Layer, REFERENCE};
use super::message::Choice;
use super::write::complete_block;
use octolux::film::Picture;
use octolux::pipeline::{Prepared, Progress, Settings, SetupError};
use octolux::run::{Goal, MOST_SPP, Run};
use octolux::settings::{EstimatorKind, SamplerKind};
use octolux::study::error::{Errors, relmse_of_reference};

/// How long a racer renders per turn.
const TURN: Duration = Duration::from_millis(40);

/// Samples per pixel of an adaptive racer: its allocation needs a total from the start.
const ADAPTIVE_SPP: u32 = 4096;

/// Factor of render time between recorded errors: enough for a curve over decades of time.
const NOTED: f64 = 1.04;

/// What takes part.
struct Racer {
    choice: Choice,
    run: Run,
    ended: bool,
    /// Seconds rendered and relMSE.
    curve: Vec<[f64; 2]>,
}

/// The reference of a race.
enum Reference {
    /// Two renders with other seeds, whose difference measures the noise of their mean.
    Underway([Box<Run>; 2]),
    /// A picture, with the share of every relMSE that is its own noise, if known.
    Ready(Arc<Layer>, Option<f64>),
}

/// A race.
pub struct Race {
    racers: Vec<Racer>,
    reference: Reference,
    /// Seconds of rendering for the reference.
    limit: f64,
}

impl Race {
    /// A race of `choices`, against `reference` if that is a picture of the same scene, otherwise against one that is rendered
    /// first, for `limit`.
    ///
    /// # Errors
    /// A setting without a kernel.
    pub fn new(
        prepared: &Prepared,
        choices: &[Choice],
        reference: Option<Picture>,
        limit: Duration,
    ) -> Result<Self, SetupError> {
        let settings = prepared.settings();
        let racer = |choice: &Choice| {
            let settings = Settings {
                estimator: choice.estimator,
                sampler: choice.sampler,
                ..settings
            };
            let goal = if choice.adaptive {
                Goal::adaptive(ADAPTIVE_SPP)
            } else {
                Goal::passes(MOST_SPP)
            };
            Ok(Racer {
                choice: *choice,
                run: prepared.with_settings(settings)?.start(goal),
                ended: false,
                curve: Vec::new(),
            })
        };
        let racers = choices.iter().map(racer).collect::<Result<_, SetupError>>()?;
        let reference = match reference {
            Some(picture) => Reference::Ready(Arc::new(Layer::new(REFERENCE, picture)), None),
            None => {
                let settings = Settings {
                    estimator: EstimatorKind::Mis,
                    sampler: SamplerKind::Sobol,
                    ..settings
                };
                let prepared = prepared.with_settings(settings)?;
                // Seeds different from those of the racers.
                let run = |turn: u32| {
                    let seed = settings.seed ^ 0x5eed_0000 ^ turn;
                    Box::new(prepared.with_seed(seed).passes(MOST_SPP))
                };
                Reference::Underway([run(1), run(2)])
            }
        };
        Ok(Self {
            racers,
            reference,
            limit: limit.as_secs_f64(),
        })
    }

    /// The racers' prepared scenes, in order.
    pub fn prepared(&self) -> Vec<Prepared> {
        self.racers.iter().map(|racer| racer.run.prepared().clone()).collect()
    }

    /// Handles to stop the runs.
    pub fn progress(&self) -> Vec<Arc<Progress>> {
        let racers = self.racers.iter().map(|racer| racer.run.progress().clone());
        let of_reference: &[Box<Run>] = match &self.reference {
            Reference::Underway(runs) => runs,
            Reference::Ready(..) => &[],
        };
        racers
            .chain(of_reference.iter().map(|run| run.progress().clone()))
            .collect()
    }

    /// Steps the racer with the least render time; returns whether there is more to do.
    pub fn step(&mut self) -> bool {
        let pause = Some(Instant::now() + TURN);
        if let Reference::Underway(runs) = &mut self.reference {
            let spent: Duration = runs.iter().map(|run| run.render_time()).sum();
            let behind = usize::from(runs[1].render_time() < runs[0].render_time());
            if spent.as_secs_f64() < self.limit || runs.iter().any(|run| run.passes() == 0) {
                return runs[behind].step_until(pause).is_more();
            }
            runs.iter_mut().for_each(|run| complete_block(run));
            if runs.iter().any(|run| run.progress().stop_requested()) {
                return false;
            }
            let (picture, noise) = mean_and_noise(&runs[0].picture(), &runs[1].picture());
            self.reference = Reference::Ready(Arc::new(Layer::new(REFERENCE, picture)), Some(noise));
        }
        let racing = self.racers.iter_mut().filter(|racer| !racer.ended);
        let Some(racer) = racing.min_by_key(|racer| racer.run.render_time()) else {
            return false;
        };
        racer.ended = !racer.run.step_until(pause).is_more();
        self.racers.iter().any(|racer| !racer.ended)
    }

    /// The current pictures; records the errors.
    pub fn look(&mut self) -> Vec<Arc<Layer>> {
        let mut layers = Vec::new();
        match &self.reference {
            Reference::Ready(layer, _) => layers.push(layer.clone()),
            Reference::Underway(runs) => {
                layers.push(Arc::new(Layer::new(REFERENCE, runs[0].picture())));
                return layers;
            }
        }
        let reference = layers[0].clone();
        for (id, racer) in self.racers.iter_mut().enumerate() {
            let picture = racer.run.picture();
            let spent = racer.run.render_time().as_secs_f64();
            let is_new = racer.curve.last().is_none_or(|last| spent >= NOTED * last[0]);
            if is_new && racer.run.spread().0 > 0 {
                let error = Errors::between(&picture.pixels, &reference.picture.pixels).relmse;
                racer.curve.push([spent, error]);
            }
            layers.push(Arc::new(Layer::new(id as u8, picture)));
        }
        layers
    }

    /// The state of the race as JSON.
    pub fn told(&self) -> Value {
        let racer = |racer: &Racer| {
            let (least, total, most) = racer.run.spread();
            let choice = racer.choice;
            json!({
                "estimator": choice.estimator.name(),
                "sampler": choice.sampler.name(),
                "adaptive": choice.adaptive,
                "seconds": racer.run.render_time().as_secs_f64(),
                "samples": total,
                "least": least,
                "most": most,
                "ended": racer.ended,
                "curve": racer.curve,
            })
        };
        let reference = match &self.reference {
            Reference::Underway(runs) => {
                let spent: Duration = runs.iter().map(|run| run.render_time()).sum();
                json!({ "ready": false, "seconds": spent.as_secs_f64(), "of": self.limit })
            }
            Reference::Ready(_, noise) => json!({ "ready": true, "noise": noise }),
        };
        json!({ "racers": self.racers.iter().map(racer).collect::<Vec<_>>(), "reference": reference })
    }
}

/// The mean of two independent pictures, and its own noise as a share of relMSE: half of their difference estimates its
/// standard error.
fn mean_and_noise(a: &Picture, b: &Picture) -> (Picture, f64) {
    let both = a.pixels.iter().zip(&b.pixels);
    let mean = both
        .clone()
        .map(|(a, b)| [0, 1, 2].map(|c| 0.5 * (a[c] + b[c])))
        .collect();
    let stderr: Vec<[f32; 3]> = both.map(|(a, b)| [0, 1, 2].map(|c| 0.5 * (a[c] - b[c]))).collect();
    let mean = Picture {
        width: a.width,
        height: a.height,
        pixels: mean,
    };
    let noise = relmse_of_reference(&mean.pixels, &stderr);
    (mean, noise)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_noise_of_a_mean_is_known_in_closed_form() {
        let picture = |value: f32| Picture {
            width: 2,
            height: 1,
            pixels: vec![[value; 3]; 2],
        };
        let (mean, noise) = mean_and_noise(&picture(1.5), &picture(0.5));
        assert_eq!(mean.pixels, picture(1.0).pixels);
        // A difference of 1 between the two: their mean has a variance of 1/4.
        assert!((noise - 0.25 / 1.0001).abs() < 1e-12);
    }
}
