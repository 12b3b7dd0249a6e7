//! Runs: renders of a prepared scene to a goal, their observers, and saved state for resuming.
//!
//! A [`Prepared`](crate::pipeline::Prepared) scene never changes. A [`Run`] is one render of it: it advances step by step until
//! it reaches its [`Goal`] or is stopped. After that it stays ended, so a loop over its steps always terminates.

mod checkpoint;
mod goal;
pub(crate) mod halves;
mod observer;
mod options;
mod record;
pub mod replicates;
mod shard;
mod start;
mod steps;

pub use checkpoint::{Checkpoint, ResumeError, Saved};
pub use goal::Goal;
pub use observer::Observer;
pub use options::{RenderError, RenderOptions, render};
pub use record::Record;
pub use shard::Shard;
pub use steps::{Reached, Run, Step};

pub use crate::scene::MOST_SPP;

/// Default samples per pixel.
pub const DEFAULT_SPP: u32 = 64;
