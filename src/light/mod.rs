//! Light sources that can be sampled, one kind per file.

pub mod cap;
pub mod delta;
pub mod disk;
pub mod environment;
pub mod falloff;
pub mod mesh;
pub mod reach;
pub mod ring;
pub mod sphere;
pub mod sun;
pub mod tree;
pub mod triangle;

pub use cap::Cap;
pub use delta::DeltaLight;
pub use environment::Environment;
pub use mesh::MeshLight;
pub use reach::Reach;
pub use ring::{Ring, Rings};
pub use sphere::{Cone, SphereLight, View};
pub use sun::Sun;
pub use tree::LightTree;
pub use triangle::{Triangle, TriangleLight, Triangles};
