//! Figures in words, and the answers in sentences.

use std::path::Path;

use crate::study::cost::Study;
use crate::study::cost::price::{Price, Verdict};
use crate::study::cost::statistics::Figure;

/// Two or three digits that count, without an exponent where that reads well.
pub fn number(value: f64) -> String {
    let size = value.abs();
    if value == 0.0 {
        "0".to_owned()
    } else if !value.is_finite() {
        "∞".to_owned()
    } else if !(9.995e-4..9.995e4).contains(&size) {
        power_of_ten(value)
    } else if size >= 99.5 {
        format!("{value:.0}")
    } else {
        // Two digits behind the first that counts.
        let digits = (1 - size.log10().floor() as i32).clamp(0, 5) as usize;
        format!("{value:.digits$}")
    }
}

/// `3.2 × 10⁻⁴`.
fn power_of_ten(value: f64) -> String {
    let text = format!("{value:.1e}");
    let (digits, exponent) = text.split_once('e').unwrap_or((&text, "0"));
    let digits = digits.trim_end_matches(".0");
    if digits == "1" {
        format!("10{}", superscript(exponent))
    } else {
        format!("{digits} × 10{}", superscript(exponent))
    }
}

/// A whole number on high.
pub fn superscript(number: &str) -> String {
    let high = |c: char| match c {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        '0' | '4'..='9' => char::from_u32(0x2070 + c as u32 - '0' as u32).unwrap_or(c),
        other => other,
    };
    number.chars().map(high).collect()
}

/// `2.1 s`, `34 ms`, `3 min 20 s`.
pub fn seconds(value: f64) -> String {
    if !value.is_finite() {
        "never".to_owned()
    } else if value >= 7200.0 {
        format!("{} h", number(value / 3600.0))
    } else if value >= 120.0 {
        format!("{:.0} min", value / 60.0)
    } else if value >= 0.995 {
        format!("{} s", number(value))
    } else if value >= 0.995e-3 {
        format!("{} ms", number(value * 1e3))
    } else {
        format!("{} µs", number(value * 1e6))
    }
}

/// `0.12 %`.
pub fn percent(value: f64) -> String {
    format!("{} %", number(100.0 * value))
}

/// `×1.24 (1.20 to 1.29)`, or without an interval where there is none.
pub fn ratio(figure: Figure) -> String {
    if figure.low == figure.high {
        return format!("× {}", number(figure.value));
    }
    format!(
        "× {} ({} to {})",
        number(figure.value),
        number(figure.low),
        number(figure.high)
    )
}

/// `1.2 × faster (1.1 to 1.3)`; below 1 `12 × slower (11 to 13)`.
pub fn speed_up(figure: Figure) -> String {
    if figure.value >= 1.0 {
        format!(
            "{} × faster ({} to {})",
            number(figure.value),
            number(figure.low),
            number(figure.high)
        )
    } else {
        format!(
            "{} × slower ({} to {})",
            number(1.0 / figure.value),
            number(1.0 / figure.high),
            number(1.0 / figure.low)
        )
    }
}

/// `+0.02 % ± 0.05 %`.
pub fn bias(figure: Figure) -> String {
    if figure.value == 0.0 && figure.reach() == 0.0 {
        return "none".to_owned();
    }
    let sign = if figure.value > 0.0 { "+" } else { "−" };
    format!("{sign}{} ± {}", percent(figure.value.abs()), percent(figure.reach()))
}

/// The name of a setting in a sentence.
pub fn name(price: &Price) -> String {
    if price.verdict == Verdict::Default || price.variant.knob.is_empty() {
        format!("the default ({})", price.variant.choice.settings.estimator.name())
    } else {
        price.arguments.trim().to_owned()
    }
}

/// What the study found, in a few sentences. The first is the headline.
pub struct Headline {
    /// The answer.
    pub answer: String,
    /// What stands beside it.
    pub beside: Vec<String>,
}

/// The relMSE of the headline: the power of ten next to what the defaults reached.
pub fn level(study: &Study) -> f64 {
    let reached = study.prices[0].points.last().map_or(1e-3, |point| point.relmse.value);
    if reached > 0.0 {
        10.0_f64.powf(reached.log10().round())
    } else {
        1e-3
    }
}

