//! `octolux verify`: verification of the user's own scene.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use super::budget_bar::BudgetBar;
use super::inputs::{Inputs, keeps_checkpoints};
use super::interrupt::Interrupt;
use super::reading::LoadOptions;
use super::verify_report::{self, Circumstances};
use super::{CliError, Exit, outputs, report, units};
use octolux::film::{Attributes, Value, replace, write_picture};
use octolux::scene::Scene;
use octolux::study::verify::{self, Options, Report, Verdict, VerifyError};

const EXAMPLES: &str = "\
What is checked:
  the scene     energy gain, lights without power, emitters inside out
  bits          1, 8 and 16 lanes through both intersectors, kernels with every
                effect, 1 to 3 threads, pictures shown on the way: the same bits
  intersectors  Embree and brute force hit the same, sample by sample
  ties          faces that coincide or touch: which of them a ray hits is not
                defined, so they are named, and are no fault
  means         estimators, samplers, seeds and numbers of samples agree with
                each other and with the independent f64 oracle

Verdicts: pass; note and warn (worth a look); no power (nothing is wrong, but
the budget was too small to see it; the bound says what would be seen); FAIL.
On a scene without fault, a row of means fails in 1 of 10000 runs at most.

Examples:
  octolux verify scene.toml
      a minute of checks, and a table
  octolux verify scene.toml --budget 600 --stats proof.json -o proof
      ten minutes, every figure in proof.json; pictures of what fails in proof/

Exit codes: 0 nothing failed, 1 something failed, 2 bad usage or a bad scene,
130 interrupted.";

/// Check on a scene that lanes, threads, estimators and the oracle agree
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// The scene file
    #[arg(value_name = "SCENE")]
    scene: PathBuf,
    /// Time to spend, to within about a tenth, such as 60s or 5m; small budgets see large faults only
    #[arg(long, value_name = "TIME", default_value = "60s", value_parser = units::time, allow_negative_numbers = true)]
    budget: f64,
    /// A folder for what fails: both pictures (.exr) and their difference in standard errors (.png, blue where the
    /// first is darker, red where it is brighter); nothing is written if nothing fails
    #[arg(short, long = "output", value_name = "DIR")]
    output: Option<PathBuf>,
    /// Write every figure and its circumstances to this .json file
    #[arg(long, value_name = "FILE")]
    stats: Option<PathBuf>,
    /// Print the same on standard output instead of the table
    #[arg(long)]
    json: bool,
    /// Seed of every random number, 0 to 4294967295
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = units::whole::<u32>("a seed is", 0..=units::MOST_SEED),
          allow_negative_numbers = true)]
    seed: u32,
    /// Threads, 1 to 1024 [default: as many as the machine offers]
    #[arg(long, value_name = "N", value_parser = units::threads(), allow_negative_numbers = true)]
    threads: Option<usize>,
    /// No progress, and nothing but errors on standard error; the table is printed all the same
    #[arg(short, long)]
    quiet: bool,
    #[command(flatten)]
    reading: LoadOptions,
}

