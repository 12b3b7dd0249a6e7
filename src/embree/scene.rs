//! Embree scenes: built once, then traced by any thread.

use std::ptr;
use std::sync::Arc;

use super::device::{Device, EmbreeError};
use super::ffi::{self, Functions};
use super::nearby::Buffers;
use super::packet::{Coherence, TraceLane};
use super::skip_ids;
use super::spheres::{self, Spheres};
use crate::shape::{Hit, Ray, SkipIds, Sphere};

/// A scene under construction; [`commit`](Self::commit) turns it into an [`Accel`].
#[derive(Debug)]
pub struct SceneBuilder {
    scene: Handle,
    geometries: u32,
    buffers: Vec<Option<Buffers>>,
    spheres: Option<Arc<Spheres>>,
}

/// A committed scene: immutable, shared by all threads.
#[derive(Debug)]
pub struct Accel {
    scene: Handle,
    /// Buffers of each mesh geometry.
    pub(super) buffers: Vec<Option<Buffers>>,
    /// Read by the callbacks; must outlive the scene at a fixed address.
    _spheres: Option<Arc<Spheres>>,
}

/// Owns one reference to an Embree scene and to its device.
#[derive(Debug)]
struct Handle {
    scene: ffi::RTCScene,
    device: Device,
}

// SAFETY: a scene belongs to no thread; while it takes geometry it is owned and used through `&mut`.
unsafe impl Send for Handle {}
// SAFETY: behind `&`, only queries of a committed scene are reachable, and Embree allows these from any thread.
unsafe impl Sync for Handle {}
// SAFETY: they point into buffers of the scene, which are only read once it is committed.
unsafe impl Send for Buffers {}
// SAFETY: as above.
unsafe impl Sync for Buffers {}

impl Drop for Handle {
    fn drop(&mut self) {
        // SAFETY: the one count that `SceneBuilder::new` received.
        unsafe { self.device.functions().rtcReleaseScene(self.scene) };
    }
}

/// Owns one reference to a geometry. A scene to which it is attached holds its own.
struct Geometry {
    handle: ffi::RTCGeometry,
    functions: &'static Functions,
}

impl Geometry {
    fn new(device: &Device, kind: ffi::RTCGeometryType) -> Result<Self, EmbreeError> {
        let functions = device.functions();
        // SAFETY: the device is alive.
        let handle = unsafe { functions.rtcNewGeometry(device.handle(), kind) };
        if handle.is_null() {
            return Err(device.refusal("no geometry"));
        }
        Ok(Self { handle, functions })
    }
}

impl Drop for Geometry {
    fn drop(&mut self) {
        // SAFETY: the one count that `new` received.
        unsafe { self.functions.rtcReleaseGeometry(self.handle) };
    }
}

impl SceneBuilder {
    /// An empty scene. `robust` closes the edges between triangles: 0.05 % of rays aimed exactly at edges miss instead of 8.1 %, at
    /// a cost of 4 % (coherent) to 20 % of the speed.
    ///
    /// # Errors
    /// [`EmbreeError::Reported`] if Embree fails, or if an earlier call on this thread failed and its error was not yet read.
    pub fn new(device: &Device, robust: bool) -> Result<Self, EmbreeError> {
        Self::counting_from(0, device, robust)
    }

    /// Like [`Self::new`]; `first` is the index of the first geometry.
    pub(super) fn counting_from(first: u32, device: &Device, robust: bool) -> Result<Self, EmbreeError> {
        let functions = device.functions();
        // SAFETY: the device is alive.
        let scene = unsafe { functions.rtcNewScene(device.handle()) };
        if scene.is_null() {
            return Err(device.refusal("no scene"));
        }
        let builder = Self {
            scene: Handle {
                scene,
                device: device.clone(),
            },
            geometries: first,
            buffers: Vec::new(),
            spheres: None,
        };
        let flags = if robust {
            ffi::RTC_SCENE_FLAG_ROBUST
        } else {
            ffi::RTC_SCENE_FLAG_NONE
        };
        // SAFETY: the scene is alive and not committed.
        unsafe {
            functions.rtcSetSceneFlags(scene, flags);
            // Medium quality builds faster than high, and traces as fast on the scenes that were measured.
            functions.rtcSetSceneBuildQuality(scene, ffi::RTC_BUILD_QUALITY_MEDIUM);
        }
        device.check()?;
        Ok(builder)
    }

    /// Adds a mesh and returns its geometry index. Embree copies the data.
    ///
    /// # Errors
    /// [`EmbreeError::Reported`], e.g. if memory is exhausted.
    ///
    /// # Panics
    /// If a vertex index is out of range; a [`crate::scene::Scene`] has none such.
    pub fn add_mesh(&mut self, vertices: &[[f32; 3]], triangles: &[[u32; 3]]) -> Result<u32, EmbreeError> {
        self.add(vertices, triangles, None)
    }

