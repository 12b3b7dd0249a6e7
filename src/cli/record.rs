//! What a file of sums says about the render that it belongs to.

use std::collections::BTreeMap;
use std::ops::Range;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use super::{CliError, build, machine};
use crate::film::{Attributes, Value};
use crate::pipeline::{Counters, Renderer, Settings};

/// One shard of a render: some of its passes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Shard {
    /// Which, from 1.
    pub number: u32,
    /// Of how many.
    pub of: u32,
}

impl Shard {
    /// Its passes of `spp`, whole leaves of `leaf` passes and what is behind the last; none where leaves are fewer than shards.
    pub fn passes(self, spp: u32, leaf: u32) -> Range<u32> {
        let leaves = u64::from(spp.div_ceil(leaf));
        let end = |number: u32| {
            let leaves = leaves * u64::from(number) / u64::from(self.of);
            (leaves * u64::from(leaf)).min(spp.into()) as u32
        };
        end(self.number - 1)..end(self.number)
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parts = text.split_once('/').map(|(number, of)| (number.parse(), of.parse()));
        match parts {
            Some((Ok(number), Ok(of))) if 0 < number && number <= of => Ok(Self { number, of }),
            _ => Err("a shard is I/N, the first of seven being 1/7".to_owned()),
        }
    }
}

/// The render, what of it the file is to hold, and what it took so far.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Record {
    /// Everything that decides a bit of the sums, in words: sums with another value of any of these do not belong together.
    pub identity: BTreeMap<String, String>,
    /// Passes of the whole render, on average where they differ.
    pub spp: u32,
    /// The passes that the file is to hold.
    pub passes: Range<u32>,
    /// Which shard it is.
    pub shard: Option<Shard>,
    /// What an EXR of these sums says about its making.
    pub attributes: Vec<(String, Value)>,
    /// The processor.
    pub cpu: String,
    /// What was traced.
    pub counters: Counters,
    /// Seconds of rendering.
    pub render_s: f64,
}

/// Who answers rays, and how.
fn answered_by(renderer: &Renderer) -> String {
    let how = if renderer.robust() == Some(false) {
        ", not robust"
    } else {
        ""
    };
    format!("{}{how}", renderer.accel().name())
}

/// The name under which [`Record::identity`] holds Embree's version.
const EMBREE: &str = "Embree";

impl Record {
    /// Of a render of `spp` passes of the scene with this hash.
    pub fn new(scene_hash: &str, settings: Settings, spp: u32, adaptive: bool, renderer: &Renderer) -> Self {
        let alike = Settings {
            lanes: 0,
            threads: 0,
            accel: None,
            robust: true,
            ..settings
        };
        let film = settings.film;
        let identity = [
            ("scene", scene_hash.to_owned()),
            ("size", format!("{} x {}", film.width, film.height)),
            ("estimator", settings.estimator.name().to_owned()),
            ("sampler", settings.sampler.name().to_owned()),
            ("seed", settings.seed.to_string()),
            ("samples a pixel", spp.to_string()),
            ("adaptive", adaptive.to_string()),
            ("rays answered by", answered_by(renderer)),
            (EMBREE, renderer.embree_version().to_owned()),
            ("Octolux", format!("{} ({})", build::VERSION, build::COMMIT)),
            // Threads and lanes change no bit, and who answers rays is said above; whatever else there is may.
            ("settings", format!("{alike:?}")),
        ];
        Self {
            identity: identity.map(|(name, value)| (name.to_owned(), value)).into(),
            spp,
            passes: 0..spp,
            shard: None,
            attributes: Vec::new(),
            cpu: machine::cpu(),
            counters: Counters::default(),
            render_s: 0.0,
        }
    }

    /// What another one differs in, in a sentence; `None` where both are of the same render.
    pub fn difference(&self, other: &Self, any_embree: bool) -> Option<String> {
        // What people know under a name comes before the settings as a whole.
        let names = self.identity.keys().filter(|name| *name != "settings");
        let mut names = names.map(String::as_str).chain(["settings"]);
        let none = String::new();
        let differs = |name: &&str| {
            let same = self.identity.get(*name) == other.identity.get(*name);
            !(same || any_embree && *name == EMBREE)
        };
        names.find(differs).map(|name| {
            let value = |record: &Self| {
                record
                    .identity
                    .get(name)
                    .unwrap_or(&none)
                    .chars()
                    .take(400)
                    .collect::<String>()
            };
            format!("{name} is {} here and {} there", value(other), value(self))
        })
    }

    /// The attributes of a picture of `spp` samples a pixel.
    pub fn attributes(&self, spp: u32, exposure: f64) -> Attributes {
        let value = |name: &str, value: &Value| match name {
            "spp" => Value::Number(spp.into()),
            _ => value.clone(),
        };
        // The names live as long as the program: they are those of one record.
        let own = |(name, v): &(String, Value)| (&*name.clone().leak(), value(name, v));
        Attributes {
            settings: self.attributes.iter().map(own).collect(),
            exposure,
            samples: None,
        }
    }

    /// An error about the file at `path` if it is not of the same render as this one.
    ///
    /// # Errors
    /// What it differs in.
    pub fn expect(&self, other: &Self, path: &std::path::Path, any_embree: bool) -> Result<(), CliError> {
        match self.difference(other, any_embree) {
            None => Ok(()),
            Some(difference) => {
                let what = format!("{}: belongs to another render: {difference}", path.display());
                Err(CliError::usage(what))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shards_divide_the_passes_at_the_ends_of_leaves() {
        for (spp, leaf) in [(1, 16), (64, 16), (100, 16), (4096, 64), (1 << 30, 16)] {
            for of in [1, 2, 7, 64] {
                let mut end = 0;
                for number in 1..=of {
                    let passes = Shard { number, of }.passes(spp, leaf);
                    assert_eq!(passes.start, end);
                    assert!(passes.start.is_multiple_of(leaf) || passes.is_empty());
                    end = passes.end;
                }
                assert_eq!(end, spp);
            }
        }
    }

    #[test]
    fn a_shard_is_written_with_its_number_first() {
        assert_eq!("3/7".parse(), Ok(Shard { number: 3, of: 7 }));
        for text in ["", "3", "0/7", "8/7", "1/0", "-1/7", "1/7/2", "99999999999/7"] {
            assert!(text.parse::<Shard>().is_err(), "{text}");
        }
    }
}