/// Verifies and prints the table on standard output.
///
/// # Errors
/// A scene that cannot be loaded or rendered; files that cannot be written.
pub fn run(args: &Args) -> Result<Exit, CliError> {
    check_targets(args)?;
    let interrupt = Interrupt::listen(true)?;
    let scene = interrupt.loading(|| args.reading.load(&args.scene))?;
    keeps_inputs(args, &scene)?;
    let options = Options {
        budget: args.budget,
        threads: args.threads.unwrap_or_else(octolux::pipeline::all_threads),
        seed: args.seed,
    };
    let observer = BudgetBar::new("verify", interrupt, args.quiet);
    let outcome = verify::run(&scene, options, &observer);
    observer.clear();
    let result = match outcome {
        Ok(result) => result,
        Err(VerifyError::Stopped) => {
            if !args.quiet {
                report::note(&format!("{}: stopped before the verdicts", args.scene.display()));
            }
            return Ok(Exit::Interrupted);
        }
        Err(VerifyError::Setup(error)) => return Err(CliError::setup(&args.scene, &error)),
        Err(error @ (VerifyError::Threads(_) | VerifyError::NotFinite { .. })) => {
            return Err(CliError::failed(format!("{}: {error}", args.scene.display())));
        }
    };
    let circumstances = Circumstances::new(&args.scene, &scene, options, &result);
    report::data(&if args.json {
        circumstances.json()?
    } else {
        verify_report::table(&args.scene, options, &result)
    })?;
    if let Some(path) = &args.stats {
        let json = circumstances.pretty()?;
        replace::replace(path, |file| io::Write::write_all(file, json.as_bytes()))?;
    }
    if let Some(folder) = &args.output {
        write_evidence(folder, &args.scene, &result, args.quiet)?;
    }
    let failed = result.count(Verdict::Fail) > 0;
    Ok(if failed { Exit::Failed } else { Exit::Well })
}

/// Check outputs before the work, not after it.
fn check_targets(args: &Args) -> Result<(), CliError> {
    if let Some(path) = &args.stats {
        outputs::stats_ending(path)?;
        outputs::without_placeholder(path)?;
        replace::check(path).map_err(|error| CliError::bad_path(&error))?;
    }
    if let Some(folder) = &args.output {
        if folder.is_dir() {
            replace::check(&folder.join("z.png")).map_err(|error| CliError::bad_path(&error))?;
        } else if folder.exists() {
            return Err(CliError::usage(format!(
                "{}: is a file, not a folder",
                folder.display()
            )));
        } else {
            // The folder is created only after a failure; check whether its parent is writable.
            replace::check(folder).map_err(|error| CliError::bad_path(&error))?;
        }
    }
    Ok(())
}

/// Failures are known only afterwards, so no input may have the name of a possible evidence file.
fn keeps_inputs(args: &Args, scene: &Scene) -> Result<(), CliError> {
    let inputs = Inputs::of_scene(scene);
    inputs.are_kept_by(args.stats.as_deref())?;
    args.stats.as_deref().map_or(Ok(()), keeps_checkpoints)?;
    let Some(folder) = &args.output else {
        return Ok(());
    };
    let evidence = |name: &str| {
        let bytes = name.as_bytes();
        let numbered = bytes.iter().take_while(|byte| byte.is_ascii_digit()).count() >= 2;
        numbered && (name.ends_with(".exr") || name.ends_with(".png"))
    };
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        if evidence(&entry.file_name().to_string_lossy()) {
            inputs.are_kept_by([entry.path().as_path()])?;
        }
    }
    Ok(())
}

/// `3-light-mis_light.exr`, `_mis.exr` and `_z.png` for row 3.
fn write_evidence(folder: &Path, scene: &Path, result: &Report, quiet: bool) -> Result<(), CliError> {
    let mut written = Vec::new();
    for (number, row) in (1..).zip(&result.rows) {
        let Some(evidence) = &row.evidence else {
            continue;
        };
        fs::create_dir_all(folder).map_err(|error| CliError::failed(format!("{}: {error}", folder.display())))?;
        let attributes = Attributes::new([
            ("scene", Value::Text(scene.display().to_string())),
            ("check", Value::Text(format!("{}: {}", row.check, row.compared))),
        ]);
        let [a, b] = &evidence.names;
        let stem = format!("{number:02}-{a}-{b}");
        let [first, second] = &evidence.pictures;
        for (picture, ending) in [
            (first, format!("{a}.exr")),
            (second, format!("{b}.exr")),
            (&evidence.z, "z.png".into()),
        ] {
            let path = folder.join(format!("{stem}_{ending}"));
            write_picture(&path, picture, &attributes)?;
            written.push(path);
        }
    }
    if !quiet && !written.is_empty() {
        report::print(&format!("wrote {} pictures into {}\n", written.len(), folder.display()));
    }
    Ok(())
}
