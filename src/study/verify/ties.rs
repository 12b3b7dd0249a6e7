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
use crate::pipeline::{self, Point, Prepared, Replay, Settings};
use crate::reference::ties::{Segment, Tie, Ties};
use crate::scene::{FilmSize, Scene};
use crate::settings::Lanes;

/// Samples per pixel that are checked for coincident faces.
const PROBES: u64 = 4;

/// Number of differing pixels that are replayed: all of them have to be ties.
const REPLAYED: usize = 200;

/// Shadow rays whose directions differ by at most this in each coordinate are one.
const ONE_DIRECTION: f32 = 1e-5;

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
    /// Pixels whose samples have one point in both renders, where shading turns the last bits of it into more.
    pub rounded: usize,
    /// Pixels not explained.
    pub unexplained: usize,
}

impl Explained {
    /// Adds another result.
    pub fn add(&mut self, other: Self) {
        self.unexplained += other.unexplained;
        self.rounded += other.rounded;
        for (tie, count) in other.counts {
            *self.counts.entry(tie).or_default() += count;
        }
    }
}

/// Why two renders differ in a pixel.
enum Cause {
    Tie(Tie),
    Rounding,
}

/// Looks for the cause in the samples of pixels that differ between renders with these settings after the given number of passes,
/// by more than `tolerance`, relative. Uses scalar kernels, whose rays equal those of all widths up to the tie.
///
/// Renders that only differ in what scalar kernels have in common must have a tie in some sample. Renders by two intersectors are
/// compared sample by sample, and every difference needs its cause.
///
/// # Errors
/// Where a render cannot start.
pub fn explain(
    bench: &Bench<'_>,
    settings: [Settings; 2],
    differing: &[usize],
    passes: u32,
    tolerance: f64,
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
    let intersectors = settings[0].accel != settings[1].accel;
    let step = differing.len().div_ceil(REPLAYED);
    for &pixel in differing.iter().step_by(step) {
        bench.announce("ties")?;
        let (x, y) = (pixel as u32 % film.width, pixel as u32 / film.width);
        let samples = (0..passes).filter_map(|pass| {
            let [a, b] = prepared.each_ref().map(|one| one.replay([x, y, pass]).ok().flatten());
            Some([a?, b?])
        });
        let found = if intersectors {
            of_differences(bench.scene, &ties, samples, tolerance)
        } else {
            let mut tie = samples.flatten().filter_map(|replay| of_replay(&ties, &replay));
            tie.next().map(Cause::Tie)
        };
        match found {
            Some(Cause::Tie(tie)) => *explained.counts.entry(tie).or_default() += 1,
            Some(Cause::Rounding) => explained.rounded += 1,
            None => explained.unexplained += 1,
        }
    }
    Ok(explained)
}

fn of_replay(ties: &Ties<'_>, replay: &Replay) -> Option<Tie> {
    let onward: Vec<Segment> = replay.rays.iter().map(of_pipeline).collect();
    ties.of_sample(camera_ray(replay), &onward)
}

/// The cause of the samples that differ by more than half of `tolerance`: all have one, and there are any.
fn of_differences(
    scene: &Scene,
    ties: &Ties<'_>,
    samples: impl Iterator<Item = [Replay; 2]>,
    tolerance: f64,
) -> Option<Cause> {
    let mut found = None;
    for [a, b] in samples {
        let pairs = a.radiance.iter().zip(&b.radiance);
        if pairs
            .into_iter()
            .all(|(a, b)| (a - b).abs() <= 0.5 * tolerance * a.max(*b))
        {
            continue;
        }
        match (cause(scene, ties, &a, &b, tolerance)?, &found) {
            (Cause::Rounding, Some(_)) => {}
            (cause, _) => found = Some(cause),
        }
    }
    found
}

