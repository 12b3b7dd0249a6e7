//! `octolux reference`: the picture of the independent oracle, with its standard errors.

use std::path::{Path, PathBuf};
use std::time::Instant;

use indicatif::{ProgressBar, ProgressStyle};
use rayon::ThreadPoolBuilder;

use super::inputs::{Inputs, keeps_checkpoints};
use super::reading::LoadOptions;
use super::{CliError, Exit, options, outputs, report, units};
use octolux::film::{Attributes, Picture, Value, check_output, write_picture};
use octolux::reference::{Reference, render};
use octolux::run::MOST_SPP;
use octolux::scene::{FilmSize, Scene};
use octolux::study::error::NotFinite;

/// Render a scene with the independent f64 oracle: a picture and the standard error of every pixel
#[derive(clap::Args)]
pub struct Args {
    /// The scene file
    #[arg(value_name = "SCENE")]
    pub scene: PathBuf,
    /// Where the picture goes: .exr or .npy. {name} stands for the scene's name
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
    /// Where the picture of standard errors goes [default: NAME_stderr beside the picture]
    #[arg(long, value_name = "FILE")]
    pub stderr: Option<PathBuf>,
    /// Samples of every pixel, at least 2
    #[arg(long, value_name = "N", default_value_t = 256, value_parser = units::whole::<u32>("samples of every pixel are", 2..=MOST_SPP.into()),
          allow_negative_numbers = true)]
    pub spp: u32,
    /// The seed of every random number
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = units::whole::<u64>("a seed is", 0..=u64::MAX),
          allow_negative_numbers = true)]
    pub seed: u64,
    /// The size of the picture in pixels [default: the scene's]
    #[arg(long, value_name = "WxH", value_parser = options::size, allow_hyphen_values = true)]
    pub size: Option<FilmSize>,
    /// Threads, 1 to 1024; the picture is the same with any number [default: as many as the machine offers]
    #[arg(long, value_name = "N", value_parser = units::threads(), allow_negative_numbers = true)]
    pub threads: Option<usize>,
    /// No progress and no summary
    #[arg(short, long)]
    pub quiet: bool,
    #[command(flatten)]
    pub reading: LoadOptions,
}

/// Renders the scene and writes both pictures. Progress (on a terminal) and a summary in one line go to standard
/// error.
///
/// # Errors
/// A scene that cannot be loaded; pictures that cannot be written, which is checked before the render.
pub fn run(args: &Args) -> Result<Exit, CliError> {
    let output = &outputs::of_picture(&args.scene, &args.output)?;
    let stderr_path = args.stderr.as_ref().map(|path| outputs::of_picture(&args.scene, path));
    let stderr_path = stderr_path.unwrap_or_else(|| Ok(stderr_beside(output)))?;
    if stderr_path == *output {
        return Err(CliError::usage("--stderr and --output name the same file"));
    }
    for path in [output, &stderr_path] {
        keeps_radiance(path)?;
        check_output(path).map_err(|error| CliError::bad_path(&error))?;
        keeps_checkpoints(path)?;
    }
    let scene = args.reading.load(&args.scene)?;
    Inputs::of_scene(&scene).are_kept_by([output.as_path(), &stderr_path])?;
    options::check_size(args.size)?;
    let film = args.size.unwrap_or(scene.film());
    // 0 means as many as the machine has.
    let threads = ThreadPoolBuilder::new().num_threads(args.threads.unwrap_or(0)).build();
    let threads = threads.map_err(|error| CliError::failed(format!("cannot start the threads: {error}")))?;
    let bar = progress_bar(
        args.quiet,
        u64::from(film.width) * u64::from(film.height) * u64::from(args.spp),
    );
    let start = Instant::now();
    let result = threads.install(|| render(&scene, film, args.spp, args.seed, &|done| bar.set_position(done)));
    let seconds = start.elapsed().as_secs_f64();
    bar.finish_and_clear();
    let pictures = [
        (output, result.to_picture(), "mean radiance"),
        (&stderr_path, result.to_stderr_picture(), "standard error of the mean"),
    ];
    for (path, picture, content) in &pictures {
        sound(path, picture, content)?;
    }
    for (path, picture, content) in &pictures {
        write_picture(path, picture, &attributes(args, &scene, content))?;
    }
    if !args.quiet {
        report::print(&summary(&result, seconds));
    }
    Ok(Exit::Well)
}

/// Checks that a file can hold what the oracle is for: numbers to compare with.
fn keeps_radiance(path: &Path) -> Result<(), CliError> {
    if !path
        .extension()
        .is_some_and(|ending| ending.eq_ignore_ascii_case("png"))
    {
        return Ok(());
    }
    let what = format!(
        "{}: a PNG does not keep radiances, and no picture can be compared with it",
        path.display()
    );
    Err(CliError::usage(what).with_help("write .exr or .npy; to look at a scene there is octolux render -o FILE.png"))
}

/// Rejects a picture with NaN or infinite values: it would be used as the truth.
fn sound(path: &Path, picture: &Picture, content: &str) -> Result<(), CliError> {
    NotFinite::find(&picture.pixels, picture.width).map_or(Ok(()), |wrong| {
        let what = format!("{}: not written: {content}: {wrong}", path.display());
        Err(CliError::failed(what).with_help(
            "this is a fault of Octolux's oracle, or radiance beyond what f32 holds; please report the scene",
        ))
    })
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

/// `indicatif` draws on terminals only.
fn progress_bar(quiet: bool, samples: u64) -> ProgressBar {
    if quiet {
        return ProgressBar::hidden();
    }
    let bar = ProgressBar::new(samples);
    if let Ok(style) = ProgressStyle::with_template("reference [{wide_bar}] {percent} %, {eta} left") {
        bar.set_style(style.progress_chars("##-"));
    }
    bar
}

fn attributes(args: &Args, scene: &Scene, content: &str) -> Attributes {
    let settings = vec![
        ("scene", Value::Text(scene.name().to_owned())),
        (
            "program",
            Value::Text(format!("octolux {} reference", env!("CARGO_PKG_VERSION"))),
        ),
        ("content", Value::Text(content.into())),
        ("spp", Value::Number(f64::from(args.spp))),
        ("seed", Value::Text(args.seed.to_string())),
    ];
    Attributes::new(settings)
}

fn summary(result: &Reference, seconds: f64) -> String {
    format!(
        "{}x{}, {} spp: mean {:.6}, median relative standard error {:.2} %, {seconds:.1} s\n",
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
    fn a_picture_without_numbers_is_not_written() {
        let mut picture = Picture {
            width: 2,
            height: 1,
            pixels: vec![[0.0; 3], [1.0; 3]],
        };
        assert!(sound(Path::new("x.npy"), &picture, "mean").is_ok());
        picture.pixels[1][2] = f32::NAN;
        let error = sound(Path::new("x.npy"), &picture, "mean").unwrap_err();
        assert_eq!(error.exit(), Exit::Failed);
        let expected = "x.npy: not written: mean: 1 of its values are NaN or infinite, the first of them in pixel 1,0";
        assert_eq!(error.to_string(), expected);
    }

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
}
