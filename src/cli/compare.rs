//! `octolux compare`: the distance between two pictures, and whether noise explains it.

use std::path::{Path, PathBuf};

use serde::Serialize;

use super::inputs::Inputs;
use super::{CliError, Exit, outputs, report};
use octolux::film::{Attributes, Picture, check_output, read_picture, write_picture};
use octolux::study::error::{Errors, Invalid, NotFinite, relmse_of_reference};
use octolux::study::significance::{Measured, Significance, ZScores};

/// Error of picture A against picture B, the reference
#[derive(clap::Args)]
pub struct Args {
    /// The picture to judge: .npy (f32 or f64, height x width x 3) or .exr
    pub a: PathBuf,
    /// The reference
    pub b: PathBuf,
    /// Standard errors of B: adds z-scores and the reference's share of relmse
    #[arg(long, value_name = "FILE")]
    pub stderr: Option<PathBuf>,
    /// Standard errors of A; without them, z-scores take the noise of A for a difference
    #[arg(long, value_name = "FILE")]
    pub stderr_a: Option<PathBuf>,
    /// Write the absolute difference of each value as a picture, .exr, .png or .npy
    #[arg(long, value_name = "FILE")]
    pub diff: Option<PathBuf>,
    /// One JSON object instead of the table
    #[arg(long)]
    pub json: bool,
    /// Exit with 1 if relmse is above X, or if a value is negative (NaN and infinite ones always do)
    #[arg(long, value_name = "X", value_parser = limit, allow_negative_numbers = true)]
    pub max_relmse: Option<f64>,
}

/// The results for two pictures; numbers that are not finite become `null` in JSON.
#[derive(Debug, Serialize)]
struct Comparison {
    a: PathBuf,
    b: PathBuf,
    width: u32,
    height: u32,
    #[serde(flatten)]
    errors: Errors,
    /// `mean(stderr^2 / (r^2 + 1e-4))`, if the reference's standard errors are known.
    relmse_of_reference: Option<f64>,
    /// `relmse - relmse_of_reference`
    relmse_net: Option<f64>,
    /// Present if any standard errors are known.
    significance: Option<Significance>,
    /// Whether all values have the same bits.
    identical: bool,
    /// Whether the z-scores include the noise of both pictures.
    noise_of_both: bool,
}

/// Reads the pictures and prints the comparison on standard output.
///
/// # Errors
/// Wrong usage: a picture that cannot be read, different sizes. Failure: NaN or infinite values (nothing is printed); a relMSE
/// above `--max-relmse` (after printing the comparison).
pub fn run(args: &Args) -> Result<Exit, CliError> {
    let read = |path: &Path| read_picture(path).map_err(|error| CliError::bad_path(&error));
    let optional = |path: &Option<PathBuf>| path.as_deref().map(read).transpose();
    let (a, b) = (read(&args.a)?, read(&args.b)?);
    let (stderr, stderr_a) = (optional(&args.stderr)?, optional(&args.stderr_a)?);
    let others = [
        (Some(&args.b), Some(&b)),
        (args.stderr.as_ref(), stderr.as_ref()),
        (args.stderr_a.as_ref(), stderr_a.as_ref()),
    ];
    for (path, other) in others.into_iter().filter_map(|(path, other)| path.zip(other)) {
        if (other.width, other.height) != (a.width, a.height) {
            let size = |path: &Path, of: &Picture| format!("{} is {}x{}", path.display(), of.width, of.height);
            let what = format!("the sizes differ: {}, {}", size(&args.a, &a), size(path, other));
            return Err(CliError::usage(what));
        }
    }
    let all = [(Some(&args.a), Some(&a))].into_iter().chain(others);
    for (path, picture) in all.filter_map(|(path, picture)| path.zip(picture)) {
        if let Some(wrong) = NotFinite::find(&picture.pixels, picture.width) {
            let what = format!("{}: {wrong}, so there is no error to speak of", path.display());
            return Err(CliError::failed(what));
        }
    }
    if let Some(path) = &args.diff {
        difference(args, path, &a, &b)?;
    }
    let comparison = compare(args, &a, &b, stderr_a.as_ref(), stderr.as_ref());
    report::data(&if args.json {
        json(&comparison)?
    } else {
        table(&comparison)
    })?;
    within_limit(args, &comparison)
}

/// Writes the absolute differences; refuses to overwrite a compared picture.
fn difference(args: &Args, path: &Path, a: &Picture, b: &Picture) -> Result<(), CliError> {
    let read = [
        Some(&args.a),
        Some(&args.b),
        args.stderr.as_ref(),
        args.stderr_a.as_ref(),
    ];
    let read = read.into_iter().flatten().cloned();
    Inputs::of("this comparison", read).are_kept_by([path])?;
    outputs::without_placeholder(path)?;
    check_output(path).map_err(|error| CliError::bad_path(&error))?;
    let pixel = |(a, b): (&[f32; 3], &[f32; 3])| [0, 1, 2].map(|k| (a[k] - b[k]).abs());
    let pixels = a.pixels.iter().zip(&b.pixels).map(pixel).collect();
    let (width, height) = (a.width, a.height);
    let picture = Picture { width, height, pixels };
    Ok(write_picture(path, &picture, &Attributes::default())?)
}

