//! What a scene is: from the text of a file to data that cannot be wrong.
//!
//! [`Scene::load`] turns the text into a [`Scene`] or into a [`SceneError`] that names the file, the line, the key and
//! the value. Everything behind a `Scene` may rely on the invariants stated here.
//!
//! The text is walked, not deserialised: `table` and `value` know the TOML tree with its names and places, `view`,
//! `materials` and `shapes` know the keys of the format. An error can then say "sphere radius must be positive", with
//! the number as it was written, where a deserialiser only knows that some `f64` was not to its taste.

mod coincide;
mod effect;
mod environment;
mod error;
mod features;
mod files;
mod load;
mod materials;
mod memory;
mod mesh;
mod nearest;
mod reach;
mod rule;
mod shapes;
mod sight;
mod table;
mod texture;
mod value;
mod view;

use std::path::PathBuf;
use std::sync::Arc;

use glam::{DMat3, DVec2, DVec3};

pub use crate::settings::{EstimatorKind, SamplerKind};
pub use effect::{Effect, Effects};
pub use error::SceneError;
pub use features::Features;
pub use files::Outside;
pub use memory::available as available_memory;
pub use texture::{Texture, Wrap};

/// A scene whose every value has been checked. Lengths are in the units of the file, in `f64`, not yet made relative
/// to anything; colours are linear RGB.
#[derive(Clone, Debug)]
pub struct Scene {
    /// The file's name without its ending: the default name of a picture.
    pub name: String,
    /// The file that the scene came from.
    pub path: PathBuf,
    /// SHA-256 of that file and of all files that it names, in hexadecimal: another picture has another one.
    pub hash: String,
    /// The pinhole camera.
    pub camera: Camera,
    /// The size of the picture.
    pub film: FilmSize,
    /// What `[render]` asks for; a command-line option overrides each.
    pub render: RenderTable,
    /// Reflecting surfaces, in the order of the file.
    pub materials: Vec<Material>,
    /// Spheres, in the order of the file.
    pub spheres: Vec<Sphere>,
    /// Triangle meshes, in the order of the file.
    pub meshes: Vec<Mesh>,
    /// What rays see that leave the scene; nothing where it is `None`.
    pub environment: Option<Environment>,
    /// What the user should be told about the scene: one sentence each, nothing that stops a render.
    pub notes: Vec<String>,
}

impl Scene {
    /// Pairs of meshes, by their numbers, that have faces in one plane which cover each other: rays look again there. A mesh beside
    /// itself has faces that lie back to back.
    pub fn overlapping_meshes(&self) -> Vec<[usize; 2]> {
        coincide::overlaps(&self.meshes, self.camera.origin).0
    }
}

/// A camera: `origin != target`, `up` not parallel to the view, the angle in (0, 180) degrees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// The pinhole, or the middle of the lens.
    pub origin: DVec3,
    /// The point in the middle of the picture.
    pub target: DVec3,
    /// A direction that points up in the picture; any length but 0.
    pub up: DVec3,
    /// The full angle of view.
    pub fov: Fov,
    /// A lens in place of the pinhole.
    pub lens: Option<Lens>,
}

/// A thin lens: a disk across the view through which every point of the plane in focus is seen sharply. Both above 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lens {
    /// Radius of the disk.
    pub radius: f64,
    /// Distance of the plane in focus, along the view.
    pub focus: f64,
}

impl Camera {
    /// What it calls for.
    pub fn effects(&self) -> Effects {
        Effects::default().with(Effect::Lens, self.lens.is_some())
    }
}

/// The full angle of view in degrees, along one side of the picture; pixels are square.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fov {
    /// Across the width.
    X(f64),
    /// Across the height.
    Y(f64),
}

/// The size of a picture in pixels; both at least 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FilmSize {
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

/// The `[render]` table of a scene file: `None` where the file is silent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RenderTable {
    /// Passes, at least 1.
    pub spp: Option<u32>,
    /// Which estimator.
    pub estimator: Option<EstimatorKind>,
    /// Which random numbers.
    pub sampler: Option<SamplerKind>,
    /// Their seed.
    pub seed: Option<u32>,
}

/// What rays see that leave the scene.
#[derive(Clone, Debug, PartialEq)]
pub enum Environment {
    /// The same radiance from every direction; finite and not negative.
    Constant(DVec3),
    /// A picture of all directions.
    Picture(LatLong),
}

