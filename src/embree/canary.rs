//! A start-up check that the loaded Embree reads and writes rays where our structs have them.
//!
//! Bindings for another version compile, link and seem to work: Embree 4.3 added a field to the end of its hits, and
//! with structs of 4.2 every hit overwrites 4 to 64 bytes of whatever lies behind. So one triangle is hit by one ray
//! and by one packet, between fences of known bytes.

use std::ffi::c_int;
use std::ptr;

use bytemuck::Zeroable;

use super::device::{Device, EmbreeError};
use super::ffi;

const FENCE: u8 = 0xA5;
const FENCE_BYTES: usize = 64;

/// An identity that no uninitialised or misplaced field is likely to show.
const GEOMETRY: u32 = 77;

/// A value between two fences, without gaps: 64 is a multiple of every alignment here, and sizes are multiples of
/// theirs.
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

    /// A pointer to the value that may also touch the fences: whether Embree does is the question.
    pub(super) fn pointer(&mut self) -> *mut T {
        // SAFETY: the offset of a field lies inside `self`, from which the pointer's permission to access comes.
        unsafe { ptr::from_mut(self).byte_add(std::mem::offset_of!(Self, value)).cast() }
    }

    /// How many bytes of the fences changed.
    pub(super) fn damage(&self) -> usize {
        self.before
            .iter()
            .chain(&self.after)
            .filter(|&&byte| byte != FENCE)
            .count()
    }
}

/// Traces one ray and one packet of eight at a triangle, and looks at every field that comes back and at the bytes
/// around. Takes 50 to 140 µs the first time and 13 µs after that.
///
/// # Errors
/// [`EmbreeError::Layout`] if the library and our structs differ, [`EmbreeError::Reported`] if it refuses a call.
pub fn layout_canary(device: &Device) -> Result<(), EmbreeError> {
    let scene = Triangle::new(device)?;
    let verdict = one(&scene).and_then(|()| eight(&scene));
    device.check()?;
    verdict.map_err(|what| EmbreeError::Layout {
        version: device.version(),
        what,
    })
}

/// Rays start here, below the triangle, and go up; the hit is then at u = x/2, v = y/4.
const X: f32 = 0.5;
const Y: f32 = 1.0;
const DEPTH: f32 = 3.0;

fn one(scene: &Triangle) -> Result<(), String> {
    let mut packet = Fenced::new(ffi::RTCRayHit::zeroed());
    let ffi::RTCRayHit { ray, hit } = &mut packet.value;
    (ray.org_x, ray.org_y, ray.org_z) = ([X], [Y], [-DEPTH]);
    (ray.dir_z, ray.tfar, ray.mask) = ([1.0], [f32::INFINITY], [u32::MAX]);
    hit.geomID = [ffi::RTC_INVALID_GEOMETRY_ID];
    // SAFETY: scene committed and alive; the packet is initialised and aligned; null asks for default options.
    unsafe { ffi::rtcIntersect1(scene.0, packet.pointer(), ptr::null_mut()) };

    let ffi::RTCRayHit { ray, hit } = packet.value;
    intact("RTCRayHit", packet.damage())?;
    expect(
        "RTCRayHit",
        Found::lane(
            0,
            &ray.tfar,
            [&hit.Ng_x, &hit.Ng_y, &hit.Ng_z],
            [&hit.u, &hit.v],
            [&hit.primID, &hit.geomID, &hit.instID, &hit.instPrimID],
        ),
        Found::hit(X, Y),
    )
}

/// Which lanes to trace: −1 yes, 0 no. Aligned as Embree wants it.
#[repr(align(32))]
struct Valid([c_int; 8]);

