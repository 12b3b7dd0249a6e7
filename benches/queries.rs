//! Rays a second through `octolux::embree`: what the estimators can get at most.
//!
//! Veach's scene and a mesh of a quarter of a million triangles; eye rays (`intersect`) and shadow rays (`occluded`);
//! in the order of tiles, where a packet covers 4 x 2 pixels, and shuffled; one and eight rays a call; both flags. The
//! time holds loading a packet from columns, the call, and using its answer. One ray a call is not auto-vectorised:
//! every step calls Embree.
//!
//! `benches/ceiling.py` holds whole renders against bare calls for the same rays.

mod common;

use std::collections::BTreeMap;

use criterion::{BenchmarkId, Criterion, Throughput};
use glam::{DVec3, dvec3};
use octolux::embree::{Accel, BoundingSphere, Coherence, Device, NO_SKIP_ID, Ray, SceneBuilder, TraceLane};
use octolux::lane::{Bits, F32x8, Lane, Mask};
use octolux::math::Vec3;

const WIDTH: usize = 384;
const HEIGHT: usize = 256;
const RAYS: usize = WIDTH * HEIGHT;

/// Rays in columns: origin, direction, end.
struct Rays {
    columns: [Vec<f32>; 7],
    skip_id: u32,
}

impl Rays {
    fn new(rays: impl Iterator<Item = [f32; 7]>, skip_id: u32) -> Self {
        let mut columns: [Vec<f32>; 7] = Default::default();
        for ray in rays {
            columns.iter_mut().zip(ray).for_each(|(column, x)| column.push(x));
        }
        // A whole number of packets: what is left over would be another measurement.
        let len = columns[0].len() / 8 * 8;
        columns.iter_mut().for_each(|column| column.truncate(len));
        Self { columns, skip_id }
    }

    fn len(&self) -> usize {
        self.columns[0].len()
    }

    fn row(&self, i: usize) -> [f32; 7] {
        std::array::from_fn(|k| self.columns[k][i])
    }

    fn shuffled(&self) -> Self {
        let mut order: Vec<usize> = (0..self.len()).collect();
        order.sort_by_key(|&i| common::mixed(i as u32));
        Self::new(order.into_iter().map(|i| self.row(i)), self.skip_id)
    }

    #[inline(always)]
    fn packet<L: Lane>(&self, at: usize) -> Ray<L> {
        let v: [L; 7] = std::array::from_fn(|k| L::load(&self.columns[k][at..at + L::N]));
        Ray {
            origin: Vec3::new(v[0], v[1], v[2]),
            direction: Vec3::new(v[3], v[4], v[5]),
            tfar: v[6],
            skip_id: L::Bits::splat(self.skip_id),
        }
    }
}

/// Eye rays, 4 x 2 pixels after 4 x 2 pixels.
fn eye_rays(origin: DVec3, target: DVec3, fov_x: f64) -> Rays {
    let forward = (target - origin).normalize();
    let right = forward.cross(DVec3::Y).normalize();
    let down = forward.cross(right);
    let pixel = 2.0 * (fov_x.to_radians() / 2.0).tan() / WIDTH as f64;
    let rays = (0..RAYS).map(|i| {
        let (block, inside) = (i / 8, i % 8);
        let x = block % (WIDTH / 4) * 4 + inside % 4;
        let y = block / (WIDTH / 4) * 2 + inside / 4;
        let across = (x as f64 + 0.5 - WIDTH as f64 / 2.0) * pixel;
        let along = (y as f64 + 0.5 - HEIGHT as f64 / 2.0) * pixel;
        let d = (forward + right * across + down * along).normalize();
        ray(origin, d, f64::INFINITY)
    });
    Rays::new(rays, NO_SKIP_ID)
}

fn ray(origin: DVec3, direction: DVec3, tfar: f64) -> [f32; 7] {
    let ([a, b, c], [x, y, z]) = (origin.to_array(), direction.to_array());
    [a, b, c, x, y, z, tfar].map(|x| x as f32)
}

/// Rays from what the eye rays meet to a light, up to just before it, off the surface by a thousandth.
fn shadow_rays(accel: &Accel, eye: &Rays, light: DVec3, radius: f64, skip_id: u32) -> Rays {
    let rays = (0..eye.len()).filter_map(|at| {
        let packet = eye.packet::<f32>(at);
        let hit = accel.intersect(true, &packet, Coherence::Coherent);
        let along = |v: Vec3<f32>| DVec3::from_array(v.lane(0).map(f64::from));
        let (d, ng) = (along(packet.direction), along(hit.ng).normalize());
        let facing = if ng.dot(d) < 0.0 { ng } else { -ng };
        let p = along(packet.origin) + d * f64::from(hit.t) + facing * 1e-3;
        let to_light = light - p;
        let distance = to_light.length();
        let wanted = hit.found && to_light.dot(facing) > 0.0 && distance > radius * 1.01;
        wanted.then(|| ray(p, to_light / distance, distance - radius))
    });
    Rays::new(rays, skip_id)
}

struct Place {
    name: &'static str,
    accel: Accel,
    eye: Rays,
    shadow: Rays,
}

