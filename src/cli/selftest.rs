//! `octolux selftest`: the hard cases, each with its figures and bounds.

use std::time::Instant;

use serde::Serialize;

use super::{CliError, Exit, report};
use octolux::study::selftest::{CASES, Case, Check, Effort, prices};
use octolux::study::verify::sanity::plural;
use octolux::{about, machine};

const EXAMPLES: &str = "\
Every case has figures with bounds; a figure passes where it is at most its
bound. The truth is a closed form, quadrature or f64. Cases whose feature does
not exist yet are named, and counted neither as passed nor as failed.
docs/hard-cases.md says what each case is and where its form comes from.

Examples:
  octolux selftest
      all cases, half a minute
  octolux selftest --case 24 --case 1
      these two
  octolux selftest --json | jq '.cases[] | select(.passed == false)'
      what failed
  octolux selftest --prices
      what each robust form costs against the textbook's, and Embree's flag
      (--robust), in time and error

Exit codes: 0 nothing failed, 1 something failed, 2 bad usage.";

/// Measure the hard cases of direct illumination against their bounds
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Only this case, by its number; may be repeated
    #[arg(long = "case", value_name = "N", value_parser = number, allow_negative_numbers = true)]
    cases: Vec<u32>,
    /// Also show the seconds that each case took
    #[arg(long)]
    time: bool,
    /// Print one JSON object instead of a table
    #[arg(long)]
    json: bool,
    /// Instead of the cases: what robust forms cost, in nanoseconds and in error
    #[arg(long, conflicts_with_all = ["cases", "time"])]
    prices: bool,
}

fn number(text: &str) -> Result<u32, String> {
    let last = CASES[CASES.len() - 1].number;
    let known = |number: &u32| CASES.iter().any(|case| case.number == *number);
    text.parse()
        .ok()
        .filter(known)
        .ok_or_else(|| format!("cases are numbered from 1 to {last}"))
}

/// The result of a case.
#[derive(Serialize)]
struct Outcome {
    case: u32,
    name: &'static str,
    passed: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    error: Option<String>,
    seconds: f64,
    checks: Vec<Row>,
}

#[derive(Serialize)]
struct Row {
    #[serde(flatten)]
    check: Check,
    passed: bool,
}

/// All results, with the circumstances.
#[derive(Serialize)]
struct Report<'a> {
    passed: bool,
    cases_passed: usize,
    cases_failed: usize,
    seconds: f64,
    octolux_version: &'static str,
    commit: &'static str,
    target_features: &'static str,
    cpu: String,
    cases: &'a [Outcome],
}

/// Runs the selected cases.
///
/// # Errors
/// If standard output cannot be written to.
pub fn run(args: &Args) -> Result<Exit, CliError> {
    if args.prices {
        let table = prices::measure().map_err(|error| CliError::failed(error.to_string()))?;
        numbers(&table)?;
        report::data(&if args.json { json(&table)? } else { prices::text(&table) })?;
        return Ok(Exit::Well);
    }
    let started = Instant::now();
    let wanted = |case: &&Case| args.cases.is_empty() || args.cases.contains(&case.number);
    let mut outcomes = Vec::new();
    for case in CASES.iter().filter(wanted) {
        let outcome = measure(case);
        if !args.json {
            report::data(&text(&outcome, args.time))?;
        }
        outcomes.push(outcome);
    }
    let passed = outcomes.iter().filter(|outcome| outcome.passed).count();
    let failed = outcomes.len() - passed;
    let seconds = started.elapsed().as_secs_f64();
    report::data(&if args.json {
        json(&Report {
            passed: failed == 0,
            cases_passed: passed,
            cases_failed: failed,
            seconds,
            octolux_version: about::VERSION,
            commit: about::COMMIT,
            target_features: about::TARGET_FEATURES,
            cpu: machine::cpu(),
            cases: &outcomes,
        })?
    } else {
        let failed = if failed > 0 {
            format!(", {failed} FAILED")
        } else {
            String::new()
        };
        let all = plural(outcomes.len(), "case");
        format!("{passed} of {all} passed{failed}, in {seconds:.1} s")
    })?;
    Ok(if failed > 0 { Exit::Failed } else { Exit::Well })
}

fn json(value: &impl Serialize) -> Result<String, CliError> {
    serde_json::to_string(value).map_err(|error| CliError::failed(format!("the figures: {error}")))
}

fn measure(case: &Case) -> Outcome {
    let mut outcome = Outcome {
        case: case.number,
        name: case.name,
        passed: false,
        error: None,
        seconds: 0.0,
        checks: Vec::new(),
    };
    let started = Instant::now();
    match (case.run)(Effort::FULL) {
        Ok(checks) => {
            outcome.passed = !checks.is_empty() && checks.iter().all(Check::passes);
            outcome.checks = checks
                .into_iter()
                .map(|check| Row {
                    passed: check.passes(),
                    check,
                })
                .collect();
        }
        Err(error) => outcome.error = Some(error.to_string()),
    }
    outcome.seconds = started.elapsed().as_secs_f64();
    outcome
}

/// A line for the case, and one for each figure.
fn text(outcome: &Outcome, time: bool) -> String {
    let verdict = if outcome.passed { "pass" } else { "FAIL" };
    let seconds = if time {
        format!(", {:.2} s", outcome.seconds)
    } else {
        String::new()
    };
    let mut lines = vec![format!("{:>2}  {}: {verdict}{seconds}", outcome.case, outcome.name)];
    lines.extend(outcome.error.iter().map(|error| format!("      {error}")));
    lines.extend(outcome.checks.iter().map(|row| {
        let Check {
            measured,
            figure,
            bound,
        } = &row.check;
        let mark = if row.passed { "" } else { "   <-- FAIL" };
        format!(
            "      {:>9}  of at most {:>9}  {measured}{mark}",
            short(*figure),
            short(*bound)
        )
    }));
    lines.join("\n")
}

/// Rejects prices with a NaN.
fn numbers(table: &[prices::Price]) -> Result<(), CliError> {
    let wrong = |row: &&prices::Price| {
        [row.nanoseconds, row.ratio, row.largest, row.rms]
            .iter()
            .any(|x| x.is_nan())
    };
    table.iter().find(wrong).map_or(Ok(()), |row| {
        let what = format!("{}, {}, {}: a figure is no number", row.quantity, row.range, row.form);
        Err(CliError::failed(what).with_help("this is a fault of Octolux, please report it"))
    })
}

/// Formats integers as such, NaN as a word, others with three digits.
fn short(x: f64) -> String {
    if x.is_nan() {
        "no number".to_owned()
    } else if x == x.trunc() && x.abs() < 1e6 {
        format!("{x:.0}")
    } else if (1e-3..1e4).contains(&x.abs()) {
        format!("{x:.4}")
    } else {
        format!("{x:.2e}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_number_fails_and_is_called_so() {
        let price = |largest: f64| prices::Price {
            quantity: "cone",
            form: "robust",
            range: "1".to_owned(),
            nanoseconds: 1.0,
            ratio: 1.0,
            largest,
            rms: 0.0,
        };
        assert!(numbers(&[price(0.0)]).is_ok());
        let error = numbers(&[price(0.0), price(f64::NAN)]).unwrap_err();
        assert_eq!(error.exit(), Exit::Failed);
        assert_eq!(error.to_string(), "cone, 1, robust: a figure is no number");
        assert_eq!(short(f64::NAN), "no number");
        assert!(!Check::new("x", f64::NAN, 1.0).passes());
    }
}
