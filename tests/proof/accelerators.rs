//! Shapes in a line, culled by tile and light, against Embree's hierarchy: the same samples, so the same pictures but for
//! rays that graze an edge.

use std::sync::Arc;

use glam::DVec3;
use octolux::film::Picture;
use octolux::linear::FEW;
use octolux::pipeline::Settings;
use octolux::scene::{
    Camera, EstimatorKind, FilmSize, Fov, Material, MaterialId, Mesh, Scene, SceneBuilder, Sphere, Surface,
};
use octolux::settings::AccelKind;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::runs::{leave, load, picture, rendered, settings};

/// Pixels whose two values differ by more than 1 % in any channel.
fn apart(a: &Picture, b: &Picture) -> usize {
    let differ = |(x, y): (&f32, &f32)| (x - y).abs() > 0.01 * x.abs().max(y.abs());
    let pixels = a.pixels.iter().zip(&b.pixels);
    pixels.filter(|(a, b)| a.iter().zip(*b).any(differ)).count()
}

/// Renders with both; says how many pixels differ and where to look at it.
pub fn compare(scene: &Scene, base: Settings, passes: u32, name: &str) -> (usize, Vec<String>) {
    let [embree, line] = AccelKind::ALL.map(|accel| {
        let settings = Settings {
            accel: Some(accel),
            ..base
        };
        picture(scene, settings, passes)
    });
    let count = apart(&embree, &line);
    let files = if count > 0 {
        [(&embree, "embree"), (&line, "line")]
            .map(|(p, accel)| leave(p, &format!("{name}-{accel}")))
            .to_vec()
    } else {
        vec![]
    };
    (count, files)
}

/// A dozen triangles and spheres of all sizes about the origin, a few of them lights, seen from `distance` away through a
/// film that they fill.
pub fn random_scene(rng: &mut Pcg64, distance: f64) -> SceneBuilder {
    let mut near = |size: f64| DVec3::from_array(std::array::from_fn(|_| size * (2.0 * rng.random::<f64>() - 1.0)));
    let grey = MaterialId::new(0);
    let triangle = |a: DVec3, b: DVec3, c: DVec3| Arc::new(Mesh::new([a, a + b, a + c], vec![[0, 1, 2]], grey));
    let mut meshes: Vec<_> = (0..8)
        .map(|i| triangle(near(1.0), near(0.1 + 0.2 * f64::from(i)), near(1.0)))
        .collect();
    let floor = -DVec3::Y - 4.0 * (DVec3::X + DVec3::Z);
    meshes.push(triangle(floor, 16.0 * DVec3::Z, 16.0 * DVec3::X));
    let balls = [0.02, 0.05, 0.1, 0.3, 0.5];
    let mut spheres: Vec<_> = balls.map(|radius| Sphere::new(near(1.0), radius, grey)).to_vec();
    spheres.extend([0.03, 0.2, 0.6].map(|radius| {
        let emission = Surface::emission(DVec3::splat(1.0 / (radius * radius)));
        Sphere::new(near(1.0) + 1.5 * DVec3::Y, radius, emission)
    }));
    let origin = distance * (near(1.0) + 0.5 * DVec3::Y).normalize();
    let fov = Fov::X(2.0 * (1.2 / distance).atan().to_degrees());
    let camera = Camera {
        up: DVec3::new(0.1, 1.0, 0.2),
        ..Camera::new(origin, near(0.3), fov)
    };
    let mut scene = Scene::builder(camera, FilmSize { width: 48, height: 33 });
    scene.material(Material::diffuse("grey", [0.5; 3]));
    SceneBuilder {
        meshes,
        spheres,
        ..scene
    }
}

/// Renders in a line with shapes left out for tiles and with none left out. Both ask the same questions of what is met, so they
/// count the same rays, and pixels differ by no more than sums of a few `f32` do: what is worth as much together as one ray is added
/// up before, where no ray is asked for.
///
/// # Panics
/// Where anything else differs.
pub fn nothing_is_missed(scene: &Scene, base: Settings, passes: u32, name: &str) {
    let [culled, all] = [true, false].map(|cull| {
        let accel = Some(AccelKind::Linear);
        let renderer = rendered(scene, Settings { accel, cull, ..base }, passes);
        (renderer.picture(), renderer.counters())
    });
    let differ = |(a, b): (&f32, &f32)| (a - b).abs() > 1e-6 * a.max(*b);
    let pixels = culled.0.pixels.iter().zip(&all.0.pixels);
    let count = pixels.filter(|(a, b)| a.iter().zip(*b).any(differ)).count();
    if count > 0 || culled.1 != all.1 {
        let files = [(&culled.0, "culled"), (&all.0, "all")].map(|(p, how)| leave(p, &format!("{name}-{how}")));
        panic!(
            "{name}: {count} pixels differ, counted {:?} and {:?}, {}",
            culled.1,
            all.1,
            files.join(", ")
        );
    }
}

