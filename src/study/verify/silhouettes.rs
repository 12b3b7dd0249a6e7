//! Pixels that show the edge of an emitter.

use crate::reference::probe::{Found, Probe, Way};
use crate::scene::{FilmSize, Scene, Surface};

/// Finds silhouettes from passes of the probe: pixels in whose 3 x 3 neighbourhood camera rays met
/// different emitted radiance. Also the pixels around the centre of each emitting sphere, which may be too small for a probe to hit.
pub fn find(scene: &Scene, probe: &Probe<'_>, film: FilmSize, passes: &[Vec<Found>]) -> Vec<bool> {
    let (width, height) = (film.width as usize, film.height as usize);
    let mut extremes = vec![(f64::INFINITY, 0.0_f64); width * height];
    for pass in passes {
        let mut seen = vec![0.0; width * height];
        for event in pass.iter().filter(|event| event.way == Way::Seen) {
            seen[event.pixel as usize] = event.radiance.iter().sum();
        }
        for (extreme, radiance) in extremes.iter_mut().zip(seen) {
            *extreme = (extreme.0.min(radiance), extreme.1.max(radiance));
        }
    }
    let around = |x: usize, y: usize| {
        let rows = y.saturating_sub(1)..(y + 2).min(height);
        rows.flat_map(move |row| (x.saturating_sub(1)..(x + 2).min(width)).map(move |column| row * width + column))
    };
    let mut silhouettes: Vec<bool> = (0..width * height)
        .map(|i| {
            let reach = around(i % width, i / width).map(|at| extremes[at]);
            let (least, most) = reach.fold((f64::INFINITY, 0.0_f64), |a, b| (a.0.min(b.0), a.1.max(b.1)));
            most > least
        })
        .collect();
    for sphere in scene
        .spheres()
        .iter()
        .filter(|sphere| matches!(sphere.surface, Surface::Emission(_)))
    {
        let Some([x, y]) = probe.project(sphere.center) else {
            continue;
        };
        if (-1.0..=width as f64).contains(&x) && (-1.0..=height as f64).contains(&y) {
            let near = around(
                (x.max(0.0) as usize).min(width - 1),
                (y.max(0.0) as usize).min(height - 1),
            );
            near.for_each(|pixel| silhouettes[pixel] = true);
        }
    }
    silhouettes
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    #[test]
    fn the_edge_is_a_rim_and_the_middle_of_nothing_is_not() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/veach-mis.toml");
        let scene = Scene::load(&path).unwrap();
        let film = FilmSize { width: 96, height: 64 };
        let probe = Probe::new(&scene, film);
        let passes: Vec<_> = (0..8).map(|seed| probe.pass(seed)).collect();
        let silhouettes = find(&scene, &probe, film, &passes);
        let count = silhouettes.iter().filter(|&&rim| rim).count();
        assert!((30..400).contains(&count), "{count}");
        assert!(!silhouettes[0]);
        // The smallest light is a third of a pixel wide.
        let [x, y] = probe.project(scene.spheres()[0].center).unwrap();
        assert!(silhouettes[y as usize * 96 + x as usize]);
    }
}