    /// Adds a mesh whose triangles do not occlude rays with their [skip id](crate::shape::Ray::skip_id); otherwise like
    /// [`Self::add_mesh`].
    ///
    /// # Errors
    /// As for [`Self::add_mesh`].
    pub fn add_light(
        &mut self,
        vertices: &[[f32; 3]],
        triangles: &[[u32; 3]],
        skip_ids: SkipIds,
    ) -> Result<u32, EmbreeError> {
        self.add(vertices, triangles, Some(skip_ids))
    }

    fn add(
        &mut self,
        vertices: &[[f32; 3]],
        triangles: &[[u32; 3]],
        skip_ids: Option<SkipIds>,
    ) -> Result<u32, EmbreeError> {
        assert!(
            triangles.iter().flatten().all(|&i| (i as usize) < vertices.len()),
            "an index is out of range"
        );
        let device = &self.scene.device;
        let geometry = Geometry::new(device, ffi::RTC_GEOMETRY_TYPE_TRIANGLE)?;
        let (handle, functions) = (geometry.handle, geometry.functions);
        // SAFETY: the geometry is alive; the buffers that Embree returns are of the sizes asked for, or null with an error that
        // is checked before anything is written.
        unsafe {
            let buffer = |kind, format, count| functions.rtcSetNewGeometryBuffer(handle, kind, 0, format, 12, count);
            let v = buffer(ffi::RTC_BUFFER_TYPE_VERTEX, ffi::RTC_FORMAT_FLOAT3, vertices.len());
            let i = buffer(ffi::RTC_BUFFER_TYPE_INDEX, ffi::RTC_FORMAT_UINT3, triangles.len());
            if v.is_null() || i.is_null() {
                return Err(device.refusal("no room for a mesh"));
            }
            ptr::copy_nonoverlapping(vertices.as_ptr(), v.cast(), vertices.len());
            ptr::copy_nonoverlapping(triangles.as_ptr(), i.cast(), triangles.len());
            if let Some(skip_ids) = skip_ids {
                functions.rtcSetGeometryUserData(handle, skip_ids::to_user_data(skip_ids));
                functions.rtcSetGeometryOccludedFilterFunction(handle, Some(skip_ids::let_pass));
            }
            functions.rtcCommitGeometry(handle);
            let id = self.attach(handle);
            self.buffers.resize(id as usize + 1, None);
            self.buffers[id as usize] = Some(Buffers {
                vertices: v.cast(),
                triangles: i.cast(),
                count: triangles.len(),
            });
            Ok(id)
        }
    }

    /// Adds all spheres as one geometry and returns its index; sphere `i` is primitive `i`. Call it at most once.
    ///
    /// # Errors
    /// [`EmbreeError::Reported`], e.g. if memory is exhausted.
    ///
    /// # Panics
    /// If it was called before.
    pub fn set_spheres(&mut self, spheres: Vec<impl Into<Sphere>>) -> Result<u32, EmbreeError> {
        assert!(self.spheres.is_none(), "the spheres are set once");
        let spheres = spheres.into_iter().map(Into::into).collect();
        let geometry = Geometry::new(&self.scene.device, ffi::RTC_GEOMETRY_TYPE_USER)?;
        let (handle, functions) = (geometry.handle, geometry.functions);
        // Reference-counted, so that the address stays fixed while the builder and the accelerator move.
        let data = Arc::as_ptr(self.spheres.insert(Arc::new(spheres)));
        // SAFETY: the geometry is alive. The user data outlives the scene (`Accel` holds both) and is only read by the callbacks.
        unsafe {
            functions.rtcSetGeometryUserPrimitiveCount(handle, (*data).len() as u32);
            functions.rtcSetGeometryUserData(handle, data.cast_mut().cast());
            functions.rtcSetGeometryBoundsFunction(handle, Some(spheres::bounds), ptr::null_mut());
            functions.rtcSetGeometryIntersectFunction(handle, Some(spheres::intersect_packet));
            functions.rtcSetGeometryOccludedFunction(handle, Some(spheres::occluded_packet));
            functions.rtcCommitGeometry(handle);
            Ok(self.attach(handle))
        }
    }

    /// # Safety
    /// `geometry` must be a committed geometry of this device.
    unsafe fn attach(&mut self, geometry: ffi::RTCGeometry) -> u32 {
        let id = self.geometries;
        self.geometries += 1;
        // SAFETY: guaranteed by the caller; the scene keeps a count of its own.
        unsafe {
            self.scene
                .device
                .functions()
                .rtcAttachGeometryByID(self.scene.scene, geometry, id)
        };
        id
    }

    /// Builds the BVH on this thread and the device's threads.
    ///
    /// # Errors
    /// [`EmbreeError::Reported`], e.g. if memory is exhausted.
    pub fn commit(self) -> Result<Accel, EmbreeError> {
        // SAFETY: the scene is alive, and all its data is in place.
        unsafe { self.scene.device.functions().rtcCommitScene(self.scene.scene) };
        self.scene.device.check()?;
        Ok(Accel {
            scene: self.scene,
            buffers: self.buffers,
            _spheres: self.spheres,
        })
    }
}

