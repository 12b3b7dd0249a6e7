//! Small scenes for the tests of the oracle.

use glam::DVec3;
use octolux::reference::{Reference, render};
use octolux::scene::{Bsdf, Camera, FilmSize, Fov, Material, MaterialId, Mesh, Scene, SceneBuilder, Sphere, Surface};

/// An eye above the plane z = 0, off every axis.
pub const EYE: DVec3 = DVec3::new(3.0, 1.0, 4.0);
/// A radiance with three different channels.
pub const LE: DVec3 = DVec3::new(2.0, 3.0, 5.0);

/// What reflects in these scenes.
pub const REFLECTS: Surface = Surface::Material(MaterialId::new(0));

/// A scene looked at from `origin` through a very narrow film: one point, in effect.
pub fn scene(origin: DVec3, target: DVec3, bsdf: Bsdf) -> SceneBuilder {
    let camera = Camera {
        up: DVec3::new(0.1, 0.2, 1.0),
        ..Camera::new(origin, target, Fov::X(1e-4))
    };
    let mut scene = Scene::builder(camera, FilmSize { width: 1, height: 1 });
    scene.material(Material::new("m", bsdf));
    scene
}

/// A reflectance with three different channels.
pub fn diffuse() -> Bsdf {
    Bsdf::Diffuse {
        rho: DVec3::new(0.8, 0.5, 0.1),
    }
}

/// A sphere in short.
pub fn sphere(center: DVec3, radius: f64, surface: Surface) -> Sphere {
    Sphere::new(center, radius, surface)
}

/// A square of side `2 half` around `center`, spanned by `right` and `up`.
pub fn quad(center: DVec3, right: DVec3, up: DVec3, half: f64, surface: Surface) -> Mesh {
    let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
    Mesh::quadrilateral(corners.map(|(x, y)| center + half * (x * right + y * up)), surface)
}

/// The square of half-width `half` in the plane z = 0.
pub fn floor(half: f64) -> Mesh {
    quad(DVec3::ZERO, DVec3::X, DVec3::Y, half, REFLECTS)
}

/// The scene in its own film.
pub fn one_pixel(scene: &SceneBuilder, spp: u32) -> Reference {
    let scene = scene.clone().build().unwrap();
    render(&scene, scene.film(), spp, 7, &|_| ())
}

/// The estimate lies within 4.5 of its own standard errors of `expected` (rounding of 1e-6 allowed for estimators
/// without variance, for the film is not quite a point), and these are below `relative` of it.
pub fn expect(scene: &SceneBuilder, spp: u32, expected: DVec3, relative: f64, what: &str) {
    let result = one_pixel(scene, spp);
    for ((x, error), e) in result.picture[0]
        .into_iter()
        .zip(result.stderr[0])
        .zip(expected.to_array())
    {
        assert!(
            (x - e).abs() <= 4.5 * error + 1e-6 * e,
            "{what}: {x} +- {error}, expected {e}"
        );
        assert!(error <= relative * e, "{what}: {x} +- {error} is too coarse a test");
    }
}
