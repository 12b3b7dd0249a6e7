//! Vectors, frames and elementary functions over lanes. Values common to all lanes (cameras, transforms, meshes) use `glam`.

pub mod elementary;
mod frame;
mod vec3;

pub use frame::Frame;
pub use vec3::Vec3;
