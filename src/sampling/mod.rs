//! Random numbers by address, and warps from random numbers to directions with their densities.

pub mod discrete;
pub mod hash;
pub mod sampler;
pub mod sobol;
mod table;
pub mod warp;

pub use discrete::Discrete;
pub use sampler::{Pair, PassBlock, TechniqueSample};
