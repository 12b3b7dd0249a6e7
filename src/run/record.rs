//! The description of a render in a file of sums.

use std::collections::BTreeMap;
use std::ops::Range;

use serde::{Deserialize, Serialize};

use super::halves::State;
use super::{Goal, Run, Shard};
use crate::film::{Attributes, Value};
use crate::pipeline::{Counters, Prepared};
use crate::{about, machine};

/// The render, the part of it in the file, and its cost so far.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Record {
    /// All settings that affect any bit of the sums, as text: sums can only be combined if all values are equal.
    pub identity: BTreeMap<String, String>,
    /// Passes of the whole render, on average where pixels differ.
    pub spp: u32,
    /// The passes in the file.
    pub passes: Range<u32>,
    /// The shard.
    pub shard: Option<Shard>,
    /// The attributes of an EXR of these sums.
    pub attributes: Vec<(String, Value)>,
    /// The processor.
    pub cpu: String,
    /// Ray counts.
    pub counters: Counters,
    /// Seconds of rendering.
    pub render_s: f64,
    /// For a render to an error, what its file holds besides the first film.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub replicates: Option<Replicates>,
}

/// A render to an error: its films and pictures.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Replicates {
    /// One entry per film: samples per pixel of its adaptive render, 0 for other renders.
    pub levels: Vec<u32>,
    /// The state of the two halves.
    pub halves: State,
}

/// Names in [`Record::identity`] that the code looks up.
const EMBREE: &str = "Embree";
const INTERSECTOR: &str = "rays answered by";
const ADAPTIVE: &str = "adaptive";
const SCENE: &str = "scene";

/// All settings that affect any bit of a film, under the names that users know. Threads and lanes affect none. The texts are
/// part of the file format, and must not change when source identifiers are renamed.
fn identity(prepared: &Prepared, goal: &Goal) -> BTreeMap<String, String> {
    let settings = prepared.settings();
    let film = settings.film;
    let robust = if prepared.robust() == Some(false) {
        ", not robust"
    } else {
        ""
    };
    let culled = match prepared.cull() {
        Some(true) => "on",
        Some(false) => "off",
        None => "without effect",
    };
    let adaptive = match goal.spp() {
        Some(spp) if goal.is_adaptive() => format!("{spp} samples a pixel"),
        _ => "no".to_owned(),
    };
    let lights = match prepared.lists() {
        Some(lists) => format!("lists of {}", lists.length),
        None => "all".to_owned(),
    };
    let replicates = match goal.error_asked() {
        Some(_) if goal.is_adaptive() => "yes, adaptive",
        Some(_) => "yes",
        None => "no",
    };
    let identity = [
        ("target error", replicates.to_owned()),
        (SCENE, prepared.scene_hash().to_owned()),
        ("size", format!("{} x {}", film.width, film.height)),
        ("estimator", settings.estimator.name().to_owned()),
        ("sampler", settings.sampler.name().to_owned()),
        ("seed", settings.seed.to_string()),
        (ADAPTIVE, adaptive),
        (INTERSECTOR, format!("{}{robust}", prepared.accel().name())),
        ("lights asked", lights),
        ("culling", culled.to_owned()),
        (EMBREE, prepared.embree_version().to_owned()),
        ("Octolux", format!("{} ({})", about::VERSION, about::COMMIT)),
    ];
    identity.map(|(name, value)| (name.to_owned(), value)).into()
}

impl Record {
    /// Describes a run that has just begun.
    pub fn new(prepared: &Prepared, goal: &Goal) -> Self {
        let passes = goal.range(prepared.settings().film);
        Self {
            identity: identity(prepared, goal),
            spp: goal.spp().unwrap_or(passes.end),
            passes,
            shard: goal.shard_of(),
            attributes: Vec::new(),
            cpu: machine::cpu(),
            counters: Counters::default(),
            render_s: 0.0,
            replicates: None,
        }
    }

    /// Describes the current state of a run, with the attributes for an EXR of its sums.
    pub fn of(run: &Run, attributes: Vec<(String, Value)>) -> Self {
        let mut record = Self::new(run.prepared(), run.goal());
        if run.goal().spp().is_none() && run.goal().error_asked().is_none() && run.is_complete() {
            record.passes = run.film().passes();
            record.spp = record.passes.end;
        }
        Self {
            counters: run.counters(),
            render_s: run.render_time().as_secs_f64(),
            attributes,
            ..record
        }
    }

    /// Whether Embree is the intersector.
    pub fn through_embree(&self) -> bool {
        self.identity
            .get(INTERSECTOR)
            .is_some_and(|by| by.starts_with("embree"))
    }

    /// Whether the render is adaptive.
    pub fn is_adaptive(&self) -> bool {
        self.identity.get(ADAPTIVE).is_some_and(|adaptive| adaptive != "no")
    }

    /// The first difference to another record as a sentence; `None` if both belong to the same render. Versions of Embree may
    /// differ if `any_embree`.
    pub fn difference(&self, other: &Self, any_embree: bool) -> Option<String> {
        let names = self.identity.keys().chain(other.identity.keys());
        for name in names.filter(|name| !any_embree || name.as_str() != EMBREE) {
            match (self.identity.get(name), other.identity.get(name)) {
                (Some(own), Some(others)) if own == others => {}
                (Some(own), Some(others)) => {
                    let (own, others) = (self.shown(name, own), other.shown(name, others));
                    return Some(format!("{name} is {others} here and {own} there"));
                }
                _ => return Some("it is of another version of Octolux".to_owned()),
            }
        }
        // The last block depends on the sample count.
        let differs = self.spp != other.spp;
        differs.then(|| format!("samples a pixel is {} here and {} there", other.spp, self.spp))
    }

    /// A setting as shown in a message: a scene by its file, if that is known, and the first digits of its hash.
    fn shown(&self, name: &str, value: &str) -> String {
        if name != SCENE {
            return value.to_owned();
        }
        let hash = value.get(..8).unwrap_or(value);
        let file = self.attributes.iter().find_map(|(name, value)| match value {
            Value::Text(file) if name == SCENE => Some(file),
            _ => None,
        });
        file.map_or(hash.to_owned(), |file| format!("{file} ({hash})"))
    }

    /// The attributes of a picture of `spp` samples per pixel.
    pub fn attributes(&self, spp: u32, exposure: f64) -> Attributes {
        let value = |name: &str, value: &Value| match name {
            "spp" => Value::Number(spp.into()),
            _ => value.clone(),
        };
        let own = |(name, v): &(String, Value)| (name.clone(), value(name, v));
        Attributes {
            settings: self.attributes.iter().map(own).collect(),
            exposure,
            samples: None,
        }
    }
}
