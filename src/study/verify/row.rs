//! Rows of a verification report.

use std::collections::BTreeMap;

use serde::Serialize;

use super::means::{Judgement, POWER};
use super::replicates::Series;
use crate::film::Picture;

/// The outcome of a check.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum Verdict {
    /// It holds.
    #[serde(rename = "pass")]
    Pass,
    /// Worth knowing, but nothing is wrong.
    #[serde(rename = "note")]
    Note,
    /// Intended or a mistake.
    #[serde(rename = "warn")]
    Warn,
    /// Nothing contradicts it, but even a large bias would not have been detected.
    #[serde(rename = "no power")]
    NoPower,
    /// It does not hold.
    #[serde(rename = "FAIL")]
    Fail,
}

impl Verdict {
    /// The word in the table.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Pass => "pass",
            Self::Note => "note",
            Self::Warn => "warn",
            Self::NoPower => "no power",
            Self::Fail => "FAIL",
        }
    }
}

/// One check.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// What is checked.
    pub check: &'static str,
    /// On what.
    pub compared: String,
    /// The measured value, as text.
    pub figure: String,
    /// The bound, as text.
    pub bound: String,
    /// The outcome.
    pub verdict: Verdict,
    /// An explanation of a verdict other than `pass`; empty otherwise.
    pub sentence: String,
    /// The figures behind it by name.
    pub numbers: BTreeMap<&'static str, f64>,
    /// Pictures to inspect after a failure.
    #[serde(skip)]
    pub evidence: Option<Evidence>,
}

/// Two pictures that should agree, and a map of their difference.
#[derive(Clone, Debug)]
pub struct Evidence {
    /// Short names of both, usable in file names.
    pub names: [String; 2],
    /// Both.
    pub pictures: [Picture; 2],
    /// Blue where the first is darker, red where it is brighter, saturated from 5 standard errors.
    pub z: Picture,
}

impl Row {
    /// A row that passes.
    pub fn pass(check: &'static str, compared: impl Into<String>) -> Self {
        Self {
            check,
            compared: compared.into(),
            figure: String::new(),
            bound: String::new(),
            verdict: Verdict::Pass,
            sentence: String::new(),
            numbers: BTreeMap::new(),
            evidence: None,
        }
    }

    /// The same with another verdict and its reason.
    #[must_use]
    pub fn judged(mut self, verdict: Verdict, sentence: impl Into<String>) -> Self {
        self.verdict = verdict;
        self.sentence = sentence.into();
        self
    }

    /// The same with a figure and its bound.
    #[must_use]
    pub fn figures(mut self, figure: impl Into<String>, bound: impl Into<String>) -> Self {
        self.figure = figure.into();
        self.bound = bound.into();
        self
    }

    /// The same with one more number for the JSON object.
    #[must_use]
    pub fn number(mut self, name: &'static str, value: f64) -> Self {
        self.numbers.insert(name, value);
        self
    }

    /// A row about means that should agree.
    pub fn of_means(check: &'static str, compared: String, family: &Judgement, alpha: f64) -> Self {
        let row = Self::pass(check, compared)
            .number("tests", 1.0)
            .number("false_alarm_rate", alpha);
        let (Some(worst), count) = (family.worst(), family.judged.len()) else {
            return row.judged(Verdict::NoPower, "there was nothing to compare");
        };
        let visible = family.visible();
        let [lit, able] = family.power();
        let row = if count > 3 {
            row.figures(
                format!("{:.2} of bound", worst.ratio),
                match visible {
                    None => "1 (no light)".to_owned(),
                    Some(bias) => format!(
                        "1 (sees {} in {:.0} %)",
                        percent(bias),
                        100.0 * able as f64 / lit as f64
                    ),
                },
            )
        } else {
            row.figures(
                format!("{:+.3} %", 100.0 * worst.difference),
                percent(visible.unwrap_or(worst.visible)),
            )
        };
        let row = row
            .number("values", count as f64)
            .number("worst_over_bound", worst.ratio)
            .number("worst_difference", worst.difference)
            .number("visible_bias", visible.unwrap_or(0.0))
            .number("values_with_light", lit as f64)
            .number("values_with_power", able as f64);
        if !family.agrees() {
            let beyond = family.judged.iter().filter(|judged| judged.ratio > 1.0).count();
            let sentence =
                format!("{beyond} of {count} means differ by more than chance, single precision and rare events allow");
            return row.judged(Verdict::Fail, sentence);
        }
        match visible {
            Some(visible) if visible > POWER => row.judged(
                Verdict::NoPower,
                format!(
                    "too noisy to say: a bias below {} could not be seen; give it a larger --budget",
                    percent(visible)
                ),
            ),
            _ => row,
        }
    }
}

