//! Random numbers with addresses, and the warps that turn them into directions, each beside its density.

pub mod discrete;
pub mod hash;
pub mod sampler;
pub mod sobol;
mod table;
pub mod warp;

pub use discrete::Discrete;
pub use sampler::{Pair, PassBlock, TechniqueSample};
