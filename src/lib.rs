//! Octolux renders direct illumination in packets of rays.
//!
//! Data flows one way: a scene file becomes a [`scene::Scene`], the scene says what it needs, the plan picks a
//! kernel, streams of packets go through Embree and the estimators, and a film collects the sums.
//!
//! Layers, lowest first; a module uses only those before it, and `tests/layers.rs` keeps that true:
//! [`cpu`], [`about`], [`machine`] and [`settings`] · [`lane`] · [`math`] · [`sampling`] · [`bsdf`] and [`light`] · [`shape`] · [`embree`] and
//! [`linear`] · [`scene`] ·
//! [`estimator`] · [`film`] and [`pipeline`] · [`run`] · [`mod@reference`] (of scene data alone) · [`study`] · [`cli`].

#[macro_use]
mod mutant;

#[cfg(test)]
extern crate self as octolux; // the checks of `tests/proof` name the crate
#[cfg(test)]
#[path = "../tests/proof/mod.rs"]
mod proof;

pub mod about;
pub mod bsdf;
#[cfg(feature = "cli")]
pub mod cli;
pub mod cpu;
pub mod embree;
pub mod estimator;
pub mod film;
pub mod lane;
pub mod light;
pub mod linear;
pub mod machine;
pub mod math;
pub mod pipeline;
pub mod reference;
pub mod run;
pub mod sampling;
pub mod scene;
pub mod settings;
pub mod shape;
pub mod study;

pub use pipeline::rays;
pub use run::{RenderError, RenderOptions, render};
