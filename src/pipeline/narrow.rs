//! From the numbers of a scene to those of the kernels.

use glam::DVec3;

/// The nearest `f32` of each component.
pub fn narrow(v: DVec3) -> [f32; 3] {
    v.to_array().map(|x| x as f32)
}