/// Veach's scene, with the rays towards its largest visible light.
fn veach(device: &Device) -> Place {
    let scene = common::scene("veach-mis.toml");
    let mut builder = SceneBuilder::new(device, true).expect("a scene");
    let narrow = |v: DVec3| v.to_array().map(|x| x as f32);
    for mesh in scene.meshes() {
        let vertices: Vec<_> = mesh.vertices.iter().map(|&v| narrow(v)).collect();
        builder.add_mesh(&vertices, &mesh.triangles).expect("a mesh");
    }
    let balls = scene.spheres().iter().map(|s| BoundingSphere {
        center: narrow(s.center),
        radius: s.radius as f32,
    });
    builder.set_spheres(balls.collect()).expect("spheres");
    let accel = builder.commit().expect("a hierarchy");
    let eye = eye_rays(scene.camera().origin, scene.camera().target, 41.0108);
    let light = &scene.spheres()[3];
    let shadow = shadow_rays(&accel, &eye, light.center, light.radius, 3);
    Place {
        name: "Veach's scene",
        accel,
        eye,
        shadow,
    }
}

/// A sphere with waves on it: 500 x 250 quadrilaterals, 249 000 triangles.
fn waves(device: &Device) -> Place {
    const AROUND: u32 = 500;
    const DOWN: u32 = 250;
    let mut vertices = Vec::new();
    for j in 0..=DOWN {
        for i in 0..=AROUND {
            let theta = std::f64::consts::PI * f64::from(j) / f64::from(DOWN);
            let phi = std::f64::consts::TAU * f64::from(i % AROUND) / f64::from(AROUND);
            let d = dvec3(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin());
            let wave = |f: f64| (f * d.x).sin() * (f * d.y + 1.0).sin() * (f * d.z + 2.0).sin();
            let height = 1.0 + 0.15 * wave(5.0) + 0.06 * wave(13.0) + 0.02 * wave(31.0);
            vertices.push((d * height).to_array().map(|x| x as f32));
        }
    }
    let mut triangles = Vec::new();
    for j in 0..DOWN {
        for i in 0..AROUND {
            let a = j * (AROUND + 1) + i;
            let b = a + AROUND + 1;
            // At the poles one of the two has no area.
            triangles.extend((j > 0).then_some([a, a + 1, b + 1]));
            triangles.extend((j + 1 < DOWN).then_some([a, b + 1, b]));
        }
    }
    let mut builder = SceneBuilder::new(device, true).expect("a scene");
    builder.add_mesh(&vertices, &triangles).expect("a mesh");
    let accel = builder.commit().expect("a hierarchy");
    let eye = eye_rays(dvec3(0.0, 0.6, 3.2), DVec3::ZERO, 55.0);
    let shadow = shadow_rays(&accel, &eye, dvec3(3.0, 4.0, 2.0), 0.0, NO_SKIP_ID);
    Place {
        name: "249 000 triangles",
        accel,
        eye,
        shadow,
    }
}

fn nearest<L: TraceLane>(accel: &Accel, rays: &Rays, coherence: Coherence) -> f32 {
    let mut sum = L::zero();
    for at in (0..rays.len()).step_by(L::N) {
        let hit = accel.intersect(L::Mask::splat(true), &rays.packet::<L>(at), coherence);
        sum = sum + hit.t.or_zero(hit.found) + hit.ng.x;
    }
    sum.lane(0)
}

fn blocked<L: TraceLane>(accel: &Accel, rays: &Rays, coherence: Coherence) -> usize {
    (0..rays.len())
        .step_by(L::N)
        .map(|at| {
            accel
                .occluded(L::Mask::splat(true), &rays.packet::<L>(at), coherence)
                .count()
        })
        .sum()
}

fn queries(c: &mut Criterion, place: &Place) {
    let mut group = c.benchmark_group(format!("queries: {}", place.name));
    let accel = &place.accel;
    for (order, shuffle) in [("tile order", false), ("shuffled", true)] {
        let arranged = |rays: &Rays| {
            if shuffle {
                rays.shuffled()
            } else {
                Rays::new((0..rays.len()).map(|i| rays.row(i)), rays.skip_id)
            }
        };
        let (eye, shadow) = (arranged(&place.eye), arranged(&place.shadow));
        for (flag, coherence) in [("COHERENT", Coherence::Coherent), ("INCOHERENT", Coherence::Incoherent)] {
            let eight = format!("8 wide, {flag}");
            let one = format!("1 wide, {flag}");
            let name = format!("intersect, eye, {order}");
            group.throughput(Throughput::Elements(eye.len() as u64));
            group.bench_function(BenchmarkId::new(&name, &eight), |b| {
                b.iter(|| nearest::<F32x8>(accel, &eye, coherence));
            });
            group.bench_function(BenchmarkId::new(&name, &one), |b| {
                b.iter(|| nearest::<f32>(accel, &eye, coherence));
            });
            let name = format!("occluded, shadow, {order}");
            group.throughput(Throughput::Elements(shadow.len() as u64));
            group.bench_function(BenchmarkId::new(&name, &eight), |b| {
                b.iter(|| blocked::<F32x8>(accel, &shadow, coherence));
            });
            group.bench_function(BenchmarkId::new(&name, &one), |b| {
                b.iter(|| blocked::<f32>(accel, &shadow, coherence));
            });
        }
    }
}

fn main() {
    let mut c = common::criterion();
    let device = Device::new(1).expect("Embree");
    for place in [veach(&device), waves(&device)] {
        queries(&mut c, &place);
    }
    c.final_summary();
    common::note_circumstances("queries", &BTreeMap::new());
}
