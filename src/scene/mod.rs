//! What a scene is: data that cannot be wrong, made by a program or from the text of a file.
//!
//! A [`SceneBuilder`] takes what `parts` defines and makes a [`Scene`] of it, or an [`InvalidScene`] that names the part, the
//! value and what would do. `check` holds every rule. Everything behind a `Scene` may rely on what `parts` states.
//!
//! [`Scene::load`] reads a text into a builder. Its [`SceneError`] also names the file, the line and the key: `places` finds
//! where in the text stands what a builder refuses. The text is walked, not deserialised: `table` and `value` know the TOML tree with its names and places, `view`,
//! `materials` and `shapes` know the keys of the format. An error can then say "sphere radius must be positive", with
//! the number as it was written, where a deserialiser only knows that some `f64` was not to its taste.

mod builder;
mod check;
mod coincide;
mod covered;
mod cuboid;
mod effect;
mod environment;
mod error;
mod features;
mod files;
mod hash;
mod invalid;
mod light;
mod lights;
mod load;
mod materials;
mod memory;
mod mesh;
mod named;
mod nearest;
mod parts;
mod picture;
mod places;
mod reach;
mod rule;
mod shapes;
mod sight;
mod table;
mod texture;
mod value;
mod view;

#[cfg(test)]
mod tests;

use std::path::PathBuf;
use std::sync::{Arc, OnceLock};

pub use crate::settings::{EstimatorKind, SamplerKind};
pub use crate::texels::Texels;
pub use builder::{LightId, MeshId, SceneBuilder, SphereId};
pub use effect::{Effect, Effects};
pub use error::SceneError;
pub use features::Features;
pub use files::Outside;
pub use invalid::{InvalidScene, Property, Subject};
pub use light::{Light, LightClass};
pub use memory::available as available_memory;
pub use parts::{
    Bsdf, Camera, Environment, FilmSize, Fov, LatLong, Lens, Material, MaterialId, Mesh, RenderTable, Sphere, Surface,
};
pub use texture::{Texture, Wrap};

/// A scene whose every value has been checked; it does not change. Lengths are in the units of the file, in `f64`, not yet made
/// relative to anything; colours are linear RGB.
///
/// Its copies share the meshes and pictures.
#[derive(Clone, Debug)]
pub struct Scene {
    parts: SceneBuilder,
    notes: Vec<String>,
    overlaps: Vec<[usize; 2]>,
    hash: OnceLock<String>,
}

impl Scene {
    /// Begins a scene of nothing but a camera and a picture.
    pub fn builder(camera: Camera, film: FilmSize) -> SceneBuilder {
        SceneBuilder::new(camera, film)
    }

    /// Begins a scene that is like this one.
    pub fn to_builder(&self) -> SceneBuilder {
        self.parts.clone()
    }

    /// The default name of a picture: of a scene file its name without the ending.
    pub fn name(&self) -> &str {
        &self.parts.name
    }

    /// The camera.
    pub fn camera(&self) -> &Camera {
        &self.parts.camera
    }

    /// The size of the picture, where nobody asks for another one.
    pub fn film(&self) -> FilmSize {
        self.parts.film
    }

    /// The settings that it asks for, where nobody asks for others.
    pub fn render(&self) -> RenderTable {
        self.parts.render
    }

    /// Reflecting surfaces, in the order in which they were added.
    pub fn materials(&self) -> &[Material] {
        &self.parts.materials
    }

    /// The material that a surface names.
    ///
    /// # Panics
    /// If the handle is one of another scene, and this one has fewer materials.
    pub fn material(&self, id: MaterialId) -> &Material {
        &self.parts.materials[id.index()]
    }

    /// Spheres, in the order in which they were added.
    pub fn spheres(&self) -> &[Sphere] {
        &self.parts.spheres
    }

    /// Triangle meshes, in the order in which they were added.
    pub fn meshes(&self) -> &[Arc<Mesh>] {
        &self.parts.meshes
    }

    /// Lights that are no shapes, in the order in which they were added.
    pub fn lights(&self) -> &[Light] {
        &self.parts.lights
    }

    /// What rays see that leave the scene; black where it is `None`.
    pub fn environment(&self) -> Option<&Environment> {
        self.parts.environment.as_ref()
    }

    /// The files that it was read from, the scene file first; none where a program made it. No output may replace one of them.
    pub fn files(&self) -> &[PathBuf] {
        &self.parts.files
    }

    /// What the user should be told about the scene: one sentence each, nothing that stops a render.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// Pairs of meshes, by their numbers, that have faces in one plane which cover each other: rays look again there. A mesh beside
    /// itself has faces that lie back to back.
    pub fn overlapping_meshes(&self) -> &[[usize; 2]] {
        &self.overlaps
    }

    /// SHA-256, in hexadecimal, of all that decides a picture but its size and the settings of the render: camera, shapes with
    /// their materials and textures, lights, environment. It is computed when it is first asked for,
    /// from all bytes of the meshes and pictures.
    pub fn hash(&self) -> &str {
        self.hash.get_or_init(|| hash::of(&self.parts))
    }
}
