//! Races: two to four settings at equal time on one machine, with their errors against a reference.

use std::sync::Arc;
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use super::board::{Layer, REFERENCE};
use super::message::{By, Choice};
use super::reference::{Oracle, Ready, Twins, counted};
use super::rims;
use octolux::film::Picture;
use octolux::pipeline::{Prepared, Progress, Settings, SetupError};
use octolux::run::{Goal, MOST_SPP, Run};
use octolux::scene::Scene;
use octolux::study::error::Errors;

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
    Twins(Twins),
    Oracle(Oracle),
    Ready(Ready),
}

/// A race.
pub struct Race {
    racers: Vec<Racer>,
    reference: Reference,
    /// The pixels whose errors count: not the [rims](rims) of lights.
    counts: Vec<bool>,
}

impl Race {
    /// A race of `choices`, against `reference`: a picture of the same scene, or what renders one first and how long.
    ///
    /// # Errors
    /// A setting without a kernel.
    pub fn new(
        scene: &Arc<Scene>,
        prepared: &Prepared,
        choices: &[Choice],
        reference: Result<Picture, (By, Duration)>,
    ) -> Result<Self, String> {
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
        let racers = choices.iter().enumerate().map(|(at, choice)| {
            // The page opens the settings of this racer.
            racer(choice).map_err(|error: SetupError| format!("racer {}: {error}", at + 1))
        });
        let racers = racers.collect::<Result<_, String>>()?;
        let reference = match reference {
            Ok(picture) => Reference::Ready(Ready::given(picture)),
            Err((By::Mis, limit)) => Reference::Twins(Twins::new(prepared, limit).map_err(|error| error.to_string())?),
            Err((By::Oracle, limit)) => Reference::Oracle(Oracle::new(scene, &settings, limit)?),
        };
        Ok(Self {
            racers,
            reference,
            counts: rims::counted(scene, prepared),
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
            Reference::Twins(twins) => twins.runs(),
            Reference::Oracle(_) | Reference::Ready(_) => &[],
        };
        racers
            .chain(of_reference.iter().map(|run| run.progress().clone()))
            .collect()
    }

    /// Steps the racer with the least render time; returns whether there is more to do.
    pub fn step(&mut self) -> bool {
        let pause = Some(Instant::now() + TURN);
        let done = match &mut self.reference {
            Reference::Ready(_) => None,
            Reference::Twins(twins) => match twins.step(pause, &self.counts) {
                None => return true,
                Some(None) => return false,
                Some(done) => done,
            },
            Reference::Oracle(oracle) => match oracle.step(&self.counts) {
                None => return true,
                done => done,
            },
        };
        if let Some(ready) = done {
            self.reference = Reference::Ready(ready);
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
        let underway = |picture| vec![Arc::new(Layer::new(REFERENCE, picture))];
        let reference = match &self.reference {
            Reference::Ready(ready) => ready.layer.clone(),
            Reference::Twins(twins) => return underway(twins.picture()),
            Reference::Oracle(oracle) => return underway(oracle.picture()),
        };
        let mut layers = vec![reference.clone()];
        let truth = counted(&reference.picture.pixels, &self.counts);
        for (id, racer) in self.racers.iter_mut().enumerate() {
            let picture = racer.run.picture();
            let spent = racer.run.render_time().as_secs_f64();
            let is_new = racer.curve.last().is_none_or(|last| spent >= NOTED * last[0]);
            if is_new && racer.run.spread().0 > 0 {
                let error = Errors::between(&counted(&picture.pixels, &self.counts), &truth).relmse;
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
            Reference::Twins(twins) => twins.told(),
            Reference::Oracle(oracle) => oracle.told(),
            Reference::Ready(ready) => json!({ "ready": true, "noise": ready.noise, "by": ready.by }),
        };
        let rims = self.counts.iter().filter(|counts| !**counts).count();
        let racers: Vec<Value> = self.racers.iter().map(racer).collect();
        json!({ "racers": racers, "reference": reference, "rims": rims })
    }
}
