//! From a scene to a film: streams, queues and stages.

pub mod progress;
pub mod renderer;

pub use progress::{Counters, Progress};
pub use renderer::{Renderer, Settings, SetupError};
