//! Guard bytes around each packet: every kind of query, on triangles and our spheres, with every kind of mask, writes nothing
//! outside its packet and nothing into inactive lanes. This also holds if Embree has no packets of a width and traces rays one by
//! one: occlusion queries then read and write the space for hits after the rays.

use std::ptr;

use bytemuck::Zeroable;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::canary::Fenced;
use super::library::embree;
use super::packet::Valid;
use super::{Accel, BoundingSphere, Device, SceneBuilder, ffi};

/// A square of two triangles, with twenty spheres in front of and behind it.
fn scene(settings: &str) -> Accel {
    let device = Device::configured(settings, embree().unwrap()).unwrap();
    let mut builder = SceneBuilder::new(&device, true).unwrap();
    let square = [[-2.0, -2.0, 5.0], [2.0, -2.0, 5.0], [2.0, 2.0, 5.0], [-2.0, 2.0, 5.0]];
    builder.add_mesh(&square, &[[0, 1, 2], [0, 2, 3]]).unwrap();
    let mut rng = Pcg64::seed_from_u64(4);
    let balls = (0..20).map(|_| BoundingSphere {
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

/// Settings with all packets of this processor, with those of eight rays at most, and without any.
const SETTINGS: [&str; 3] = ["threads=1", "threads=1,isa=avx2", "threads=1,isa=sse2"];

/// Checks `$call` on packets of `$n` rays.
macro_rules! every_packet {
    ($n:literal, $packet:ident, |$accel:ident, $valid:ident, $pointer:ident| $call:expr) => {
        for settings in SETTINGS {
            every_packet!(settings, $n, $packet, |$accel, $valid, $pointer| $call);
        }
    };
    ($settings:ident, $n:literal, $packet:ident, |$accel:ident, $valid:ident, $pointer:ident| $call:expr) => {{
        let $accel = scene($settings);
        let mut rng = Pcg64::seed_from_u64($n);
        let (mut hits, mut idle) = (0, 0);
        for _ in 0..3_000 {
            let mut packet = Fenced::new(ffi::$packet::zeroed());
            {
                let ray = &mut packet.value.ray;
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
            // All lanes, none, one, or random lanes.
            let bits: u32 = match rng.random_range(0..4) {
                0 => !0,
                1 => 0,
                2 => 1 << rng.random_range(0..$n),
                _ => rng.random(),
            };
            let $valid = Valid::<16>(std::array::from_fn(|lane| {
                if $n == 1 || bits >> lane & 1 == 1 { -1 } else { 0 }
            }));
            packet.value.hit.geomID = [ffi::RTC_INVALID_GEOMETRY_ID; $n];
            let before = packet.value.ray;
            let $pointer = packet.pointer();
            // SAFETY: the scene is committed and alive; packet and mask are initialised and aligned.
            unsafe { $call };
            let after = packet.value.ray;
            assert_eq!(packet.damage(), 0, "bytes around a packet of {} changed", $n);
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
    every_packet!(1, RTCRayHit, |accel, _valid, packet| {
        accel.functions().rtcIntersect1(accel.handle(), packet, ptr::null_mut());
    });
    every_packet!(8, RTCRayHit8, |accel, valid, packet| {
        accel
            .functions()
            .rtcIntersect8(valid.0.as_ptr(), accel.handle(), packet, ptr::null_mut());
    });
    every_packet!(16, RTCRayHit16, |accel, valid, packet| {
        accel
            .functions()
            .rtcIntersect16(valid.0.as_ptr(), accel.handle(), packet, ptr::null_mut());
    });
}

#[test]
fn visibility_queries_stay_inside_their_packets() {
    every_packet!(1, RTCRayHit, |accel, _valid, packet| {
        accel
            .functions()
            .rtcOccluded1(accel.handle(), packet.cast(), ptr::null_mut());
    });
    every_packet!(8, RTCRayHit8, |accel, valid, packet| {
        accel
            .functions()
            .rtcOccluded8(valid.0.as_ptr(), accel.handle(), packet.cast(), ptr::null_mut());
    });
    every_packet!(16, RTCRayHit16, |accel, valid, packet| {
        accel
            .functions()
            .rtcOccluded16(valid.0.as_ptr(), accel.handle(), packet.cast(), ptr::null_mut());
    });
}
