//! Emissive triangles do not occlude their own shadow rays: a filter function of the geometry rejects such hits.
//!
//! Spheres skip themselves in their own callback (`spheres.rs`). Triangles are native Embree geometry, so Embree must call a
//! filter. Only emissive meshes have the filter; queries that hit none of their triangles never call it.

use std::ffi::c_void;
use std::ptr;

use super::ffi;
use crate::shape::SkipIds;

/// Column indices: the ray's id within a ray, the primitive within a hit.
const ID: usize = 10;
const PRIMITIVE: usize = 5;

/// Packs the skip ids into the user data pointer of a geometry, so no allocation must outlive it.
pub(crate) fn to_user_data(skip_ids: SkipIds) -> *mut c_void {
    ptr::without_provenance_mut((usize::from(skip_ids.each) << 32) | skip_ids.first as usize)
}

fn from_user_data(data: *mut c_void) -> SkipIds {
    let bits = data.addr();
    SkipIds {
        first: bits as u32,
        each: bits >> 32 != 0,
    }
}

/// # Safety
/// Embree calls it with a packet of `N` rays and hits and the user data that [`super::scene`] set.
pub(crate) unsafe extern "C" fn let_pass(args: *const ffi::RTCFilterFunctionNArguments) {
    // SAFETY: `args` lives during the call.
    let args = unsafe { &*args };
    let (skip_ids, n) = (from_user_data(args.geometryUserPtr), args.N as usize);
    for lane in 0..n {
        // SAFETY: a packet of N rays has 12 columns of N numbers, its hits have 9, and `valid` has N; all belong to this
        // thread during the call.
        unsafe {
            // Hits of inactive lanes are undefined.
            if args.valid.add(lane).read() == 0 {
                continue;
            }
            let id = args.ray.cast::<u32>().add(ID * n + lane).read();
            let primitive = args.hit.cast::<u32>().add(PRIMITIVE * n + lane).read();
            if id == skip_ids.of(primitive) {
                args.valid.add(lane).write(0);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Embree leaves the hits of inactive lanes undefined. Here they hold invalid triangle indices.
    #[test]
    fn lanes_that_are_off_are_not_looked_at() {
        const N: usize = 8;
        let skip_ids = SkipIds {
            first: SkipIds::TRIANGLE + 3,
            each: true,
        };
        let mut valid = [-1, 0, -1, 0, -1, -1, 0, -1];
        let (mut ray, mut hit) = ([[0_u32; N]; 12], [[0_u32; N]; 9]);
        for lane in 0..N {
            hit[PRIMITIVE][lane] = if valid[lane] == 0 { u32::MAX } else { lane as u32 };
            // Lanes 0 and 4 have the skip id of the triangle they hit.
            ray[ID][lane] = skip_ids.first + if lane % 4 == 0 { lane as u32 } else { 99 };
        }
        let args = ffi::RTCFilterFunctionNArguments {
            valid: valid.as_mut_ptr(),
            geometryUserPtr: to_user_data(skip_ids),
            context: ptr::null_mut(),
            ray: ray.as_mut_ptr().cast(),
            hit: hit.as_mut_ptr().cast(),
            N: N as u32,
        };
        // SAFETY: a packet of eight rays with its hits, and the user data of a mesh that emits.
        unsafe { let_pass(&args) };
        assert_eq!(valid, [0, 0, -1, 0, 0, -1, 0, -1]);
    }
}
