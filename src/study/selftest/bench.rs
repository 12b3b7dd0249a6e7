//! Scenes and renders for cases: parts of scenes, pictures, means with their errors.

use std::error::Error;
use std::path::Path;
use std::sync::Arc;

use glam::DVec3;

use crate::film::Picture;
use crate::pipeline::{Prepared, Settings};
use crate::run::Run;
use crate::scene::{
    Camera, EstimatorKind, FilmSize, Fov, InvalidScene, Material, MaterialId, Mesh, SamplerKind, Scene, SceneBuilder,
    Sphere, Surface,
};
use crate::settings::AccelKind;
use crate::study::estimate::Estimate;

/// What stops a case.
pub type SelftestError = Box<dyn Error + Send + Sync>;

/// Both who answer rays.
pub const ACCELS: [AccelKind; 2] = [AccelKind::Linear, AccelKind::Embree];

/// Standard errors that a mean may be off. One in 26 million is by chance, and seeds are fixed: what passes once passes for
/// good. With twice the samples that a test at 4 standard errors would take, it sees smaller faults than that one.
pub const SIGMAS: f64 = 5.5;

/// The scene of a file.
///
/// # Errors
/// As for [`Scene::parse`].
pub fn scene(text: &str) -> Result<Scene, SelftestError> {
    Ok(Scene::parse(text, Path::new("selftest.toml"))?)
}

/// A camera with a picture of 32 x 32 pixels, and nothing else.
pub fn view(origin: impl Into<DVec3>, target: impl Into<DVec3>, fov: f64) -> SceneBuilder {
    let film = FilmSize { width: 32, height: 32 };
    Scene::builder(Camera::new(origin, target, Fov::X(fov)), film)
}

/// What the plate of [`test_point`] is made of.
pub const PLATE: MaterialId = MaterialId::new(0);

/// One spot of a plate in the plane y = 0 of reflectance 0.5: every pixel shows its origin, seen from a distance of 4.24.
pub fn test_point() -> SceneBuilder {
    let mut scene = view([-3.0, 3.0, 0.0], [0.0; 3], 0.001);
    scene.material(Material::diffuse("plate", [0.5; 3]));
    let corners = [[-1.0, 0.0, 1.0], [1.0, 0.0, 1.0], [1.0, 0.0, -1.0], [-1.0, 0.0, -1.0]];
    scene.mesh(Mesh::quadrilateral(corners, PLATE));
    scene
}

/// The spot under spheres.
///
/// # Errors
/// Where there can be no such sphere.
pub fn lit(lights: &[Sphere]) -> Result<Scene, InvalidScene> {
    let mut scene = test_point();
    scene.spheres.extend_from_slice(lights);
    scene.build()
}

/// A sphere that emits.
pub fn light(center: [f64; 3], radius: f64, radiance: f64) -> Sphere {
    Sphere::new(center, radius, Surface::emission([radiance; 3]))
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
pub fn render(scene: &Scene, settings: Settings, passes: u32) -> Result<Run, SelftestError> {
    Ok(Prepared::new(scene, settings)?.passes(passes).finish())
}

/// The picture after so many passes.
///
/// # Errors
/// As for [`render`].
pub fn picture(scene: &Scene, settings: Settings, passes: u32) -> Result<Picture, SelftestError> {
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
