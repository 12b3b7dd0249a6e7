//! References of races: a given picture, two renders of other seeds, or the oracle, which renders in a thread of its own.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use super::board::{Layer, REFERENCE};
use super::write::complete_block;
use octolux::film::Picture;
use octolux::pipeline::{Prepared, Settings, SetupError};
use octolux::reference;
use octolux::run::{MOST_SPP, Run};
use octolux::scene::Scene;
use octolux::settings::{EstimatorKind, SamplerKind};

/// How long a call of the oracle shall take: it cannot be interrupted.
const CALL: f64 = 0.3;

/// The oracle pauses when it was not asked for this long: the race is stopped.
const LEASE: Duration = Duration::from_millis(500);

/// Two renders with other seeds, whose difference measures the noise of their mean.
pub struct Twins {
    runs: [Box<Run>; 2],
    limit: f64,
}

/// The oracle at work.
pub struct Oracle {
    shared: Arc<Shared>,
    limit: f64,
}

struct Shared {
    size: (u32, u32),
    stop: AtomicBool,
    sums: Mutex<Sums>,
}

struct Sums {
    /// Samples of every pixel.
    samples: u32,
    seconds: f64,
    wanted: Instant,
    /// Sums of samples.
    sum: Vec<[f64; 3]>,
    /// Their variances.
    variance: Vec<[f64; 3]>,
}

/// A finished reference.
pub struct Ready {
    /// The picture.
    pub layer: Arc<Layer>,
    /// The share of every relMSE that is its own noise, if known.
    pub noise: Option<f64>,
    /// What made it.
    pub by: &'static str,
}

impl Ready {
    /// A picture by something else.
    pub fn given(picture: Picture) -> Self {
        Self::new(picture, None, "file")
    }

    fn new(picture: Picture, noise: Option<f64>, by: &'static str) -> Self {
        let layer = Arc::new(Layer::new(REFERENCE, picture));
        Self { layer, noise, by }
    }
}

impl Twins {
    /// Two renders of a scene by `mis`, for `limit` together.
    ///
    /// # Errors
    /// No kernel for them.
    pub fn new(prepared: &Prepared, limit: Duration) -> Result<Self, SetupError> {
        let settings = Settings {
            estimator: EstimatorKind::Mis,
            sampler: SamplerKind::Sobol,
            ..prepared.settings()
        };
        let prepared = prepared.with_settings(settings)?;
        // Seeds different from those of the racers.
        let run = |turn: u32| {
            let seed = settings.seed ^ 0x5eed_0000 ^ turn;
            Box::new(prepared.with_seed(seed).passes(MOST_SPP))
        };
        Ok(Self {
            runs: [run(1), run(2)],
            limit: limit.as_secs_f64(),
        })
    }

    /// The renders.
    pub fn runs(&self) -> &[Box<Run>] {
        &self.runs
    }

    /// Renders for a turn; `Some` once it is finished, `None` in it if it was interrupted.
    pub fn step(&mut self, pause: Option<Instant>, counts: &[bool]) -> Option<Option<Ready>> {
        let [a, b] = &self.runs;
        let behind = usize::from(b.render_time() < a.render_time());
        if self.seconds() < self.limit || self.runs.iter().any(|run| run.passes() == 0) {
            return (!self.runs[behind].step_until(pause).is_more()).then_some(None);
        }
        self.runs.iter_mut().for_each(|run| complete_block(run));
        if self.runs.iter().any(|run| run.progress().stop_requested()) {
            return Some(None);
        }
        let (picture, noise) = mean_and_noise(&self.runs[0].picture(), &self.runs[1].picture(), counts);
        Some(Some(Ready::new(picture, Some(noise), "mis")))
    }

    /// What there is of it.
    pub fn picture(&self) -> Picture {
        self.runs[0].picture()
    }

    fn seconds(&self) -> f64 {
        self.runs.iter().map(|run| run.render_time().as_secs_f64()).sum()
    }

    /// The state as JSON.
    pub fn told(&self) -> Value {
        json!({ "ready": false, "by": "mis", "seconds": self.seconds(), "of": self.limit })
    }
}

impl Oracle {
    /// Starts the oracle on a scene, in as many threads as the race has, for `limit`.
    ///
    /// # Errors
    /// The threads cannot be started.
    pub fn new(scene: &Arc<Scene>, settings: &Settings, limit: Duration) -> Result<Self, String> {
        let cannot = |error: &dyn std::fmt::Display| format!("cannot start the threads of the oracle: {error}");
        let film = settings.film;
        let pixels = film.width as usize * film.height as usize;
        let shared = Arc::new(Shared {
            size: (film.width, film.height),
            stop: AtomicBool::new(false),
            sums: Mutex::new(Sums {
                samples: 0,
                seconds: 0.0,
                wanted: Instant::now(),
                sum: vec![[0.0; 3]; pixels],
                variance: vec![[0.0; 3]; pixels],
            }),
        });
        let pool = rayon::ThreadPoolBuilder::new().num_threads(settings.threads).build();
        let pool = pool.map_err(|error| cannot(&error))?;
        let (scene, sums) = (scene.clone(), shared.clone());
        let work = move || {
            let (mut seed, mut spp) = (0x5eed_0000_0000, 2);
            while !sums.stop.load(Ordering::Relaxed) {
                if sums.lock().wanted.elapsed() > LEASE {
                    std::thread::sleep(Duration::from_millis(20));
                    continue;
                }
                seed += 1;
                let begun = Instant::now();
                let more = pool.install(|| reference::render(&scene, film, spp, seed, &|_| {}));
                let seconds = begun.elapsed().as_secs_f64();
                sums.lock().add(&more, seconds);
                spp = (f64::from(spp) * CALL / seconds.max(1e-3)).clamp(2.0, 64.0) as u32;
            }
        };
        let started = std::thread::Builder::new().name("oracle".to_owned()).spawn(work);
        started.map_err(|error| cannot(&error))?;
        Ok(Self {
            shared,
            limit: limit.as_secs_f64(),
        })
    }

