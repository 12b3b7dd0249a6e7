//! The figures of a render as one JSON object, and the part stored with a picture.

use std::path::Path;
use std::time::Duration;

use serde::Serialize;

use super::CliError;
use super::names::were;
use super::options::switch;
use octolux::film::{Attributes, Value, replace};
use octolux::pipeline::Counters;
use octolux::run::Run;
use octolux::scene::{EstimatorKind, FilmSize, SamplerKind};
use octolux::study::outliers::Outliers;
use octolux::{about, machine};

/// The content of `--stats`. Names that end in `_s` are seconds of wall-clock time; `_per_s` are relative to `render_s`.
#[derive(Clone, Debug, Serialize)]
pub struct Stats {
    /// The scene file as given.
    pub scene: String,
    pub width: u32,
    pub height: u32,
    /// Passes in the picture, whether ended by `--spp`, `--time` or ctrl-c; the rounded mean over pixels where they differ.
    pub spp: u32,
    /// Minimum samples of a pixel.
    pub spp_min: u32,
    pub spp_mean: f64,
    /// Maximum samples of a pixel.
    pub spp_max: u32,
    /// Adaptive sampling.
    pub adaptive: bool,
    /// Number of renders with different seeds whose mean is the picture.
    pub replicates: u32,
    /// The error given by `--target-error`.
    pub target_error: Option<f64>,
    /// The root of the pixels' mean variance over the mean of the picture, from the spread of the replicates; `null` with fewer
    /// than two.
    pub error: Option<f64>,
    /// Whether the run ended because the error was below the target, and not by a time limit or a stop.
    pub target_reached: Option<bool>,
    pub estimator: EstimatorKind,
    /// Who named the estimator, or why it was chosen; `null` where the page of the live picture did.
    pub estimator_why: Option<&'static str>,
    pub sampler: SamplerKind,
    pub seed: u32,
    pub lanes: usize,
    /// Rays per call of the intersector: 1 if Embree has no packets of this width.
    pub rays_together: usize,
    pub threads: usize,
    /// The kernel that the plan chose.
    pub kernel: String,
    /// Embree's robust mode; `null` with the brute-force intersector.
    pub robust: Option<bool>,
    /// Culling per tile; `null` with too many shapes.
    pub cull: Option<bool>,
    /// The effects that the scene requires.
    pub needs: Vec<&'static str>,
    pub octolux_version: &'static str,
    pub commit: &'static str,
    pub target_features: &'static str,
    pub embree_version: String,
    pub cpu: String,
    /// Whether ctrl-c came before the goal.
    pub interrupted: bool,
    /// Reading the scene and its meshes.
    pub load_s: f64,
    /// Building the accelerator.
    pub build_s: f64,
    /// The first block of passes (one pass; two if adaptive), included in `render_s`.
    pub first_pass_s: f64,
    /// Rendering only.
    pub render_s: f64,
    /// Writing pictures, including snapshots.
    pub write_s: f64,
    /// Pixels x passes.
    pub samples: u64,
    pub eye_rays: u64,
    pub shadow_rays: u64,
    pub samples_per_s: f64,
    /// Rays traced by the intersector.
    pub rays_per_s: f64,
    /// Rejected contributions, by cause. Anything but zero is a bug to report.
    pub invalid_samples: Invalid,
    /// How much depends on few samples, comparing the first of each pixel with all others; `null` if not measured: a single
    /// pass, a resumed render, shards, replicates.
    pub outliers: Option<Outliers>,
    /// Peak memory of the process; `null` where the system does not report it.
    pub peak_rss_bytes: Option<u64>,
}

/// Invalid contributions.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Invalid {
    pub nan: u64,
    pub inf: u64,
    pub negative: u64,
}

impl Invalid {
    /// A warning for the user, if necessary.
    pub fn warning(self, scene: &str) -> Option<String> {
        let Self { nan, inf, negative } = self;
        let total = nan + inf + negative;
        (total > 0).then(|| {
            format!(
                "{scene}: {} rejected ({nan} NaN, {inf} infinite, {negative} negative): the \
                 picture may be too dark",
                were(total, "contribution")
            )
        })
    }
}

/// Times measured by the command.
#[derive(Clone, Copy, Debug, Default)]
pub struct Times {
    pub load: Duration,
    pub write: Duration,
}

impl Stats {
    /// The figures of the current state of a run.
    pub fn new(scene: &Path, run: &Run, times: Times, interrupted: bool) -> Self {
        let (prepared, goal) = (run.prepared(), run.goal());
        let (settings, render_s) = (prepared.settings(), run.render_time().as_secs_f64());
        let Counters {
            samples,
            eye_rays,
            shadow_rays,
            invalid_nan,
            invalid_inf,
            invalid_negative,
        } = run.counters();
        let (spp_min, total, spp_max) = run.spread();
        let FilmSize { width, height } = settings.film;
        let spp_mean = total as f64 / (f64::from(width) * f64::from(height));
        // JSON has no infinity: without render time the rate is 0.
        let per_s = |count: u64| {
            if render_s > 0.0 { count as f64 / render_s } else { 0.0 }
        };
        Self {
            scene: scene.to_string_lossy().into_owned(),
            width,
            height,
            spp: if goal.is_adaptive() {
                spp_mean.round() as u32
            } else {
                spp_min
            },
            spp_min,
            spp_mean,
            spp_max,
            adaptive: goal.is_adaptive(),
            replicates: run.replicates() as u32,
            target_error: goal.error_asked(),
            error: run.reached().map(|reached| reached.error),
            target_reached: goal
                .error_asked()
                .map(|_| run.reached().is_some_and(|reached| !reached.early)),
            estimator: settings.estimator,
            estimator_why: None,
            sampler: settings.sampler,
            seed: settings.seed,
            lanes: prepared.lanes().count(),
            rays_together: prepared.rays_together(),
            threads: settings.threads,
            kernel: prepared.kernel().to_owned(),
            robust: prepared.robust(),
            cull: prepared.cull(),
            needs: prepared.needs(),
            octolux_version: about::VERSION,
            commit: about::COMMIT,
            target_features: about::TARGET_FEATURES,
            embree_version: prepared.embree_version().to_owned(),
            cpu: machine::cpu(),
            interrupted,
            load_s: times.load.as_secs_f64(),
            build_s: prepared.build_time().as_secs_f64(),
            first_pass_s: run.first_block_time().as_secs_f64(),
            render_s,
            write_s: times.write.as_secs_f64(),
            samples,
            eye_rays,
            shadow_rays,
            samples_per_s: per_s(samples),
            rays_per_s: per_s(eye_rays + shadow_rays),
            invalid_samples: Invalid {
                nan: invalid_nan,
                inf: invalid_inf,
                negative: invalid_negative,
            },
            outliers: None,
            peak_rss_bytes: machine::peak_rss_bytes(),
        }
    }

