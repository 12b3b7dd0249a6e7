//! `octolux reference`: the picture that the independent oracle sees, with its standard errors.

use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};

use crate::film::{Attributes, PictureError, Value, check_output, write_picture};
use crate::reference::{Reference, render};
use crate::scene::{FilmSize, Scene};

/// Render a scene with the independent f64 oracle: a picture and the standard error of every pixel
#[derive(Args, Clone, Debug)]
pub struct ReferenceArgs {
    /// The scene file
    pub scene: PathBuf,
    /// Where the picture goes: .exr or .npy
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
    /// Where the picture of standard errors goes [default: NAME_stderr beside the picture]
    #[arg(long, value_name = "FILE")]
    pub stderr: Option<PathBuf>,
    /// Samples of every pixel
    #[arg(long, value_name = "N", default_value_t = 256, value_parser = clap::value_parser!(u32).range(2..))]
    pub spp: u32,
    /// The seed of every random number
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
    /// The size of the picture in pixels [default: the scene's]
    #[arg(long, value_name = "WxH", value_parser = film_size)]
    pub size: Option<FilmSize>,
    /// Threads; the picture is the same with any number [default: one for each core]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub threads: Option<u16>,
    /// No progress and no summary
    #[arg(short, long)]
    pub quiet: bool,
}

/// Why there is no reference picture.
#[derive(Debug, thiserror::Error)]
pub enum ReferenceError {
    /// A picture cannot be written.
    #[error(transparent)]
    Picture(#[from] PictureError),
    /// The system refuses the threads.
    #[error("cannot start the threads: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
}

/// Renders `scene`, which was loaded from `args.scene`, and writes both pictures. Progress (on a terminal) and a
/// summary in one line go to standard error.
///
/// # Errors
/// [`ReferenceError`]; whether the pictures can be written is looked at before the render.
pub fn run(args: &ReferenceArgs, scene: &Scene) -> Result<(), ReferenceError> {
    let stderr_path = args.stderr.clone().unwrap_or_else(|| stderr_beside(&args.output));
    check_output(&args.output)?;
    check_output(&stderr_path)?;
    let film = args.size.unwrap_or(scene.film);
    let threads = rayon::ThreadPoolBuilder::new()
        .num_threads(args.threads.map_or(0, usize::from))
        .build()?;
    let bar = progress_bar(
        args.quiet,
        u64::from(film.width) * u64::from(film.height) * u64::from(args.spp),
    );
    let start = Instant::now();
    let result = threads.install(|| render(scene, film, args.spp, args.seed, &|done| bar.set_position(done)));
    let seconds = start.elapsed().as_secs_f64();
    bar.finish_and_clear();
    write_picture(
        &args.output,
        &result.to_picture(),
        &attributes(args, scene, "mean radiance"),
    )?;
    write_picture(
        &stderr_path,
        &result.to_stderr_picture(),
        &attributes(args, scene, "standard error of the mean"),
    )?;
    if !args.quiet {
        eprintln!("{}", summary(&result, seconds));
    }
    Ok(())
}

/// `out/x.npy` becomes `out/x_stderr.npy`.
fn stderr_beside(picture: &Path) -> PathBuf {
    let mut name = picture.file_stem().unwrap_or_default().to_owned();
    name.push("_stderr");
    if let Some(ending) = picture.extension() {
        name.push(".");
        name.push(ending);
    }
    picture.with_file_name(name)
}

/// `384x256`, both at least 1.
fn film_size(text: &str) -> Result<FilmSize, String> {
    let sides = text
        .split_once(['x', 'X'])
        .and_then(|(w, h)| Some((w.parse().ok()?, h.parse().ok()?)));
    match sides {
        Some((width, height)) if width > 0 && height > 0 => Ok(FilmSize { width, height }),
        _ => Err("a size is two whole numbers above 0, such as 384x256".into()),
    }
}

/// Hidden where nobody watches: `indicatif` draws on terminals only.
fn progress_bar(quiet: bool, samples: u64) -> ProgressBar {
    if quiet {
        return ProgressBar::hidden();
    }
    let style = ProgressStyle::with_template("reference {wide_bar} {percent} % {elapsed} (left {eta})")
        .unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::new(samples).with_style(style)
}

fn attributes(args: &ReferenceArgs, scene: &Scene, content: &str) -> Attributes {
    let settings = vec![
        ("scene", Value::Text(scene.name.clone())),
        (
            "program",
            Value::Text(format!("octolux {} reference", env!("CARGO_PKG_VERSION"))),
        ),
        ("content", Value::Text(content.into())),
        ("spp", Value::Number(f64::from(args.spp))),
        ("seed", Value::Text(args.seed.to_string())),
    ];
    Attributes {
        settings,
        ..Attributes::default()
    }
}

fn summary(result: &Reference, seconds: f64) -> String {
    format!(
        "{}x{}, {} spp: mean {:.6}, median relative standard error {:.2} %, {seconds:.1} s",
        result.width,
        result.height,
        result.spp,
        result.mean(),
        100.0 * result.median_relative_error()
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_standard_errors_stand_beside_the_picture() {
        for (picture, stderr) in [
            ("out/x.npy", "out/x_stderr.npy"),
            ("a.b.exr", "a.b_stderr.exr"),
            ("x", "x_stderr"),
        ] {
            assert_eq!(stderr_beside(Path::new(picture)), Path::new(stderr));
        }
    }

    #[test]
    fn sizes_are_two_numbers_above_zero() {
        assert_eq!(
            film_size("384x256"),
            Ok(FilmSize {
                width: 384,
                height: 256
            })
        );
        for wrong in ["", "384", "384x", "0x5", "-3x5", "3.5x2", "3x4x5", "99999999999x1"] {
            assert!(film_size(wrong).is_err(), "{wrong}");
        }
    }
}