/// Why a sample differs between two intersectors. They may hit different faces if the camera ray is a tie, unless it is one of faces
/// in one plane of meshes that the scene names: there the rule decides. Shadow rays that are ties may have different answers. Where both hit one face at one point with one normal and reflectance, and the answers to equal
/// shadow rays are equal, the difference is made by shading, which is the same code for both: frames turn about axes whose z
/// changes its sign, sharp lobes amplify roundings. Anything else has no cause.
fn cause(scene: &Scene, ties: &Ties<'_>, a: &Replay, b: &Replay, tolerance: f64) -> Option<Cause> {
    let face = |replay: &Replay| replay.hit.map(|met| (met.geometry, met.primitive));
    if face(a) != face(b) {
        let tie = ties.of_camera_ray(camera_ray(a))?;
        return (!named(scene, tie) || !ties.in_one_plane(camera_ray(a))).then_some(Cause::Tie(tie));
    }
    let (here, there) = (a.point?, b.point?);
    let wide = |v: [f32; 3]| DVec3::from_array(v.map(f64::from));
    let place = |point: &Point| [wide(point.p), wide(point.n)];
    let alike = |(a, b): (&f32, &f32)| f64::from((a - b).abs()) <= tolerance * f64::from(a.max(*b));
    if !ties.one_point(camera_ray(a), place(&here), place(&there)) || !here.rho.iter().zip(&there.rho).all(alike) {
        return None;
    }
    if answers_agree(a, b) {
        return Some(Cause::Rounding);
    }
    let onward: Vec<Segment> = a.rays.iter().chain(&b.rays).map(of_pipeline).collect();
    ties.of_onward(camera_ray(a), &onward).map(Cause::Tie)
}

/// Whether the scene names two bodies as meshes that overlap in one plane.
fn named(scene: &Scene, Tie(a, b): Tie) -> bool {
    let spheres = scene.spheres().len();
    let pair = [a, b].map(|body| body.wrapping_sub(spheres));
    scene.overlapping_meshes().contains(&pair)
}

/// Whether the shadow rays that two replays have in common are occluded in both or in neither.
fn answers_agree(a: &Replay, b: &Replay) -> bool {
    let same = |a: [f32; 3], b: [f32; 3]| a.iter().zip(&b).all(|(a, b)| (a - b).abs() <= ONE_DIRECTION);
    let directions = a.asked.iter().zip(&b.asked);
    let asked = directions.filter_map(|(a, b)| Some([a.found?, b.found?]));
    let mut beside = a.beside.iter().flat_map(|a| b.beside.iter().map(move |b| [a, b]));
    asked
        .into_iter()
        .all(|[a, b]| a.occluded == b.occluded || !same(a.wi, b.wi))
        && beside.all(|[a, b]| a.blocked_by.is_some() == b.blocked_by.is_some() || !same(a.wi, b.wi))
}

fn camera_ray(replay: &Replay) -> Segment {
    segment(replay.origin, replay.direction, f32::INFINITY)
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

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::settings::{AccelKind, EstimatorKind};

    /// A camera above two floors in one plane: every ray to them is a tie, and both intersectors name the first floor. If their
    /// pictures differ all the same, nothing explains it. Packets of two widths have only such rays to be explained by.
    #[test]
    fn a_tie_that_both_intersectors_decide_alike_explains_no_difference() {
        let floor = |half: f64, material: &str| {
            format!(
                "[[meshes]]\nmaterial = \"{material}\"\nfaces = [[0, 1, 2, 3]]\n\
                 vertices = [[-{half}, 0, {half}], [{half}, 0, {half}], [{half}, 0, -{half}], [-{half}, 0, -{half}]]\n"
            )
        };
        let text = "[camera]\norigin = [0.3, 5, 0.2]\ntarget = [0, 0, 0]\nup = [0, 0, 1]\nfov_x = 20\n[film]\nwidth = 4\nheight = 4\n\
                    [materials.a]\ndiffuse = [0.5, 0.5, 0.5]\n[materials.b]\ndiffuse = [0.1, 0.1, 0.1]\n\
                    [[spheres]]\ncenter = [0, 9, 0]\nradius = 1\nemission = [1, 1, 1]\n"
            .to_owned()
            + &floor(8.0, "a")
            + &floor(9.0, "b");
        let scene = Scene::parse(&text, Path::new("scene.toml")).unwrap();
        assert_eq!(scene.overlapping_meshes(), [[0, 1]]);
        let settings = Settings {
            film: scene.film(),
            estimator: EstimatorKind::Mis,
            threads: 1,
            ..Settings::default()
        };
        let by = |accel| Settings {
            accel: Some(accel),
            ..settings
        };
        let (embree, linear) = (by(AccelKind::Embree), by(AccelKind::Linear));
        let bench = Bench::new(&scene, settings, f64::INFINITY, &());
        let all: Vec<usize> = (0..16).collect();
        let found = explain(&bench, [embree, linear], &all, 2, 0.01).unwrap();
        assert_eq!((found.unexplained, found.rounded, found.counts.len()), (16, 0, 0));
        let found = explain(&bench, [embree, embree], &all, 2, 0.0).unwrap();
        assert_eq!((found.unexplained, found.counts[&Tie(1, 2)]), (0, 16));
    }
}
