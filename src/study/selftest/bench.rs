//! Scenes and renders for cases: texts of scenes, pictures, means with their errors.

use std::error::Error;
use std::path::Path;
use std::sync::Arc;

use glam::DVec3;

use crate::film::Picture;
use crate::pipeline::{Prepared, Settings};
use crate::run::Run;
use crate::scene::{EstimatorKind, FilmSize, InvalidScene, SamplerKind, Scene};
use crate::settings::AccelKind;
use crate::study::estimate::Estimate;

/// What stops a case.
pub type Trouble = Box<dyn Error + Send + Sync>;

/// Both who answer rays.
pub const ACCELS: [AccelKind; 2] = [AccelKind::Linear, AccelKind::Embree];

/// Standard errors that a mean may be off. One in 26 million is by chance, and seeds are fixed: what passes once passes for
/// good. With twice the samples that a test at 4 standard errors would take, it sees smaller faults than that one.
pub const SIGMAS: f64 = 5.5;

/// The scene that a text describes.
///
/// # Errors
/// As for [`Scene::parse`].
pub fn scene(text: &str) -> Result<Scene, Trouble> {
    Ok(Scene::parse(text, Path::new("selftest.toml"))?)
}

/// A camera.
pub fn camera(origin: [f64; 3], target: [f64; 3], fov: f64) -> String {
    let up = if origin[0] == target[0] && origin[2] == target[2] {
        [0, 0, 1]
    } else {
        [0, 1, 0]
    };
    format!(
        "[camera]\norigin = {origin:?}\ntarget = {target:?}\nup = {up:?}\nfov_x = {fov:?}\n[film]\nwidth = 32\nheight = 32\n"
    )
}

/// One spot of a plate in the plane y = 0 of reflectance 0.5: every pixel shows its origin, seen from a distance of 4.24.
pub fn spot() -> String {
    camera([-3.0, 3.0, 0.0], [0.0; 3], 0.001)
        + "[materials.plate]\ndiffuse = [0.5, 0.5, 0.5]\n[[meshes]]\nmaterial = \"plate\"\n\
           vertices = [[-1, 0, 1], [1, 0, 1], [1, 0, -1], [-1, 0, -1]]\nfaces = [[0, 1, 2, 3]]\n"
}

/// A sphere that emits.
pub fn light(center: [f64; 3], radius: f64, radiance: f64) -> String {
    format!(
        "[[spheres]]\ncenter = {center:?}\nradius = {radius:?}\nemission = [{radiance:?}, {radiance:?}, {radiance:?}]\n"
    )
}

/// A sphere that reflects, of a material by name.
pub fn ball(center: [f64; 3], radius: f64, material: &str) -> String {
    format!("[[spheres]]\ncenter = {center:?}\nradius = {radius:?}\nmaterial = \"{material}\"\n")
}

/// Independent numbers, one thread, the widest lanes.
pub fn settings(width: u32, height: u32, estimator: EstimatorKind) -> Settings {
    Settings {
        film: FilmSize { width, height },
        estimator,
        sampler: SamplerKind::Independent,
        seed: 1,
        threads: 1,
        ..Settings::default()
    }
}

/// A run of so many passes.
///
/// # Errors
/// Where the scene cannot be rendered so.
pub fn render(scene: &Scene, settings: Settings, passes: u32) -> Result<Run, Trouble> {
    Ok(Prepared::new(scene, settings)?.passes(passes).finish())
}

/// The picture after so many passes.
///
/// # Errors
/// As for [`render`].
pub fn picture(scene: &Scene, settings: Settings, passes: u32) -> Result<Picture, Trouble> {
    Ok(render(scene, settings, passes)?.picture())
}

/// Contributions that a run threw away.
pub fn invalid(run: &Run) -> usize {
    let counters = run.counters();
    (counters.invalid_nan + counters.invalid_inf + counters.invalid_negative) as usize
}

/// The mean of the green of pixels that all show the same.
pub fn mean_of_pixels(picture: &Picture) -> Estimate {
    let green: Vec<f64> = picture.pixels.iter().map(|p| f64::from(p[1])).collect();
    Estimate::of(&green)
}

/// Pixels that differ in any bit.
pub fn differences(a: &Picture, b: &Picture) -> usize {
    let bits = |p: &[f32; 3]| p.map(f32::to_bits);
    let pairs = a.pixels.iter().zip(&b.pixels);
    pairs.filter(|(a, b)| bits(a) != bits(b)).count() + a.pixels.len().abs_diff(b.pixels.len())
}

/// The scene, `scale` times as large about 0 and then moved by `offset`.
///
/// # Errors
/// Where it does not fit into single precision there.
pub fn moved(scene: &Scene, scale: f64, offset: DVec3) -> Result<Scene, InvalidScene> {
    let mut scene = scene.to_builder();
    let change = |place: &mut DVec3| *place = *place * scale + offset;
    for sphere in &mut scene.spheres {
        sphere.radius *= scale;
        change(&mut sphere.center);
    }
    for mesh in &mut scene.meshes {
        Arc::make_mut(mesh).vertices.iter_mut().for_each(change);
    }
    change(&mut scene.camera.origin);
    change(&mut scene.camera.target);
    scene.build()
}
