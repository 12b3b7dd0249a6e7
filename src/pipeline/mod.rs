//! From a scene to a film: streams, queues and stages.

mod camera;
mod chosen;
mod closed;
mod columns;
mod emitters;
mod intersector;
mod job;
mod kernels;
mod lights;
mod lists;
mod model;
mod narrow;
mod outlook;
mod plan;
mod prepared;
mod progress;
mod queue;
pub mod rays;
mod renderer;
mod replay;
mod settings;
mod space;
mod stage;
mod stream;
mod texture;
mod ties;
mod tracer;
mod world;

pub use chosen::Chosen;
pub use plan::widest_lanes;
pub use prepared::{ListsOfLights, Prepared, SetupError};
pub use progress::{Counters, Progress};
pub(crate) use renderer::Renderer;
pub use replay::{Asked, Beside, Found, Met, Point, Replay};
pub use settings::{Settings, all_threads};
pub use stage::Segment;
