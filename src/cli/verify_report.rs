//! The output of `octolux verify`: a table for people, an object for programs.

use std::path::Path;

use serde::Serialize;

use super::CliError;
use octolux::scene::{Features, Scene};
use octolux::study::verify::sanity::plural;
use octolux::study::verify::{FALSE_ALARMS, Options, Report, Row, Verdict};
use octolux::{about, machine};

/// Every figure with the circumstances of its measurement.
#[derive(Serialize)]
pub struct Circumstances<'a> {
    scene: String,
    passed: bool,
    needs: Vec<&'static str>,
    budget_s: f64,
    seconds: f64,
    threads: usize,
    seed: u32,
    false_alarm_rate: f64,
    /// The film of the comparisons of means.
    width: u32,
    height: u32,
    spp: u32,
    replicates: usize,
    oracle_spp: u32,
    probes_per_pixel: u32,
    renders: u64,
    octolux_version: &'static str,
    commit: &'static str,
    target_features: &'static str,
    embree_version: &'a str,
    cpu: String,
    rows: &'a [Row],
}

impl<'a> Circumstances<'a> {
    /// Collects them.
    pub fn new(path: &Path, scene: &Scene, options: Options, report: &'a Report) -> Self {
        Self {
            scene: path.to_string_lossy().into_owned(),
            passed: report.count(Verdict::Fail) == 0,
            needs: Features::of(scene, scene.film()).effects().names(),
            budget_s: options.budget,
            seconds: report.seconds,
            threads: options.threads,
            seed: options.seed,
            false_alarm_rate: FALSE_ALARMS,
            width: report.film.width,
            height: report.film.height,
            spp: report.spp,
            replicates: report.replicates,
            oracle_spp: report.oracle_spp,
            probes_per_pixel: report.probes,
            renders: report.renders,
            octolux_version: about::VERSION,
            commit: about::COMMIT,
            target_features: about::TARGET_FEATURES,
            embree_version: &report.embree_version,
            cpu: machine::cpu(),
            rows: &report.rows,
        }
    }

    /// The report as JSON on one line.
    ///
    /// # Errors
    /// None expected: numbers that are not finite become `null`.
    pub fn json(&self) -> Result<String, CliError> {
        serde_json::to_string(self).map_err(|error| CliError::failed(format!("the figures: {error}")))
    }

    /// The report as JSON, one value per line.
    ///
    /// # Errors
    /// As [`json`](Self::json).
    pub fn pretty(&self) -> Result<String, CliError> {
        let text = serde_json::to_string_pretty(self).map(|text| text + "\n");
        text.map_err(|error| CliError::failed(format!("the figures: {error}")))
    }
}

/// The rows in columns, sentences for rows that did not pass, and a summary.
pub fn table(path: &Path, options: Options, report: &Report) -> String {
    let head = ["check", "compared", "figure", "bound", "verdict"].map(str::to_owned);
    let body = report.rows.iter().map(|row| {
        [
            row.check.to_owned(),
            row.compared.clone(),
            row.figure.clone(),
            row.bound.clone(),
            row.verdict.word().to_owned(),
        ]
    });
    let cells: Vec<[String; 5]> = std::iter::once(head).chain(body).collect();
    let width = |column: usize| cells.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
    let widths = [0, 1, 2, 3].map(width);
    let line = |row: &[String; 5]| {
        let padded = row.iter().zip(widths).map(|(cell, width)| format!("{cell:<width$}  "));
        format!("{}{}", padded.collect::<String>(), row[4])
    };
    let mut lines: Vec<String> = cells.iter().map(line).collect();
    lines.insert(
        1,
        "-".repeat(lines.iter().map(|line| line.chars().count()).max().unwrap_or(0)),
    );
    let remarks = report.rows.iter().filter(|row| !row.sentence.is_empty());
    let remarks = remarks.map(|row| {
        format!(
            "{}: {} ({}): {}",
            row.verdict.word(),
            row.check,
            row.compared,
            row.sentence
        )
    });
    lines.push(String::new());
    let before = lines.len();
    lines.extend(remarks);
    if lines.len() > before {
        lines.push(String::new());
    }
    lines.push(summary(path, options, report));
    lines.join("\n")
}

fn summary(path: &Path, options: Options, report: &Report) -> String {
    let count = |verdict: Verdict, words: &str| match report.count(verdict) {
        0 => None,
        count => Some(format!("{count} {words}")),
    };
    let counts = [
        count(Verdict::Pass, "pass"),
        count(Verdict::Note, "note"),
        count(Verdict::Warn, "warn"),
        count(Verdict::NoPower, "without power"),
        count(Verdict::Fail, "FAIL"),
    ];
    let counts: Vec<String> = counts.into_iter().flatten().collect();
    format!(
        "{}: {} in {:.1} s; means of {} x {} pixels, {} seeds of {} spp, oracle {} spp, {}",
        path.display(),
        counts.join(", "),
        report.seconds,
        report.film.width,
        report.film.height,
        report.replicates,
        report.spp,
        report.oracle_spp,
        plural(options.threads, "thread"),
    )
}
