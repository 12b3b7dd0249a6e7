//! The request for one picture, from a command line or a manifest.

use std::path::PathBuf;
use std::time::Duration;

use super::CliError;
use super::outputs::Targets;
use super::reading::LoadOptions;
use octolux::pipeline::{Prepared, Settings};
use octolux::run::{DEFAULT_SPP, Goal, MOST_SPP, Record, RenderOptions, Shard};
use octolux::scene::{Effects, FilmSize, Scene};

/// One scene, its options, and its outputs.
#[derive(Clone, Debug)]
pub struct Request {
    /// The scene file.
    pub scene: PathBuf,
    /// Options for reading it.
    pub reading: LoadOptions,
    /// Options of the render, except samples and shard.
    pub options: RenderOptions,
    /// Samples per pixel, overriding the scene.
    pub spp: Option<u32>,
    /// The shard to render.
    pub shard: Option<Shard>,
    /// Effects that are always compiled into the kernel.
    pub hold: Effects,
    /// The files to write.
    pub targets: Targets,
    /// Whether to write each picture after 1, 2, 4, … samples, too.
    pub snapshots: bool,
    /// Exposure of PNGs in stops.
    pub exposure: f64,
    /// Interval between checkpoints.
    pub every: Duration,
    /// Whether to resume from the checkpoint.
    pub resume: bool,
    /// Whether to keep the checkpoint of a finished render.
    pub keep: bool,
    /// Address of the viewer tev for live display.
    pub tev: Option<String>,
    /// Whether to print the figures.
    pub json: bool,
    /// Whether to print only errors.
    pub quiet: bool,
}

impl Request {
    /// Reads the scene.
    ///
    /// # Errors
    /// An error of the scene, and its place.
    pub fn load(&self) -> Result<Scene, CliError> {
        self.reading.load(&self.scene)
    }

    /// Resolves every option.
    pub fn settings(&self, scene: &Scene) -> Settings {
        self.options.settings(scene)
    }

    /// The goal for a scene with `scene_spp` samples.
    pub fn goal(&self, scene_spp: Option<u32>) -> Goal {
        let spp = if self.options.time.is_some() {
            MOST_SPP
        } else {
            self.samples(scene_spp)
        };
        match self.shard {
            Some(shard) => Goal::shard(shard, spp),
            None => RenderOptions { spp, ..self.options }.goal(),
        }
    }

    /// Samples per pixel if neither a time nor an error decides.
    pub fn samples(&self, scene_spp: Option<u32>) -> u32 {
        self.spp.or(scene_spp).unwrap_or(DEFAULT_SPP)
    }

    /// The size of the picture for a scene with `film`.
    pub fn film(&self, film: FilmSize) -> FilmSize {
        self.options.size.unwrap_or(film)
    }

    /// Everything that affects the pictures as text in a stable format, for a hash.
    pub fn decisive_words(&self, prepared: &Prepared, goal: &Goal) -> String {
        let record = Record::new(prepared, goal);
        let bits = |number: Option<f64>| number.map_or("none".to_owned(), |number| number.to_bits().to_string());
        let shard = |shard: Shard| format!("{} of {}", shard.number, shard.of);
        let own = [
            ("samples", record.spp.to_string()),
            ("shard", self.shard.map_or("none".to_owned(), shard)),
            ("time", bits(goal.time_limit().map(|time| time.as_secs_f64()))),
            ("error", bits(goal.error_asked())),
            ("exposure", bits(Some(self.exposure))),
            ("snapshots", self.snapshots.to_string()),
        ];
        let own = own.map(|(name, value)| format!("{name} = {value}\n"));
        let identity = record
            .identity
            .iter()
            .map(|(name, value)| format!("{name} = {value}\n"));
        identity.chain(own).collect()
    }
}
