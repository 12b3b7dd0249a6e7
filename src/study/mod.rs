//! Studies: distances between pictures, and the cost of accuracy.

#[cfg(feature = "lab")]
pub mod cost;
pub mod distributions;
pub mod effect_costs;
pub mod error;
pub mod estimate;
pub mod family;
#[cfg(feature = "lab")]
pub mod hunt;
pub mod outliers;
#[cfg(feature = "lab")]
pub mod page;
#[cfg(feature = "lab")]
pub mod selftest;
pub mod significance;
#[cfg(feature = "lab")]
pub mod verify;
