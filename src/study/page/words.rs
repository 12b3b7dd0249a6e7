//! Formats figures, and phrases the answers.

use std::path::Path;

use crate::study::cost::Study;
use crate::study::cost::price::{Price, Verdict};
use crate::study::cost::statistics::Figure;

/// Two or three significant digits, without an exponent where that is readable.
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
        // Two significant digits of the rounded number: 9.99 becomes 10.
        let rounded: f64 = format!("{size:.1e}").parse().unwrap_or(size);
        let digits = (1 - rounded.log10().floor() as i32).clamp(0, 5) as usize;
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

/// An integer in superscript digits.
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
    } else if value >= 3.6e6 {
        "more than 1000 h".to_owned()
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

/// `3 %`, `0.1 %`: a share that is known exactly.
pub fn exact_percent(value: f64) -> String {
    format!("{} %", exact(100.0 * value))
}

/// The shortest way to write a number that is known exactly.
pub fn exact(value: f64) -> String {
    if (1e-3..1e5).contains(&value.abs()) {
        // Binary fractions add noise beyond the tenth digit.
        format!("{value:.10}")
            .trim_end_matches('0')
            .trim_end_matches('.')
            .to_owned()
    } else {
        power_of_ten(value)
    }
}

/// `× 1.24` and `1.20 to 1.29`; no interval if there is none.
pub fn ratio(figure: Figure) -> (String, String) {
    let value = format!("× {}", number(figure.value));
    let interval = if figure.low == figure.high {
        String::new()
    } else {
        format!("{} to {}", number(figure.low), number(figure.high))
    };
    (value, interval)
}

/// `1.2 × faster` and `1.1 to 1.3`; below 1 `12 × slower` and `11 to 13`.
pub fn speed_up(figure: Figure) -> (String, String) {
    let (figure, word) = if figure.value >= 1.0 {
        (figure, "faster")
    } else {
        let slower = Figure {
            value: 1.0 / figure.value,
            low: 1.0 / figure.high,
            high: 1.0 / figure.low,
        };
        (slower, "slower")
    };
    let interval = format!("{} to {}", number(figure.low), number(figure.high));
    (format!("{} × {word}", number(figure.value)), interval)
}

/// `+0.02 % ± 0.05 %`: two significant digits of the interval, and as many decimals of the value.
pub fn bias(figure: Figure) -> String {
    let (value, reach) = (100.0 * figure.value, 100.0 * figure.reach());
    if value == 0.0 && reach == 0.0 {
        return "none".to_owned();
    }
    let least = if reach > 0.0 { reach } else { value.abs() };
    let power = if least.is_finite() {
        least.log10().floor() as i32
    } else {
        0
    };
    let small = power < -3;
    let scale = if small { 10.0_f64.powi(-power) } else { 1.0 };
    let places = if small { 1 } else { (1 - power).max(0) as usize };
    let size = format!("{:.places$}", scale * value.abs());
    let sign = match size.bytes().any(|digit| (b'1'..=b'9').contains(&digit)) {
        false => "",
        true if value > 0.0 => "+",
        true => "−",
    };
    if !reach.is_finite() {
        format!("{sign}{size} % ± ∞ %")
    } else if small {
        let power = superscript(&power.to_string());
        format!("({sign}{size} ± {:.places$}) × 10{power} %", scale * reach)
    } else {
        format!("{sign}{size} % ± {reach:.places$} %")
    }
}

/// The name of a setting in a sentence.
pub fn name(price: &Price) -> String {
    if price.verdict == Verdict::Default || price.variant.setting.is_empty() {
        format!("the default ({})", price.variant.choice.settings.estimator.name())
    } else {
        price.arguments.trim().to_owned()
    }
}

/// The findings in a few sentences. The first is the headline.
pub struct Headline {
    /// The answer.
    pub answer: String,
    /// Further sentences.
    pub beside: Vec<String>,
}

/// The relative mean squared error of the headline: the power of ten nearest to what the defaults reached.
pub fn level(study: &Study) -> f64 {
    let reached = study.prices[0]
        .points
        .last()
        .map_or(1e-3, |point| point.relative_mse.value);
    if reached > 0.0 {
        10.0_f64.powf(reached.log10().round())
    } else {
        1e-3
    }
}

/// Ratio of render times at the scene's own film size and at the study's.
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
    let time = |price: &Price| seconds(whole * price.seconds_for_mse(level));
    let (default, best) = (&study.prices[0], study.cheapest_by_mse(level));
    let asked = format!("a relative MSE of {}", exact(level));
    let faster = default.seconds_for_mse(level) / best.seconds_for_mse(level);
    // The first sentence is large and wraps at blanks: use no-break spaces between numbers and units.
    let time_unbroken = |price: &Price| time(price).replace(' ', "\u{a0}");
    let first = asked.replacen('a', "A", 1);
    let answer = if best.variant.setting.is_empty() || faster < 1.05 {
        format!(
            "{first} takes {} with the default settings, and nothing is cheaper.",
            time_unbroken(default)
        )
    } else {
        format!(
            "{first} takes {} with {}, and {} with the default settings.",
            time_unbroken(best),
            name(best),
            time_unbroken(default)
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
        .filter(|price| price.variant.setting == "estimator")
        .map(|price| format!("{} {}", price.label, time(price)))
        .collect();
    if others.is_empty() {
        return String::new();
    }
    format!("For {asked} the other estimators need: {}.", others.join(", "))
}

fn biases(study: &Study) -> String {
    let biased: Vec<String> = study
        .prices
        .iter()
        .filter(|price| price.verdict == Verdict::Harmful)
        .map(|price| format!("{} ({})", name(price), bias(price.bias)))
        .collect();
    if !biased.is_empty() {
        return format!("Harmful, as its pictures are wrong: {}.", biased.join("; "));
    }
    format!(
        "No setting is seen to be biased. The default is off the brightness of the independent oracle by {} (95 %).",
        bias(study.prices[0].bias)
    )
}

/// A few lines for the terminal.
pub fn summary(study: &Study, scene: &Path) -> String {
    let Headline { answer, beside } = headline(study);
    format!(
        "{}: {}\n{}\n{} settings, {} seeds, up to {} samples a pixel at {} x {}, {:.0} s\n",
        scene.display(),
        answer.replace('\u{a0}', " "),
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
            (9.99, "10"),
            (0.9999, "1.0"),
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
            (1e12, "more than 1000 h"),
            (f64::INFINITY, "never"),
        ] {
            assert_eq!(seconds(value), text);
        }
        let figure = Figure {
            value: -0.001,
            low: -0.002,
            high: 0.0,
        };
        assert_eq!(bias(figure), "−0.10 % ± 0.10 %");
        assert_eq!(bias(Figure::exact(0.0)), "none");
        for (value, reach, text) in [
            (-0.0051, 0.11, "−1 % ± 11 %"),
            (4.6e-6, 0.0069, "0.00 % ± 0.69 %"),
            (1.6e-3, 0.012, "+0.2 % ± 1.2 %"),
            (-2.3e-7, 5.7e-7, "(−2.3 ± 5.7) × 10⁻⁵ %"),
            (0.01, f64::INFINITY, "+1.0 % ± ∞ %"),
        ] {
            let (low, high) = (value - reach, value + reach);
            assert_eq!(bias(Figure { value, low, high }), text);
        }
        let figure = Figure {
            value: 2.0,
            low: 1.5,
            high: 3.0,
        };
        assert_eq!(ratio(figure), ("× 2.0".to_owned(), "1.5 to 3.0".to_owned()));
        assert_eq!(speed_up(figure), ("2.0 × faster".to_owned(), "1.5 to 3.0".to_owned()));
        let slow = Figure {
            value: 0.5,
            low: 0.25,
            high: 0.8,
        };
        assert_eq!(speed_up(slow), ("2.0 × slower".to_owned(), "1.2 to 4.0".to_owned()));
    }

    #[test]
    fn what_is_known_exactly_has_no_idle_zeros() {
        for (value, text) in [(0.1, "0.1"), (10.0, "10"), (0.01, "0.01"), (1e-4, "10⁻⁴"), (1.0, "1")] {
            assert_eq!(exact(value), text);
        }
        for (value, text) in [(0.3, "30 %"), (0.03, "3 %"), (0.003, "0.3 %"), (1e-4, "0.01 %")] {
            assert_eq!(exact_percent(value), text);
        }
    }
}
