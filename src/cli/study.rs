//! `octolux study`: the cost of accuracy.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

use super::budget_bar::BudgetBar;
use super::inputs::{Inputs, keeps_checkpoints};
use super::interrupt::Interrupt;
use super::options::Options;
use super::{CliError, Exit, report};
use octolux::film::replace;
use octolux::scene::{FilmSize, Scene, SceneBuilder};
use octolux::study::cost::statistics::Figure;
use octolux::study::cost::{self, Study, StudyError, warnings};
use octolux::study::page::{self, Circumstances};
use octolux::{about, machine};

const EXAMPLES: &str = "\
What is written into DIR:
  study.html   the report, one file that needs nothing else
  study.csv    every run: setting, seed, samples, seconds, errors
  study.json   every figure of the report, with its interval
  *.svg        the charts of the report

Examples:
  octolux study scene.toml -o study
      a minute of measuring, and a summary on standard error
  octolux study scene.toml --recommend 0.01
      prints the command line that reaches an error of 1 % in the least time

Exit codes: 0 well, 2 bad usage or a bad scene, 1 anything else,
130 interrupted.";

/// Show what accuracy costs in time: a page, every run, and the cheapest command line
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// The scene file
    #[arg(value_name = "SCENE")]
    scene: PathBuf,
    /// A folder for the report; it is made where there is none
    #[arg(short, long = "output", value_name = "DIR", required_unless_present = "recommend")]
    output: Option<PathBuf>,
    /// Time to spend, to within about a tenth, such as 60s or 5m
    #[arg(long, value_name = "TIME", default_value = "60s", value_parser = super::units::time, allow_negative_numbers = true)]
    budget: f64,
    /// Print just the command line that reaches this error in the least time. It means what --target-error of render
    /// means: the root of the mean variance of the pixels over the mean of the picture
    #[arg(long, value_name = "E", value_parser = super::units::error, allow_negative_numbers = true)]
    recommend: Option<f64>,
    #[command(flatten)]
    options: Options,
    /// Render the reference again, and do not keep it
    #[arg(long)]
    no_cache: bool,
    /// Say nothing but errors
    #[arg(short, long)]
    quiet: bool,
}

/// Runs the study, writes the report, and prints the requested results.
///
/// # Errors
/// A scene that cannot be loaded or rendered; files that cannot be written.
pub fn run(args: &Args) -> Result<Exit, CliError> {
    if let Some(folder) = &args.output {
        check_folder(folder)?;
    }
    let load = machine::load();
    let interrupt = Interrupt::listen(true)?;
    let started = Instant::now();
    let scene = interrupt.loading(|| args.options.reading.load(&args.scene))?;
    if let Some(folder) = &args.output {
        let files: Vec<PathBuf> = page::NAMES.iter().map(|name| folder.join(name)).collect();
        Inputs::of_scene(&scene).are_kept_by(files.iter().map(PathBuf::as_path))?;
        files.iter().try_for_each(|file| keeps_checkpoints(file))?;
    }
    let load_s = started.elapsed().as_secs_f64();
    let settings = args.options.settings(&scene)?;
    let scene = SceneBuilder {
        film: settings.film,
        ..scene.to_builder()
    };
    let scene = scene.build().map_err(|error| CliError::change(&error))?;
    let options = cost::Options {
        settings,
        budget: args.budget,
        cache: machine::cache_folder()
            .filter(|_| !args.no_cache)
            .map(|folder| folder.join("references")),
        prices_only: args.output.is_none(),
    };
    let observer = BudgetBar::new("study", interrupt, args.quiet);
    let outcome = cost::run(&scene, &options, &observer);
    observer.clear();
    let mut study = match outcome {
        Ok(study) => study,
        Err(StudyError::Stopped) => {
            if !args.quiet {
                report::note(&format!("{}: stopped before any result", args.scene.display()));
            }
            return Ok(Exit::Interrupted);
        }
        Err(StudyError::Setup(error)) => return Err(CliError::setup(&args.scene, &error)),
        Err(StudyError::Black) => {
            let what = format!("{}: {}", args.scene.display(), StudyError::Black);
            return Err(CliError::usage(what).with_help("give the scene a light that reaches what the camera sees"));
        }
        Err(error @ (StudyError::Threads(_) | StudyError::NotFinite { .. })) => {
            return Err(CliError::failed(format!("{}: {error}", args.scene.display())));
        }
    };
    study.phases.load_s = load_s;
    study.warnings = warnings::of(&study, load);
    if !args.quiet {
        study.warnings.iter().for_each(|warning| report::warning(warning));
    }
    if let Some(folder) = &args.output {
        write(
            folder,
            &study,
            &scene,
            &circumstances(args, &options, study.phases.lanes, load),
        )?;
        if !args.quiet {
            report::print(&page::words::summary(&study, &args.scene));
            report::print(&format!("wrote {}\n", folder.join("study.html").display()));
        }
    }
    if let Some(error) = args.recommend {
        let given = args.options.given(study.cheapest(error).variant.setting);
        let line = format!("{}{given}{}", command(args), study.recommendation(error));
        report::data(&line)?;
        if !args.quiet {
            report::note(&expectation(&study, error, settings.film));
        }
    }
    Ok(Exit::Well)
}

