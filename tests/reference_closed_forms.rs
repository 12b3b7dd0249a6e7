//! The oracle against answers that can be written down.

use std::f64::consts::PI;
use std::sync::atomic::{AtomicU64, Ordering};

use glam::{DMat3, DVec3};
use octolux::reference::{Reference, render};
use octolux::scene::{
    Bsdf, Camera, FilmSize, Fov, Material, Mesh, RenderTable, Scene, Sphere, Surface, Surface::Emission,
};

/// A scene looked at from `origin` through a very narrow film: one point, in effect.
fn scene(origin: DVec3, target: DVec3, bsdf: Bsdf) -> Scene {
    Scene {
        name: "test".into(),
        path: "test.toml".into(),
        camera: Camera {
            origin,
            target,
            up: DVec3::new(0.1, 0.2, 1.0),
            fov: Fov::X(1e-4),
        },
        film: FilmSize { width: 1, height: 1 },
        render: RenderTable::default(),
        materials: vec![Material { name: "m".into(), bsdf }],
        spheres: vec![],
        meshes: vec![],
    }
}

fn diffuse() -> Bsdf {
    Bsdf::Diffuse {
        rho: DVec3::new(0.8, 0.5, 0.1),
    }
}

fn sphere(center: DVec3, radius: f64, surface: Surface) -> Sphere {
    Sphere {
        center,
        radius,
        surface,
    }
}

/// A square of side `2 half` around `center`, spanned by `right` and `up`.
fn quad(center: DVec3, right: DVec3, up: DVec3, half: f64, surface: Surface) -> Mesh {
    let corner = |x: f64, y: f64| center + half * (x * right + y * up);
    Mesh {
        vertices: vec![
            corner(-1.0, -1.0),
            corner(1.0, -1.0),
            corner(1.0, 1.0),
            corner(-1.0, 1.0),
        ],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        normals: None,
        surface,
    }
}

fn floor(half: f64) -> Mesh {
    quad(DVec3::ZERO, DVec3::X, DVec3::Y, half, Surface::Material(0))
}

fn one_pixel(scene: &Scene, spp: u32) -> Reference {
    render(scene, scene.film, spp, 7, &|_| ())
}

/// The estimate lies within 4.5 of its own standard errors of `expected` (rounding of 1e-6 allowed for estimators
/// without variance, for the film is not quite a point), and these are below `relative` of it.
fn expect(scene: &Scene, spp: u32, expected: DVec3, relative: f64, what: &str) {
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

const EYE: DVec3 = DVec3::new(3.0, 1.0, 4.0);
const LE: DVec3 = DVec3::new(2.0, 3.0, 5.0);

/// Irradiance of a sphere wholly above the horizon is exactly pi L (R/D)^2 cos, so L_o = rho L (R/D)^2 cos.
#[test]
fn a_sphere_over_a_diffuse_plane() {
    for (distance, radius, tilt) in [(2.0, 0.5, 0.3_f64), (1.0, 0.9, 0.05), (1e3, 1e-3, 1.2)] {
        let below_the_light = DVec3::new(4.0, 1.0, 0.3);
        let mut scene = scene(below_the_light, DVec3::ZERO, diffuse());
        scene.meshes.push(floor(10.0));
        let center = distance * DVec3::new(-tilt.sin(), 0.0, tilt.cos());
        scene.spheres.push(sphere(center, radius, Emission(LE)));
        let ratio: f64 = radius / distance;
        let expected = DVec3::new(0.8, 0.5, 0.1) * LE * ratio * ratio * tilt.cos();
        expect(
            &scene,
            40_000,
            expected,
            0.01,
            &format!("sphere of {radius} at {distance}"),
        );
    }
}

/// A white furnace: radiance L from everywhere gives rho L. From inside an emitting sphere, off its centre, and from
/// inside an emitting cube.
#[test]
fn inside_an_emitter_a_diffuse_surface_shows_rho() {
    let rho = DVec3::new(0.8, 0.5, 0.1);
    let mut inside_sphere = scene(EYE, DVec3::ZERO, diffuse());
    inside_sphere.meshes.push(floor(1.0));
    inside_sphere
        .spheres
        .push(sphere(DVec3::new(1.0, 2.0, 0.5), 20.0, Emission(LE)));
    expect(&inside_sphere, 20_000, rho * LE, 0.01, "sphere");

    let mut inside_cube = scene(EYE, DVec3::ZERO, diffuse());
    inside_cube.meshes.push(floor(1.0));
    inside_cube.meshes.push(cube(DVec3::new(1.0, 0.5, 0.0), 6.0));
    expect(&inside_cube, 20_000, rho * LE, 0.01, "cube");
}

fn cube(center: DVec3, half: f64) -> Mesh {
    let corner = |i: u32| DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2)) * 2.0 - 1.0;
    let quads = [
        [0, 1, 3, 2],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 3, 7, 6],
        [0, 2, 6, 4],
        [1, 3, 7, 5],
    ];
    Mesh {
        vertices: (0..8).map(|i| center + half * corner(i)).collect(),
        triangles: quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect(),
        normals: None,
        surface: Emission(LE),
    }
}

