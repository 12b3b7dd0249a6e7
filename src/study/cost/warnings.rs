//! Warnings about reduced certainty of a study, as sentences.

use super::Study;
use super::price::Verdict;

/// Seconds below which a render is too short to time: timers, threads and caches matter.
const SHORT: f64 = 0.005;

/// Relative spread of times of the same work above which the machine counts as busy.
const SPREAD: f64 = 0.05;

/// All warnings that apply. `load` is the load average before the study.
pub fn of(study: &Study, load: Option<f64>) -> Vec<String> {
    let mut found = Vec::new();
    if let Some(load) = load.filter(|&load| load > 1.0) {
        found.push(format!(
            "The machine was busy before the study began: load {load:.1}. Close other programs and run it again."
        ));
    }
    found.extend(study.too_slow.iter().map(ToString::to_string));
    if let Some(price) = study.prices.first()
        && let Some(last) = price.points.last()
    {
        if last.seconds.value < SHORT {
            found.push(format!(
                "Renders are short: the defaults took {:.1} ms at {} samples a pixel. A larger --budget makes them longer.",
                last.seconds.value * 1e3,
                last.spp
            ));
        }
        let own = study.reference.relative_mse;
        if own > 0.1 * last.relative_mse.value {
            found.push(format!(
                "The reference's own relative MSE of {own:.1e} is more than a tenth of the smallest error of the defaults. The errors \
                 on this page are not affected. Only the check for bias is less exact."
            ));
        }
    }
    let wide: Vec<String> = study
        .prices
        .iter()
        .filter_map(|price| {
            let spread = price.pass_seconds.reach() / price.pass_seconds.value;
            (spread > SPREAD).then(|| format!("{} ±{:.0} %", price.label, spread * 100.0))
        })
        .collect();
    if !wide.is_empty() {
        found.push(format!(
            "Times of a pass are known to no better than: {}. Something else was using the processor.",
            wide.join(", ")
        ));
    }
    if study
        .prices
        .first()
        .is_some_and(|price| price.verdict == Verdict::Harmful)
    {
        found.push(
            "The defaults and the oracle disagree: run `octolux verify` on this scene, and report it.".to_owned(),
        );
    }
    found
}
