//! Files in and out: scenes and meshes of every kind, broken ones with their sentences, and pictures.

mod broken_scenes;
mod files;
mod film_files;
mod format;
mod fuzz_corpus;
mod light_clouds;
mod meshes;
mod pictures;
mod radiance;