/// Straight on, the lobe and the foreshortening share their axis: rho L (alpha + 1) times the integral of
/// cos^(alpha + 1), which is 1 / (alpha + 2).
#[test]
fn straight_on_inside_an_emitter_phong_shows_its_albedo() {
    for alpha in [1.5, 10.0, 1e3, 1e6] {
        let rho = DVec3::new(0.3, 0.6, 0.9);
        let mut scene = scene(4.0 * DVec3::Z, DVec3::ZERO, Bsdf::Phong { rho, alpha });
        scene.camera.fov = Fov::X(1e-6);
        scene.meshes.push(floor(1.0));
        scene
            .spheres
            .push(sphere(DVec3::new(1.0, 2.0, 0.5), 20.0, Emission(LE)));
        expect(
            &scene,
            20_000,
            rho * LE * (alpha + 1.0) / (alpha + 2.0),
            0.01,
            &format!("alpha {alpha}"),
        );
    }
}

/// A square light of half-width h, parallel to the plane at distance d: its form factor from a point below its middle
/// is 4 / (pi) * 2 * h/(2 s) * atan(h/s), s = sqrt(h^2 + d^2) (four times the corner formula of Howell's catalogue,
/// B-3). Seen from its front or its back, as both emit.
#[test]
fn a_square_light_has_its_form_factor_from_both_sides() {
    let (h, d) = (0.7_f64, 1.1_f64);
    let s = h.hypot(d);
    let form_factor = 4.0 / PI * (h / s) * (h / s).atan();
    for up in [DVec3::Y, -DVec3::Y] {
        let mut scene = scene(EYE, DVec3::ZERO, diffuse());
        scene.meshes.push(floor(10.0));
        scene.meshes.push(quad(d * DVec3::Z, DVec3::X, up, h, Emission(LE)));
        scene.camera.origin = DVec3::new(4.0, 0.0, 1.0);
        expect(
            &scene,
            40_000,
            DVec3::new(0.8, 0.5, 0.1) * LE * form_factor,
            0.01,
            "square",
        );
    }
}

/// Emitters occlude each other and reflect nothing; what an occluder hides is exactly 0.
#[test]
fn emitters_occlude_and_a_hidden_light_is_black() {
    let mut scene = scene(EYE, DVec3::ZERO, diffuse());
    scene.meshes.push(floor(10.0));
    scene.spheres.push(sphere(3.0 * DVec3::Z, 0.5, Emission(1e6 * LE)));
    scene.spheres.push(sphere(2.0 * DVec3::Z, 0.9, Emission(LE)));
    expect(
        &scene,
        40_000,
        DVec3::new(0.8, 0.5, 0.1) * LE * 0.2025,
        0.01,
        "the nearer of two lights",
    );
    scene.spheres[1].surface = Emission(DVec3::ZERO);
    assert_eq!(one_pixel(&scene, 1000).picture, [[0.0; 3]]);
}

/// An emitter shows its radiance without noise, from outside and from inside; nothing shows black.
#[test]
fn an_eye_ray_shows_emitters_and_black() {
    let mut scene = scene(EYE, DVec3::ZERO, diffuse());
    assert_eq!(one_pixel(&scene, 10).picture, [[0.0; 3]]);
    scene.spheres.push(sphere(DVec3::ZERO, 1.0, Emission(LE)));
    let seen = one_pixel(&scene, 10);
    assert_eq!((seen.picture[0], seen.stderr[0]), (LE.to_array(), [0.0; 3]));
    scene.spheres[0].center = EYE; // from inside, too
    assert_eq!(one_pixel(&scene, 10).picture, [LE.to_array()]);
}

