//! Pictures: what comes out.

pub mod picture;

pub use picture::Picture;