/// Lane 3 is switched off and lane 6 misses; the others hit at places of their own.
fn eight(scene: &Triangle) -> Result<(), String> {
    const OFF: usize = 3;
    const MISS: usize = 6;
    let valid = Valid(std::array::from_fn(|lane| if lane == OFF { 0 } else { -1 }));
    let x: [f32; 8] = std::array::from_fn(|lane| if lane == MISS { -1.0 } else { X / (1 + lane) as f32 });

    let mut packet = Fenced::new(ffi::RTCRayHit8::zeroed());
    packet.value.ray = upwards(x);
    packet.value.hit.geomID = [ffi::RTC_INVALID_GEOMETRY_ID; 8];
    // SAFETY: as in `one`; the mask has eight lanes and is aligned to 32 bytes.
    unsafe { ffi::rtcIntersect8(valid.0.as_ptr(), scene.0, packet.pointer(), ptr::null_mut()) };

    let ffi::RTCRayHit8 { ray, hit } = packet.value;
    intact("RTCRayHit8", packet.damage())?;
    for (lane, &x) in x.iter().enumerate() {
        let found = Found::lane(
            lane,
            &ray.tfar,
            [&hit.Ng_x, &hit.Ng_y, &hit.Ng_z],
            [&hit.u, &hit.v],
            [&hit.primID, &hit.geomID, &hit.instID, &hit.instPrimID],
        );
        expect(
            "RTCRayHit8",
            found,
            if lane == OFF || lane == MISS {
                Found::nothing()
            } else {
                Found::hit(x, Y)
            },
        )?;
    }
    Ok(())
}

fn upwards(x: [f32; 8]) -> ffi::RTCRay8 {
    ffi::RTCRay8 {
        org_x: x,
        org_y: [Y; 8],
        org_z: [-DEPTH; 8],
        dir_z: [1.0; 8],
        tfar: [f32::INFINITY; 8],
        mask: [u32::MAX; 8],
        ..ffi::RTCRay8::zeroed()
    }
}

fn intact(name: &str, damage: usize) -> Result<(), String> {
    if damage == 0 {
        Ok(())
    } else {
        Err(format!("it changes {damage} bytes outside {name}"))
    }
}

fn expect(name: &str, found: Found, expected: Found) -> Result<(), String> {
    // All numbers here are exact in f32 but the thirds, fifths and sevenths of `X`.
    let close = |a: f32, b: f32| a == b || (a - b).abs() <= 1e-5;
    let reals = found.reals.iter().zip(&expected.reals).all(|(&a, &b)| close(a, b));
    if reals && found.ids == expected.ids {
        return Ok(());
    }
    Err(format!(
        "a ray of known answer comes back in {name} as {found:?} and not as {expected:?}"
    ))
}

/// What one lane brought back: distance, normal, u and v; primitive, geometry and both instance numbers.
#[derive(Debug)]
struct Found {
    reals: [f32; 6],
    ids: [u32; 4],
}

impl Found {
    fn lane(lane: usize, tfar: &[f32], ng: [&[f32]; 3], uv: [&[f32]; 2], ids: [&[u32]; 4]) -> Self {
        let [x, y, z] = ng.map(|of| of[lane]);
        let [u, v] = uv.map(|of| of[lane]);
        Self {
            reals: [tfar[lane], x, y, z, u, v],
            ids: ids.map(|of| of[lane]),
        }
    }

    fn hit(x: f32, y: f32) -> Self {
        let none = ffi::RTC_INVALID_GEOMETRY_ID;
        Self {
            reals: [DEPTH, 0.0, 0.0, 8.0, x / 2.0, y / 4.0],
            ids: [0, GEOMETRY, none, none],
        }
    }

    fn nothing() -> Self {
        Self {
            reals: [f32::INFINITY, 0.0, 0.0, 0.0, 0.0, 0.0],
            ids: [0, ffi::RTC_INVALID_GEOMETRY_ID, 0, 0],
        }
    }
}

/// A committed scene of one triangle, (0, 0, 0), (2, 0, 0), (0, 4, 0).
struct Triangle(ffi::RTCScene);

