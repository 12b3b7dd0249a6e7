//! The reference: the independent `f64` oracle with its standard error, cached between studies.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use rayon::prelude::*;

use crate::film::{Attributes, read_picture, write_picture};
use crate::reference;
use crate::reference::probe::Probe;
use crate::scene::{FilmSize, Scene};
use crate::study::verify;
use crate::study::verify::blocks::Grid;
use crate::study::verify::tails::Tails;

/// Probes per pixel.
const PROBES: u64 = 32;

/// Means and their standard errors.
type Known = (Vec<[f64; 3]>, Vec<[f64; 3]>);

/// Part of every name in the cache beside the scene's hash. Increase it whenever the oracle's pictures change.
const REVISION: u32 = 2;

/// The best known estimate of what the picture converges to.
#[derive(Clone, Debug)]
pub struct Truth {
    /// The film.
    pub film: FilmSize,
    /// Mean radiance of each pixel, row by row.
    pub mean: Vec<[f64; 3]>,
    /// The standard error of each value.
    pub stderr: Vec<[f64; 3]>,
    /// Samples per pixel.
    pub spp: u32,
    /// It was read from the cache.
    pub cached: bool,
    /// Silhouette pixels of visible lights. Their noise comes from the high-contrast edge, is the same for every setting and
    /// dominates all other noise: slopes and biases leave them out, errors do not.
    pub silhouettes: Vec<bool>,
    /// Light that samples may have missed.
    pub tails: Arc<Tails>,
    /// The cell of `tails` with the whole picture outside silhouettes.
    pub whole: usize,
}

/// Returns the oracle's picture of `spp` samples per pixel and stores it in `cache`; or returns the best cached one with at
/// least two thirds as many.
pub fn find(scene: &Scene, film: FilmSize, spp: u32, cache: Option<&Path>) -> Truth {
    let stem = cache.map(|folder| {
        let name = format!("{}-r{REVISION}-{}x{}", scene.hash(), film.width, film.height);
        folder.join(name)
    });
    if let Some(found) = stem.as_deref().and_then(|stem| read(scene, stem, film, spp * 2 / 3)) {
        return found;
    }
    let rendered = reference::render_picking(scene, film, spp, 0x5EED);
    if let Some(stem) = stem {
        // A cache that cannot be written costs only time.
        let _ = store(&stem, &rendered);
    }
    Truth::new(scene, film, (rendered.picture, rendered.stderr), spp, false)
}

impl Truth {
    /// Traces probes for the silhouettes and tails.
    fn new(scene: &Scene, film: FilmSize, known: Known, spp: u32, cached: bool) -> Self {
        let probe = Probe::new(scene, film).picking();
        let passes: Vec<_> = (0..PROBES).into_par_iter().map(|pass| probe.pass(pass)).collect();
        let silhouettes = verify::silhouettes::find(scene, &probe, film, &passes);
        let grid = Grid::new(film, &silhouettes);
        let mut tails = Tails::new(grid.clone(), &probe);
        passes.iter().for_each(|found| tails.add(found));
        let (mean, stderr) = known;
        Self {
            film,
            mean,
            stderr,
            spp,
            cached,
            silhouettes,
            tails: Arc::new(tails),
            whole: grid.blocks(),
        }
    }
}

fn files(stem: &Path, spp: u32) -> [PathBuf; 2] {
    ["", "-stderr"].map(|part| PathBuf::from(format!("{}-{spp}spp{part}.npy", stem.display())))
}

/// The best cached picture with at least that many samples; unreadable files are ignored.
fn read(scene: &Scene, stem: &Path, film: FilmSize, least: u32) -> Option<Truth> {
    let prefix = format!("{}-", stem.file_name()?.to_str()?);
    let spp = std::fs::read_dir(stem.parent()?)
        .ok()?
        .filter_map(|entry| {
            let name = entry.ok()?.file_name().into_string().ok()?;
            name.strip_prefix(&prefix)?.strip_suffix("spp.npy")?.parse::<u32>().ok()
        })
        .filter(|&spp| spp >= least)
        .max()?;
    let [mean, stderr] = files(stem, spp).map(|path| {
        let picture = read_picture(&path).ok()?;
        let sound = (picture.width, picture.height) == (film.width, film.height)
            && picture.pixels.iter().flatten().all(|x| x.is_finite() && *x >= 0.0);
        sound.then(|| picture.pixels.iter().map(|p| p.map(f64::from)).collect())
    });
    Some(Truth::new(scene, film, (mean?, stderr?), spp, true))
}

fn store(stem: &Path, rendered: &reference::Reference) -> Result<(), Box<dyn std::error::Error>> {
    std::fs::create_dir_all(stem.parent().unwrap_or(Path::new(".")))?;
    let [mean, stderr] = files(stem, rendered.spp);
    // The picture is written last: if it exists, its errors exist too.
    write_picture(&stderr, &rendered.to_stderr_picture(), &Attributes::default())?;
    write_picture(&mean, &rendered.to_picture(), &Attributes::default())?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    const FILM: FilmSize = FilmSize { width: 6, height: 4 };

    fn scene() -> Scene {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/tests/two-lights.toml");
        Scene::load(Path::new(path)).unwrap()
    }

    #[test]
    fn the_cache_gives_what_it_got_and_nothing_less() {
        let folder = tempfile::tempdir().unwrap();
        let at = Some(folder.path());
        let first = find(&scene(), FILM, 8, at);
        let again = find(&scene(), FILM, 10, at);
        assert!(!first.cached && again.cached && again.spp == 8);
        for (a, b) in first.mean.iter().flatten().zip(again.mean.iter().flatten()) {
            assert!(
                (a - b).abs() <= 1e-7 * a.abs(),
                "a picture in the cache is rounded to f32"
            );
        }
        assert!(!find(&scene(), FILM, 16, at).cached, "too few samples in the cache");
        // A truncated file is not accepted as a reference.
        for entry in std::fs::read_dir(folder.path()).unwrap() {
            std::fs::write(entry.unwrap().path(), b"cut").unwrap();
        }
        assert!(!find(&scene(), FILM, 8, at).cached);
    }
}