/// Either face of a plane, of either winding, shows the light on the eye's side and not the one behind.
#[test]
fn surfaces_are_two_sided_and_opaque() {
    let expected = DVec3::new(0.8, 0.5, 0.1) * LE * 0.0625;
    for side in [1.0, -1.0] {
        for winding in [1.0, -1.0] {
            let mut scene = scene(side * EYE, DVec3::ZERO, diffuse());
            scene.meshes.push(quad(
                DVec3::ZERO,
                DVec3::X,
                winding * DVec3::Y,
                10.0,
                Surface::Material(0),
            ));
            scene.spheres.push(sphere(side * 2.0 * DVec3::Z, 0.5, Emission(LE)));
            scene
                .spheres
                .push(sphere(side * -2.0 * DVec3::Z, 0.5, Emission(1e6 * LE)));
            expect(
                &scene,
                20_000,
                expected,
                0.01,
                &format!("side {side}, winding {winding}"),
            );
        }
    }
}

/// A plane with slanted vertex normals shades like a slanted plane as long as the light is above both horizons.
#[test]
fn smooth_normals_slant_the_shading_on_the_side_of_the_eye() {
    let slant = 0.4_f64;
    for flip in [1.0, -1.0] {
        let mut scene = scene(EYE, DVec3::ZERO, diffuse());
        let n = flip * 3.0 * DVec3::new(-slant.sin(), 0.0, slant.cos());
        scene.meshes.push(Mesh {
            normals: Some(vec![n.normalize(); 4]),
            ..floor(10.0)
        });
        scene.spheres.push(sphere(
            4.0 * DVec3::new(-slant.sin(), 0.0, slant.cos()),
            0.5,
            Emission(LE),
        ));
        expect(&scene, 20_000, DVec3::new(0.8, 0.5, 0.1) * LE / 64.0, 0.01, "slanted");
    }
}

/// The inside and the outside of a reflecting sphere: no acne, on scales from dust to planets and far from the origin.
#[test]
fn spheres_never_shadow_themselves() {
    let rotation = DMat3::from_rotation_x(0.7);
    for (scale, away) in [(1.0, 0.0), (1e-6, 0.0), (1e7, 0.0), (1.0, 1e4)] {
        let shift = DVec3::splat(away);
        let (top, light) = (rotation * DVec3::Z * scale, rotation * DVec3::Z * 3.0 * scale);
        let eye = rotation * DVec3::new(0.0, 4.0, 2.0) * scale;
        let mut outside = scene(eye + shift, top + shift, diffuse());
        outside.spheres.push(sphere(shift, scale, Surface::Material(0)));
        outside.spheres.push(sphere(light + shift, 0.5 * scale, Emission(LE)));
        outside.camera.fov = Fov::X(1e-5);
        let expected = DVec3::new(0.8, 0.5, 0.1) * LE * 0.0625;
        expect(
            &outside,
            20_000,
            expected,
            0.01,
            &format!("outside, scale {scale}, {away} away"),
        );

        let mut inside = scene(shift, top + shift, diffuse());
        inside.spheres.push(sphere(shift, scale, Surface::Material(0)));
        inside
            .spheres
            .push(sphere(shift - 0.5 * top, 0.3 * scale, Emission(LE)));
        inside.camera.fov = Fov::X(1e-5);
        let expected = DVec3::new(0.8, 0.5, 0.1) * LE * 0.04;
        expect(
            &inside,
            20_000,
            expected,
            0.01,
            &format!("inside, scale {scale}, {away} away"),
        );
    }
}

#[test]
fn threads_do_not_matter_and_seeds_do() {
    let mut scene = scene(EYE, DVec3::ZERO, diffuse());
    scene.camera.fov = Fov::Y(40.0);
    scene.meshes.push(floor(10.0));
    scene.spheres.push(sphere(2.0 * DVec3::Z, 0.5, Emission(LE)));
    let film = FilmSize { width: 24, height: 16 };
    let threads = |count, seed| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(count).build().unwrap();
        let heard = AtomicU64::new(0);
        let result = pool.install(|| {
            render(&scene, film, 8, seed, &|done| {
                _ = heard.fetch_max(done, Ordering::Relaxed)
            })
        });
        assert_eq!(heard.into_inner(), 24 * 16 * 8);
        result
    };
    let one = threads(1, 0);
    assert_eq!(one, threads(3, 0));
    assert_ne!(one.picture, threads(1, 1).picture);
    assert_eq!((one.width, one.height, one.spp, one.picture.len()), (24, 16, 8, 384));
}
