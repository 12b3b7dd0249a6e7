//! Shapes in a line answer as Embree does, and culling changes no answer at all.

use octolux::embree::{Coherence, Device, SceneBuilder};
use octolux::lane::{Bits, F32x8, Lane, Mask, U32x8};
use octolux::linear::cull::{Bounds, Points};
use octolux::linear::{Candidates, LinearScene};
use octolux::math::Vec3;
use octolux::shape::{BoundingSphere, NO_SKIP_ID, Ray};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

/// A dozen triangles and five spheres, anywhere within 4 units of a point 6 units away from the origin.
struct World {
    line: LinearScene,
    vertices: Vec<[f32; 3]>,
    triangles: Vec<[u32; 3]>,
    balls: Vec<BoundingSphere>,
}

fn point(rng: &mut Pcg64, reach: f32) -> [f32; 3] {
    std::array::from_fn(|k| rng.random_range(-reach..reach) + if k == 2 { 6.0 } else { 0.0 })
}

fn world(rng: &mut Pcg64) -> World {
    let vertices: Vec<[f32; 3]> = (0..36).map(|_| point(rng, 4.0)).collect();
    let triangles: Vec<[u32; 3]> = (0..12).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    let balls: Vec<BoundingSphere> = (0..5)
        .map(|_| BoundingSphere {
            center: point(rng, 4.0),
            radius: rng.random_range(0.05..0.9),
        })
        .collect();
    let mut line = LinearScene::default();
    line.add_mesh(0, &vertices, &triangles, None);
    line.set_spheres(balls.clone(), 1);
    World {
        line,
        vertices,
        triangles,
        balls,
    }
}

fn lanes(mut f: impl FnMut() -> [f32; 3]) -> Vec3<F32x8> {
    let eight: [[f32; 3]; 8] = std::array::from_fn(|_| f());
    Vec3::new(
        F32x8::from_fn(|i| eight[i][0]),
        F32x8::from_fn(|i| eight[i][1]),
        F32x8::from_fn(|i| eight[i][2]),
    )
}

#[test]
fn a_line_and_embree_name_the_same_shapes() {
    let mut rng = Pcg64::seed_from_u64(1);
    let device = Device::new(1).unwrap();
    let (mut rays, mut different) = (0_u32, 0_u32);
    for _ in 0..20 {
        let world = world(&mut rng);
        let mut builder = SceneBuilder::new(&device, true).unwrap();
        builder.add_mesh(&world.vertices, &world.triangles).unwrap();
        builder.set_spheres(world.balls.clone()).unwrap();
        let accel = builder.commit().unwrap();
        let mut all = Candidates::default();
        world.line.all(&mut all);
        for _ in 0..2_000 {
            let ray = Ray {
                origin: lanes(|| point(&mut rng, 5.0)),
                direction: lanes(|| std::array::from_fn(|_| rng.random_range(-1.0..1.0))),
                tfar: F32x8::splat(f32::INFINITY),
                skip_id: U32x8::splat(NO_SKIP_ID),
            };
            let active = Mask::splat(true);
            let ours = world.line.intersect(&all, active, &ray).0;
            let theirs = accel.intersect(active, &ray, Coherence::Incoherent);
            let blocked = world.line.occluded(&all, active, &ray);
            assert_eq!(
                blocked.to_bitmask(),
                ours.found.to_bitmask(),
                "a ray that meets something is blocked by it"
            );
            rays += 8;
            for lane in 0..8 {
                let found = |bits: u32| bits >> lane & 1 == 1;
                let (a, b) = (found(ours.found.to_bitmask()), found(theirs.found.to_bitmask()));
                let same = a == b
                    && (!a
                        || (ours.geometry.lane(lane), ours.primitive.lane(lane))
                            == (theirs.geometry.lane(lane), theirs.primitive.lane(lane)));
                if !same {
                    different += 1;
                } else if a {
                    let (s, t) = (ours.t.lane(lane), theirs.t.lane(lane));
                    assert!((s - t).abs() <= 2e-4 * t.abs().max(1e-2), "distances {s} and {t}");
                }
            }
        }
    }
    // What is left are rays within rounding of an edge: about 1e-6 of random rays.
    assert!(
        different * 10_000 < rays,
        "{different} of {rays} rays meet another shape"
    );
}

