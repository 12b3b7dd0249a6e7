//! Pictures: what comes out.

pub mod picture;
mod sums;

pub use picture::Picture;
pub use sums::{Film, TILE, Tile, TileSum};
