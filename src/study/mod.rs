//! Studies: how far a picture is from another, and what accuracy costs.

pub mod cost;
pub mod distributions;
pub mod effect_costs;
pub mod error;
pub mod estimate;
pub mod family;
pub mod outliers;
pub mod page;
pub mod selftest;
pub mod significance;
pub mod target;
pub mod verify;
