//! Rays, and the shapes that they meet, over lanes: pure functions that know no accelerator.

mod ball;
mod ray;
mod sphere;
mod triangle;

pub use ball::Ball;
pub use ray::{AimNames, Aims, Hit, NO_SPHERE, Ray};
pub use sphere::Sphere;
pub use triangle::{EDGE, FromOrigin, Triangle};
