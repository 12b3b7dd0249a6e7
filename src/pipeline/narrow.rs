//! Conversion from scene precision to kernel precision.

use glam::DVec3;

/// Rounds each component to the nearest `f32`.
pub fn narrow(v: DVec3) -> [f32; 3] {
    v.to_array().map(|x| x as f32)
}
