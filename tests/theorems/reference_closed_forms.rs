//! The oracle against answers that can be written down.

use std::f64::consts::PI;

use crate::reference_scene::*;
use glam::DVec3;
use octolux::scene::{Bsdf, Fov, Mesh, Surface::Emission};

/// Irradiance of a sphere wholly above the horizon is exactly pi L (R/D)^2 cos, so L_o = rho L (R/D)^2 cos.
#[test]
fn a_sphere_over_a_diffuse_plane() {
    for (distance, radius, tilt) in [(2.0, 0.5, 0.3_f64), (1.0, 0.9, 0.05), (1e3, 1e-3, 1.2)] {
        let below_the_light = DVec3::new(4.0, 1.0, 0.3);
        let mut scene = scene(below_the_light, DVec3::ZERO, diffuse());
        scene.mesh(floor(10.0));
        let center = distance * DVec3::new(-tilt.sin(), 0.0, tilt.cos());
        scene.sphere(sphere(center, radius, Emission(LE)));
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
    inside_sphere.mesh(floor(1.0));
    inside_sphere.sphere(sphere(DVec3::new(1.0, 2.0, 0.5), 20.0, Emission(LE)));
    expect(&inside_sphere, 20_000, rho * LE, 0.01, "sphere");

    let mut inside_cube = scene(EYE, DVec3::ZERO, diffuse());
    inside_cube.mesh(floor(1.0));
    inside_cube.mesh(cube(DVec3::new(1.0, 0.5, 0.0), 6.0));
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
    let triangles = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    Mesh::new((0..8).map(|i| center + half * corner(i)), triangles, Emission(LE))
}

/// Straight on, the lobe and the foreshortening share their axis: rho L (alpha + 1) times the integral of
/// cos^(alpha + 1), which is 1 / (alpha + 2).
#[test]
fn straight_on_inside_an_emitter_phong_shows_its_albedo() {
    for alpha in [1.5, 10.0, 1e3, 1e6] {
        let rho = DVec3::new(0.3, 0.6, 0.9);
        let mut scene = scene(4.0 * DVec3::Z, DVec3::ZERO, Bsdf::Phong { rho, alpha });
        scene.camera.fov = Fov::X(1e-6);
        scene.mesh(floor(1.0));
        scene.sphere(sphere(DVec3::new(1.0, 2.0, 0.5), 20.0, Emission(LE)));
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
        scene.mesh(floor(10.0));
        scene.mesh(quad(d * DVec3::Z, DVec3::X, up, h, Emission(LE)));
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
    scene.mesh(floor(10.0));
    scene.sphere(sphere(3.0 * DVec3::Z, 0.5, Emission(1e6 * LE)));
    scene.sphere(sphere(2.0 * DVec3::Z, 0.9, Emission(LE)));
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
    scene.sphere(sphere(DVec3::ZERO, 1.0, Emission(LE)));
    let seen = one_pixel(&scene, 10);
    assert_eq!((seen.picture[0], seen.stderr[0]), (LE.to_array(), [0.0; 3]));
    scene.spheres[0].center = EYE; // from inside, too
    assert_eq!(one_pixel(&scene, 10).picture, [LE.to_array()]);
}