    /// A warning for the user if the picture depends on few samples.
    pub fn speckles(&self) -> Option<String> {
        let outliers = self.outliers.filter(|outliers| outliers.firefly(self.spp_mean))?;
        let Outliers { share, light, kurtosis } = outliers;
        let remedy = match self.estimator {
            EstimatorKind::Uniform | EstimatorKind::Brdf => "--estimator mis or light looks for lights, ",
            EstimatorKind::Light | EstimatorKind::Projected => "--estimator mis also follows polished surfaces, ",
            EstimatorKind::Mis | EstimatorKind::Mis2Balance | EstimatorKind::Mis2Power | EstimatorKind::Product => "",
        };
        Some(format!(
            "{}: the picture has fireflies: 1 of {:.0} samples brings {:.0} % of the light (kurtosis {kurtosis:.0}). {remedy}more \
             samples reduce them slowly; nothing is clamped",
            self.scene,
            1.0 / share,
            100.0 * light
        ))
    }

    /// The attributes of a picture: everything that affects its pixels, and nothing that varies from run to run.
    pub fn attributes(&self, exposure: f64) -> Attributes {
        let text = |words: &str| Value::Text(words.to_owned());
        let settings = [
            ("scene", text(&self.scene)),
            ("spp", Value::Number(self.spp.into())),
            ("adaptive", text(if self.adaptive { "true" } else { "false" })),
            ("replicates", Value::Number(self.replicates.into())),
            ("estimator", text(self.estimator.name())),
            ("sampler", text(self.sampler.name())),
            ("seed", Value::Number(self.seed.into())),
            ("lanes", Value::Number(self.lanes as f64)),
            ("kernel", text(&self.kernel)),
            ("robust", text(self.robust.map_or("without effect", switch))),
            ("cull", text(self.cull.map_or("without effect", switch))),
            ("version", text(self.octolux_version)),
            ("commit", text(self.commit)),
            ("target_features", text(self.target_features)),
            ("embree_version", text(&self.embree_version)),
        ];
        Attributes {
            exposure,
            ..Attributes::new(settings)
        }
    }

    /// The object on one line.
    ///
    /// # Errors
    /// None expected: every value here can be written as JSON.
    pub fn json(&self) -> Result<String, CliError> {
        serde_json::to_string(self).map_err(|error| CliError::failed(format!("the figures: {error}")))
    }

    /// The object in a file, one value a line.
    ///
    /// # Errors
    /// Errors of the system.
    pub fn write(&self, path: &Path) -> Result<(), CliError> {
        Ok(replace::replace(path, |file| {
            serde_json::to_writer_pretty(&mut *file, self)?;
            std::io::Write::write_all(file, b"\n")
        })?)
    }

    /// A short text for a list of pictures.
    pub fn short(&self) -> String {
        let Self { width, height, spp, .. } = self;
        let error = self
            .error
            .map_or(String::new(), |error| format!(", error {:.3} %", 100.0 * error));
        format!(
            "{}, {width} x {height}, {spp} spp{error}, {:.2} s",
            self.scene, self.render_s
        )
    }

    /// One or two lines of text.
    pub fn summary(&self) -> String {
        format!(
            "{}: {} x {}, {} spp{}, {}, {} in {:.2} s ({:.2} Msamples/s, {:.2} Mrays/s)",
            self.scene,
            self.width,
            self.height,
            self.spp,
            if self.adaptive {
                format!(" ({} to {})", self.spp_min, self.spp_max)
            } else {
                String::new()
            },
            self.estimator.name(),
            self.sampler.name(),
            self.render_s,
            self.samples_per_s * 1e-6,
            self.rays_per_s * 1e-6,
        ) + &self.target_error.map_or(String::new(), |asked| self.error_words(asked))
    }

    /// The outcome of a target error.
    fn error_words(&self, asked: f64) -> String {
        let percent = |x: f64| format!("{:.3} %", 100.0 * x);
        let ended = if self.interrupted {
            "when it was stopped"
        } else {
            "when the time was over"
        };
        match (self.error, self.target_reached == Some(true)) {
            (Some(error), true) => format!(
                "; error {} of the mean, {} was asked for",
                percent(error),
                percent(asked)
            ),
            (Some(error), false) => format!(
                "; error {} of the mean {ended}, {} was asked for",
                percent(error),
                percent(asked)
            ),
            (None, _) => format!("; the error is not known: there was one picture {ended}, and it takes two"),
        }
    }
}
