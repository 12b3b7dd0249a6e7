//! A start-up check that the loaded Embree reads and writes rays in the layout of our structs.
//!
//! Bindings for another version compile, link and seem to work. But Embree 4.3 appended a field to its hits, and with structs of
//! 4.2 every hit overwrites 4 to 64 bytes of whatever follows. So each query of each width traces rays with known results, between
//! guard bytes: towards an emissive triangle and spheres, so that all callbacks run.

use std::fmt::Debug;
use std::ptr;

use bytemuck::Zeroable;

use super::device::{Device, EmbreeError};
use super::ffi;
use super::packet::Valid;
use super::scene::{Accel, SceneBuilder};
use crate::shape::{BoundingSphere, NO_SKIP_ID, SkipIds};

const FENCE: u8 = 0xA5;
const FENCE_BYTES: usize = 64;

/// Identifiers unlikely to appear in an uninitialized or misplaced field. The spheres follow the triangle.
const TRIANGLE: u32 = 77;
const SPHERES: u32 = TRIANGLE + 1;

/// The sphere that is hit, and the skip ids of the triangle.
const SPHERE: u32 = 2;
const AIM: SkipIds = SkipIds {
    first: SkipIds::TRIANGLE + 5,
    each: true,
};

/// A value between two guard regions, without padding: 64 is a multiple of every alignment here, and sizes are multiples of
/// alignments.
#[repr(C, align(64))]
pub(super) struct Fenced<T> {
    before: [u8; FENCE_BYTES],
    pub(super) value: T,
    after: [u8; FENCE_BYTES],
}

impl<T> Fenced<T> {
    pub(super) fn new(value: T) -> Self {
        Self {
            before: [FENCE; FENCE_BYTES],
            value,
            after: [FENCE; FENCE_BYTES],
        }
    }

    /// A pointer to the value that may also access the guards, because the test checks whether Embree does.
    pub(super) fn pointer(&mut self) -> *mut T {
        // SAFETY: the offset of a field lies inside `self`, from which the pointer's permission to access comes.
        unsafe { ptr::from_mut(self).byte_add(std::mem::offset_of!(Self, value)).cast() }
    }

    /// Number of guard bytes that changed.
    pub(super) fn damage(&self) -> usize {
        self.before
            .iter()
            .chain(&self.after)
            .filter(|&&byte| byte != FENCE)
            .count()
    }
}

/// Traces rays with every query that Octolux uses, singly and in packets of eight and sixteen. Checks the results and the guard
/// bytes.
///
/// # Errors
/// [`EmbreeError::Layout`] if the library and our structs differ, [`EmbreeError::Reported`] if a call fails.
pub fn layout_canary(device: &Device) -> Result<(), EmbreeError> {
    let scene = scene(device)?;
    let verdict = one(&scene).and_then(|()| eight(&scene)).and_then(|()| sixteen(&scene));
    device.check()?;
    verdict.map_err(|what| EmbreeError::Layout {
        version: device.version(),
        what,
    })
}

/// An emissive triangle, (0, 0, 0), (2, 0, 0), (0, 4, 0), and three spheres, one of which is hit.
fn scene(device: &Device) -> Result<Accel, EmbreeError> {
    let mut builder = SceneBuilder::counting_from(TRIANGLE, device, true)?;
    let corners = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 4.0, 0.0]];
    builder.add_light(&corners, &[[0, 1, 2]], AIM)?;
    let ball = |x| BoundingSphere {
        center: [x, Y, 0.5],
        radius: 0.5,
    };
    builder.set_spheres(vec![ball(50.0), ball(60.0), ball(AT_SPHERE)])?;
    builder.commit()
}

/// Rays start at this depth below the triangle and the spheres, and go up.
const DEPTH: f32 = 3.0;
const Y: f32 = 1.0;
const AT_SPHERE: f32 = -3.0;

/// A ray, by its expected hit.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Trial {
    /// The triangle, at u = x/2, v = y/4.
    Triangle { x: f32, skip_id: u32 },
    /// The sphere.
    Sphere { skip_id: u32 },
    /// A miss.
    Nothing,
    /// The triangle, but the lane is inactive.
    Off,
}

const TRIALS: [Trial; 8] = [
    Trial::Triangle {
        x: 0.5,
        skip_id: NO_SKIP_ID,
    },
    Trial::Sphere { skip_id: NO_SKIP_ID },
    Trial::Triangle {
        x: 0.25,
        skip_id: AIM.first,
    },
    Trial::Off,
    Trial::Sphere { skip_id: SPHERE },
    Trial::Triangle {
        x: 0.125,
        skip_id: SPHERE,
    },
    Trial::Nothing,
    Trial::Sphere { skip_id: AIM.first },
];

