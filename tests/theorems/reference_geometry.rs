//! The oracle's geometry: sides, normals, starting points of rays, meshes, threads.

use std::f64::consts::PI;
use std::sync::atomic::{AtomicU64, Ordering};

use crate::reference_scene::*;
use glam::{DMat3, DVec3};
use octolux::reference::render;
use octolux::scene::{Bsdf, FilmSize, Fov, Mesh, Surface, Surface::Emission};

/// Either face of a plane, of either winding, shows the light on the eye's side and not the one behind.
#[test]
fn surfaces_are_two_sided_and_opaque() {
    let expected = DVec3::new(0.8, 0.5, 0.1) * LE * 0.0625;
    for side in [1.0, -1.0] {
        for winding in [1.0, -1.0] {
            let mut scene = scene(side * EYE, DVec3::ZERO, diffuse());
            scene.mesh(quad(DVec3::ZERO, DVec3::X, winding * DVec3::Y, 10.0, REFLECTS));
            scene.sphere(sphere(side * 2.0 * DVec3::Z, 0.5, Emission(LE)));
            scene.sphere(sphere(side * -2.0 * DVec3::Z, 0.5, Emission(1e6 * LE)));
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
        scene.mesh(Mesh {
            normals: Some(vec![n.normalize(); 4]),
            ..floor(10.0)
        });
        scene.sphere(sphere(
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
        outside.sphere(sphere(shift, scale, REFLECTS));
        outside.sphere(sphere(light + shift, 0.5 * scale, Emission(LE)));
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
        inside.sphere(sphere(shift, scale, REFLECTS));
        inside.sphere(sphere(shift - 0.5 * top, 0.3 * scale, Emission(LE)));
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

/// A sphere of 2 * 200 * 200 triangles, with the sphere's own normals at its vertices.
fn tessellated(center: DVec3, radius: f64, surface: Surface) -> Mesh {
    const N: u32 = 200;
    let direction = |i: u32, j: u32| {
        let (sin, cos) = (PI * f64::from(i) / f64::from(N)).sin_cos();
        let (y, x) = (2.0 * PI * f64::from(j) / f64::from(N)).sin_cos();
        DVec3::new(sin * x, sin * y, cos)
    };
    let normals: Vec<DVec3> = (0..=N).flat_map(|i| (0..=N).map(move |j| direction(i, j))).collect();
    let corner = |i: u32, j: u32| i * (N + 1) + j;
    let quad = |i, j| {
        let [a, b, c, d] = [corner(i, j), corner(i, j + 1), corner(i + 1, j + 1), corner(i + 1, j)];
        [[a, b, c], [a, c, d]]
    };
    let vertices = normals.iter().map(|n| center + radius * n);
    let triangles = (0..N).flat_map(|i| (0..N).flat_map(move |j| quad(i, j))).collect();
    Mesh {
        normals: Some(normals.clone()),
        ..Mesh::new(vertices, triangles, surface)
    }
}

/// The same random numbers meet a sphere and 80 000 triangles in its place: the pictures differ by the tessellation
/// alone. The chords of its edges are 1 - cos(pi / 200) = 1.2e-4 off the sphere.
#[test]
fn a_fine_mesh_is_the_sphere_it_stands_for() {
    let mut scene = scene(
        DVec3::new(0.0, 4.0, 2.0),
        DVec3::ZERO,
        Bsdf::Phong {
            rho: DVec3::ONE,
            alpha: 5.0,
        },
    );
    scene.camera.fov = Fov::X(20.0);
    let film = FilmSize { width: 12, height: 12 };
    scene.sphere(sphere(DVec3::new(1.0, 2.0, 3.0), 1.0, Emission(LE)));
    let mut with_mesh = scene.clone();
    scene.sphere(sphere(DVec3::ZERO, 1.0, REFLECTS));
    with_mesh.mesh(tessellated(DVec3::ZERO, 1.0, REFLECTS));
    let [by_sphere, by_mesh] = [scene, with_mesh].map(|scene| render(&scene.build().unwrap(), film, 64, 1, &|_| ()));
    for (a, b) in by_sphere.picture.iter().flatten().zip(by_mesh.picture.iter().flatten()) {
        assert!((a - b).abs() < 0.02 * (a + 0.01), "{a} {b}");
    }
    assert!(
        (by_mesh.mean() / by_sphere.mean() - 1.0).abs() < 1e-3,
        "{} {}",
        by_mesh.mean(),
        by_sphere.mean()
    );
}

/// As a light, too: seen from outside only the near half lights, which the density of area does not know of.
#[test]
fn a_fine_mesh_emits_like_the_sphere_it_stands_for() {
    let mut scene = scene(EYE, DVec3::ZERO, diffuse());
    scene.mesh(floor(10.0));
    scene.mesh(tessellated(2.0 * DVec3::Z, 0.5, Emission(LE)));
    // The mean cross-section of the inscribed mesh is smaller by about 2/3 (pi / 200)^2.
    expect(
        &scene,
        40_000,
        DVec3::new(0.8, 0.5, 0.1) * LE * 0.0625 * (1.0 - 1.6e-4),
        0.01,
        "mesh light",
    );
}

#[test]
fn threads_do_not_matter_and_seeds_do() {
    let mut scene = scene(EYE, DVec3::ZERO, diffuse());
    scene.camera.fov = Fov::Y(40.0);
    scene.mesh(floor(10.0));
    scene.sphere(sphere(2.0 * DVec3::Z, 0.5, Emission(LE)));
    let scene = scene.build().unwrap();
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
