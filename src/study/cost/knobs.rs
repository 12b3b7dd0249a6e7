//! The table of knobs: everything that a user can turn and that may cost time or accuracy. A new knob is a new row here;
//! it then is measured, priced and drawn.

use crate::pipeline::{Settings, widest_lanes};
use crate::settings::{AccelKind, EstimatorKind, Lanes, SamplerKind};
use serde::Serialize;

/// What a render can be asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Choice {
    /// All that the renderer is told.
    pub settings: Settings,
    /// Samples go where the noise is.
    pub adaptive: bool,
}

/// One row of the table.
pub struct Knob {
    /// The name of its option, without dashes.
    pub name: &'static str,
    /// What it decides, in a few words.
    pub what: &'static str,
    /// Its values: as the command line spells them (empty for an option without a value), with what they change.
    values: fn(Choice) -> Vec<(String, Choice)>,
}

/// All knobs, in the order of the report.
pub const KNOBS: [Knob; 8] = [
    Knob {
        name: "estimator",
        what: "how directions of light are drawn",
        values: |from| {
            let of = |estimator: EstimatorKind| (estimator.name().to_owned(), from.with(|s| s.estimator = estimator));
            EstimatorKind::ALL.into_iter().map(of).collect()
        },
    },
    Knob {
        name: "sampler",
        what: "where random numbers come from",
        values: |from| {
            let of = |sampler: SamplerKind| (sampler.name().to_owned(), from.with(|s| s.sampler = sampler));
            SamplerKind::ALL.into_iter().map(of).collect()
        },
    },
    Knob {
        name: "adaptive",
        what: "samples go where the relative noise is",
        values: |from| vec![(String::new(), Choice { adaptive: true, ..from })],
    },
    Knob {
        name: "lanes",
        what: "rays a packet",
        values: |from| {
            let widths = Lanes::ALL.into_iter().filter(|&lanes| lanes <= widest_lanes());
            widths
                .map(|lanes| (lanes.to_string(), from.with(|s| s.lanes = Some(lanes))))
                .collect()
        },
    },
    Knob {
        name: "threads",
        what: "how many threads render",
        values: |from| vec![("1".to_owned(), from.with(|s| s.threads = 1))],
    },
    Knob {
        name: "accel",
        what: "how rays find what they hit",
        values: |from| {
            let of = |accel: AccelKind| (accel.name().to_owned(), from.with(|s| s.accel = Some(accel)));
            AccelKind::ALL.into_iter().map(of).collect()
        },
    },
    Knob {
        name: "robust",
        what: "whether Embree closes the edges between triangles",
        values: |from| {
            let of = |(name, robust): (&str, bool)| (name.to_owned(), from.with(|s| s.robust = robust));
            [("on", true), ("off", false)].map(of).into()
        },
    },
    Knob {
        name: "cull",
        what: "whether shapes are left out for a tile at once",
        values: |from| {
            let of = |(name, cull): (&str, bool)| (name.to_owned(), from.with(|s| s.cull = cull));
            [("on", true), ("off", false)].map(of).into()
        },
    },
];

impl Choice {
    fn with(self, change: impl FnOnce(&mut Settings)) -> Self {
        let mut settings = self.settings;
        change(&mut settings);
        Self { settings, ..self }
    }
}

/// A choice that is measured: the defaults, or the defaults with one knob turned.
#[derive(Clone, Debug, Serialize)]
pub struct Variant {
    /// The knob; empty for the defaults.
    pub knob: &'static str,
    /// Its value, where it has one.
    pub value: String,
    /// What it decides.
    pub what: &'static str,
    /// What is measured.
    #[serde(skip)]
    pub choice: Choice,
}

impl Variant {
    /// The defaults.
    pub fn defaults(settings: Settings) -> Self {
        Self {
            knob: "",
            value: String::new(),
            what: "",
            choice: Choice {
                settings,
                adaptive: false,
            },
        }
    }

    /// Its short name in tables and charts: `mis`, `1 lane`, `adaptive`.
    pub fn label(&self) -> String {
        match (self.knob, self.value.as_str()) {
            ("", _) => "default".to_owned(),
            (knob, "") => knob.to_owned(),
            ("lanes" | "threads", "1") => format!("1 {}", self.knob.trim_end_matches('s')),
            ("lanes" | "threads", count) => format!("{count} {}", self.knob),
            ("robust" | "cull", value) => format!("{} {value}", self.knob),
            (_, value) => value.to_owned(),
        }
    }

    /// What to add to `octolux render SCENE`.
    pub fn arguments(&self) -> String {
        match (self.knob, self.value.as_str()) {
            ("", _) => String::new(),
            (knob, "") => format!(" --{knob}"),
            (knob, value) => format!(" --{knob} {value}"),
        }
    }
}

/// The defaults first, then every value of every knob that changes something, one knob at a time. Some may not be possible
/// with the scene: the renderer says so. `culls` tells whether there are so few shapes that they are
/// culled.
pub fn variants(settings: Settings, (plan_accel, plan_lanes): (AccelKind, Lanes), culls: bool) -> Vec<Variant> {
    let defaults = Variant::defaults(settings);
    let from = defaults.choice;
    // What the plan would choose anyway is no change, nor is Embree's flag where the shapes stand in a line, nor culling where
    // there is none.
    let resolved = |choice: &Choice| {
        choice.with(|s| {
            let accel = *s.accel.get_or_insert(plan_accel);
            s.lanes.get_or_insert(plan_lanes);
            s.robust |= accel == AccelKind::Linear;
            s.cull |= !culls;
        })
    };
    let same = |choice: &Choice| resolved(choice) == resolved(&from);
    let turned = KNOBS.iter().flat_map(|knob| {
        let values = (knob.values)(from).into_iter().filter(|(_, choice)| !same(choice));
        values.map(|(value, choice)| Variant {
            knob: knob.name,
            value,
            what: knob.what,
            choice,
        })
    });
    std::iter::once(defaults.clone()).chain(turned).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::FilmSize;

    fn settings() -> Settings {
        Settings {
            film: FilmSize { width: 8, height: 8 },
            estimator: EstimatorKind::Mis,
            sampler: SamplerKind::Sobol,
            seed: 0,
            lanes: Some(Lanes::Eight),
            threads: 2,
            ..Settings::default()
        }
    }

    #[test]
    fn each_variant_turns_one_knob_and_none_is_the_default() {
        let all = variants(settings(), (AccelKind::Linear, Lanes::Eight), true);
        let labels: Vec<String> = all.iter().map(Variant::label).collect();
        assert_eq!(
            labels[..11],
            [
                "default",
                "uniform",
                "light",
                "brdf",
                "mis2-balance",
                "mis2-power",
                "projected",
                "product",
                "independent",
                "adaptive",
                "1 lane"
            ]
        );
        assert!(labels.contains(&"embree".to_owned()) && !labels.contains(&"linear".to_owned()));
        assert!(all[1..].iter().all(|variant| variant.choice != all[0].choice));
        assert!(!labels.iter().any(|label| label.starts_with("robust")));
        assert!(labels.contains(&"cull off".to_owned()));
        let through_embree = |culls: bool| -> Vec<String> {
            let all = variants(settings(), (AccelKind::Embree, Lanes::Eight), culls);
            all.iter().map(Variant::arguments).collect()
        };
        assert_eq!(through_embree(false).last().unwrap(), " --robust off");
        assert_eq!(through_embree(true)[through_embree(false).len()..], [" --cull off"]);
        assert_eq!(all[1].arguments(), " --estimator uniform");
        assert_eq!(all[9].arguments(), " --adaptive");
    }
}
