//! The program as its users meet it: every test starts the real binary in a folder of its own.

mod batch;
mod broken_scenes;
mod chosen;
mod coincidences;
mod compare;
mod edges;
mod embree;
mod errors;
mod explain;
mod faults;
mod info;
mod inputs;
#[cfg(target_os = "linux")]
mod losses;
mod manifests;
mod not_a_number;
mod options;
mod place;
mod reference;
mod render;
mod replayed;
mod shards;
mod study;
mod tev;
mod verify;
mod view;
mod viewed;
