//! Scenes and renders for self-test cases: parts of scenes, pictures, means with their errors.

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

/// An error that stops a case.
pub type SelftestError = Box<dyn Error + Send + Sync>;

/// Both intersectors.
pub const ACCELS: [AccelKind; 2] = [AccelKind::Linear, AccelKind::Embree];

/// Accepted deviation of a mean, in standard errors. One in 26 million exceeds it by chance, and seeds are fixed: a test that
/// passes once passes forever. With twice the samples that a test at 4 standard errors would take, it detects smaller faults
/// than that test.
pub const SIGMAS: f64 = 5.5;

/// The scene of a file.
///
/// # Errors
/// As for [`Scene::parse`].
pub fn scene(text: &str) -> Result<Scene, SelftestError> {
    Ok(Scene::parse(text, Path::new("selftest.toml"))?)
}

/// A camera with a film of 32 x 32 pixels, and an otherwise empty scene.
pub fn view(origin: impl Into<DVec3>, target: impl Into<DVec3>, fov: f64) -> SceneBuilder {
    let film = FilmSize { width: 32, height: 32 };
    Scene::builder(Camera::new(origin, target, Fov::X(fov)), film)
}

/// The material of the plate of [`test_point`].
pub const PLATE: MaterialId = MaterialId::new(0);

/// A test point on a plate in the plane y = 0 of reflectance 0.5: every pixel shows the origin, from a distance of 4.24.
pub fn test_point() -> SceneBuilder {
    let mut scene = view([-3.0, 3.0, 0.0], [0.0; 3], 0.001);
    scene.material(Material::diffuse("plate", [0.5; 3]));
    let corners = [[-1.0, 0.0, 1.0], [1.0, 0.0, 1.0], [1.0, 0.0, -1.0], [-1.0, 0.0, -1.0]];
    scene.mesh(Mesh::quadrilateral(corners, PLATE));
    scene
}

/// The test point under spheres.
///
/// # Errors
/// Where a sphere is invalid.
pub fn lit(lights: &[Sphere]) -> Result<Scene, InvalidScene> {
    let mut scene = test_point();
    scene.spheres.extend_from_slice(lights);
    scene.build()
}

/// An emitting sphere.
pub fn light(center: [f64; 3], radius: f64, radiance: f64) -> Sphere {
    Sphere::new(center, radius, Surface::emission([radiance; 3]))
}

/// Independent random numbers, one thread, the widest lanes.
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

/// A run of the given passes.
///
/// # Errors
/// Where the scene cannot be rendered with these settings.
pub fn render(scene: &Scene, settings: Settings, passes: u32) -> Result<Run, SelftestError> {
    Ok(Prepared::new(scene, settings)?.passes(passes).finish())
}

/// The picture after the given passes.
///
/// # Errors
/// As for [`render`].
pub fn picture(scene: &Scene, settings: Settings, passes: u32) -> Result<Picture, SelftestError> {
    Ok(render(scene, settings, passes)?.picture())
}

/// Contributions that a run rejected as invalid.
pub fn invalid(run: &Run) -> usize {
    let counters = run.counters();
    (counters.invalid_nan + counters.invalid_inf + counters.invalid_negative) as usize
}

/// The mean of the green channel over pixels that all show the same.
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

/// The scene, scaled by `scale` about 0 and then moved by `offset`.
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
