//! Hand-written bindings for the part of Embree's C interface that Octolux uses.
//!
//! Layouts are those of Embree 4.3 and later (`rtcore_*.h`, compiled without `RTC_MIN_WIDTH` and with one level of instances, as in
//! Debian's library and in the wheel): a hit ends in `instPrimID`, which 4.2 did not have. Names are Embree's own, to match its
//! manual. The numbers in the `layout!` lines come from gcc's `sizeof` and `offsetof`.

// Names: see above. Dead code: the table lists the whole interface; unused entries cost nothing.
#![allow(non_camel_case_types, non_snake_case, dead_code)]

use std::ffi::{c_char, c_int, c_void};
use std::mem::{align_of, offset_of, size_of};

use libloading::os::unix::Library;

use super::nearby;

/// Opaque handle types.
macro_rules! handle {
    ($($name:ident, $opaque:ident;)*) => {$(
        #[repr(C)]
        pub(crate) struct $opaque {
            _private: [u8; 0],
        }
        pub(crate) type $name = *mut $opaque;
    )*};
}

handle! {
    RTCDevice, RTCDeviceTy;
    RTCScene, RTCSceneTy;
    RTCGeometry, RTCGeometryTy;
}

/// A C enumeration. With a Rust enum, an unknown value from a newer library would be undefined behaviour.
macro_rules! enumeration {
    ($name:ident { $($value:ident = $number:expr,)* }) => {
        pub(crate) type $name = u32;
        $(pub(crate) const $value: $name = $number;)*
    };
}

pub(crate) const RTC_INVALID_GEOMETRY_ID: u32 = u32::MAX;

enumeration! { RTCError {
    RTC_ERROR_NONE = 0,
    RTC_ERROR_UNKNOWN = 1,
    RTC_ERROR_INVALID_ARGUMENT = 2,
    RTC_ERROR_INVALID_OPERATION = 3,
    RTC_ERROR_OUT_OF_MEMORY = 4,
    RTC_ERROR_UNSUPPORTED_CPU = 5,
    RTC_ERROR_CANCELLED = 6,
}}

enumeration! { RTCDeviceProperty {
    RTC_DEVICE_PROPERTY_VERSION = 0,
    RTC_DEVICE_PROPERTY_NATIVE_RAY4_SUPPORTED = 32,
    RTC_DEVICE_PROPERTY_NATIVE_RAY8_SUPPORTED = 33,
    RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED = 34,
    RTC_DEVICE_PROPERTY_RAY_MASK_SUPPORTED = 64,
    RTC_DEVICE_PROPERTY_BACKFACE_CULLING_ENABLED = 65,
    RTC_DEVICE_PROPERTY_FILTER_FUNCTION_SUPPORTED = 66,
    RTC_DEVICE_PROPERTY_IGNORE_INVALID_RAYS_ENABLED = 67,
    RTC_DEVICE_PROPERTY_TRIANGLE_GEOMETRY_SUPPORTED = 96,
    RTC_DEVICE_PROPERTY_USER_GEOMETRY_SUPPORTED = 100,
    RTC_DEVICE_PROPERTY_POINT_GEOMETRY_SUPPORTED = 101,
    RTC_DEVICE_PROPERTY_TASKING_SYSTEM = 128,
}}

enumeration! { RTCBufferType {
    RTC_BUFFER_TYPE_INDEX = 0,
    RTC_BUFFER_TYPE_VERTEX = 1,
    RTC_BUFFER_TYPE_NORMAL = 3,
}}

enumeration! { RTCFormat {
    RTC_FORMAT_UNDEFINED = 0,
    RTC_FORMAT_UINT = 0x5001,
    RTC_FORMAT_UINT3 = 0x5003,
    RTC_FORMAT_FLOAT = 0x9001,
    RTC_FORMAT_FLOAT3 = 0x9003,
    RTC_FORMAT_FLOAT4 = 0x9004,
}}

