//! The table of settings: every option that may change time or accuracy. A new row here is measured, costed and charted
//! automatically.

use crate::pipeline::{Settings, widest_lanes};
use crate::settings::{AccelKind, EstimatorKind, Lanes, LightsAsked, SamplerKind};
use serde::Serialize;

/// The settings of a render.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Choice {
    /// The renderer's settings.
    pub settings: Settings,
    /// Adaptive sampling.
    pub adaptive: bool,
}

/// One row of the table.
pub struct Setting {
    /// The name of its command-line option, without dashes.
    pub name: &'static str,
    /// What it decides, in a few words.
    pub what: &'static str,
    /// Its values as on the command line (empty for a flag), with the changed settings.
    values: fn(Choice) -> Vec<(String, Choice)>,
}

/// All settings, in the order of the report.
pub const SETTINGS: [Setting; 9] = [
    Setting {
        name: "estimator",
        what: "how directions of light are drawn",
        values: |from| {
            let of = |estimator: EstimatorKind| (estimator.name().to_owned(), from.with(|s| s.estimator = estimator));
            EstimatorKind::ALL.into_iter().map(of).collect()
        },
    },
    Setting {
        name: "sampler",
        what: "where random numbers come from",
        values: |from| {
            let of = |sampler: SamplerKind| (sampler.name().to_owned(), from.with(|s| s.sampler = sampler));
            SamplerKind::ALL.into_iter().map(of).collect()
        },
    },
    Setting {
        name: "adaptive",
        what: "samples go where the relative noise is",
        values: |from| vec![(String::new(), Choice { adaptive: true, ..from })],
    },
    Setting {
        name: "lanes",
        what: "rays a packet",
        values: |from| {
            let widths = Lanes::ALL.into_iter().filter(|&lanes| lanes <= widest_lanes());
            widths
                .map(|lanes| (lanes.to_string(), from.with(|s| s.lanes = Some(lanes))))
                .collect()
        },
    },
    Setting {
        name: "threads",
        what: "how many threads render",
        values: |from| vec![("1".to_owned(), from.with(|s| s.threads = 1))],
    },
    Setting {
        name: "accel",
        what: "how rays find what they hit",
        values: |from| {
            let of = |accel: AccelKind| (accel.name().to_owned(), from.with(|s| s.accel = Some(accel)));
            AccelKind::ALL.into_iter().map(of).collect()
        },
    },
    Setting {
        name: "robust",
        what: "whether Embree closes the edges between triangles",
        values: |from| {
            let of = |(name, robust): (&str, bool)| (name.to_owned(), from.with(|s| s.robust = robust));
            [("on", true), ("off", false)].map(of).into()
        },
    },
    Setting {
        name: "cull",
        what: "whether shapes are left out for a tile at once",
        values: |from| {
            let of = |(name, cull): (&str, bool)| (name.to_owned(), from.with(|s| s.cull = cull));
            [("on", true), ("off", false)].map(of).into()
        },
    },
    Setting {
        name: "lights",
        what: "which lights a pass samples, where there are many",
        values: |from| {
            let of = |asked: LightsAsked| (asked.to_string(), from.with(|s| s.lights = asked));
            let lists = [4, 8, 16, 32, LightsAsked::LONGEST].map(LightsAsked::List);
            std::iter::once(LightsAsked::All).chain(lists).map(of).collect()
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

/// A measured choice: the defaults, or the defaults with one setting changed.
#[derive(Clone, Debug, Serialize)]
pub struct Variant {
    /// The setting; empty for the defaults. Its name in `study.json` is older.
    #[serde(rename = "knob")]
    pub setting: &'static str,
    /// Its value, if it has one.
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
            setting: "",
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
        match (self.setting, self.value.as_str()) {
            ("", _) => "default".to_owned(),
            (setting, "") => setting.to_owned(),
            ("lanes" | "threads", "1") => format!("1 {}", self.setting.trim_end_matches('s')),
            ("lanes" | "threads", count) => format!("{count} {}", self.setting),
            ("robust" | "cull" | "lights", value) => format!("{} {value}", self.setting),
            (_, value) => value.to_owned(),
        }
    }

    /// The arguments to add to `octolux render SCENE`.
    pub fn arguments(&self) -> String {
        match (self.setting, self.value.as_str()) {
            ("", _) => String::new(),
            (setting, "") => format!(" --{setting}"),
            (setting, value) => format!(" --{setting} {value}"),
        }
    }
}

/// The defaults first, then every value of every setting that changes something, one at a time. The renderer rejects those that
/// the scene does not allow. `culls` tells whether the scene has so few shapes that they are culled; `emitters` is the number
/// of emitting spheres and triangles, points and spots.
pub fn variants(
    settings: Settings,
    (plan_accel, plan_lanes): (AccelKind, Lanes),
    culls: bool,
    emitters: usize,
) -> Vec<Variant> {
    let defaults = Variant::defaults(settings);
    let from = defaults.choice;
    // Lists of a few lights are no choice of the plan, so they are compared only if the settings ask for one.
    let many = emitters > LightsAsked::FEW || matches!(settings.lights, LightsAsked::List(_));
    // No change: a value that the plan chooses anyway, Embree's flag with the brute-force intersector, culling where nothing is
    // culled, lists where no light is sampled.
    let resolved = |choice: &Choice| {
        choice.with(|s| {
            let accel = *s.accel.get_or_insert(plan_accel);
            s.lanes.get_or_insert(plan_lanes);
            s.robust |= accel == AccelKind::Linear;
            s.cull |= !culls;
            s.lights = match s.lights.list_of(emitters) {
                Some(length) if many && s.estimator.per_light() => LightsAsked::List(length as u8),
                _ => LightsAsked::All,
            };
        })
    };
    let same = |choice: &Choice| resolved(choice) == resolved(&from);
    let turned = SETTINGS.iter().flat_map(|setting| {
        let values = (setting.values)(from).into_iter().filter(|(_, choice)| !same(choice));
        values.map(|(value, choice)| Variant {
            setting: setting.name,
            value,
            what: setting.what,
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
    fn each_variant_turns_one_setting_and_none_is_the_default() {
        let all = variants(settings(), (AccelKind::Linear, Lanes::Eight), true, 3);
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
            let all = variants(settings(), (AccelKind::Embree, Lanes::Eight), culls, 3);
            all.iter().map(Variant::arguments).collect()
        };
        assert_eq!(through_embree(false).last().unwrap(), " --robust off");
        assert_eq!(through_embree(true)[through_embree(false).len()..], [" --cull off"]);
        assert_eq!(all[1].arguments(), " --estimator uniform");
        assert_eq!(all[9].arguments(), " --adaptive");
    }

    /// Without many lights, and with estimators that sample none, `--lights` is not measured and takes no time of a study.
    #[test]
    fn lists_are_compared_where_a_pass_draws_them() {
        let turned = |estimator: EstimatorKind, lights: LightsAsked, emitters: usize| -> Vec<String> {
            let settings = Settings {
                estimator,
                lights,
                ..settings()
            };
            let all = variants(settings, (AccelKind::Embree, Lanes::Eight), false, emitters);
            let rows = all.iter().filter(|variant| variant.setting == "lights");
            rows.map(|variant| variant.value.clone()).collect()
        };
        use EstimatorKind::{Brdf, Light, Mis, Product, Uniform};
        for estimator in [Light, Mis, Product] {
            assert_eq!(turned(estimator, LightsAsked::Auto, 65), ["all", "4", "16", "32", "64"]);
            assert!(turned(estimator, LightsAsked::Auto, 64).is_empty());
            assert!(turned(estimator, LightsAsked::All, 64).is_empty());
        }
        for estimator in [Uniform, Brdf] {
            assert!(turned(estimator, LightsAsked::Auto, 1024).is_empty());
        }
        assert_eq!(turned(Mis, LightsAsked::All, 65), ["4", "8", "16", "32", "64"]);
        // Who asks for lists of a few lights sees what they cost.
        assert_eq!(turned(Mis, LightsAsked::List(8), 17), ["all", "4", "16", "32", "64"]);
        assert!(turned(Mis, LightsAsked::List(8), 0).is_empty());
    }
}
