//! The report: one self-contained page, and machine-readable exports.

mod chart;
mod export;
mod html;
mod pictures;
mod tables;
mod theme;
pub mod words;

use serde::Serialize;

use crate::scene::Scene;
use crate::study::cost::Study;
use crate::study::cost::price::Price;
use chart::About;
use html::escape;

/// The page with placeholders for its parts.
const TEMPLATE: &str = include_str!("page.html");

/// The environment of a study.
#[derive(Clone, Debug, Serialize)]
pub struct Circumstances {
    /// The scene file as given.
    pub scene: String,
    /// The command line.
    pub command: String,
    /// The version of Octolux.
    pub version: String,
    /// The commit that it was built from.
    pub commit: String,
    /// Target features of the build.
    pub target_features: String,
    /// The processor.
    pub cpu: String,
    /// Threads of the defaults.
    pub threads: usize,
    /// Lanes of the defaults.
    pub lanes: usize,
    /// Their estimator.
    pub estimator: String,
    /// Their sampler.
    pub sampler: String,
    /// Seconds to spend.
    pub budget: f64,
    /// The load average before the study.
    pub load: Option<f64>,
}

/// The names of a report's files.
pub const NAMES: [&str; 5] = [
    "study.html",
    "study.csv",
    "study.json",
    "error-over-time.svg",
    "same-picture.svg",
];

/// All files of a report: [`NAMES`] and text.
///
/// # Errors
/// None expected: everything is built in memory.
pub fn files(
    study: &Study,
    scene: &Scene,
    circumstances: &Circumstances,
) -> Result<Vec<(&'static str, String)>, Box<dyn std::error::Error>> {
    let (bits, time): (Vec<&Price>, Vec<&Price>) = split(study);
    let error = [chart::DESK, chart::PHONE].map(|layout| chart::draw(&bits, layout, About::Noise));
    let same = [chart::DESK, chart::PHONE].map(|layout| chart::draw(&time, layout, About::Time));
    let ([error, error_small], [same, same_small]) = (all(error)?, all(same)?);
    let headline = words::headline(study);
    let warnings: String = study
        .warnings
        .iter()
        .map(|warning| format!("<p class=\"warning\">{}</p>\n", escape(warning)))
        .collect();
    let beside: String = headline
        .beside
        .iter()
        .map(|sentence| format!("<p>{}</p>\n", escape(sentence)))
        .collect();
    let page = fill(&[
        ("theme", theme::CSS.to_owned()),
        (
            "title",
            escape(&format!("{}: what accuracy costs in time", scene.name())),
        ),
        ("scene", escape(scene.name())),
        ("answer", escape(&headline.answer)),
        ("beside", beside),
        ("warnings", warnings),
        ("cheapest", tables::cheapest(study, circumstances)),
        ("error-chart", both(&error, &error_small)),
        ("time-chart", both(&same, &same_small)),
        ("prices", tables::prices(study)),
        ("strip", pictures::strip(study)?),
        ("effects", tables::effects(study, scene)),
        ("phases", tables::phases(study)),
        ("circumstances", tables::circumstances(study, circumstances)),
        ("rounds", crate::study::cost::schedule::LEAST_ROUNDS.to_string()),
        (
            "false-alarms",
            words::exact_percent(crate::study::cost::price::FALSE_ALARMS),
        ),
        ("harmless", words::exact_percent(crate::study::cost::price::HARMLESS)),
    ]);
    let texts = [
        page,
        export::csv(study),
        export::json(study, circumstances)?,
        chart::alone(&error),
        chart::alone(&same),
    ];
    Ok(NAMES.into_iter().zip(texts).collect())
}

/// Settings whose pictures differ from those of the defaults, and settings that only differ in speed; both start with the
/// defaults.
fn split(study: &Study) -> (Vec<&Price>, Vec<&Price>) {
    let default = &study.prices[0];
    let others = study.prices[1..].iter();
    let (same, differ): (Vec<&Price>, Vec<&Price>) = others.partition(|price| price.same_noise);
    let lead = [default];
    ([&lead[..], &differ].concat(), [&lead[..], &same].concat())
}

fn all<E>([a, b]: [Result<String, E>; 2]) -> Result<[String; 2], E> {
    Ok([a?, b?])
}

/// One drawing for wide screens and paper, one for narrow screens.
fn both(wide: &str, narrow: &str) -> String {
    format!("<div class=\"chart wide\">{wide}</div>\n<div class=\"chart narrow\">{narrow}</div>\n")
}

/// The template with each `{{name}}` replaced.
fn fill(parts: &[(&str, String)]) -> String {
    let mut page = String::with_capacity(TEMPLATE.len() * 8);
    let mut rest = TEMPLATE;
    while let Some((before, after)) = rest.split_once("{{") {
        let (name, behind) = after.split_once("}}").unwrap_or((after, ""));
        let part = parts.iter().find(|(known, _)| *known == name);
        page.push_str(before);
        page.push_str(part.map_or("", |(_, text)| text));
        rest = behind;
    }
    page + rest
}