enumeration! { RTCBuildQuality {
    RTC_BUILD_QUALITY_LOW = 0,
    RTC_BUILD_QUALITY_MEDIUM = 1,
    RTC_BUILD_QUALITY_HIGH = 2,
    RTC_BUILD_QUALITY_REFIT = 3,
}}

enumeration! { RTCSceneFlags {
    RTC_SCENE_FLAG_NONE = 0,
    RTC_SCENE_FLAG_DYNAMIC = 1 << 0,
    RTC_SCENE_FLAG_COMPACT = 1 << 1,
    RTC_SCENE_FLAG_ROBUST = 1 << 2,
    RTC_SCENE_FLAG_FILTER_FUNCTION_IN_ARGUMENTS = 1 << 3,
}}

enumeration! { RTCGeometryType {
    RTC_GEOMETRY_TYPE_TRIANGLE = 0,
    RTC_GEOMETRY_TYPE_SPHERE_POINT = 50,
    RTC_GEOMETRY_TYPE_USER = 120,
}}

enumeration! { RTCRayQueryFlags {
    RTC_RAY_QUERY_FLAG_NONE = 0,
    RTC_RAY_QUERY_FLAG_INVOKE_ARGUMENT_FILTER = 1 << 1,
    RTC_RAY_QUERY_FLAG_INCOHERENT = 0 << 16,
    RTC_RAY_QUERY_FLAG_COHERENT = 1 << 16,
}}

enumeration! { RTCFeatureFlags {
    RTC_FEATURE_FLAG_NONE = 0,
    RTC_FEATURE_FLAG_TRIANGLE = 1 << 1,
    RTC_FEATURE_FLAG_SPHERE_POINT = 1 << 20,
    RTC_FEATURE_FLAG_FILTER_FUNCTION_IN_GEOMETRY = 1 << 25,
    RTC_FEATURE_FLAG_USER_GEOMETRY_CALLBACK_IN_ARGUMENTS = 1 << 26,
    RTC_FEATURE_FLAG_USER_GEOMETRY_CALLBACK_IN_GEOMETRY = 1 << 27,
    RTC_FEATURE_FLAG_32_BIT_RAY_MASK = 1 << 28,
    RTC_FEATURE_FLAG_ALL = 0xffff_ffff,
}}

/// Compile-time check that a struct has the layout of its C counterpart.
macro_rules! layout {
    ($($name:ident: $size:literal bytes, align $align:literal, { $($field:ident $offset:literal),* })*) => {$(
        const _: () = assert!(size_of::<$name>() == $size && align_of::<$name>() == $align);
        $(const _: () = assert!(offset_of!($name, $field) == $offset);)*
    )*};
}

/// A ray, a hit and both for `$n` rays. The valid mask and `geomID` mark idle lanes and misses.
macro_rules! packet {
    ($n:tt, align $align:tt, $ray:ident, $hit:ident, $rayhit:ident) => {
        #[repr(C, align($align))]
        #[derive(Clone, Copy, Debug, bytemuck::Zeroable)]
        pub(crate) struct $ray {
            pub org_x: [f32; $n],
            pub org_y: [f32; $n],
            pub org_z: [f32; $n],
            pub tnear: [f32; $n],
            pub dir_x: [f32; $n],
            pub dir_y: [f32; $n],
            pub dir_z: [f32; $n],
            pub time: [f32; $n],
            /// In: end of the segment. Out: distance to the hit; −∞ if found occluded.
            pub tfar: [f32; $n],
            pub mask: [u32; $n],
            pub id: [u32; $n],
            pub flags: [u32; $n],
        }

        #[repr(C, align($align))]
        #[derive(Clone, Copy, Debug, bytemuck::Zeroable)]
        pub(crate) struct $hit {
            /// Geometric normal, not of unit length.
            pub Ng_x: [f32; $n],
            pub Ng_y: [f32; $n],
            pub Ng_z: [f32; $n],
            pub u: [f32; $n],
            pub v: [f32; $n],
            pub primID: [u32; $n],
            /// In: must be [`RTC_INVALID_GEOMETRY_ID`]; unchanged if nothing is hit.
            pub geomID: [u32; $n],
            pub instID: [u32; $n],
            pub instPrimID: [u32; $n],
        }

        #[repr(C)]
        #[derive(Clone, Copy, Debug, bytemuck::Zeroable)]
        pub(crate) struct $rayhit {
            pub ray: $ray,
            pub hit: $hit,
        }
    };
}

