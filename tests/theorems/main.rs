//! What Octolux computes is right: distributions, weights, bits, pictures and the oracle, each against a truth from elsewhere.
//!
//! What these tests share is in `tests/proof`, which the library's tests of mutants use too.

#[path = "../proof/mod.rs"]
mod proof;

mod accelerators;
mod adaptive;
mod caps;
mod chosen;
mod closed_forms;
mod combinations;
mod effects;
mod effects_agree;
mod embree;
mod estimators;
mod ggx;
mod lanes;
mod lanes_estimators;
mod linear;
mod many_lamps;
mod many_lights;
mod pictures;
mod properties;
mod rays;
mod reference_closed_forms;
mod reference_geometry;
mod reference_scene;
mod replay;
mod rings;
mod runs;
mod samplers;
mod selftest;
mod statistics;
mod strategies;
mod terminator;
mod triangles;
mod verify_right;
mod warps;
mod weights;
