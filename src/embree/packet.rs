//! Packet queries: as many rays as lanes, from one source for all widths.

use std::marker::PhantomData;
use std::mem::MaybeUninit;
use std::ptr;

use super::ffi;
use super::scene::Accel;
use crate::lane::{Bits, F32x8, F32x16, Lane, Mask, Work, with_avx512};
use crate::math::Vec3;
use crate::shape::{Hit, Ray};

/// Coherence of the rays in a packet. Affects speed (38 % to a factor of 3), never the result.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coherence {
    /// Neighbors have similar directions: camera rays in tile order.
    Coherent,
    /// Neighbors are unrelated: shadow rays.
    Incoherent,
}

impl Coherence {
    const fn flags(self) -> ffi::RTCRayQueryFlags {
        match self {
            Self::Coherent => ffi::RTC_RAY_QUERY_FLAG_COHERENT,
            Self::Incoherent => ffi::RTC_RAY_QUERY_FLAG_INCOHERENT,
        }
    }
}

/// Lane types that Embree has queries for.
pub trait TraceLane: Lane {
    /// Closest hits of active rays.
    fn intersect(accel: &Accel, active: Self::Mask, ray: &Ray<Self>, coherence: Coherence) -> Hit<Self>;
    /// Which active rays hit any shape but the one with their skip id.
    fn occluded(accel: &Accel, active: Self::Mask, ray: &Ray<Self>, coherence: Coherence) -> Self::Mask;
}

/// Code generic over lane width. `run` must be `#[inline(always)]`, like everything in it that handles lanes.
pub trait LaneWork {
    /// Runs the code.
    fn run<L: TraceLane>(self);
}

/// Code for one lane width, compiled for AVX-512.
struct OfAvx512<L, W>(W, PhantomData<L>);

impl<L: TraceLane, W: LaneWork> Work for OfAvx512<L, W> {
    #[inline(always)]
    fn run(self) {
        self.0.run::<L>();
    }
}

/// Runs code in eight lanes compiled for AVX-512, which has 32 registers instead of 16.
///
/// # Panics
/// If [`has_avx512`](crate::lane::has_avx512) is false.
pub fn in_eight_of_avx512<W: LaneWork>(work: W) {
    with_avx512(OfAvx512::<F32x8, W>(work, PhantomData));
}

/// Runs code in sixteen lanes.
///
/// # Panics
/// If [`has_avx512`](crate::lane::has_avx512) is false.
pub fn in_sixteen<W: LaneWork>(work: W) {
    with_avx512(OfAvx512::<F32x16, W>(work, PhantomData));
}

const FEATURES: ffi::RTCFeatureFlags = ffi::RTC_FEATURE_FLAG_TRIANGLE
    | ffi::RTC_FEATURE_FLAG_FILTER_FUNCTION_IN_GEOMETRY
    | ffi::RTC_FEATURE_FLAG_USER_GEOMETRY_CALLBACK_IN_GEOMETRY;

fn intersect_arguments(coherence: Coherence) -> ffi::RTCIntersectArguments {
    ffi::RTCIntersectArguments {
        flags: coherence.flags(),
        feature_mask: FEATURES,
        context: ptr::null_mut(),
        filter: None,
        intersect: None,
    }
}

fn occluded_arguments(coherence: Coherence) -> ffi::RTCOccludedArguments {
    ffi::RTCOccludedArguments {
        flags: coherence.flags(),
        feature_mask: FEATURES,
        context: ptr::null_mut(),
        filter: None,
        occluded: None,
    }
}

/// A packet of rays followed by space for hits.
///
/// If Embree has no occlusion query for packets of this width, it treats the packet as one of rays and hits, traces the rays one by
/// one, and writes back what it read, including the hits. Those bytes are unused and need no initialization.
#[repr(C)]
struct Roomy<R, H> {
    ray: R,
    room: MaybeUninit<H>,
}

impl<R, H> Roomy<R, H> {
    #[inline(always)]
    const fn new(ray: R) -> Self {
        Self {
            ray,
            room: MaybeUninit::uninit(),
        }
    }

    /// A pointer to the rays that may also access the space for hits.
    #[inline(always)]
    const fn pointer(&mut self) -> *mut R {
        ptr::from_mut(self).cast()
    }
}