// A single ray is a packet of one: `[f32; 1]` has the layout of `f32`.
packet!(1, align 16, RTCRay, RTCHit, RTCRayHit);
packet!(4, align 16, RTCRay4, RTCHit4, RTCRayHit4);
packet!(8, align 32, RTCRay8, RTCHit8, RTCRayHit8);
packet!(16, align 64, RTCRay16, RTCHit16, RTCRayHit16);

layout! {
    RTCRay: 48 bytes, align 16, { tnear 12, dir_x 16, time 28, tfar 32, mask 36, id 40, flags 44 }
    RTCHit: 48 bytes, align 16, { Ng_x 0, u 12, primID 20, geomID 24, instID 28, instPrimID 32 }
    RTCRayHit: 96 bytes, align 16, { ray 0, hit 48 }
    RTCRay4: 192 bytes, align 16, { tfar 128, flags 176 }
    RTCHit4: 144 bytes, align 16, { primID 80, instPrimID 128 }
    RTCRayHit4: 336 bytes, align 16, { ray 0, hit 192 }
    RTCRay8: 384 bytes, align 32, { tfar 256, flags 352 }
    RTCHit8: 288 bytes, align 32, { primID 160, instPrimID 256 }
    RTCRayHit8: 672 bytes, align 32, { ray 0, hit 384 }
    RTCRay16: 768 bytes, align 64, { tfar 512, flags 704 }
    RTCHit16: 576 bytes, align 64, { primID 320, instPrimID 512 }
    RTCRayHit16: 1344 bytes, align 64, { ray 0, hit 768 }
}

#[repr(C, align(16))]
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct RTCBounds {
    pub lower_x: f32,
    pub lower_y: f32,
    pub lower_z: f32,
    pub align0: f32,
    pub upper_x: f32,
    pub upper_y: f32,
    pub upper_z: f32,
    pub align1: f32,
}

/// Context that a query passes to callbacks. Our own structs may begin with it and append data.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub(crate) struct RTCRayQueryContext {
    pub instID: [u32; 1],
    pub instPrimID: [u32; 1],
}

impl RTCRayQueryContext {
    /// Equivalent of `rtcInitRayQueryContext`, which is inline C and therefore not in the library.
    pub(crate) const fn new() -> Self {
        Self {
            instID: [RTC_INVALID_GEOMETRY_ID],
            instPrimID: [RTC_INVALID_GEOMETRY_ID],
        }
    }
}

/// Options of a query. Callbacks given here override those of the geometry.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub(crate) struct RTCIntersectArguments {
    pub flags: RTCRayQueryFlags,
    pub feature_mask: RTCFeatureFlags,
    pub context: *mut RTCRayQueryContext,
    pub filter: RTCFilterFunctionN,
    pub intersect: RTCIntersectFunctionN,
}

#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub(crate) struct RTCOccludedArguments {
    pub flags: RTCRayQueryFlags,
    pub feature_mask: RTCFeatureFlags,
    pub context: *mut RTCRayQueryContext,
    pub filter: RTCFilterFunctionN,
    pub occluded: RTCOccludedFunctionN,
}

#[repr(C)]
pub(crate) struct RTCBoundsFunctionArguments {
    pub geometryUserPtr: *mut c_void,
    pub primID: u32,
    pub timeStep: u32,
    pub bounds_o: *mut RTCBounds,
}