#[test]
fn culling_for_a_light_changes_no_answer() {
    let mut rng = Pcg64::seed_from_u64(2);
    let (mut kept, mut of, mut blocked) = (0_usize, 0_usize, 0_usize);
    for _ in 0..400 {
        let world = world(&mut rng);
        let mut all = Candidates::default();
        world.line.all(&mut all);
        // Points of a tile: a patch on a triangle, a hair above it, or anywhere in a small box.
        let corner = point(&mut rng, 4.0);
        let size = 10.0_f32.powf(rng.random_range(-3.0..0.3));
        let skip_id = rng.random_range(0..5);
        let light = world.balls[skip_id as usize];
        let mut patch = || -> [f32; 3] { std::array::from_fn(|k| corner[k] + size * rng.random_range(0.0..1.0)) };
        let points: Vec<Vec3<F32x8>> = (0..16).map(|_| lanes(&mut patch)).collect();
        let each = || points.iter().flat_map(|p| (0..8).map(|i| p.lane(i)));
        let bounds = Bounds {
            low: std::array::from_fn(|k| each().map(|p| p[k]).fold(f32::INFINITY, f32::min)),
            high: std::array::from_fn(|k| each().map(|p| p[k]).fold(f32::NEG_INFINITY, f32::max)),
        };
        let mut survey = Points::default();
        world.line.look::<F32x8>(bounds, &mut survey);
        for triangle in 0..world.triangles.len() as u32 {
            let (normal, offset) = world.line.plane(triangle);
            let side = |p: [f32; 3]| Vec3::<f32>::splat(p).dot(Vec3::splat(normal)) - offset;
            let low = each().map(side).fold(f32::INFINITY, f32::min);
            let high = each().map(side).fold(f32::NEG_INFINITY, f32::max);
            survey.measure(triangle, [low, high]);
        }
        let mut set = Candidates::default();
        world.line.in_shaft::<F32x8>(&survey, &light, skip_id, &mut set);
        let mut one_by_one = Candidates::default();
        world.line.in_shaft::<f32>(&survey, &light, skip_id, &mut one_by_one);
        assert_eq!(set, one_by_one, "points at {corner:?} + {size}");
        kept += set.len();
        of += all.len();
        for origin in points {
            // To points in the light, surface and inside.
            let to = lanes(|| {
                let v: [f32; 3] = std::array::from_fn(|_| rng.random_range(-1.0..1.0));
                let length = v.iter().map(|x| x * x).sum::<f32>().sqrt().max(1.0);
                std::array::from_fn(|k| light.center[k] + light.radius * v[k] / length)
            });
            let ray = Ray {
                origin,
                direction: to - origin,
                tfar: F32x8::one(),
                skip_id: U32x8::splat(skip_id),
            };
            let active = Mask::splat(true);
            let full = world.line.occluded(&all, active, &ray).to_bitmask();
            assert_eq!(
                world.line.occluded(&set, active, &ray).to_bitmask(),
                full,
                "points at {corner:?} + {size}"
            );
            blocked += full.count_ones() as usize;
        }
    }
    assert!(kept * 2 < of, "{kept} of {of} shapes kept: culling does nothing");
    assert!(blocked > 10_000, "only {blocked} rays blocked: the test sees nothing");
}

#[test]
fn culling_for_a_tile_changes_no_answer() {
    let mut rng = Pcg64::seed_from_u64(3);
    let (mut kept, mut of, mut met) = (0_usize, 0_usize, 0_usize);
    for _ in 0..400 {
        let world = world(&mut rng);
        let mut all = Candidates::default();
        world.line.all(&mut all);
        let (x, y) = (rng.random_range(-0.9..0.9_f32), rng.random_range(-0.9..0.9_f32));
        let size = 10.0_f32.powf(rng.random_range(-3.0..0.0));
        let at = |u: f32, v: f32| [x + u * size, y + v * size, 1.0];
        let corners = [at(0.0, 0.0), at(1.0, 0.0), at(1.0, 1.0), at(0.0, 1.0)];
        let mut set = Candidates::default();
        world.line.in_frustum::<F32x8>(corners, &mut set);
        let mut one_by_one = Candidates::default();
        world.line.in_frustum::<f32>(corners, &mut one_by_one);
        assert_eq!(set, one_by_one);
        let (mut sorted, mut from_tree) = (world.line.clone(), Candidates::default());
        sorted.sort_spheres();
        sorted.in_frustum::<F32x8>(corners, &mut from_tree);
        assert_eq!(from_tree.len(), set.len(), "a hierarchy keeps what a list keeps");
        kept += set.len();
        of += all.len();
        for _ in 0..64 {
            let ray = Ray {
                origin: Vec3::zero(),
                direction: lanes(|| at(rng.random_range(0.0..1.0), rng.random_range(0.0..1.0))),
                tfar: F32x8::splat(f32::INFINITY),
                skip_id: U32x8::splat(NO_SKIP_ID),
            };
            let active = Mask::splat(true);
            let a = world.line.intersect(&all, active, &ray).0;
            for (line, set) in [(&world.line, &set), (&sorted, &from_tree)] {
                let b = line.intersect(set, active, &ray).0;
                assert_eq!(a.found.to_bitmask(), b.found.to_bitmask());
                for lane in a.found.lanes() {
                    assert_eq!(a.t.lane(lane).to_bits(), b.t.lane(lane).to_bits());
                    assert_eq!(a.primitive.lane(lane), b.primitive.lane(lane));
                }
            }
            met += a.found.count();
        }
    }
    assert!(kept * 2 < of, "{kept} of {of} shapes kept: culling does nothing");
    assert!(met > 10_000, "only {met} rays meet anything: the test sees nothing");
}

