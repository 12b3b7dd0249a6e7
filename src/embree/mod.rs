//! Embree 4, made safe: bindings, device, scene, packets of queries, and a check that both sides agree about layouts.
//!
//! The shape is `Device` → [`SceneBuilder`] → [`SceneBuilder::commit`] → [`Accel`], which any thread may query.

mod aims;
mod canary;
mod device;
#[cfg(test)]
mod fences;
pub(crate) mod ffi;
mod packet;
mod prefetch;
mod scene;
mod spheres;

pub use crate::shape::{Ball, Hit, NO_SPHERE, Ray};
pub use canary::layout_canary;
pub use device::{Device, EmbreeError};
pub use packet::{Coherence, TraceLane};
pub use prefetch::prefetch;
pub use scene::{Accel, SceneBuilder};