impl Triangle {
    fn new(device: &Device) -> Result<Self, EmbreeError> {
        const CORNERS: [f32; 9] = [0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 4.0, 0.0];
        const INDICES: [u32; 3] = [0, 1, 2];
        // SAFETY: the device is alive, and null is asked for after each call that can answer it. The two buffers have
        // room for what is copied (Embree pads them itself). The scene keeps the geometry alive after its release.
        unsafe {
            let scene = Self(ffi::rtcNewScene(device.handle()));
            let geometry = ffi::rtcNewGeometry(device.handle(), ffi::RTC_GEOMETRY_TYPE_TRIANGLE);
            if scene.0.is_null() || geometry.is_null() {
                device.check()?;
                return Err(EmbreeError::NoDevice("it makes no scene"));
            }
            let new = ffi::rtcSetNewGeometryBuffer;
            let corners = new(geometry, ffi::RTC_BUFFER_TYPE_VERTEX, 0, ffi::RTC_FORMAT_FLOAT3, 12, 3).cast::<f32>();
            let indices = new(geometry, ffi::RTC_BUFFER_TYPE_INDEX, 0, ffi::RTC_FORMAT_UINT3, 12, 1).cast::<u32>();
            if !corners.is_null() && !indices.is_null() {
                corners.copy_from_nonoverlapping(CORNERS.as_ptr(), CORNERS.len());
                indices.copy_from_nonoverlapping(INDICES.as_ptr(), INDICES.len());
                ffi::rtcCommitGeometry(geometry);
                ffi::rtcAttachGeometryByID(scene.0, geometry, GEOMETRY);
                ffi::rtcCommitScene(scene.0);
            }
            ffi::rtcReleaseGeometry(geometry);
            device.check()?;
            Ok(scene)
        }
    }
}

impl Drop for Triangle {
    fn drop(&mut self) {
        if !self.0.is_null() {
            // SAFETY: the one count of the scene is ours.
            unsafe { ffi::rtcReleaseScene(self.0) };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_loaded_library_fits_our_structs() {
        assert_eq!(layout_canary(&Device::new(1).unwrap()), Ok(()));
    }

    #[test]
    fn a_struct_that_is_too_short_is_found_out() {
        // What bindings of Embree 4.2 pass: their `RTCHit8` ends before `instPrimID`.
        #[repr(C)]
        struct Short {
            ray: ffi::RTCRay8,
            hit: [[u32; 8]; 8],
        }
        let device = Device::new(1).unwrap();
        let scene = Triangle::new(&device).unwrap();
        let mut packet = Fenced::new(Short {
            ray: upwards([X; 8]),
            hit: [[0; 8]; 8],
        });
        packet.value.hit[6] = [ffi::RTC_INVALID_GEOMETRY_ID; 8];
        // SAFETY: as in `eight`; what Embree writes past `Short` stays inside the fence, which the pointer may touch.
        unsafe {
            ffi::rtcIntersect8(
                Valid([-1; 8]).0.as_ptr(),
                scene.0,
                packet.pointer().cast(),
                ptr::null_mut(),
            )
        };
        assert_eq!(packet.value.hit[6], [GEOMETRY; 8]);
        assert_eq!(packet.damage(), 32);
    }

    #[test]
    fn a_wrong_answer_is_found_out() {
        let wrong = Found {
            ids: [GEOMETRY, 0, 0, 0],
            ..Found::hit(X, Y)
        };
        assert!(expect("RTCRayHit", wrong, Found::hit(X, Y)).is_err());
        assert!(expect("RTCRayHit", Found::nothing(), Found::hit(X, Y)).is_err());
        let far = Found {
            reals: [3.1, 0.0, 0.0, 8.0, X / 2.0, Y / 4.0],
            ..Found::hit(X, Y)
        };
        assert!(expect("RTCRayHit", far, Found::hit(X, Y)).is_err());
    }
}