impl Accel {
    pub(super) const fn handle(&self) -> ffi::RTCScene {
        self.scene.scene
    }

    #[inline(always)]
    pub(super) const fn functions(&self) -> &'static Functions {
        self.scene.device.functions()
    }

    /// Closest hits of active rays.
    #[inline(always)]
    pub fn intersect<L: TraceLane>(&self, active: L::Mask, ray: &Ray<L>, coherence: Coherence) -> Hit<L> {
        L::intersect(self, active, ray, coherence)
    }

    /// Which active rays hit anything except the shape with their skip id.
    #[inline(always)]
    pub fn occluded<L: TraceLane>(&self, active: L::Mask, ray: &Ray<L>, coherence: Coherence) -> L::Mask {
        L::occluded(self, active, ray, coherence)
    }

    /// Makes a call fail on this thread.
    #[cfg(test)]
    pub(crate) fn provoke_error(&self) {
        let device = &self.scene.device;
        // SAFETY: the device is alive; no geometry has this type, and Embree answers null and an error.
        let none = unsafe { device.functions().rtcNewGeometry(device.handle(), 99) };
        assert!(none.is_null());
    }

    /// Reads this thread's error; call it once per batch.
    ///
    /// # Errors
    /// [`EmbreeError::Reported`] with the first failure.
    pub fn check(&self) -> Result<(), EmbreeError> {
        self.scene.device.check()
    }
}

#[cfg(test)]
mod tests {
    use crate::shape::BoundingSphere;
    use std::cell::Cell;
    use std::ffi::c_void;
    use std::sync::LazyLock;

    use super::super::library::{Embree, embree};
    use super::*;

    thread_local! {
        /// Number of scenes and geometries that this thread owns.
        static OWNED: Cell<isize> = const { Cell::new(0) };
    }

    fn real() -> &'static Functions {
        &embree().unwrap().functions
    }

    /// Embree functions that count owned objects, and that fail to allocate meshes.
    fn counting() -> &'static Embree {
        fn owned<T>(handle: *mut T, change: isize) -> *mut T {
            if !handle.is_null() {
                OWNED.set(OWNED.get() + change);
            }
            handle
        }
        unsafe extern "C" fn new_scene(device: ffi::RTCDevice) -> ffi::RTCScene {
            // SAFETY: the caller's promise, here and below.
            owned(unsafe { real().rtcNewScene(device) }, 1)
        }
        unsafe extern "C" fn release_scene(scene: ffi::RTCScene) {
            // SAFETY: as above.
            unsafe { real().rtcReleaseScene(owned(scene, -1)) };
        }
        unsafe extern "C" fn new_geometry(device: ffi::RTCDevice, kind: u32) -> ffi::RTCGeometry {
            // SAFETY: as above.
            owned(unsafe { real().rtcNewGeometry(device, kind) }, 1)
        }
        unsafe extern "C" fn release_geometry(geometry: ffi::RTCGeometry) {
            // SAFETY: as above.
            unsafe { real().rtcReleaseGeometry(owned(geometry, -1)) };
        }
        unsafe extern "C" fn no_buffer(_: ffi::RTCGeometry, _: u32, _: u32, _: u32, _: usize, _: usize) -> *mut c_void {
            ptr::null_mut()
        }
        static COUNTING: LazyLock<Embree> = LazyLock::new(|| Embree {
            functions: Functions {
                rtcNewScene: new_scene,
                rtcReleaseScene: release_scene,
                rtcNewGeometry: new_geometry,
                rtcReleaseGeometry: release_geometry,
                rtcSetNewGeometryBuffer: no_buffer,
                ..*real()
            },
            path: "counting".into(),
        });
        &COUNTING
    }

    /// An error left by an earlier call on the thread is reported, and nothing leaks.
    #[test]
    fn nothing_leaks_where_a_scene_is_refused() {
        let device = Device::configured("threads=1", counting()).unwrap();
        let triangle = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let ball = BoundingSphere {
            center: [0.0; 3],
            radius: 1.0,
        };
        let stale = || {
            // SAFETY: the device is alive; no geometry has this type, and Embree answers null and an error.
            let none = unsafe { real().rtcNewGeometry(device.handle(), 99) };
            assert!(none.is_null());
        };
        stale();
        assert!(SceneBuilder::new(&device, true).is_err());
        assert_eq!(OWNED.get(), 0);

        let mut builder = SceneBuilder::new(&device, true).unwrap();
        assert_eq!(OWNED.get(), 1);
        stale();
        let _ = builder.set_spheres(vec![ball]);
        stale();
        assert!(builder.add_mesh(&triangle, &[[0, 1, 2]]).is_err());
        assert!(builder.add_mesh(&triangle, &[[0, 1, 2]]).is_err(), "there is no room");
        assert_eq!(OWNED.get(), 1, "the scene alone");
        drop(builder);
        assert_eq!(OWNED.get(), 0);
    }
}