/// Times of the scene's own film over those of the study's.
pub fn whole_film(study: &Study) -> f64 {
    let pixels = |[width, height]: [u32; 2]| f64::from(width) * f64::from(height);
    if study.phases.pass_s > 0.0 {
        study.phases.pass_s / study.prices[0].pass_seconds.value
    } else {
        pixels(study.scene_film) / pixels(study.film)
    }
}

/// The headline.
pub fn headline(study: &Study) -> Headline {
    let level = level(study);
    let whole = whole_film(study);
    let time = |price: &Price| seconds(whole * price.seconds_for_relmse(level));
    let (default, best) = (&study.prices[0], study.cheapest_by_relmse(level));
    let asked = format!("relMSE {}", number(level));
    let faster = default.seconds_for_relmse(level) / best.seconds_for_relmse(level);
    let answer = if best.variant.knob.is_empty() || faster < 1.05 {
        format!(
            "{asked} takes {} with the default settings, and nothing is cheaper.",
            time(default)
        )
    } else {
        format!(
            "{asked} takes {} with {}, and {} with the default settings.",
            time(best),
            name(best),
            time(default)
        )
    };
    let mut beside = vec![estimators(study, &asked, &time)];
    beside.push(biases(study));
    beside.push(format!(
        "Times are for the scene's own {} × {} pixels.",
        study.scene_film[0], study.scene_film[1]
    ));
    beside.retain(|sentence| !sentence.is_empty());
    Headline { answer, beside }
}

fn estimators(study: &Study, asked: &str, time: &dyn Fn(&Price) -> String) -> String {
    let others: Vec<String> = study
        .prices
        .iter()
        .filter(|price| price.variant.knob == "estimator")
        .map(|price| format!("{} {}", price.label, time(price)))
        .collect();
    if others.is_empty() {
        return String::new();
    }
    format!("For {asked} the other estimators need: {}.", others.join(", "))
}

fn biases(study: &Study) -> String {
    let harmful: Vec<String> = study
        .prices
        .iter()
        .filter(|price| price.verdict == Verdict::Harmful)
        .map(|price| format!("{} ({})", name(price), bias(price.bias)))
        .collect();
    if !harmful.is_empty() {
        return format!("Harmful, as its pictures are wrong: {}.", harmful.join("; "));
    }
    let default = study.prices[0].bias;
    format!(
        "No setting is seen to be biased: the default agrees with the independent oracle to {}, within {} (95 %).",
        percent(default.value.abs()),
        percent(default.reach())
    )
}

/// A few lines for the terminal.
pub fn summary(study: &Study, scene: &Path) -> String {
    let Headline { answer, beside } = headline(study);
    format!(
        "{}: {answer}\n{}\n{} settings, {} seeds, up to {} samples a pixel at {} x {}, {:.0} s\n",
        scene.display(),
        beside.join("\n"),
        study.prices.len(),
        study.seeds,
        study.prices[0].points.last().map_or(0, |point| point.spp),
        study.film[0],
        study.film[1],
        study.seconds
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_well() {
        for (value, text) in [
            (0.0, "0"),
            (1.0, "1.0"),
            (12.34, "12"),
            (123.4, "123"),
            (0.01234, "0.012"),
            (0.1, "0.10"),
            (1e-4, "10⁻⁴"),
            (3.2e-5, "3.2 × 10⁻⁵"),
            (2.5e6, "2.5 × 10⁶"),
            (f64::INFINITY, "∞"),
        ] {
            assert_eq!(number(value), text);
        }
    }

    #[test]
    fn times_and_shares_have_units() {
        for (value, text) in [
            (0.000_02, "20 µs"),
            (0.034, "34 ms"),
            (2.14, "2.1 s"),
            (61.0, "61 s"),
            (600.0, "10 min"),
            (7200.0, "2.0 h"),
            (f64::INFINITY, "never"),
        ] {
            assert_eq!(seconds(value), text);
        }
        assert_eq!(percent(0.0123), "1.2 %");
        let figure = Figure {
            value: -0.001,
            low: -0.002,
            high: 0.0,
        };
        assert_eq!(bias(figure), "−0.10 % ± 0.10 %");
        assert_eq!(bias(Figure::exact(0.0)), "none");
        assert_eq!(
            ratio(Figure {
                value: 2.0,
                low: 1.5,
                high: 3.0
            }),
            "× 2.0 (1.5 to 3.0)"
        );
    }
}