/// A picture of all directions by longitude and latitude: its top row is up (+y), its middle column is forward (-z), and columns
/// to the right of it are to the right (+x). Radiance is interpolated between the centres of texels, across the left and right
/// edge too.
#[derive(Clone, Debug, PartialEq)]
pub struct LatLong {
    /// Texels in a row, at least 1.
    pub width: u32,
    /// Rows, at least 1.
    pub height: u32,
    /// Radiance at the centres, row by row from the top; finite and not negative.
    pub texels: Vec<[f32; 3]>,
    /// Turns directions of the picture into those of the scene.
    pub to_scene: DMat3,
}

/// How a surface reflects.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Its key under `[materials]`.
    pub name: String,
    /// The model with its parameters.
    pub bsdf: Bsdf,
    /// Whether only the front reflects: outside of a sphere, or where the corners of a triangle go round counter-clockwise.
    pub one_sided: bool,
    /// What the reflectance is multiplied by, of a blend the diffuse one; only on meshes with texture coordinates.
    pub texture: Option<Arc<Texture>>,
}

impl Material {
    /// What it calls for.
    pub fn effects(&self) -> Effects {
        let model = match self.bsdf {
            Bsdf::Diffuse { .. } => Effects::of(&[Effect::Diffuse]),
            Bsdf::Phong { .. } => Effects::of(&[Effect::Phong]),
            Bsdf::Blend { .. } => Effects::of(&[Effect::Diffuse, Effect::Phong, Effect::Blend]),
        };
        let model = model.with(Effect::Textures, self.texture.is_some());
        model.with(Effect::OneSided, self.one_sided)
    }
}

/// The reflection models. Reflectances are finite and not negative.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bsdf {
    /// `f = rho / pi`.
    Diffuse {
        /// Diffuse reflectance.
        rho: DVec3,
    },
    /// `f = rho (alpha + 1) / (2 pi) max(0, dot(wr, wi))^alpha`, with `wr` the mirror direction of `wo`.
    Phong {
        /// Specular reflectance.
        rho: DVec3,
        /// The exponent, finite and above 1.
        alpha: f64,
    },
    /// The sum of both.
    Blend {
        /// Diffuse reflectance.
        rho: DVec3,
        /// Specular reflectance.
        gloss: DVec3,
        /// The exponent, finite and above 1.
        alpha: f64,
    },
}

impl Bsdf {
    /// The largest reflectance of a colour, of both lobes together.
    pub fn largest(&self) -> f64 {
        match *self {
            Self::Diffuse { rho } | Self::Phong { rho, .. } => rho.max_element(),
            Self::Blend { rho, gloss, .. } => (rho + gloss).max_element(),
        }
    }
}

/// What a shape's surface does: it reflects or it emits, never both.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Surface {
    /// Index into [`Scene::materials`].
    Material(usize),
    /// Radiance in W m⁻² sr⁻¹, the same in every direction and on both sides; finite and not negative.
    Emission(DVec3),
}

impl Surface {
    /// What a shape of this surface calls for: `reflector`, `light`, or nothing where it emits nothing.
    fn effects(&self, reflector: Effect, light: Effect) -> Effects {
        match self {
            Self::Material(_) => Effects::of(&[reflector]),
            Self::Emission(le) => Effects::default().with(light, le.max_element() > 0.0),
        }
    }
}

/// A sphere of finite centre and finite radius above 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    /// Centre.
    pub center: DVec3,
    /// Radius.
    pub radius: f64,
    /// What it does.
    pub surface: Surface,
}

impl Sphere {
    /// What it calls for, its material aside.
    pub fn effects(&self) -> Effects {
        self.surface.effects(Effect::Spheres, Effect::SphereLights)
    }
}

/// Triangles in scene space (transforms are applied); vertices finite, indices in range, at least one triangle.
#[derive(Clone, Debug, PartialEq)]
pub struct Mesh {
    /// Positions.
    pub vertices: Vec<DVec3>,
    /// Corners of each triangle, as indices into `vertices`.
    pub triangles: Vec<[u32; 3]>,
    /// With smooth shading: a unit normal for each vertex (same length as `vertices`).
    pub normals: Option<Vec<DVec3>>,
    /// Texture coordinates for each vertex, finite; `v` points up.
    pub uvs: Option<Vec<DVec2>>,
    /// What it does.
    pub surface: Surface,
}

impl Mesh {
    /// What it calls for, its material aside.
    pub fn effects(&self) -> Effects {
        let smooth = self.normals.is_some() && matches!(self.surface, Surface::Material(_));
        let plain = self.surface.effects(Effect::Meshes, Effect::MeshLights);
        plain.with(Effect::SmoothNormals, smooth)
    }
}