/// Spheres of one size, of many sizes, in clusters and at one place: a hierarchy of them keeps exactly those that a list keeps, and the
/// selection for a few rays changes no answer.
#[test]
fn a_hierarchy_of_spheres_changes_no_answer() {
    let mut rng = Pcg64::seed_from_u64(4);
    let (mut kept, mut of, mut selected, mut crowds, mut blocked) = (0, 0, 0, 0, 0);
    for round in 0..200 {
        let number = [1, 7, 8, 9, 65, 600, 2000][round % 7];
        let spread = [4.0, 0.5, 0.0, 4.0, 4.0][round % 5];
        let balls: Vec<BoundingSphere> = (0..number)
            .map(|_| BoundingSphere {
                center: point(&mut rng, 4.0).map(|x| if spread > 0.0 { x * spread / 4.0 } else { 3.0 }),
                radius: 10.0_f32.powf(rng.random_range(-2.5..-1.0)),
            })
            .collect();
        let (mut line, mut sorted) = (LinearScene::default(), LinearScene::default());
        line.set_spheres(balls.clone(), 0);
        sorted.set_spheres(balls.clone(), 0);
        sorted.sort_spheres();
        let mut all = Candidates::default();
        line.all(&mut all);
        let corner = point(&mut rng, 4.0);
        let size = 10.0_f32.powf(rng.random_range(-3.0..0.3));
        let skip_id = rng.random_range(0..number);
        let light = balls[skip_id as usize];
        let bounds = Bounds {
            low: corner,
            high: corner.map(|x| x + size),
        };
        let (mut survey, mut set, mut from_tree) = (Points::default(), Candidates::default(), Candidates::default());
        line.look::<F32x8>(bounds, &mut survey);
        line.in_shaft::<F32x8>(&survey, &light, skip_id, &mut set);
        sorted.in_shaft::<F32x8>(&survey, &light, skip_id, &mut from_tree);
        assert_eq!(
            set.len(),
            from_tree.len(),
            "of {number} spheres, from {corner:?} + {size}"
        );
        // The same among what lies between the points and a box around the light, which holds other lights as well.
        let around = Bounds {
            low: light.center.map(|x| x - light.radius - 0.3),
            high: light.center.map(|x| x + light.radius + 0.2),
        };
        let (mut wide, mut narrowed) = (Candidates::default(), Candidates::default());
        let ball = BoundingSphere::around(&[around.low, around.high]);
        sorted.in_shaft_to::<F32x8>(&survey, &around, (&ball, NO_SKIP_ID), &mut wide);
        let target = Bounds {
            low: light.center.map(|x| x - 1.001 * light.radius),
            high: light.center.map(|x| x + 1.001 * light.radius),
        };
        sorted.in_shaft_of::<F32x8>(&survey, &target, (&light, skip_id), &wide, &mut narrowed);
        assert!(narrowed.len() <= wide.len());
        kept += set.len();
        of += all.len();
        for _ in 0..8 {
            // Neighbors in a part of the box.
            let part: [f32; 3] = std::array::from_fn(|k| corner[k] + size * rng.random_range(0.0..0.8));
            let origins: Vec<[f32; 3]> = (0..8)
                .map(|_| std::array::from_fn(|k| part[k] + 0.2 * size * rng.random_range(0.0..1.0)))
                .collect();
            let mut near = from_tree.without_balls();
            from_tree.narrow(&BoundingSphere::around(&origins), &mut near);
            selected += near.len();
            crowds += from_tree.len();
            let mut each = origins.iter();
            let origin = lanes(|| *each.next().unwrap());
            let to = lanes(|| {
                let v: [f32; 3] = std::array::from_fn(|_| rng.random_range(-1.0..1.0));
                let length = v.iter().map(|x| x * x).sum::<f32>().sqrt().max(1.0);
                std::array::from_fn(|k| light.center[k] + light.radius * v[k] / length)
            });
            let ray = Ray {
                origin,
                direction: to - origin,
                tfar: F32x8::one(),
                skip_id: U32x8::splat(skip_id),
            };
            let active = Mask::splat(true);
            let full = line.occluded(&all, active, &ray).to_bitmask();
            let sets = [
                (&set, &line),
                (&from_tree, &sorted),
                (&near, &sorted),
                (&wide, &sorted),
                (&narrowed, &sorted),
            ];
            for (candidates, line) in sets {
                let found = line.occluded(candidates, active, &ray).to_bitmask();
                assert_eq!(found, full, "of {number} spheres, from {part:?} + {size}");
            }
            blocked += full.count_ones();
        }
    }
    assert!(kept * 2 < of, "{kept} of {of} spheres kept: culling does nothing");
    assert!(
        selected < crowds,
        "{selected} of {crowds} selected: selecting does nothing"
    );
    assert!(blocked > 1_000, "only {blocked} rays blocked: the test sees nothing");
}