/// The expected time of the recommended command, and equivalent settings. The study may use a smaller film; the time is scaled
/// by the number of pixels.
fn expectation(study: &Study, error: f64, film: FilmSize) -> String {
    let Figure { value, low, high } = study.expected_seconds(error);
    let best = study.cheapest(error);
    let pixels = |[width, height]: [u32; 2]| f64::from(width) * f64::from(height);
    let larger = pixels([film.width, film.height]) / pixels(study.film);
    let [value, low, high] = [value, low, high].map(|s| s * larger);
    let seconds = |s: f64| if s < 10.0 { format!("{s:.2}") } else { format!("{s:.0}") };
    let ties: Vec<&str> = study.ties(error).iter().map(|price| price.label.as_str()).collect();
    let ties = match &ties[..] {
        [] => String::new(),
        some => format!(
            "; {} cannot be told from {} by this budget",
            some.join(", "),
            best.label
        ),
    };
    format!(
        "this is expected to render for {} s on this machine ({} to {}){ties}",
        seconds(value),
        seconds(low),
        seconds(high)
    )
}

/// `octolux render SCENE`, with the scene quoted for the shell if necessary.
fn command(args: &Args) -> String {
    format!("octolux render {}", quoted(&args.scene.to_string_lossy()))
}

fn quoted(text: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "/._-+=:@,%".contains(c);
    if text.chars().all(plain) && !text.starts_with('-') && !text.is_empty() {
        text.to_owned()
    } else {
        format!("'{}'", text.replace('\'', "'\\''"))
    }
}

fn circumstances(args: &Args, options: &cost::Options, lanes: usize, load: Option<f64>) -> Circumstances {
    let words: Vec<String> = std::env::args().skip(1).map(|word| quoted(&word)).collect();
    Circumstances {
        scene: args.scene.to_string_lossy().into_owned(),
        command: format!("octolux {}", words.join(" ")),
        version: about::VERSION.to_owned(),
        commit: about::COMMIT.to_owned(),
        target_features: about::TARGET_FEATURES.to_owned(),
        cpu: machine::cpu(),
        threads: options.settings.threads,
        lanes,
        estimator: options.settings.estimator.name().to_owned(),
        sampler: options.settings.sampler.name().to_owned(),
        budget: options.budget,
        load,
    }
}

/// Check outputs before the work, not after it.
fn check_folder(folder: &Path) -> Result<(), CliError> {
    if folder.exists() && !folder.is_dir() {
        let what = format!("{}: is a file, not a folder", folder.display());
        return Err(CliError::usage(what).with_help("name a folder; it is made where there is none"));
    }
    let probe = if folder.is_dir() {
        folder.join("study.html")
    } else {
        folder.to_owned()
    };
    replace::check(&probe).map_err(|error| CliError::bad_path(&error))
}

fn write(folder: &Path, study: &Study, scene: &Scene, circumstances: &Circumstances) -> Result<(), CliError> {
    fs::create_dir_all(folder).map_err(|error| CliError::failed(format!("{}: {error}", folder.display())))?;
    let files = page::files(study, scene, circumstances).map_err(|error| CliError::failed(error.to_string()))?;
    for (name, text) in files {
        replace::replace(&folder.join(name), |file| file.write_all(text.as_bytes()))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Settings are options of `render`. A value that no setting covers would be missing from every report: new estimators,
    /// samplers and intersectors must appear automatically.
    #[test]
    fn settings_turn_every_value_that_render_offers() {
        use clap::Args as _;
        let settings = octolux::pipeline::Settings {
            film: octolux::scene::FilmSize { width: 8, height: 8 },
            estimator: octolux::scene::EstimatorKind::Mis,
            sampler: octolux::scene::SamplerKind::Sobol,
            seed: 0,
            lanes: Some(octolux::settings::Lanes::Eight),
            threads: 2,
            ..octolux::pipeline::Settings::default()
        };
        // `--robust` only concerns Embree, `--cull` only few shapes.
        let variants = cost::settings::variants(
            settings,
            (octolux::settings::AccelKind::Embree, octolux::settings::Lanes::Eight),
            true,
            3,
        );
        let render = super::super::render::Args::augment_args(clap::Command::new("render"));
        for setting in &cost::settings::SETTINGS {
            let option = render
                .get_arguments()
                .find(|option| option.get_long() == Some(setting.name));
            let option = option.unwrap_or_else(|| panic!("--{} is no option of render", setting.name));
            let turned = |name: &str| variants.iter().any(|v| v.setting == setting.name && v.value == name);
            let offered = match option.get_action().takes_values() {
                true => option.get_possible_values(),
                false => Vec::new(),
            };
            // `auto` stands for one of the others.
            let named = offered.iter().filter(|value| value.get_name() != "auto");
            let left_out: Vec<_> = named.filter(|value| !turned(value.get_name())).collect();
            // The defaults need no options.
            assert_eq!(
                left_out.len(),
                usize::from(!offered.is_empty()),
                "--{}: {left_out:?}",
                setting.name
            );
        }
    }

    #[test]
    fn what_a_shell_would_take_apart_is_quoted() {
        assert_eq!(quoted("scenes/veach-mis.toml"), "scenes/veach-mis.toml");
        assert_eq!(quoted("my scene's.toml"), "'my scene'\\''s.toml'");
        assert_eq!(quoted("-x.toml"), "'-x.toml'");
    }
}