/// Random scenes from `distances`, and the most pixels in a thousand that may differ.
///
/// # Panics
/// Where more do.
pub fn random_scenes(name: &str, distances: &[f64], scenes: u64, most: usize) {
    let mut worst = vec![];
    let (mut differ, mut pixels) = (0, 0);
    for &distance in distances {
        for seed in 0..scenes {
            let scene = random_scene(&mut Pcg64::seed_from_u64(seed), distance)
                .build()
                .expect("a scene");
            for estimator in [EstimatorKind::Light, EstimatorKind::Brdf] {
                let base = settings(scene.film().width, scene.film().height, estimator);
                let what = format!("{name}-{distance}-{seed}-{}", estimator.name());
                let (count, files) = compare(&scene, base, 2, &what);
                differ += count;
                pixels += 48 * 33;
                worst.push((count, files.join(", ")));
            }
        }
    }
    println!("{name}: {differ} of {pixels} pixels differ");
    worst.sort_by_key(|(count, _)| std::cmp::Reverse(*count));
    assert!(
        differ * 1000 <= most * pixels,
        "{name}: {differ} of {pixels} pixels differ; the worst, {} in one picture: {}",
        worst[0].0,
        worst[0].1
    );
}

/// A lamp that stands half above a table and half below it, over a floor that only the lower half may light: the table's plane has
/// the middle of the lamp and the floor on one side. Far below lie so many triangles that Embree answers every ray itself.
///
/// # Panics
/// Where a pixel differs.
pub fn a_lamp_through_a_table() {
    let mut scene = random_scene(&mut Pcg64::seed_from_u64(0), 2.0);
    let grey = MaterialId::new(0);
    let square = |half: f64, y: f64| {
        let corners = [(-half, -half), (-half, half), (half, half), (half, -half)];
        Mesh::quadrilateral(corners.map(|(x, z)| DVec3::new(x, y, z)), grey)
    };
    let below = (0..2 * FEW as u32).map(|i| DVec3::new(f64::from(i % 2), -50.0 - f64::from(i), f64::from(i % 3)));
    let strip = (0..2 * FEW as u32 - 2).map(|i| [i, i + 1, i + 2]);
    let strip = Mesh::new(below, strip.collect(), grey);
    scene.meshes = [square(4.0, 0.0), square(3.0, 0.5), strip].map(Arc::new).to_vec();
    scene.spheres = vec![Sphere::new([0.0, 0.42, 0.0], 0.3, Surface::emission([10.0; 3]))];
    scene.camera = Camera::new([3.9, 0.4, 0.1], [0.5, 0.0, 0.0], Fov::X(40.0));
    let scene = scene.build().expect("a scene");
    let (count, files) = compare(&scene, settings(48, 33, EstimatorKind::Light), 4, "lamp-through-table");
    assert_eq!(count, 0, "a lamp through a table: {}", files.join(", "));
}

/// A ball that fills half of the view, seen through so many degrees, must be the same in every pixel.
///
/// # Panics
/// Where one differs.
pub fn narrow_views(fovs: &[f64]) {
    for &fov in fovs {
        let mut scene = load("tests/emitter-seen.toml").to_builder();
        let origin = DVec3::new(0.3, -0.2, 0.1);
        let center = origin + 5.0 * DVec3::new(0.48, 0.6, 0.64);
        (scene.camera.origin, scene.camera.target, scene.camera.fov) = (origin, center, Fov::X(fov));
        scene.spheres[0].center = center;
        scene.spheres[0].radius = 5.0 * (fov.to_radians() / 4.0).tan();
        let scene = scene.build().expect("a scene");
        let name = format!("narrow-{fov}");
        let (count, files) = compare(&scene, settings(64, 64, EstimatorKind::Light), 4, &name);
        assert_eq!(count, 0, "{name}: {}", files.join(", "));
    }
}
