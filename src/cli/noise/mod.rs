//! `explain --noise`: the sources of a picture's noise, and the cheapest way to reduce it.
//!
//! Noise is the variance of pixels between renders with different seeds. The map has the picture's own size; the shares of
//! lights and materials (`parts`) and the cost of settings (`prices`) are measured on a smaller film.

mod map;
mod parts;
mod prices;
mod words;

use std::path::{Path, PathBuf};
use std::time::Instant;

use serde::Serialize;

use self::map::Map;
use self::parts::{Part, Parts};
use self::prices::Price;
use super::budget_bar::BudgetBar;
use super::inputs::Inputs;
use super::interrupt::Interrupt;
use super::{CliError, outputs};
use octolux::film::{Picture, check_output};
use octolux::pipeline::{Prepared, Settings, SetupError};
use octolux::run::{Goal, Observer as _, replicates};
use octolux::scene::{FilmSize, Scene};

pub use self::words::lines;

/// Renders with different seeds. Eight determine the variance of a whole picture to a few percent, since every pixel
/// contributes.
const SEEDS: usize = 8;

/// Samples per pixel of each: enough for Sobol points and adaptive sampling to show their advantage.
const SPP: u32 = 16;

/// The longer side of the film for shares and costs.
const SIDE: u32 = 192;

/// The results of `--noise`.
#[derive(Debug, Serialize)]
pub struct Noise {
    /// The map.
    map: PathBuf,
    #[serde(flatten)]
    spread: map::Spread,
    /// Size of the film for the other measurements, and samples per pixel of each of its renders.
    film: [u32; 2],
    spp: u32,
    seeds: usize,
    /// The root of the pixels' mean variance of one such render, over the mean of the picture; and its standard error.
    error: f64,
    error_uncertainty: f64,
    /// Shares; none where passes sample lists of lights.
    lights: Vec<Part>,
    materials: Vec<Part>,
    prices: Vec<Price>,
    seconds: f64,
}

/// Why there is no result.
enum Ended {
    Stopped,
    Setup(SetupError),
    Other(CliError),
}

impl From<SetupError> for Ended {
    fn from(error: SetupError) -> Self {
        Self::Setup(error)
    }
}

/// Measures, and writes the map to `to`; `None` after ctrl-c.
///
/// # Errors
/// A map that cannot be written, a scene that cannot be rendered with these settings, a picture without light or noise.
pub fn measure(path: &Path, scene: &Scene, settings: Settings, to: &Path) -> Result<Option<Noise>, CliError> {
    let to = outputs::of_scene(path, &[to.to_owned()], None, None).pictures.remove(0);
    Inputs::of_scene(scene).are_kept_by([to.as_path()])?;
    check_output(&to).map_err(|error| CliError::bad_path(&error))?;
    let observer = BudgetBar::new("noise", Interrupt::listen(true)?, false);
    let outcome = all(scene, settings, &to, &observer);
    observer.clear();
    match outcome {
        Ok(noise) => Ok(Some(noise)),
        Err(Ended::Stopped) => Ok(None),
        Err(Ended::Setup(error)) => Err(CliError::setup(path, &error)),
        Err(Ended::Other(error)) => Err(error),
    }
}

fn all(scene: &Scene, settings: Settings, to: &Path, observer: &BudgetBar) -> Result<Noise, Ended> {
    let started = Instant::now();
    observer.doing(0.0, "the map");
    let map = Map::measure(&Prepared::new(scene, settings)?, observer)?;
    let Some(spread) = map.spread() else {
        let what = "there is no noise: all seeds make the same picture, or it is black";
        return Err(Ended::Other(CliError::usage(what)));
    };
    map.write(to).map_err(Ended::Other)?;
    let film = shrunk(settings.film);
    let settings = Settings { film, ..settings };
    // Parts only add up to the whole if they sample its lights: lists of many lights differ between parts.
    let lists = Prepared::new(scene, settings)?.lists().is_some();
    let count = if lists { 0 } else { Parts::count(scene) };
    let steps = 1.0 + (SEEDS + count) as f64;
    let (prices, pictures) = prices::measure(scene, settings, &|seed| {
        observer.doing((1.0 + seed as f64) / steps, "what settings cost");
        observer
    })?;
    let shown = replicates::error(&pictures);
    let begins = |part: usize| {
        observer.doing((1.0 + (SEEDS + part) as f64) / steps, "lights and materials");
        observer
    };
    let parts = if lists {
        Parts::default()
    } else {
        Parts::measure(scene, settings, &pictures, &begins)?
    };
    let error = shown.error * (SEEDS as f64).sqrt();
    Ok(Noise {
        map: to.to_owned(),
        spread,
        film: [film.width, film.height],
        spp: SPP,
        seeds: SEEDS,
        error,
        error_uncertainty: error * shown.uncertainty,
        lights: parts.lights,
        materials: parts.materials,
        prices,
        seconds: started.elapsed().as_secs_f64(),
    })
}

/// The film with its longer side reduced to [`SIDE`].
fn shrunk(FilmSize { width, height }: FilmSize) -> FilmSize {
    let scale = f64::from(SIDE.min(width.max(height))) / f64::from(width.max(height));
    let side = |side: u32| ((f64::from(side) * scale).round() as u32).max(1);
    FilmSize {
        width: side(width),
        height: side(height),
    }
}

/// One of the renders with different seeds, and its time in seconds.
fn render(prepared: &Prepared, goal: Goal, seed: usize, observer: &BudgetBar) -> Result<(Picture, f64), Ended> {
    let seed = replicates::seed(prepared.settings().seed, seed);
    let mut run = prepared.with_seed(seed).start(goal);
    let _ = run.run(observer);
    match run.failure() {
        Some(error) => Err(SetupError::Embree(error.clone()).into()),
        None if !run.is_complete() => Err(Ended::Stopped),
        None => Ok((run.picture(), run.render_time().as_secs_f64())),
    }
}