    /// Waits a moment; `Some` once it is finished.
    pub fn step(&mut self, counts: &[bool]) -> Option<Ready> {
        std::thread::sleep(Duration::from_millis(10));
        let mut sums = self.shared.lock();
        sums.wanted = Instant::now();
        if sums.samples == 0 || sums.seconds < self.limit {
            return None;
        }
        let picture = sums.picture(self.shared.size);
        let samples = f64::from(sums.samples);
        let stderr: Vec<[f64; 3]> = sums.variance.iter().map(|v| v.map(|v| v.sqrt() / samples)).collect();
        let noise = noise(&picture, &stderr, counts);
        Some(Ready::new(picture, Some(noise), "oracle"))
    }

    /// What there is of it.
    pub fn picture(&self) -> Picture {
        self.shared.lock().picture(self.shared.size)
    }

    /// The state as JSON.
    pub fn told(&self) -> Value {
        let sums = self.shared.lock();
        json!({ "ready": false, "by": "oracle", "seconds": sums.seconds, "of": self.limit, "samples": sums.samples })
    }
}

impl Drop for Oracle {
    /// The thread ends after its call.
    fn drop(&mut self) {
        self.shared.stop.store(true, Ordering::Relaxed);
    }
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, Sums> {
        self.sums.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Sums {
    fn add(&mut self, more: &reference::Reference, seconds: f64) {
        let n = f64::from(more.spp);
        for (at, (mean, error)) in more.picture.iter().zip(&more.stderr).enumerate() {
            for c in 0..3 {
                self.sum[at][c] += n * mean[c];
                self.variance[at][c] += (n * error[c]).powi(2);
            }
        }
        self.samples += more.spp;
        self.seconds += seconds;
    }

    fn picture(&self, (width, height): (u32, u32)) -> Picture {
        let samples = f64::from(self.samples.max(1));
        let pixels = self.sum.iter().map(|sum| sum.map(|s| (s / samples) as f32)).collect();
        Picture { width, height, pixels }
    }
}

/// The pixels that count.
pub fn counted<T: Copy>(pixels: &[T], counts: &[bool]) -> Vec<T> {
    let pixels = pixels.iter().zip(counts);
    pixels.filter(|(_, counts)| **counts).map(|(pixel, _)| *pixel).collect()
}

fn noise<T: Copy + Into<f64>>(picture: &Picture, stderr: &[[T; 3]], counts: &[bool]) -> f64 {
    octolux::study::error::relmse_of_reference(&counted(&picture.pixels, counts), &counted(stderr, counts))
}

/// The mean of two independent pictures, and its own noise as a share of relMSE over the pixels that count: half of their
/// difference estimates its standard error.
fn mean_and_noise(a: &Picture, b: &Picture, counts: &[bool]) -> (Picture, f64) {
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
    let noise = noise(&mean, &stderr, counts);
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
            pixels: vec![[value; 3], [0.0; 3]],
        };
        let (mean, noise) = mean_and_noise(&picture(1.5), &picture(0.5), &[true, true]);
        assert_eq!(mean.pixels, picture(1.0).pixels);
        // A difference of 1 between the two: their mean has a variance of 1/4. The other pixel is the same in both.
        assert!((noise - 0.125 / 1.0001).abs() < 1e-12);
        let (_, noise) = mean_and_noise(&picture(1.5), &picture(0.5), &[true, false]);
        assert!((noise - 0.25 / 1.0001).abs() < 1e-12);
    }

    #[test]
    fn calls_of_the_oracle_add_up_to_one_mean_with_its_standard_error() {
        let call = |spp: u32, mean: f64, error: f64| reference::Reference {
            width: 1,
            height: 1,
            spp,
            picture: vec![[mean; 3]],
            stderr: vec![[error; 3]],
        };
        let mut sums = Sums {
            samples: 0,
            seconds: 0.0,
            wanted: Instant::now(),
            sum: vec![[0.0; 3]],
            variance: vec![[0.0; 3]],
        };
        // A variance of 8 of a sample: standard errors of 2 for two samples and of 1 for eight.
        sums.add(&call(2, 3.0, 2.0), 0.5);
        sums.add(&call(8, 0.5, 1.0), 0.5);
        assert_eq!(sums.picture((1, 1)).pixels, [[1.0; 3]]);
        let samples = f64::from(sums.samples);
        assert!((sums.variance[0][0] / samples / samples - 8.0 / 10.0).abs() < 1e-12);
    }
}
