//! Runs: how far a prepared scene is rendered, who looks on, and what is kept to go on later.
//!
//! A [`Prepared`](crate::pipeline::Prepared) scene never changes. A [`Run`] is one render of it: it goes on step by step until its [`Goal`] is reached or it is
//! stopped, and then it has ended for good, so no loop over its steps can spin.

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

/// The most samples a pixel: far beyond what any picture needs, and far below where counting in `u32` ends.
pub const MOST_SPP: u32 = 1 << 30;

/// Samples a pixel where nobody says.
pub const DEFAULT_SPP: u32 = 64;
