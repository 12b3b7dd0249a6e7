//! Safe wrapper of Embree 4: bindings, device, scene, packet queries, and a check that both sides use the same layouts.
//!
//! Usage: `Device` → [`SceneBuilder`] → [`SceneBuilder::commit`] → [`Accel`], which any thread may query.

mod canary;
mod device;
#[cfg(test)]
mod fences;
mod ffi;
mod library;
mod nearby;
mod packet;
mod prefetch;
mod scene;
mod skip_ids;
mod spheres;

pub use crate::shape::{BoundingSphere, Hit, NO_SKIP_ID, Ray};
pub use canary::layout_canary;
pub use device::{Device, EmbreeError, Packets};
pub use packet::{Coherence, LaneWork, TraceLane, in_eight_of_avx512, in_sixteen};
pub use prefetch::prefetch;
pub use scene::{Accel, SceneBuilder};
