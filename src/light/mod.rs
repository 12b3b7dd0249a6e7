//! What emits and can be sampled: one kind a file.

pub mod sphere;
pub mod triangle;

pub use sphere::{Cone, SphereLight};
pub use triangle::{Triangle, TriangleLight, Triangles};
