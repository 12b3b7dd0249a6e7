//! What emits and can be sampled: one kind a file.

pub mod sphere;

pub use sphere::{Cone, SphereLight, View};