impl Trial {
    const fn x(self) -> f32 {
        match self {
            Self::Triangle { x, .. } => x,
            Self::Sphere { .. } => AT_SPHERE,
            Self::Nothing => -1.0,
            Self::Off => 0.5,
        }
    }

    const fn skip_id(self) -> u32 {
        match self {
            Self::Triangle { skip_id, .. } | Self::Sphere { skip_id } => skip_id,
            Self::Nothing | Self::Off => NO_SKIP_ID,
        }
    }

    /// −1 for active lanes.
    const fn valid(self) -> i32 {
        if matches!(self, Self::Off) { 0 } else { -1 }
    }

    /// The expected result of a closest-hit query.
    const fn nearest(self) -> Found {
        let none = ffi::RTC_INVALID_GEOMETRY_ID;
        match self {
            Self::Triangle { x, .. } => Found {
                reals: [DEPTH, 0.0, 0.0, 8.0, x / 2.0, Y / 4.0],
                ids: [0, TRIANGLE, none, none],
            },
            Self::Sphere { .. } => Found {
                reals: [DEPTH, 0.0, 0.0, -0.5, 0.0, 0.0],
                ids: [SPHERE, SPHERES, none, none],
            },
            Self::Nothing | Self::Off => Found {
                reals: [f32::INFINITY, 0.0, 0.0, 0.0, 0.0, 0.0],
                ids: [0, none, 0, 0],
            },
        }
    }

    /// The distance that an occlusion query must leave.
    const fn end(self) -> f32 {
        match self {
            Self::Triangle { skip_id, .. } if skip_id != AIM.first => f32::NEG_INFINITY,
            Self::Sphere { skip_id } if skip_id != SPHERE => f32::NEG_INFINITY,
            _ => f32::INFINITY,
        }
    }
}

/// Checks both queries of `$n` rays.
macro_rules! check {
    ($name:ident, $n:literal, $ray:ident, $rayhit:ident, |$functions:ident, $valid:ident, $scene:ident, $packet:ident|
     $nearest:expr, $occluded:expr) => {
        fn $name(accel: &Accel) -> Result<(), String> {
            let (name, $functions, $scene) = (stringify!($rayhit), accel.functions(), accel.handle());
            for first in (0..TRIALS.len()).step_by($n) {
                let trials: [Trial; $n] = std::array::from_fn(|lane| TRIALS[(first + lane) % TRIALS.len()]);
                let mask = Valid(trials.map(Trial::valid));
                // A single ray has no mask.
                if mask.0 == [0; $n] {
                    continue;
                }
                let $valid = mask.0.as_ptr();
                let mut before: ffi::$rayhit = Zeroable::zeroed();
                before.ray.org_x = trials.map(Trial::x);
                before.ray.org_y = [Y; $n];
                before.ray.org_z = [-DEPTH; $n];
                before.ray.dir_z = [1.0; $n];
                before.ray.tfar = [f32::INFINITY; $n];
                before.ray.mask = [u32::MAX; $n];
                before.ray.id = trials.map(Trial::skip_id);
                before.hit.geomID = [ffi::RTC_INVALID_GEOMETRY_ID; $n];

                let mut fenced = Fenced::new(before);
                let $packet = fenced.pointer();
                // SAFETY: the scene is committed and alive; packet and mask are initialised and aligned; null asks for default
                // options.
                unsafe { $nearest };
                intact(name, fenced.damage())?;
                let ffi::$rayhit { ray, hit } = &fenced.value;
                for (lane, trial) in trials.into_iter().enumerate() {
                    let found = Found {
                        reals: [&ray.tfar, &hit.Ng_x, &hit.Ng_y, &hit.Ng_z, &hit.u, &hit.v].map(|of| of[lane]),
                        ids: [&hit.primID, &hit.geomID, &hit.instID, &hit.instPrimID].map(|of| of[lane]),
                    };
                    let right = trial.nearest();
                    expect(name, found.is(&right), &found, &right)?;
                }

                // Rays followed by space for hits, as `packet.rs` passes them.
                let mut fenced = Fenced::new(before);
                let $packet = fenced.pointer().cast::<ffi::$ray>();
                // SAFETY: as above.
                unsafe { $occluded };
                intact(name, fenced.damage())?;
                let (found, right) = (fenced.value.ray.tfar, trials.map(Trial::end));
                expect(name, found == right, &found, &right)?;
            }
            Ok(())
        }
    };
}

