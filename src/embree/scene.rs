//! A scene in Embree's hands: built once, then queried by any thread.

use std::ptr;
use std::sync::Arc;

use super::aims;
use super::device::{Device, EmbreeError};
use super::ffi;
use super::packet::{Coherence, TraceLane};
use super::spheres::{self, Balls};
use crate::shape::{Aims, Ball, Hit, Ray};

/// A scene that takes geometry; [`commit`](Self::commit) makes it one that answers.
#[derive(Debug)]
pub struct SceneBuilder {
    scene: Handle,
    geometries: u32,
    spheres: Option<Arc<Balls>>,
}

/// A committed scene: immutable, shared by all threads.
#[derive(Debug)]
pub struct Accel {
    scene: Handle,
    /// The callbacks read it: alive as long as the scene, at one address.
    _spheres: Option<Arc<Balls>>,
}

/// Owns one count of an Embree scene and of its device.
#[derive(Debug)]
struct Handle {
    scene: ffi::RTCScene,
    device: Device,
}

// SAFETY: a scene belongs to no thread; while it takes geometry it is owned and used through `&mut`.
unsafe impl Send for Handle {}
// SAFETY: behind `&`, only queries of a committed scene are reachable, and Embree allows these from any thread.
unsafe impl Sync for Handle {}

impl Drop for Handle {
    fn drop(&mut self) {
        // SAFETY: the one count that `SceneBuilder::new` received.
        unsafe { ffi::rtcReleaseScene(self.scene) };
    }
}

impl SceneBuilder {
    /// An empty scene. `robust` closes the edges between triangles: rays aimed exactly at edges miss in 0.05 % of cases
    /// instead of 8.1 %, for 4 % (coherent) to 20 % of the speed.
    ///
    /// # Errors
    /// [`EmbreeError::Reported`] if Embree refuses.
    pub fn new(device: &Device, robust: bool) -> Result<Self, EmbreeError> {
        // SAFETY: the device is alive.
        let scene = unsafe { ffi::rtcNewScene(device.handle()) };
        device.check()?;
        let builder = Self {
            scene: Handle {
                scene,
                device: device.clone(),
            },
            geometries: 0,
            spheres: None,
        };
        let flags = if robust {
            ffi::RTC_SCENE_FLAG_ROBUST
        } else {
            ffi::RTC_SCENE_FLAG_NONE
        };
        // SAFETY: the scene is alive and not committed.
        unsafe {
            ffi::rtcSetSceneFlags(scene, flags);
            // Medium equals high on the scenes measured (design notes), and builds faster.
            ffi::rtcSetSceneBuildQuality(scene, ffi::RTC_BUILD_QUALITY_MEDIUM);
        }
        device.check()?;
        Ok(builder)
    }

    /// Adds a mesh and returns the number of its geometry. Embree copies what it is given.
    ///
    /// # Errors
    /// [`EmbreeError::Reported`], for instance when memory is exhausted.
    ///
    /// # Panics
    /// If an index names a vertex that is not there: a [`crate::scene::Scene`] has none such.
    pub fn add_mesh(&mut self, vertices: &[[f32; 3]], triangles: &[[u32; 3]]) -> Result<u32, EmbreeError> {
        self.add(vertices, triangles, None)
    }

    /// Adds a mesh whose triangles block no ray that [aims at](crate::shape::Ray::aims_at) them; otherwise as
    /// [`Self::add_mesh`].
    ///
    /// # Errors
    /// As for [`Self::add_mesh`].
    pub fn add_light(&mut self, vertices: &[[f32; 3]], triangles: &[[u32; 3]], aims: Aims) -> Result<u32, EmbreeError> {
        self.add(vertices, triangles, Some(aims))
    }

