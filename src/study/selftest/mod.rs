//! The hard cases of direct illumination, each with a figure and a bound.

pub mod bench;
pub mod places;
pub mod row;
