//! Rays, and the shapes that they meet, over lanes: pure functions that know no accelerator.

mod ball;
mod ray;
mod sphere;
mod triangle;

pub use ball::Ball;
pub use ray::{Hit, NO_SKIP_ID, Ray, SkipIdAllocator, SkipIds};
pub use sphere::Sphere;
pub use triangle::{EDGE, FromOrigin, Triangle};
