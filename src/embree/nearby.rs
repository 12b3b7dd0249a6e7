//! Finds triangles around a point with Embree's point queries: the other candidates where a ray passes near an edge.

#![allow(non_snake_case, reason = "the names of Embree's headers")]

use std::ffi::c_void;
use std::mem::{align_of, offset_of, size_of};

use super::ffi;
use super::scene::Accel;

/// A sphere around a point.
#[repr(C, align(16))]
pub(crate) struct RTCPointQuery {
    pub x: f32,
    pub y: f32,
    pub z: f32,
    pub time: f32,
    pub radius: f32,
}

/// The stack of instances, one level deep.
#[repr(C, align(16))]
pub(crate) struct RTCPointQueryContext {
    pub world2inst: [f32; 16],
    pub inst2world: [f32; 16],
    pub instID: u32,
    pub instPrimID: u32,
    pub instStackSize: u32,
}

#[repr(C, align(16))]
pub(crate) struct RTCPointQueryFunctionArguments {
    pub query: *mut RTCPointQuery,
    pub userPtr: *mut c_void,
    pub primID: u32,
    pub geomID: u32,
    pub context: *mut RTCPointQueryContext,
    pub similarityScale: f32,
}

pub(crate) type RTCPointQueryFunction = Option<unsafe extern "C" fn(args: *mut RTCPointQueryFunctionArguments) -> bool>;

const _: () = {
    assert!(size_of::<RTCPointQuery>() == 32 && align_of::<RTCPointQuery>() == 16);
    assert!(offset_of!(RTCPointQuery, radius) == 16);
    assert!(size_of::<RTCPointQueryContext>() == 144 && align_of::<RTCPointQueryContext>() == 16);
    assert!(offset_of!(RTCPointQueryContext, inst2world) == 64 && offset_of!(RTCPointQueryContext, instID) == 128);
    assert!(
        offset_of!(RTCPointQueryContext, instPrimID) == 132 && offset_of!(RTCPointQueryContext, instStackSize) == 136
    );
    assert!(size_of::<RTCPointQueryFunctionArguments>() == 48 && align_of::<RTCPointQueryFunctionArguments>() == 16);
    assert!(offset_of!(RTCPointQueryFunctionArguments, userPtr) == 8);
    assert!(
        offset_of!(RTCPointQueryFunctionArguments, primID) == 16
            && offset_of!(RTCPointQueryFunctionArguments, geomID) == 20
    );
    assert!(offset_of!(RTCPointQueryFunctionArguments, context) == 24);
};

/// Pointers to the vertices and indices of a mesh in Embree's own buffers.
#[derive(Clone, Copy, Debug)]
pub(super) struct Buffers {
    pub vertices: *const [f32; 3],
    pub triangles: *const [u32; 3],
    pub count: usize,
}

struct Visitor<'a> {
    accel: &'a Accel,
    visit: &'a mut dyn FnMut([u32; 2], [[f32; 3]; 3]),
}

impl Accel {
    /// The corners of a triangle; `None` if the geometry is the spheres.
    pub fn corners(&self, geometry: u32, primitive: u32) -> Option<[[f32; 3]; 3]> {
        let Buffers {
            vertices,
            triangles,
            count,
        } = *self.buffers.get(geometry as usize)?.as_ref()?;
        if primitive as usize >= count {
            return None;
        }
        // SAFETY: the buffers belong to a geometry that the scene keeps alive, nobody writes to them any more, they hold `count`
        // triangles, and `SceneBuilder::add` has checked that their indices are in range.
        unsafe { Some((*triangles.add(primitive as usize)).map(|i| *vertices.add(i as usize))) }
    }

    /// Visits every triangle closer to a point than `radius`, and possibly others: geometry and primitive index, then corners.
    pub fn nearby(&self, [x, y, z]: [f32; 3], radius: f32, visit: &mut dyn FnMut([u32; 2], [[f32; 3]; 3])) {
        let mut query = RTCPointQuery {
            x,
            y,
            z,
            time: 0.0,
            radius,
        };
        let mut context = RTCPointQueryContext {
            world2inst: [0.0; 16],
            inst2world: [0.0; 16],
            instID: ffi::RTC_INVALID_GEOMETRY_ID,
            instPrimID: ffi::RTC_INVALID_GEOMETRY_ID,
            instStackSize: 0,
        };
        let mut visitor = Visitor { accel: self, visit };
        // SAFETY: the scene is committed and alive; query and context have Embree's layout (asserted) and belong to this thread, as
        // does the visitor, which lives during the call.
        unsafe {
            self.functions().rtcPointQuery(
                self.handle(),
                &mut query,
                &mut context,
                Some(visit_one),
                (&raw mut visitor).cast::<c_void>(),
            );
        }
    }
}

/// # Safety
/// Embree calls it with the user pointer that [`Accel::nearby`] gave it.
unsafe extern "C" fn visit_one(args: *mut RTCPointQueryFunctionArguments) -> bool {
    // SAFETY: `args` and the visitor live during the call, on this thread.
    let (args, visitor) = unsafe { (&*args, &mut *(*args).userPtr.cast::<Visitor<'_>>()) };
    if let Some(corners) = visitor.accel.corners(args.geomID, args.primID) {
        (visitor.visit)([args.geomID, args.primID], corners);
    }
    // The radius does not change.
    false
}

#[cfg(test)]
mod tests {
    use super::super::{Device, SceneBuilder};
    use crate::shape::BoundingSphere;

    /// All triangles of all meshes around a point are visited; spheres are skipped.
    #[test]
    fn nobody_nearby_is_missed() {
        let device = Device::new(1).unwrap();
        let mut builder = SceneBuilder::new(&device, true).unwrap();
        // A fan of 40 triangles around the origin, twice, and one triangle far away.
        let rim = |i: u32| {
            let turn = std::f32::consts::TAU * i as f32 / 40.0;
            [turn.cos(), turn.sin(), 0.0]
        };
        let mut vertices: Vec<[f32; 3]> = (0..40).map(rim).collect();
        vertices.push([0.0; 3]);
        let fan: Vec<[u32; 3]> = (0..40).map(|i| [40, i, (i + 1) % 40]).collect();
        for _ in 0..2 {
            builder.add_mesh(&vertices, &fan).unwrap();
        }
        builder
            .add_mesh(&[[50.0, 0.0, 0.0], [51.0, 0.0, 0.0], [50.0, 1.0, 0.0]], &[[0, 1, 2]])
            .unwrap();
        builder
            .set_spheres(vec![BoundingSphere {
                center: [0.0; 3],
                radius: 0.1,
            }])
            .unwrap();
        let accel = builder.commit().unwrap();
        let mut seen = Vec::new();
        accel.nearby([1e-4, 0.0, 0.0], 1e-3, &mut |name, corners| {
            assert_eq!(Some(corners), accel.corners(name[0], name[1]));
            seen.push(name);
        });
        seen.sort_unstable();
        seen.dedup();
        for mesh in 0..2 {
            for triangle in 0..40 {
                assert!(seen.contains(&[mesh, triangle]), "{mesh}, {triangle}");
            }
        }
        assert!(!seen.contains(&[2, 0]), "what is far is not visited");
        assert_eq!(accel.corners(3, 0), None, "a sphere has no corners");
        assert_eq!(accel.corners(2, 1), None);
    }
}