/// For `N` rays, 1, 4, 8 or 16: `rayhit` is an [`RTCRayHit`], [`RTCRayHit4`], [`RTCRayHit8`] or [`RTCRayHit16`].
#[repr(C)]
pub(crate) struct RTCIntersectFunctionNArguments {
    pub valid: *mut c_int,
    pub geometryUserPtr: *mut c_void,
    pub primID: u32,
    pub context: *mut RTCRayQueryContext,
    pub rayhit: *mut c_void,
    pub N: u32,
    pub geomID: u32,
}

/// For `N` rays, 1, 4, 8 or 16: `ray` is an [`RTCRay`], [`RTCRay4`], [`RTCRay8`] or [`RTCRay16`].
#[repr(C)]
pub(crate) struct RTCOccludedFunctionNArguments {
    pub valid: *mut c_int,
    pub geometryUserPtr: *mut c_void,
    pub primID: u32,
    pub context: *mut RTCRayQueryContext,
    pub ray: *mut c_void,
    pub N: u32,
    pub geomID: u32,
}

/// Arguments of a filter: `N` rays that hit a triangle. Setting `valid` to 0 rejects a hit.
#[repr(C)]
pub(crate) struct RTCFilterFunctionNArguments {
    pub valid: *mut c_int,
    pub geometryUserPtr: *mut c_void,
    pub context: *mut RTCRayQueryContext,
    pub ray: *mut c_void,
    pub hit: *mut c_void,
    pub N: u32,
}

layout! {
    RTCBounds: 32 bytes, align 16, { upper_x 16 }
    RTCRayQueryContext: 8 bytes, align 4, { instPrimID 4 }
    RTCIntersectArguments: 32 bytes, align 8, { feature_mask 4, context 8, filter 16, intersect 24 }
    RTCOccludedArguments: 32 bytes, align 8, { feature_mask 4, context 8, filter 16, occluded 24 }
    RTCBoundsFunctionArguments: 24 bytes, align 8, { primID 8, timeStep 12, bounds_o 16 }
    RTCIntersectFunctionNArguments: 48 bytes, align 8,
        { geometryUserPtr 8, primID 16, context 24, rayhit 32, N 40, geomID 44 }
    RTCOccludedFunctionNArguments: 48 bytes, align 8,
        { geometryUserPtr 8, primID 16, context 24, ray 32, N 40, geomID 44 }
    RTCFilterFunctionNArguments: 48 bytes, align 8, { geometryUserPtr 8, context 16, ray 24, hit 32, N 40 }
}

pub(crate) type RTCErrorFunction =
    Option<unsafe extern "C" fn(userPtr: *mut c_void, code: RTCError, message: *const c_char)>;
pub(crate) type RTCFilterFunctionN = Option<unsafe extern "C" fn(args: *const RTCFilterFunctionNArguments)>;
pub(crate) type RTCBoundsFunction = Option<unsafe extern "C" fn(args: *const RTCBoundsFunctionArguments)>;
pub(crate) type RTCIntersectFunctionN = Option<unsafe extern "C" fn(args: *const RTCIntersectFunctionNArguments)>;
pub(crate) type RTCOccludedFunctionN = Option<unsafe extern "C" fn(args: *const RTCOccludedFunctionNArguments)>;

/// The functions that Octolux uses, available once the library is open.
///
/// Each is a field with the function's address, and a method that calls it.
macro_rules! functions {
    ($(fn $name:ident($($argument:ident: $type:ty),* $(,)?) $(-> $result:ty)?;)*) => {
        #[derive(Clone, Copy, Debug)]
        pub(crate) struct Functions {
            $(pub $name: unsafe extern "C" fn($($type),*) $(-> $result)?,)*
        }

        impl Functions {
            /// Looks up all functions; the error is the name of a missing one.
            ///
            /// # Safety
            /// `library` must be an Embree 4, and stay open as long as the functions are called.
            pub unsafe fn of(library: &Library) -> Result<Self, &'static str> {
                Ok(Self {
                    // SAFETY: a function of this name has this type, by the caller's promise.
                    $($name: *unsafe { library.get(stringify!($name)) }.map_err(|_| stringify!($name))?,)*
                })
            }

            $(
                /// # Safety
                /// The requirements of the function in Embree's manual.
                #[inline(always)]
                pub unsafe fn $name(&self, $($argument: $type),*) $(-> $result)? {
                    // SAFETY: guaranteed by the caller.
                    unsafe { (self.$name)($($argument),*) }
                }
            )*
        }
    };
}

