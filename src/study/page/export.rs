//! Machine-readable exports: every run as CSV, every figure as JSON.

use std::fmt::Write;

use serde::Serialize;

use super::Circumstances;
use crate::study::cost::Study;

/// One line per look at a run. No field contains a comma or a quote: names of settings are words and numbers.
pub fn csv(study: &Study) -> String {
    let mut text = String::from("setting,arguments,seed,spp,seconds,rmse,relmse,smape,mean,same_bits\n");
    for line in &study.lines {
        let e = line.errors;
        let _ = writeln!(
            text,
            "{},{},{},{},{:e},{:e},{:e},{:e},{:e},{}",
            line.setting,
            line.arguments,
            line.seed,
            line.spp,
            line.seconds,
            e.rmse,
            e.relmse,
            e.smape,
            e.mean,
            line.same_bits
        );
    }
    text
}

#[derive(Serialize)]
struct All<'a> {
    circumstances: &'a Circumstances,
    #[serde(flatten)]
    study: &'a Study,
}

/// Everything except single runs and pictures. Values that are not finite become `null`.
///
/// # Errors
/// None expected: every value here can be written as JSON.
pub fn json(study: &Study, circumstances: &Circumstances) -> Result<String, serde_json::Error> {
    Ok(serde_json::to_string_pretty(&All { circumstances, study })? + "\n")
}
