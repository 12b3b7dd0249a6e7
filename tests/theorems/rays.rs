//! Ray queries on arrays say what a search through all shapes in f64 says, on both accelerators and in every width of packets.

use crate::proof::runs::{load, settings};
use glam::DVec3;
use octolux::pipeline::{Prepared, Settings, widest_lanes};
use octolux::rays::{Hits, HitsMut, NOTHING, RayQueries, Rays};
use octolux::scene::{EstimatorKind, Scene};
use octolux::settings::{AccelKind, Lanes};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

const RAYS: usize = 3000;

fn queries(scene: &Scene, accel: AccelKind, lanes: Lanes) -> RayQueries {
    let settings = Settings {
        accel: Some(accel),
        lanes: Some(lanes),
        ..settings(8, 8, EstimatorKind::Mis)
    };
    RayQueries::new(&Prepared::new(scene, settings).expect("it renders"))
}

/// Rays from around the scene to places in it, of directions that are not unit.
fn rays(scene: &Scene, seed: u64) -> (Vec<[f32; 3]>, Vec<[f32; 3]>) {
    let mut rng = Pcg64::seed_from_u64(seed);
    let middle = scene.camera().target;
    let size = (scene.camera().origin - middle).length();
    let mut point = |reach: f64| {
        let v = DVec3::from_array(std::array::from_fn(|_| rng.random_range(-1.0..1.0)));
        (middle + v * reach * size).to_array().map(|x| x as f32)
    };
    (0..RAYS)
        .map(|_| {
            let (from, to) = (point(1.5), point(0.5));
            (from, std::array::from_fn(|k| 0.37 * (to[k] - from[k])))
        })
        .unzip()
}

/// Distances to the nearest and the second nearest shape, with the object, the primitive and the normal of the nearest.
type Found = ([f64; 2], u32, u32, DVec3);

fn search(scene: &Scene, origin: [f32; 3], direction: [f32; 3]) -> Found {
    let [o, d] = [origin, direction].map(|v| DVec3::from_array(v.map(f64::from)));
    let mut found = ([f64::INFINITY; 2], NOTHING, NOTHING, DVec3::ZERO);
    let mut meet = |t: f64, object: u32, primitive: u32, normal: DVec3| {
        if t < found.0[0] {
            found = ([t, found.0[0]], object, primitive, normal);
        } else {
            found.0[1] = found.0[1].min(t);
        }
    };
    for (object, mesh) in (0..).zip(scene.meshes()) {
        for (primitive, corners) in (0..).zip(&mesh.triangles) {
            let [a, b, c] = corners.map(|i| mesh.vertices[i as usize]);
            let n = (b - a).cross(c - a);
            let t = (a - o).dot(n) / d.dot(n);
            let p = o + t * d;
            let inside = |from: DVec3, to: DVec3| (to - from).cross(p - from).dot(n) >= 0.0;
            if t >= 0.0 && inside(a, b) && inside(b, c) && inside(c, a) {
                meet(t, object, primitive, n.normalize());
            }
        }
    }
    for (object, sphere) in (scene.meshes().len() as u32..).zip(scene.spheres()) {
        let from = o - sphere.center;
        let (a, b, c) = (
            d.length_squared(),
            from.dot(d),
            from.length_squared() - sphere.radius.powi(2),
        );
        let root = (b * b - a * c).sqrt();
        for t in [(-b - root) / a, (-b + root) / a] {
            if t >= 0.0 {
                meet(t, object, 0, (from + t * d).normalize());
            }
        }
    }
    found
}

fn widths() -> impl Iterator<Item = Lanes> {
    Lanes::ALL.into_iter().filter(|&lanes| lanes <= widest_lanes())
}

