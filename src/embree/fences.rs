//! A canary after each packet: every kind of query, on triangles and on our spheres, with every kind of mask, writes
//! nothing outside its packet and nothing into idle lanes.

use std::ptr;

use bytemuck::Zeroable;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::canary::Fenced;
use super::{Accel, Ball, Device, SceneBuilder, ffi};

/// A square of two triangles and twenty spheres before and behind it.
fn scene() -> Accel {
    let device = Device::new(1).unwrap();
    let mut builder = SceneBuilder::new(&device, true).unwrap();
    let square = [[-2.0, -2.0, 5.0], [2.0, -2.0, 5.0], [2.0, 2.0, 5.0], [-2.0, 2.0, 5.0]];
    builder.add_mesh(&square, &[[0, 1, 2], [0, 2, 3]]).unwrap();
    let mut rng = Pcg64::seed_from_u64(4);
    let balls = (0..20).map(|_| Ball {
        center: [
            rng.random_range(-3.0..3.0),
            rng.random_range(-3.0..3.0),
            rng.random_range(2.0..8.0),
        ],
        radius: rng.random_range(0.05..0.8),
    });
    builder.set_spheres(balls.collect()).unwrap();
    builder.commit().unwrap()
}

/// Embree reads masks with aligned loads.
#[repr(align(64))]
struct Valid([i32; 16]);

/// Checks `$call` on packets of `$n` rays; `$ray` is the field that holds the ray.
macro_rules! every_packet {
    ($n:literal, $packet:ident, |$p:ident| $ray:expr, |$accel:ident, $valid:ident, $pointer:ident| $call:expr) => {{
        let $accel = scene();
        let mut rng = Pcg64::seed_from_u64($n);
        let (mut hits, mut idle) = (0, 0);
        for _ in 0..3_000 {
            let mut $p = Fenced::new(ffi::$packet::zeroed());
            {
                let ray = &mut $ray;
                for lane in 0..$n {
                    ray.org_x[lane] = rng.random_range(-0.5..0.5);
                    ray.dir_x[lane] = rng.random_range(-0.6..0.6);
                    ray.dir_y[lane] = rng.random_range(-0.6..0.6);
                    ray.dir_z[lane] = 1.0;
                    ray.tfar[lane] = 100.0;
                    ray.mask[lane] = u32::MAX;
                    ray.id[lane] = rng.random_range(0..25);
                }
            }
            // All lanes, none, one, or any.
            let bits: u32 = match rng.random_range(0..4) {
                0 => !0,
                1 => 0,
                2 => 1 << rng.random_range(0..$n),
                _ => rng.random(),
            };
            let $valid = Valid(std::array::from_fn(|lane| {
                if $n == 1 || bits >> lane & 1 == 1 { -1 } else { 0 }
            }));
            let before = $ray;
            let $pointer = $p.pointer();
            // SAFETY: the scene is committed and alive; packet and mask are initialised and aligned.
            unsafe { $call };
            let after = $ray;
            assert_eq!($p.damage(), 0, "bytes around a packet of {} changed", $n);
            for lane in 0..$n {
                if $valid.0[lane] == 0 {
                    idle += 1;
                    assert_eq!(
                        after.tfar[lane].to_bits(),
                        before.tfar[lane].to_bits(),
                        "an idle lane was written"
                    );
                } else if after.tfar[lane] < 100.0 {
                    hits += 1;
                }
                assert_eq!(after.org_x[lane].to_bits(), before.org_x[lane].to_bits());
                assert_eq!(after.dir_z[lane].to_bits(), before.dir_z[lane].to_bits());
                assert_eq!(after.id[lane], before.id[lane]);
            }
        }
        assert!(hits > 500, "{hits} hits: the test sees nothing");
        assert!($n == 1 || idle > 500, "{idle} idle lanes: the test sees nothing");
    }};
}

#[test]
fn intersections_stay_inside_their_packets() {
    every_packet!(1, RTCRayHit, |p| p.value.ray, |accel, _valid, pointer| {
        (*pointer).hit.geomID = [ffi::RTC_INVALID_GEOMETRY_ID];
        ffi::rtcIntersect1(accel.handle(), pointer, ptr::null_mut());
    });
    every_packet!(8, RTCRayHit8, |p| p.value.ray, |accel, valid, pointer| {
        (*pointer).hit.geomID = [ffi::RTC_INVALID_GEOMETRY_ID; 8];
        ffi::rtcIntersect8(valid.0.as_ptr(), accel.handle(), pointer, ptr::null_mut());
    });
    every_packet!(16, RTCRayHit16, |p| p.value.ray, |accel, valid, pointer| {
        (*pointer).hit.geomID = [ffi::RTC_INVALID_GEOMETRY_ID; 16];
        ffi::rtcIntersect16(valid.0.as_ptr(), accel.handle(), pointer, ptr::null_mut());
    });
}

#[test]
fn visibility_queries_stay_inside_their_packets() {
    every_packet!(1, RTCRay, |p| p.value, |accel, _valid, pointer| {
        ffi::rtcOccluded1(accel.handle(), pointer, ptr::null_mut());
    });
    every_packet!(8, RTCRay8, |p| p.value, |accel, valid, pointer| {
        ffi::rtcOccluded8(valid.0.as_ptr(), accel.handle(), pointer, ptr::null_mut());
    });
    every_packet!(16, RTCRay16, |p| p.value, |accel, valid, pointer| {
        ffi::rtcOccluded16(valid.0.as_ptr(), accel.handle(), pointer, ptr::null_mut());
    });
}
