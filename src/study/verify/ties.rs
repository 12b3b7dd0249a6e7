//! Distinguishes ties from faults: where faces touch or coincide, the scene does not determine which one a ray hits.

use std::collections::BTreeMap;

use glam::DVec3;
use rayon::prelude::*;

use super::bench::Bench;
use super::blocks::Grid;
use super::error::VerifyError;
use super::lights::{mesh_name, sphere_name};
use super::row::{Row, Verdict};
use super::sanity::{list, plural};
use crate::pipeline::{self, Prepared, Settings};
use crate::reference::ties::{Segment, Tie, Ties};
use crate::scene::{FilmSize, Scene};
use crate::settings::Lanes;

/// Samples per pixel that are checked for coincident faces.
const PROBES: u64 = 4;

/// Number of differing pixels that are replayed: all of them have to be ties.
const REPLAYED: usize = 200;

/// Number of ties by pair of bodies.
pub type Counts = BTreeMap<Tie, usize>;

/// The names of the two bodies of a tie, as in the file.
fn names(scene: &Scene, Tie(a, b): Tie) -> String {
    let name = |body: usize| match body.checked_sub(scene.spheres().len()) {
        None => sphere_name(body),
        Some(mesh) => mesh_name(mesh),
    };
    if a == b {
        format!("edges of {}", name(a))
    } else {
        format!("{} and {}", name(a), name(b))
    }
}

/// The bodies that tie most often.
pub fn worst(scene: &Scene, counts: &Counts) -> String {
    let mut all: Vec<_> = counts.iter().collect();
    all.sort_by_key(|(tie, count)| (std::cmp::Reverse(**count), **tie));
    list(&all.iter().map(|(tie, _)| names(scene, **tie)).collect::<Vec<_>>())
}

/// Pixels that depend on coincident faces, and these faces.
pub fn pixels(scene: &Scene, film: FilmSize, seed: u64) -> (Vec<bool>, Counts) {
    let ties = Ties::new(scene, film);
    let count = film.width as usize * film.height as usize;
    let found: Vec<Option<Tie>> = (0..count)
        .into_par_iter()
        .map(|pixel| (0..PROBES).find_map(|probe| ties.of_pixel(pixel, seed << 8 | probe)))
        .collect();
    let mut counts = Counts::new();
    for &tie in found.iter().flatten() {
        *counts.entry(tie).or_default() += 1;
    }
    (found.iter().map(Option::is_some).collect(), counts)
}

/// Reports what was left out of the means, and why.
pub fn row(scene: &Scene, grid: &Grid, counts: &Counts) -> Row {
    let left_out = grid.pixels(grid.left_out());
    let all = left_out + grid.pixels(grid.blocks()) + grid.pixels(grid.silhouettes());
    let row = Row::pass("ties", plural(all as usize, "pixel"))
        .figures(format!("{left_out} left out"), "0")
        .number("left_out", left_out);
    if counts.is_empty() {
        return row;
    }
    let what = format!(
        "{}: faces lie in one another, and which of them a ray meets is not defined; the means leave out the pixels that depend on it",
        worst(scene, counts)
    );
    row.judged(Verdict::Warn, what)
}

/// Pixels that differ between two renders, replayed ray by ray.
#[derive(Clone, Debug, Default)]
pub struct Explained {
    /// The bodies that tie there.
    pub counts: Counts,
    /// Pixels not explained by a tie.
    pub unexplained: usize,
}

impl Explained {
    /// Adds another result.
    pub fn add(&mut self, other: Self) {
        self.unexplained += other.unexplained;
        for (tie, count) in other.counts {
            *self.counts.entry(tie).or_default() += count;
        }
    }
}

/// Looks for ties in the samples of pixels that differ between renders with these settings after the given number of passes. Uses scalar
/// kernels, whose rays equal those of all widths up to the tie.
///
/// # Errors
/// Where a render cannot start.
pub fn explain(
    bench: &Bench<'_>,
    settings: [Settings; 2],
    differing: &[usize],
    passes: u32,
) -> Result<Explained, VerifyError> {
    let mut explained = Explained::default();
    if differing.is_empty() {
        return Ok(explained);
    }
    let film = settings[0].film;
    let ties = Ties::new(bench.scene, film);
    // Without culling every ray is traced, and so recorded.
    let prepared = settings.map(|settings| {
        let settings = Settings {
            lanes: Some(Lanes::One),
            threads: 1,
            cull: false,
            ..settings
        };
        Prepared::new(bench.scene, settings)
    });
    let [first, second] = prepared;
    let prepared = [first?, second?];
    let step = differing.len().div_ceil(REPLAYED);
    for &pixel in differing.iter().step_by(step) {
        bench.announce("ties")?;
        let (x, y) = (pixel as u32 % film.width, pixel as u32 / film.width);
        let samples = (0..passes).flat_map(|pass| prepared.iter().map(move |one| (pass, one)));
        let tie = samples.into_iter().find_map(|(pass, one)| {
            let replay = one.replay([x, y, pass]).ok().flatten()?;
            let eye = segment(replay.origin, replay.direction, f32::INFINITY);
            let onward: Vec<Segment> = replay.rays.iter().map(of_pipeline).collect();
            ties.of_sample(eye, &onward)
        });
        match tie {
            Some(tie) => *explained.counts.entry(tie).or_default() += 1,
            None => explained.unexplained += 1,
        }
    }
    Ok(explained)
}

fn of_pipeline(segment: &pipeline::Segment) -> Segment {
    self::segment(segment.origin, segment.direction, segment.tfar)
}

fn segment(origin: [f32; 3], direction: [f32; 3], end: f32) -> Segment {
    let wide = |v: [f32; 3]| DVec3::from_array(v.map(f64::from));
    Segment {
        origin: wide(origin),
        direction: wide(direction),
        end: f64::from(end),
    }
}
