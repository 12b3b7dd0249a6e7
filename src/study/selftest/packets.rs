//! Cases 36 and 37: films and packets of awkward sizes.

use super::bench;
use super::bench::SelftestError;
use super::row::{Check, Checks, Effort};
use crate::embree::{Coherence, Device, SceneBuilder};
use crate::lane::{Bits, F32x8, Lane, Mask, Mask8, U32x8, Word};
use crate::math::Vec3;
use crate::pipeline::{Settings, widest_lanes};
use crate::scene::{EstimatorKind, Scene};
use crate::settings::Lanes;
use crate::shape::{BoundingSphere, NO_SKIP_ID, Ray};

/// Pixels whose bits depend on the packet width.
fn widths(scene: &Scene, [width, height]: [u32; 2], passes: u32) -> Result<usize, SelftestError> {
    let mut different = 0;
    for estimator in [EstimatorKind::Mis, EstimatorKind::Brdf] {
        for accel in bench::ACCELS {
            let settings = Settings {
                accel: Some(accel),
                ..bench::settings(width, height, estimator)
            };
            let one = bench::picture(
                scene,
                Settings {
                    lanes: Some(Lanes::One),
                    ..settings
                },
                passes,
            )?;
            for lanes in [Lanes::Eight, widest_lanes()] {
                different += bench::differences(
                    &one,
                    &bench::picture(
                        scene,
                        Settings {
                            lanes: Some(lanes),
                            ..settings
                        },
                        passes,
                    )?,
                );
            }
        }
    }
    Ok(different)
}

/// Case 36.
pub fn awkward_films(effort: Effort) -> Checks {
    let scene = bench::scene(include_str!("../../../scenes/veach-mis.toml"))?;
    let (mut small, mut long) = (0, 0);
    for size in [[1, 1], [1, 7], [9, 1], [17, 3], [15, 16], [31, 2]] {
        for passes in [1, 3] {
            small += widths(&scene, size, passes)?;
        }
    }
    let side = effort.of(65_536);
    for size in [[1, side], [side, 1]] {
        long += widths(&scene, size, 1)?;
    }
    Ok(vec![
        Check::none(
            "films of 1 x 1 to 31 x 2: pixels whose bits follow the width of packets",
            small,
        ),
        Check::none("films of 1 x 65536 and 65536 x 1: such pixels", long),
    ])
}

/// Case 37.
pub fn idle_lanes(_: Effort) -> Checks {
    let device = Device::new(1)?;
    let mut builder = SceneBuilder::new(&device, true)?;
    builder.add_mesh(&[[-9.0, -9.0, 5.0], [9.0, -9.0, 5.0], [0.0, 9.0, 5.0]], &[[0, 1, 2]])?;
    builder.set_spheres(vec![BoundingSphere {
        center: [0.5, 0.0, 3.0],
        radius: 0.5,
    }])?;
    let accel = builder.commit()?;
    let (mut idle, mut different) = (0, 0);
    for step in 0..64_u16 {
        let x = f32::from(step) / 32.0 - 1.0;
        let along = |i: usize| x + i as f32 / 300.0;
        let ray = Ray {
            origin: Vec3::<F32x8>::zero(),
            direction: Vec3::new(F32x8::from_fn(along), F32x8::splat(0.1), F32x8::splat(4.0)),
            tfar: F32x8::splat(f32::INFINITY),
            skip_id: U32x8::splat(NO_SKIP_ID),
        };
        let none = Mask8::splat(false);
        idle += accel.intersect(none, &ray, Coherence::Incoherent).found.count();
        idle += accel.occluded(none, &ray, Coherence::Incoherent).count();
        for lane in 0..8 {
            let one = Mask8::from_bitmask(1 << lane);
            let single = Ray {
                origin: Vec3::<f32>::zero(),
                direction: Vec3::splat(ray.direction.lane(lane)),
                tfar: f32::INFINITY,
                skip_id: Word(NO_SKIP_ID),
            };
            for coherence in [Coherence::Coherent, Coherence::Incoherent] {
                let (wide, scalar) = (
                    accel.intersect(one, &ray, coherence),
                    accel.intersect(true, &single, coherence),
                );
                let same = wide.found.to_bitmask() == (u32::from(scalar.found)) << lane
                    && wide.t.lane(lane).to_bits() == scalar.t.to_bits()
                    && wide.primitive.lane(lane) == scalar.primitive.0;
                different += usize::from(!same);
            }
        }
    }
    Ok(vec![
        Check::none("hits of packets without an active lane", idle),
        Check::none(
            "packets with one active lane that answer otherwise than one ray",
            different,
        ),
    ])
}
