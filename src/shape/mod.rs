//! Rays and shapes, generic over lanes: pure functions, independent of the intersector.

mod bounding_sphere;
mod ray;
mod sphere;
mod triangle;

pub use bounding_sphere::BoundingSphere;
pub use ray::{Hit, NO_SKIP_ID, Ray, SkipIdAllocator, SkipIds};
pub use sphere::Sphere;
pub use triangle::{EDGE, FromOrigin, Triangle};