fn compare(
    args: &Args,
    a: &Picture,
    b: &Picture,
    stderr_a: Option<&Picture>,
    stderr_b: Option<&Picture>,
) -> Comparison {
    let errors = Errors::between(&a.pixels, &b.pixels);
    let share = stderr_b.map(|stderr| relmse_of_reference(&b.pixels, &stderr.pixels));
    let measured_a = Measured {
        pixels: &a.pixels,
        stderr: stderr_a.map(|picture| picture.pixels.as_slice()),
    };
    let measured_b = Measured {
        pixels: &b.pixels,
        stderr: stderr_b.map(|picture| picture.pixels.as_slice()),
    };
    let any_noise = stderr_a.is_some() || stderr_b.is_some();
    Comparison {
        a: args.a.clone(),
        b: args.b.clone(),
        width: a.width,
        height: a.height,
        errors,
        relmse_of_reference: share,
        relmse_net: share.map(|share| errors.relmse - share),
        significance: any_noise.then(|| Significance::between(measured_a, measured_b, a.width as usize)),
        identical: a
            .pixels
            .iter()
            .flatten()
            .map(|x| x.to_bits())
            .eq(b.pixels.iter().flatten().map(|x| x.to_bits())),
        noise_of_both: stderr_a.is_some() && stderr_b.is_some(),
    }
}

fn within_limit(args: &Args, comparison: &Comparison) -> Result<Exit, CliError> {
    let Some(limit) = args.max_relmse else {
        return Ok(Exit::Well);
    };
    let errors = &comparison.errors;
    let invalid = errors.invalid.total() + errors.reference_invalid.total();
    if invalid > 0 {
        return Err(CliError::failed(format!(
            "{} negative",
            match invalid {
                1 => "1 value is".to_owned(),
                some => format!("{some} values are"),
            }
        )));
    }
    if errors.relmse > limit {
        return Err(CliError::failed(format!(
            "relmse {:.4e} is above {limit:e}",
            errors.relmse
        )));
    }
    Ok(Exit::Well)
}

fn json(comparison: &Comparison) -> Result<String, CliError> {
    serde_json::to_string_pretty(comparison).map_err(|error| CliError::failed(error.to_string()))
}

fn table(comparison: &Comparison) -> String {
    let Comparison {
        errors, significance, ..
    } = comparison;
    let mut rows = vec![
        (
            "picture",
            format!("{}, {}x{}", comparison.a.display(), comparison.width, comparison.height),
        ),
        ("reference", comparison.b.display().to_string()),
        ("mean", format!("{:.6}", errors.mean)),
        (
            "reference mean",
            format!("{:.6}  ({:+.4} %)", errors.reference_mean, 100.0 * errors.relative),
        ),
        ("rmse", format!("{:.4e}", errors.rmse)),
        ("relmse", format!("{:.4e}", errors.relmse)),
    ];
    if let (Some(share), Some(net)) = (comparison.relmse_of_reference, comparison.relmse_net) {
        rows.push(("", format!("{net:.4e} without the reference's own {share:.4e}")));
    }
    rows.push(("smape", format!("{:.4e}", errors.smape)));
    rows.push(("largest error", format!("{:.4e}", errors.max_abs)));
    rows.push((
        "invalid values",
        format!("{} and {}", invalid(errors.invalid), invalid(errors.reference_invalid)),
    ));
    if let Some(z) = significance {
        let [red, green, blue] = z.z_mean;
        let scores = |s: ZScores| format!("rms {:.3}, max {:.2} of {}", s.rms, s.max, s.count);
        rows.push((
            "z of the mean",
            format!("{red:+.2} {green:+.2} {blue:+.2}  (red green blue)"),
        ));
        rows.push(("z of pixels", scores(z.pixels)));
        if z.pixels.max > 10.0 * z.blocks.max.max(1.0) {
            // The README's comparison has 16777208 here, of a pixel whose radiance is 1e-23.
            let why =
                "where few samples met light, standard errors of pixels are too small: blocks and the mean tell more";
            rows.push(("", why.to_owned()));
        }
        rows.push(("z of 8x8 blocks", scores(z.blocks)));
        rows.push((
            "without noise",
            format!(
                "{} values left out, {} of them differ",
                z.left_out, z.left_out_different
            ),
        ));
        if !comparison.noise_of_both {
            rows.push((
                "",
                "one picture's standard errors are not known: its noise is in the z-scores".into(),
            ));
        }
    }
    if comparison.identical {
        rows.push(("verdict", "the same, bit for bit".to_owned()));
    }
    let lines: Vec<String> = rows.iter().map(|(name, value)| format!("{name:<16} {value}")).collect();
    lines.join("\n")
}

fn invalid(counts: Invalid) -> String {
    match counts.total() {
        0 => "0".into(),
        total => format!(
            "{total} ({} NaN, {} infinite, {} negative)",
            counts.nan, counts.infinite, counts.negative
        ),
    }
}

/// Parses a finite number of 0 or above.
fn limit(text: &str) -> Result<f64, String> {
    text.parse()
        .ok()
        .filter(|limit: &f64| limit.is_finite() && *limit >= 0.0)
        .ok_or("a limit is a number, 0 or above".into())
}
