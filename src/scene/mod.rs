//! Scenes: validated data, made by a program or read from a file.
//!
//! A [`SceneBuilder`] takes the types of `parts` and makes a [`Scene`] of them, or an [`InvalidScene`] that names the part, the
//! value and a remedy. `check` has every rule. All users of a `Scene` may rely on the invariants stated in `parts`.
//!
//! [`Scene::load`] reads a text into a builder. Its [`SceneError`] also names the file, the line and the key: `places` maps
//! what a builder rejects to its place in the text. The text is traversed, not deserialised: `table` and `value` wrap the TOML
//! tree with names and places; `view`, `materials` and `shapes` know the keys of the format. So an error can say "sphere radius
//! must be positive" with the number as written, where a deserialiser only knows that some `f64` was invalid.

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
mod light_cloud;
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
pub use check::MOST_SPP;
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

/// An immutable scene whose every value has been checked. Lengths are in the units of the file, in absolute `f64` coordinates;
/// colours are linear RGB.
///
/// Copies share the meshes and pictures.
#[derive(Clone, Debug)]
pub struct Scene {
    parts: SceneBuilder,
    notes: Vec<String>,
    overlaps: Vec<[usize; 2]>,
    hash: OnceLock<String>,
}

impl Scene {
    /// A builder with only a camera and a film.
    pub fn builder(camera: Camera, film: FilmSize) -> SceneBuilder {
        SceneBuilder::new(camera, film)
    }

    /// A builder that starts as a copy of this scene.
    pub fn to_builder(&self) -> SceneBuilder {
        self.parts.clone()
    }

    /// The default name of a picture: for a scene file its name without the extension.
    pub fn name(&self) -> &str {
        &self.parts.name
    }

    /// The camera.
    pub fn camera(&self) -> &Camera {
        &self.parts.camera
    }

    /// The default size of the picture.
    pub fn film(&self) -> FilmSize {
        self.parts.film
    }

    /// The default render settings.
    pub fn render(&self) -> RenderTable {
        self.parts.render
    }

    /// Reflecting surfaces, in the order in which they were added.
    pub fn materials(&self) -> &[Material] {
        &self.parts.materials
    }

    /// The material of a surface.
    ///
    /// # Panics
    /// If the handle belongs to another scene, and this one has fewer materials.
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

    /// Lights without shape, in the order in which they were added.
    pub fn lights(&self) -> &[Light] {
        &self.parts.lights
    }

    /// The environment; black if `None`.
    pub fn environment(&self) -> Option<&Environment> {
        self.parts.environment.as_ref()
    }

    /// The files that it was read from, the scene file first; none for a scene made by a program. No output may overwrite them.
    pub fn files(&self) -> &[PathBuf] {
        &self.parts.files
    }

    /// Messages for the user: one sentence each; none of them prevents a render.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// Pairs of meshes, by index, with overlapping faces in one plane: rays that hit them are traced again. A mesh paired with
    /// itself has faces back to back.
    pub fn overlapping_meshes(&self) -> &[[usize; 2]] {
        &self.overlaps
    }

    /// SHA-256, in hexadecimal, of everything that affects a picture except its size and the render settings: camera, shapes
    /// with their materials and textures, lights, environment. Computed on the first call, from all bytes of the meshes and
    /// pictures.
    pub fn hash(&self) -> &str {
        self.hash.get_or_init(|| hash::of(&self.parts))
    }
}
