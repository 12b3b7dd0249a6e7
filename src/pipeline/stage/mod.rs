//! The stages of a chunk, in order: [`camera`] fills the hit streams, [`shade`] fills the shadow queue, [`shadow`] traces it and
//! adds to the film.

mod bundles;
pub mod camera;
mod chunk;
mod directions;
mod disks;
pub mod each;
mod facets;
mod grid;
pub mod listed;
pub mod meshes;
mod met;
mod penumbra;
mod picks;
mod request;
mod rings;
#[cfg(feature = "rival")]
pub mod rival;
mod scratch;
pub mod shade;
pub mod shadow;
pub mod surface;
pub mod walked;

pub use chunk::{Chunk, Order, Segment, pairs};
pub use directions::Directions;
pub use penumbra::{MARKS, Penumbra};
pub use request::{Request, RequestHandler};
pub use scratch::{Scratch, Shaft, Stage};
