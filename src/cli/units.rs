//! Parsers of numbers, times, shares and angles, common to all options.

use std::ops::RangeInclusive;

/// The largest seed of a render.
pub const MOST_SEED: u64 = u32::MAX as u64;

/// A year: far longer than any wait, and far below the range of the clock.
const MOST_SECONDS: f64 = 3.2e7;

/// Range of target errors: below it `f32` pictures have no precision, above it there is only noise.
const LEAST_ERROR: f64 = 1e-6;
const MOST_ERROR: f64 = 100.0;

/// Parses a whole number of a range; `what` begins the error, such as "a seed is".
pub fn whole<T: TryFrom<u64>>(
    what: &'static str,
    range: RangeInclusive<u64>,
) -> impl Fn(&str) -> Result<T, String> + Clone + Send + Sync + 'static {
    move |text| {
        let number = text.parse().ok().filter(|number| range.contains(number));
        let number = number.and_then(|number| T::try_from(number).ok());
        number.ok_or_else(|| format!("{what} a whole number from {} to {}", range.start(), range.end()))
    }
}

/// Parses a number of threads.
pub fn threads() -> impl Fn(&str) -> Result<usize, String> + Clone + Send + Sync + 'static {
    whole("threads are", 1..=1024)
}

/// Parses a time in seconds: `10`, `10s`, `5m`, `1h` or `1m30s`.
pub fn time(text: &str) -> Result<f64, String> {
    let refused =
        || "a time is a positive number of seconds, or has units, such as 10, 10s, 5m, 1h or 1m30s".to_owned();
    let bare = text.parse::<f64>().ok();
    let seconds = bare.or_else(|| with_units(text)).ok_or_else(refused)?;
    if seconds > 0.0 && seconds <= MOST_SECONDS {
        Ok(seconds)
    } else {
        Err(refused())
    }
}

/// Parses hours, minutes and seconds, each at most once and in this order.
fn with_units(text: &str) -> Option<f64> {
    let (mut rest, mut sum) = (text, 0.0);
    for (unit, seconds) in [('h', 3600.0), ('m', 60.0), ('s', 1.0)] {
        if let Some((number, after)) = rest.split_once(unit) {
            let digits = number.chars().all(|c| c.is_ascii_digit() || c == '.');
            sum += seconds * number.parse::<f64>().ok().filter(|_| digits)?;
            rest = after;
        }
    }
    (rest.is_empty() && !text.is_empty()).then_some(sum)
}

/// Parses a relative error: `0.02` or `2%`.
pub fn error(text: &str) -> Result<f64, String> {
    let number = match text.strip_suffix('%') {
        Some(percent) => percent.trim_end().parse::<f64>().map(|percent| percent / 100.0),
        None => text.parse::<f64>(),
    };
    match number {
        Ok(number) if (LEAST_ERROR..=MOST_ERROR).contains(&number) => Ok(number),
        _ => Err(format!(
            "an error is a share of the picture's mean from {LEAST_ERROR} to {MOST_ERROR}, such as 0.01 or 1%"
        )),
    }
}

/// Parses a field of view.
pub fn degrees(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(number) if number > 0.0 && number < 180.0 => Ok(number),
        _ => Err("an angle of view is a number of degrees between 0 and 180, such as 40".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_written_in_seconds_or_with_units() {
        for (text, seconds) in [
            ("10", 10.0),
            ("10s", 10.0),
            ("0.5", 0.5),
            ("1.5m", 90.0),
            ("1m30s", 90.0),
            ("1h", 3600.0),
            ("1h1m1s", 3661.0),
        ] {
            assert_eq!(time(text), Ok(seconds), "{text}");
        }
        for text in [
            "", "0", "-1", "s", "10x", "30s1m", "1m30", "nan", "inf", "1e9", "5 m", "+1m", "2h2h",
        ] {
            assert!(time(text).is_err(), "{text}");
        }
    }

    #[test]
    fn errors_are_shares_or_percent() {
        assert_eq!(
            (error("0.02"), error("2%"), error("2 %")),
            (Ok(0.02), Ok(0.02), Ok(0.02))
        );
        for text in ["", "%", "0", "-1%", "nan", "1e9", "2%%"] {
            assert!(error(text).is_err(), "{text}");
        }
    }
}