#[test]
fn every_ray_meets_what_a_search_through_all_shapes_meets() {
    for name in ["veach-mis.toml", "large-lights.toml", "mesh-light.toml"] {
        let scene = load(name);
        let (origins, directions) = rays(&scene, 7);
        let rays = Rays::new(&origins, &directions);
        for accel in AccelKind::ALL {
            for lanes in widths() {
                let queries = queries(&scene, accel, lanes);
                let hits = queries.intersect(rays).expect("arrays of one length");
                let mut met = 0;
                for i in 0..RAYS {
                    let what = format!("{name}, {}, {lanes} lanes, ray {i}", accel.name());
                    let ([t, second], object, primitive, normal) = search(&scene, origins[i], directions[i]);
                    if t.is_infinite() {
                        assert_eq!((hits.t[i], hits.objects[i]), (f32::INFINITY, NOTHING), "{what}");
                        continue;
                    }
                    // Rays along an edge may go either way; so near is none of these.
                    assert!(
                        (f64::from(hits.t[i]) - t).abs() < 1e-4 * t.max(1.0),
                        "{what}: {} and {t}",
                        hits.t[i]
                    );
                    if second - t < 1e-3 * t {
                        continue;
                    }
                    met += 1;
                    assert_eq!((hits.objects[i], hits.primitives[i]), (object, primitive), "{what}");
                    let told = DVec3::from_array(hits.normals[i].map(f64::from));
                    let towards = DVec3::from_array(directions[i].map(f64::from)).dot(told) <= 0.0;
                    assert!(
                        towards && told.dot(normal).abs() > 1.0 - 1e-4,
                        "{what}: {told} and {normal}"
                    );
                }
                assert!(met > RAYS / 10, "{name}: only {met} rays met anything");
                let short: Vec<f32> = hits.t.iter().map(|t| 0.99 * t.min(1e6)).collect();
                let long: Vec<f32> = hits.t.iter().map(|t| 1.01 * t.min(1e6)).collect();
                assert!(
                    queries
                        .occluded(rays.within(&short))
                        .expect("lengths")
                        .iter()
                        .all(|met| !met),
                    "{name}"
                );
                let occluded = queries.occluded(rays.within(&long)).expect("lengths");
                assert!(
                    occluded.iter().zip(&hits.t).all(|(&met, t)| met == t.is_finite()),
                    "{name}"
                );
            }
        }
    }
}

#[test]
fn columns_and_rows_and_every_width_have_the_same_answers() {
    let scene = load("large-lights.toml");
    let (origins, directions) = rays(&scene, 8);
    let column = |rows: &[[f32; 3]], k: usize| rows.iter().map(|row| row[k]).collect::<Vec<_>>();
    let o: Vec<Vec<f32>> = (0..3).map(|k| column(&origins, k)).collect();
    let d: Vec<Vec<f32>> = (0..3).map(|k| column(&directions, k)).collect();
    let rows = Rays::new(&origins, &directions);
    let columns = Rays::new([&o[0][..], &o[1], &o[2]], [&d[0][..], &d[1], &d[2]]).coherent();
    let expected = queries(&scene, AccelKind::Linear, Lanes::One)
        .intersect(rows)
        .expect("lengths");
    for lanes in widths() {
        let queries = queries(&scene, AccelKind::Linear, lanes);
        for rays in [rows, columns] {
            assert_eq!(queries.intersect(rays).expect("lengths"), expected, "{lanes} lanes");
        }
    }
}

#[test]
fn what_is_no_ray_meets_nothing() {
    let scene = load("large-lights.toml");
    let (mut origins, mut directions) = rays(&scene, 9);
    origins.truncate(5);
    directions.truncate(5);
    origins[0][1] = f32::NAN;
    directions[1] = [0.0; 3];
    directions[2][0] = f32::INFINITY;
    let tmax = [f32::INFINITY, f32::INFINITY, f32::INFINITY, f32::NAN, -1.0];
    for accel in AccelKind::ALL {
        for lanes in widths() {
            let queries = queries(&scene, accel, lanes);
            let hits = queries
                .intersect(Rays::new(&origins, &directions).within(&tmax))
                .expect("lengths");
            assert_eq!(hits.objects, [NOTHING; 5], "{lanes} lanes");
            assert!(hits.t.iter().all(|t| t.is_infinite()));
        }
    }
}

#[test]
fn arrays_that_do_not_fit_together_are_refused_and_none_is_written() {
    let queries = queries(&load("large-lights.toml"), AccelKind::Linear, Lanes::Eight);
    let (three, two) = ([[1.0_f32; 3]; 3], [[1.0_f32; 3]; 2]);
    let error = queries.intersect(Rays::new(&three, &two)).expect_err("lengths differ");
    assert_eq!(error.to_string(), "there are 3 origins, and directions has 2");
    let error = queries
        .occluded(Rays::new(&three, &three).within(&[1.0]))
        .expect_err("lengths differ");
    assert_eq!(error.to_string(), "there are 3 origins, and tmax has 1");
    let mut hits = Hits {
        t: vec![7.0; 3],
        normals: vec![[7.0; 3]; 3],
        uv: vec![[7.0; 2]; 2],
        objects: vec![7; 3],
        primitives: vec![7; 3],
    };
    let into = HitsMut {
        t: &mut hits.t,
        normals: &mut hits.normals,
        uv: &mut hits.uv,
        objects: &mut hits.objects,
        primitives: &mut hits.primitives,
    };
    let error = queries
        .intersect_into(Rays::new(&three, &three), into)
        .expect_err("lengths differ");
    assert_eq!(error.to_string(), "there are 3 origins, and uv has 2");
    assert_eq!(hits.t, [7.0; 3]);
    let none: [[f32; 3]; 0] = [];
    assert!(
        queries
            .intersect(Rays::new(&none, &none))
            .expect("no rays")
            .t
            .is_empty()
    );
}