    fn add(&mut self, vertices: &[[f32; 3]], triangles: &[[u32; 3]], aims: Option<Aims>) -> Result<u32, EmbreeError> {
        assert!(
            triangles.iter().flatten().all(|&i| (i as usize) < vertices.len()),
            "an index is out of range"
        );
        let device = &self.scene.device;
        // SAFETY: the device is alive; the buffers that Embree returns are of the sizes asked for, or null with an error
        // that is checked before anything is written; the geometry's count is given up after attaching.
        unsafe {
            let geometry = ffi::rtcNewGeometry(device.handle(), ffi::RTC_GEOMETRY_TYPE_TRIANGLE);
            device.check()?;
            let buffer = |kind, format, count| ffi::rtcSetNewGeometryBuffer(geometry, kind, 0, format, 12, count);
            let v = buffer(ffi::RTC_BUFFER_TYPE_VERTEX, ffi::RTC_FORMAT_FLOAT3, vertices.len());
            let i = buffer(ffi::RTC_BUFFER_TYPE_INDEX, ffi::RTC_FORMAT_UINT3, triangles.len());
            if v.is_null() || i.is_null() {
                ffi::rtcReleaseGeometry(geometry);
                device.check()?;
                return Err(EmbreeError::Reported {
                    kind: "no room for a mesh",
                    message: String::new(),
                });
            }
            ptr::copy_nonoverlapping(vertices.as_ptr(), v.cast(), vertices.len());
            ptr::copy_nonoverlapping(triangles.as_ptr(), i.cast(), triangles.len());
            if let Some(aims) = aims {
                ffi::rtcSetGeometryUserData(geometry, aims::to_user_data(aims));
                ffi::rtcSetGeometryOccludedFilterFunction(geometry, Some(aims::let_pass));
            }
            ffi::rtcCommitGeometry(geometry);
            Ok(self.attach(geometry))
        }
    }

    /// Adds all spheres as one geometry and returns its number; sphere `i` is primitive `i`. Call it at most once.
    ///
    /// # Errors
    /// [`EmbreeError::Reported`], for instance when memory is exhausted.
    ///
    /// # Panics
    /// If it was called before.
    pub fn set_spheres(&mut self, balls: Vec<Ball>) -> Result<u32, EmbreeError> {
        assert!(self.spheres.is_none(), "the spheres are set once");
        let device = &self.scene.device;
        // Behind a count, so that its address stays while the builder and the accelerator move.
        let data = Arc::as_ptr(self.spheres.insert(Arc::new(balls)));
        // SAFETY: the user data outlives the scene (`Accel` holds both) and is only read by the callbacks.
        unsafe {
            let geometry = ffi::rtcNewGeometry(device.handle(), ffi::RTC_GEOMETRY_TYPE_USER);
            device.check()?;
            ffi::rtcSetGeometryUserPrimitiveCount(geometry, (*data).len() as u32);
            ffi::rtcSetGeometryUserData(geometry, data.cast_mut().cast());
            ffi::rtcSetGeometryBoundsFunction(geometry, Some(spheres::bounds), ptr::null_mut());
            ffi::rtcSetGeometryIntersectFunction(geometry, Some(spheres::intersect_packet));
            ffi::rtcSetGeometryOccludedFunction(geometry, Some(spheres::occluded_packet));
            ffi::rtcCommitGeometry(geometry);
            Ok(self.attach(geometry))
        }
    }

    /// # Safety
    /// `geometry` must be a committed geometry of this device whose one count is given up here.
    unsafe fn attach(&mut self, geometry: ffi::RTCGeometry) -> u32 {
        let id = self.geometries;
        self.geometries += 1;
        // SAFETY: by the caller's promise; the scene keeps a count of its own.
        unsafe {
            ffi::rtcAttachGeometryByID(self.scene.scene, geometry, id);
            ffi::rtcReleaseGeometry(geometry);
        }
        id
    }

    /// Builds the hierarchy on this thread and the device's own.
    ///
    /// # Errors
    /// [`EmbreeError::Reported`], for instance when memory is exhausted.
    pub fn commit(self) -> Result<Accel, EmbreeError> {
        // SAFETY: the scene is alive, and all its data is in place.
        unsafe { ffi::rtcCommitScene(self.scene.scene) };
        self.scene.device.check()?;
        Ok(Accel {
            scene: self.scene,
            _spheres: self.spheres,
        })
    }
}

impl Accel {
    pub(crate) fn handle(&self) -> ffi::RTCScene {
        self.scene.scene
    }

    /// What active rays meet first.
    #[inline(always)]
    pub fn intersect<L: TraceLane>(&self, active: L::Mask, ray: &Ray<L>, coherence: Coherence) -> Hit<L> {
        L::intersect(self, active, ray, coherence)
    }

    /// Which active rays meet anything but the light that they aim at.
    #[inline(always)]
    pub fn occluded<L: TraceLane>(&self, active: L::Mask, ray: &Ray<L>, coherence: Coherence) -> L::Mask {
        L::occluded(self, active, ray, coherence)
    }

    /// Asks whether anything failed on this thread; once a batch.
    ///
    /// # Errors
    /// [`EmbreeError::Reported`] with the first failure.
    pub fn check(&self) -> Result<(), EmbreeError> {
        self.scene.device.check()
    }
}
