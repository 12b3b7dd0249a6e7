//! Embree 4, made safe: bindings, the device, and a check that both agree about the layout of rays.

mod canary;
mod device;
pub(crate) mod ffi;

pub use canary::layout_canary;
pub use device::{Device, EmbreeError};
