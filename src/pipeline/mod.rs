//! From a scene to a film: streams, queues and stages.

mod columns;
mod emitters;
mod job;
mod plan;
mod progress;
mod queue;
mod renderer;
mod replay;
mod rows;
mod stage;
mod stream;
mod texture;
mod tracer;
mod world;

pub use plan::widest_lanes;
pub use progress::{Counters, Progress};
pub use renderer::{Renderer, Settings, SetupError};
pub use replay::{Asked, Found, Met, Point, Replay};