// `rtcGetDeviceLastErrorMessage` and `rtcGetErrorString` are omitted: Debian's 4.3 lacks them.
functions! {
    fn rtcNewDevice(config: *const c_char) -> RTCDevice;
    fn rtcRetainDevice(device: RTCDevice);
    fn rtcReleaseDevice(device: RTCDevice);
    fn rtcGetDeviceProperty(device: RTCDevice, prop: RTCDeviceProperty) -> isize;
    fn rtcGetDeviceError(device: RTCDevice) -> RTCError;
    fn rtcSetDeviceErrorFunction(device: RTCDevice, error: RTCErrorFunction, userPtr: *mut c_void);

    fn rtcNewScene(device: RTCDevice) -> RTCScene;
    fn rtcReleaseScene(scene: RTCScene);
    fn rtcSetSceneFlags(scene: RTCScene, flags: RTCSceneFlags);
    fn rtcSetSceneBuildQuality(scene: RTCScene, quality: RTCBuildQuality);
    fn rtcAttachGeometryByID(scene: RTCScene, geometry: RTCGeometry, geomID: u32);
    fn rtcCommitScene(scene: RTCScene);

    fn rtcNewGeometry(device: RTCDevice, kind: RTCGeometryType) -> RTCGeometry;
    fn rtcReleaseGeometry(geometry: RTCGeometry);
    fn rtcCommitGeometry(geometry: RTCGeometry);
    fn rtcSetNewGeometryBuffer(
        geometry: RTCGeometry,
        kind: RTCBufferType,
        slot: u32,
        format: RTCFormat,
        byteStride: usize,
        itemCount: usize,
    ) -> *mut c_void;
    fn rtcSetGeometryUserPrimitiveCount(geometry: RTCGeometry, count: u32);
    fn rtcSetGeometryUserData(geometry: RTCGeometry, ptr: *mut c_void);
    fn rtcSetGeometryBoundsFunction(geometry: RTCGeometry, bounds: RTCBoundsFunction, userPtr: *mut c_void);
    fn rtcSetGeometryIntersectFunction(geometry: RTCGeometry, intersect: RTCIntersectFunctionN);
    fn rtcSetGeometryOccludedFunction(geometry: RTCGeometry, occluded: RTCOccludedFunctionN);
    fn rtcSetGeometryOccludedFilterFunction(geometry: RTCGeometry, filter: RTCFilterFunctionN);

    // `valid` and packets are aligned to 4 bytes per lane: an unaligned mask crashed with Debian's library.
    fn rtcIntersect1(scene: RTCScene, rayhit: *mut RTCRayHit, args: *mut RTCIntersectArguments);
    fn rtcIntersect8(valid: *const c_int, scene: RTCScene, rayhit: *mut RTCRayHit8, args: *mut RTCIntersectArguments);
    fn rtcIntersect16(valid: *const c_int, scene: RTCScene, rayhit: *mut RTCRayHit16, args: *mut RTCIntersectArguments);
    fn rtcOccluded1(scene: RTCScene, ray: *mut RTCRay, args: *mut RTCOccludedArguments);
    fn rtcOccluded8(valid: *const c_int, scene: RTCScene, ray: *mut RTCRay8, args: *mut RTCOccludedArguments);
    fn rtcOccluded16(valid: *const c_int, scene: RTCScene, ray: *mut RTCRay16, args: *mut RTCOccludedArguments);
    fn rtcPointQuery(
        scene: RTCScene,
        query: *mut nearby::RTCPointQuery,
        context: *mut nearby::RTCPointQueryContext,
        function: nearby::RTCPointQueryFunction,
        userPtr: *mut c_void
    ) -> bool;
}
