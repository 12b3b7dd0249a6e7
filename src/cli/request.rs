//! What is asked of one picture, as a command line or a manifest says it.

use std::path::PathBuf;
use std::time::Duration;

use super::CliError;
use super::outputs::Targets;
use super::reading::LoadOptions;
use octolux::pipeline::{Prepared, Settings};
use octolux::run::{DEFAULT_SPP, Goal, MOST_SPP, Record, RenderOptions, Shard};
use octolux::scene::{Effects, FilmSize, Scene};

/// One scene, how it is rendered, and where to.
#[derive(Clone, Debug)]
pub struct Request {
    /// The scene file.
    pub scene: PathBuf,
    /// How it is read.
    pub reading: LoadOptions,
    /// What is asked of the render, samples and shard aside.
    pub options: RenderOptions,
    /// Samples a pixel, whatever the scene says.
    pub spp: Option<u32>,
    /// The shard that is wanted.
    pub shard: Option<Shard>,
    /// Effects that the kernel holds in any case.
    pub hold: Effects,
    /// The files to write.
    pub targets: Targets,
    /// Whether each picture is also written after 1, 2, 4, … samples.
    pub snapshots: bool,
    /// Stops by which a PNG is brightened.
    pub exposure: f64,
    /// How often the checkpoint is written.
    pub every: Duration,
    /// Whether to go on from it.
    pub resume: bool,
    /// Whether the checkpoint of a finished render stays.
    pub keep: bool,
    /// The viewer tev that shows it on the way, by its address.
    pub tev: Option<String>,
    /// Whether the figures are printed.
    pub json: bool,
    /// Whether nothing but errors is said.
    pub quiet: bool,
}

impl Request {
    /// Reads the scene.
    ///
    /// # Errors
    /// What is wrong with it, and where.
    pub fn load(&self) -> Result<Scene, CliError> {
        self.reading.load(&self.scene)
    }

    /// Every choice resolved.
    pub fn settings(&self, scene: &Scene) -> Settings {
        self.options.settings(scene)
    }

    /// What ends the render of a scene that asks for `scene_spp` samples.
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

    /// Samples a pixel where neither a time nor an error decides.
    pub fn samples(&self, scene_spp: Option<u32>) -> u32 {
        self.spp.or(scene_spp).unwrap_or(DEFAULT_SPP)
    }

    /// The size of the picture of a scene that asks for `film`.
    pub fn film(&self, film: FilmSize) -> FilmSize {
        self.options.size.unwrap_or(film)
    }

    /// Everything that decides the pictures, in words of a format of their own, for a hash of it.
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