/// The two halves of a packet of `$n` lanes between our types and Embree's.
macro_rules! trace_lane {
    ($lane:ty, $n:tt, $ray:ident, $hit:ident, $rayhit:ident, |$accel:ident, $active:ident, $packet:ident, $args:ident|
     intersect $intersect:expr, occluded $occluded:expr) => {
        impl TraceLane for $lane {
            #[inline(always)]
            fn intersect($accel: &Accel, $active: Self::Mask, ray: &Ray<Self>, coherence: Coherence) -> Hit<Self> {
                // Built in place: moving 672 bytes cost a tenth of a render.
                let mut $packet: ffi::$rayhit = bytemuck::Zeroable::zeroed();
                ray.write_to(&mut $packet.ray);
                $packet.hit.geomID = [ffi::RTC_INVALID_GEOMETRY_ID; $n];
                let mut $args = intersect_arguments(coherence);
                $intersect;
                let hit = &$packet.hit;
                let geometry = <$lane as Lane>::Bits::load(&hit.geomID);
                Hit {
                    found: $active & !geometry.eq(<$lane as Lane>::Bits::splat(ffi::RTC_INVALID_GEOMETRY_ID)),
                    t: Lane::load(&$packet.ray.tfar),
                    ng: Vec3 {
                        x: Lane::load(&hit.Ng_x),
                        y: Lane::load(&hit.Ng_y),
                        z: Lane::load(&hit.Ng_z),
                    },
                    u: Lane::load(&hit.u),
                    v: Lane::load(&hit.v),
                    geometry,
                    primitive: Bits::load(&hit.primID),
                }
            }

            #[inline(always)]
            fn occluded($accel: &Accel, $active: Self::Mask, ray: &Ray<Self>, coherence: Coherence) -> Self::Mask {
                let mut $packet = Roomy::<_, ffi::$hit>::new(<ffi::$ray as bytemuck::Zeroable>::zeroed());
                ray.write_to(&mut $packet.ray);
                let mut $args = occluded_arguments(coherence);
                $occluded;
                // Embree marks occluded rays with a distance of −∞.
                let t: $lane = Lane::load(&$packet.ray.tfar);
                $active & Lane::lt(t, <$lane as Lane>::zero())
            }
        }

        impl Ray<$lane> {
            /// Writes the nonzero columns into a zeroed packet.
            #[inline(always)]
            fn write_to(&self, packet: &mut ffi::$ray) {
                self.origin.x.store(&mut packet.org_x);
                self.origin.y.store(&mut packet.org_y);
                self.origin.z.store(&mut packet.org_z);
                self.direction.x.store(&mut packet.dir_x);
                self.direction.y.store(&mut packet.dir_y);
                self.direction.z.store(&mut packet.dir_z);
                self.tfar.store(&mut packet.tfar);
                self.skip_id.store(&mut packet.id);
                packet.mask = [u32::MAX; $n];
            }
        }
    };
}

/// Embree reads the valid mask of a packet with aligned loads.
#[repr(align(64))]
pub(super) struct Valid<const N: usize>(pub [i32; N]);

trace_lane!(f32, 1, RTCRay, RTCHit, RTCRayHit, |accel, active, packet, args|
    intersect if active {
        // SAFETY: the scene is committed and alive, the packet has Embree's layout (asserted), and belongs to this thread.
        unsafe { accel.functions().rtcIntersect1(accel.handle(), &mut packet, &mut args) }
    },
    occluded if active {
        // SAFETY: as above.
        unsafe { accel.functions().rtcOccluded1(accel.handle(), packet.pointer(), &mut args) }
    }
);

trace_lane!(F32x8, 8, RTCRay8, RTCHit8, RTCRayHit8, |accel, active, packet, args|
    intersect if active.any() {
        let valid = Valid(active.to_valid());
        // SAFETY: the scene is committed and alive, packet and mask have Embree's layout and alignment (asserted), and
        // belong to this thread.
        unsafe { accel.functions().rtcIntersect8(valid.0.as_ptr(), accel.handle(), &mut packet, &mut args) }
    },
    occluded if active.any() {
        let valid = Valid(active.to_valid());
        // SAFETY: as above.
        unsafe { accel.functions().rtcOccluded8(valid.0.as_ptr(), accel.handle(), packet.pointer(), &mut args) }
    }
);

trace_lane!(F32x16, 16, RTCRay16, RTCHit16, RTCRayHit16, |accel, active, packet, args|
    intersect if active.any() {
        let valid = Valid(active.to_valid());
        // SAFETY: as above.
        unsafe { accel.functions().rtcIntersect16(valid.0.as_ptr(), accel.handle(), &mut packet, &mut args) }
    },
    occluded if active.any() {
        let valid = Valid(active.to_valid());
        // SAFETY: as above.
        unsafe { accel.functions().rtcOccluded16(valid.0.as_ptr(), accel.handle(), packet.pointer(), &mut args) }
    }
);