/// A percentage with a suitable number of digits.
pub fn percent(share: f64) -> String {
    let percent = 100.0 * share;
    match percent {
        p if p < 0.1 => format!("{p:.3} %"),
        p if p < 10.0 => format!("{p:.2} %"),
        p if p < 1000.0 => format!("{p:.0} %"),
        p => format!("{p:.0e} %"),
    }
}

impl Evidence {
    /// The mean pictures of two series, and their difference in standard errors.
    pub fn of_series(a: &Series, b: &Series, width: u32, names: [String; 2]) -> Self {
        Self::of_measured(&a.picture(), &b.picture(), width, names)
    }

    /// Pictures of `(mean, variance)`.
    pub fn of_measured(a: &[[(f64, f64); 3]], b: &[[(f64, f64); 3]], width: u32, names: [String; 2]) -> Self {
        let picture = |pixels: Vec<[f32; 3]>| Picture {
            width,
            height: pixels.len() as u32 / width.max(1),
            pixels,
        };
        let means = |m: &[[(f64, f64); 3]]| picture(m.iter().map(|p| p.map(|(mean, _)| mean as f32)).collect());
        let score = |a: (f64, f64), b: (f64, f64)| match ((a.0 - b.0), (a.1 + b.1).sqrt()) {
            (0.0, _) => 0.0,
            (difference, s) => difference / s,
        };
        let z = a.iter().zip(b).map(|(a, b)| {
            let scores = [0, 1, 2].map(|channel| score(a[channel], b[channel]));
            let strongest = scores.into_iter().max_by(|x, y| x.abs().total_cmp(&y.abs()));
            diverging(strongest.unwrap_or(0.0))
        });
        Self {
            names,
            z: picture(z.collect()),
            pictures: [means(a), means(b)],
        }
    }

    /// Two pictures that should agree bit by bit: any difference is saturated.
    pub fn of_bits(a: &Picture, b: &Picture, names: [String; 2]) -> Self {
        let exact = |picture: &Picture| -> Vec<[(f64, f64); 3]> {
            picture
                .pixels
                .iter()
                .map(|p| p.map(|value| (f64::from(value), 0.0)))
                .collect()
        };
        Self::of_measured(&exact(a), &exact(b), a.width, names)
    }
}

/// White at 0, red above, blue below: linear radiance for a PNG.
fn diverging(z: f64) -> [f32; 3] {
    let t = if z.is_nan() {
        1.0
    } else {
        (z.abs() / 5.0).min(1.0) as f32
    };
    let fade = |end: f32| 1.0 + t * (end - 1.0);
    if z < 0.0 {
        [fade(0.03), fade(0.12), fade(0.6)]
    } else {
        [fade(0.55), fade(0.02), fade(0.05)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_show_in_colour() {
        let picture = |value: f32| Picture {
            width: 2,
            height: 1,
            pixels: vec![[1.0; 3], [value; 3]],
        };
        let names = ["a".to_owned(), "b".to_owned()];
        let evidence = Evidence::of_bits(&picture(1.0), &picture(1.5), names);
        assert_eq!(evidence.z.pixels[0], [1.0; 3]);
        let [red, _, blue] = evidence.z.pixels[1];
        assert!(blue > red, "the first is darker");
        assert_eq!(percent(0.00012), "0.012 %");
        assert_eq!(percent(0.5), "50 %");
    }
}
