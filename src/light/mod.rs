//! What emits and can be sampled: one kind a file.

pub mod cap;
pub mod environment;
pub mod mesh;
pub mod ring;
pub mod sphere;
pub mod tree;
pub mod triangle;

pub use cap::Cap;
pub use environment::Environment;
pub use mesh::MeshLight;
pub use ring::{Ring, Rings};
pub use sphere::{Cone, SphereLight, View};
pub use tree::LightTree;
pub use triangle::{Triangle, TriangleLight, Triangles};