check!(
    one,
    1,
    RTCRay,
    RTCRayHit,
    |embree, _valid, scene, packet| embree.rtcIntersect1(scene, packet, ptr::null_mut()),
    embree.rtcOccluded1(scene, packet, ptr::null_mut())
);
check!(
    eight,
    8,
    RTCRay8,
    RTCRayHit8,
    |embree, valid, scene, packet| embree.rtcIntersect8(valid, scene, packet, ptr::null_mut()),
    embree.rtcOccluded8(valid, scene, packet, ptr::null_mut())
);
check!(
    sixteen,
    16,
    RTCRay16,
    RTCRayHit16,
    |embree, valid, scene, packet| embree.rtcIntersect16(valid, scene, packet, ptr::null_mut()),
    embree.rtcOccluded16(valid, scene, packet, ptr::null_mut())
);

fn intact(name: &str, damage: usize) -> Result<(), String> {
    if damage == 0 {
        Ok(())
    } else {
        Err(format!("it changes {damage} bytes outside {name}"))
    }
}

fn expect<T: Debug>(name: &str, right: bool, found: &T, expected: &T) -> Result<(), String> {
    if right {
        return Ok(());
    }
    Err(format!(
        "rays of known answer come back in {name} as {found:?} and not as {expected:?}"
    ))
}

/// The result of one lane: distance, normal, u and v; primitive, geometry and both instance ids.
#[derive(Clone, Copy, Debug)]
struct Found {
    reals: [f32; 6],
    ids: [u32; 4],
}

impl Found {
    /// Whether it is as expected. Embree's triangles differ in the last digit between instruction sets.
    fn is(&self, expected: &Self) -> bool {
        let close = |(&a, &b): (&f32, &f32)| a == b || (a - b).abs() <= 1e-5;
        self.ids == expected.ids && self.reals.iter().zip(&expected.reals).all(close)
    }
}

#[cfg(test)]
mod tests {
    use super::super::library::embree;
    use super::*;

    #[test]
    fn the_loaded_library_fits_our_structs() {
        assert_eq!(layout_canary(&Device::new(1).unwrap()), Ok(()));
    }

    /// Without packets of a width, Embree traces rays one by one, through other code.
    #[test]
    fn it_fits_without_packets_too() {
        for (isa, packets) in [("avx2", [true, false]), ("sse2", [false, false])] {
            let device = Device::configured(&format!("threads=1,isa={isa}"), embree().unwrap()).unwrap();
            assert_eq!([8, 16].map(|lanes| device.packets().has(lanes)), packets, "{isa}");
            assert_eq!(layout_canary(&device), Ok(()), "{isa}");
        }
    }

    #[test]
    fn a_struct_that_is_too_short_is_found_out() {
        // The struct in bindings of Embree 4.2: their `RTCHit8` ends before `instPrimID`.
        #[repr(C)]
        struct Short {
            ray: ffi::RTCRay8,
            hit: [[u32; 8]; 8],
        }
        let device = Device::new(1).unwrap();
        let scene = scene(&device).unwrap();
        let mut packet = Fenced::new(Short {
            ray: ffi::RTCRay8 {
                org_x: [0.5; 8],
                org_y: [Y; 8],
                org_z: [-DEPTH; 8],
                dir_z: [1.0; 8],
                tfar: [f32::INFINITY; 8],
                mask: [u32::MAX; 8],
                ..ffi::RTCRay8::zeroed()
            },
            hit: [[0; 8]; 8],
        });
        packet.value.hit[6] = [ffi::RTC_INVALID_GEOMETRY_ID; 8];
        let (valid, pointer) = (Valid([-1_i32; 8]), packet.pointer().cast());
        // SAFETY: as in `eight`; what Embree writes past `Short` stays inside the fence, which the pointer may touch.
        unsafe {
            let functions = scene.functions();
            functions.rtcIntersect8(valid.0.as_ptr(), scene.handle(), pointer, ptr::null_mut());
        };
        assert_eq!(packet.value.hit[6], [TRIANGLE; 8]);
        assert_eq!(packet.damage(), 32);
    }

    /// The canary detects wrong results: a hit in another field, a hit in an inactive lane, a light that occludes itself.
    #[test]
    fn a_wrong_answer_is_found_out() {
        let right = TRIALS[0].nearest();
        let [a, b, c, d] = right.ids;
        let other_order = Found {
            ids: [b, a, c, d],
            ..right
        };
        let farther = Found {
            reals: right.reals.map(|x| x + 0.1),
            ..right
        };
        assert!(right.is(&right));
        assert!(!other_order.is(&right) && !farther.is(&right) && !Trial::Nothing.nearest().is(&right));
        let ends = [Trial::Off, TRIALS[2], TRIALS[4], Trial::Nothing].map(Trial::end);
        assert_eq!(ends, [f32::INFINITY; 4]);
        assert_eq!([TRIALS[0], TRIALS[1]].map(Trial::end), [f32::NEG_INFINITY; 2]);
    }
}
