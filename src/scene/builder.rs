//! Builders of scenes.

use std::ops::{Index, IndexMut};
use std::path::PathBuf;
use std::sync::{Arc, OnceLock};

use super::invalid::InvalidScene;
use super::light::Light;
use super::parts::{Camera, Environment, FilmSize, Material, MaterialId, Mesh, RenderTable, Sphere};
use super::{Scene, check, coincide, covered};

/// A mutable scene: [`Scene::builder`] starts a new one, [`Scene::to_builder`] a changed copy.
///
/// Everything may be added and changed freely; [`SceneBuilder::build`] checks it all.
///
/// ```
/// use octolux::scene::{Camera, FilmSize, Fov, Material, Mesh, Scene, Sphere, Surface};
///
/// let camera = Camera::new([0.0, 2.0, 6.0], [0.0, 0.5, 0.0], Fov::X(40.0));
/// let mut scene = Scene::builder(camera, FilmSize { width: 96, height: 64 });
/// let grey = scene.material(Material::diffuse("grey", [0.5; 3]));
/// let corners = [[-3.0, 0.0, 3.0], [3.0, 0.0, 3.0], [3.0, 0.0, -3.0], [-3.0, 0.0, -3.0]];
/// scene.mesh(Mesh::quadrilateral(corners, grey));
/// let lamp = scene.sphere(Sphere::new([0.0, 3.0, 0.0], 0.5, Surface::emission([8.0, 7.0, 6.0])));
///
/// // Invalid values are rejected, with the invalid part and a remedy.
/// scene[lamp].radius = -0.5;
/// let error = scene.clone().build().unwrap_err();
/// assert_eq!(error.to_string(), "sphere 1 radius must be positive and finite, got -0.5");
/// assert_eq!(error.remedy(), "write a number above 0, at most 3.4e38");
///
/// scene[lamp].radius = 0.5;
/// let scene = scene.build()?;
///
/// // Scenes are immutable: a change makes a new one.
/// let mut wider = scene.to_builder();
/// wider.camera.fov = Fov::X(60.0);
/// assert_ne!(wider.build()?.hash(), scene.hash());
/// # Ok::<(), octolux::scene::InvalidScene>(())
/// ```
#[derive(Clone, Debug)]
pub struct SceneBuilder {
    /// The default name of a picture. It does not affect the picture.
    pub name: String,
    /// The camera.
    pub camera: Camera,
    /// The default size of the picture; from 1 to 65536 on a side.
    pub film: FilmSize,
    /// The default render settings.
    pub render: RenderTable,
    /// Reflecting surfaces. A [`MaterialId`] is an index into this list.
    pub materials: Vec<Material>,
    /// Spheres. A [`SphereId`] is an index into this list.
    pub spheres: Vec<Sphere>,
    /// Triangle meshes, shared with scenes that use them. A [`MeshId`] is an index into this list.
    pub meshes: Vec<Arc<Mesh>>,
    /// Lights without shape. A [`LightId`] is an index into this list.
    pub lights: Vec<Light>,
    /// Radiance of rays that leave the scene; black if `None`.
    pub environment: Option<Environment>,
    /// Messages for the user: the first of the scene's notes. They do not affect the picture.
    pub notes: Vec<String>,
    /// The files that it was read from, the scene file first; the command line overwrites none of them. They do not affect the
    /// picture.
    pub files: Vec<PathBuf>,
}

/// A sphere of a builder.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct SphereId(usize);

/// A light without shape, of a builder.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct LightId(usize);

/// A mesh of a builder.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct MeshId(usize);

impl SceneBuilder {
    /// A scene with only a camera and a film.
    pub fn new(camera: Camera, film: FilmSize) -> Self {
        Self {
            name: "scene".to_owned(),
            camera,
            film,
            render: RenderTable::default(),
            materials: Vec::new(),
            spheres: Vec::new(),
            meshes: Vec::new(),
            lights: Vec::new(),
            environment: None,
            notes: Vec::new(),
            files: Vec::new(),
        }
    }

    /// Adds a material for shapes.
    pub fn material(&mut self, material: Material) -> MaterialId {
        self.materials.push(material);
        MaterialId::new(self.materials.len() - 1)
    }

    /// Adds a sphere.
    pub fn sphere(&mut self, sphere: Sphere) -> SphereId {
        self.spheres.push(sphere);
        SphereId(self.spheres.len() - 1)
    }

    /// Adds a mesh.
    pub fn mesh(&mut self, mesh: impl Into<Arc<Mesh>>) -> MeshId {
        self.meshes.push(mesh.into());
        MeshId(self.meshes.len() - 1)
    }

    /// Adds a light without shape.
    pub fn light(&mut self, light: Light) -> LightId {
        self.lights.push(light);
        LightId(self.lights.len() - 1)
    }

    /// Sets the environment.
    pub fn environment(&mut self, environment: Environment) -> &mut Self {
        self.environment = Some(environment);
        self
    }

    /// The material with this name.
    pub fn material_named(&self, name: &str) -> Option<MaterialId> {
        let place = self.materials.iter().position(|material| material.name == name);
        place.map(MaterialId::new)
    }

    /// Checks everything, removes what can never be seen (the notes of the scene say so), and makes the scene.
    ///
    /// It removes triangles without area, spheres that coincide with an earlier one, spheres hidden by another one at the same
    /// centre whose radius is equal in single precision, and triangles that lie exactly on earlier ones which hide them. So
    /// indices in the scene may be smaller than in the builder.
    ///
    /// # Errors
    /// The first invalid item: a number that is not finite or overflows single precision, a negative radiance or reflectance,
    /// an index out of range, a camera without a direction, a mesh without a triangle, and so on.
    pub fn build(mut self) -> Result<Scene, InvalidScene> {
        check::all(&self)?;
        let mut notes = self.notes.clone();
        let origin = self.camera.origin;
        covered::drop_spheres(&mut self.spheres, &mut notes);
        notes.extend(coincide::drop_close(&mut self.spheres, origin));
        for (index, mesh) in self.meshes.iter_mut().enumerate() {
            covered::drop_flat(index, mesh, &mut notes)?;
        }
        covered::drop_triangles(&mut self.meshes, origin, &mut notes);
        covered::drop_twins(&mut self.meshes, &self.materials, &mut notes);
        let overlaps = covered::note_overlaps(&mut self.meshes, origin, &mut notes);
        covered::note_reach(&self, &mut notes);
        covered::note_darkness(&self, &mut notes);
        covered::note_colours(&self, &mut notes);
        Ok(Scene {
            parts: self,
            notes,
            overlaps,
            hash: OnceLock::new(),
        })
    }
}

macro_rules! indexed_by {
    ($id:ty, $list:ident, $item:ty, $change:expr) => {
        impl Index<$id> for SceneBuilder {
            type Output = $item;

            fn index(&self, id: $id) -> &$item {
                &self.$list[id.0]
            }
        }

        impl IndexMut<$id> for SceneBuilder {
            fn index_mut(&mut self, id: $id) -> &mut $item {
                $change(&mut self.$list[id.0])
            }
        }
    };
}
indexed_by!(SphereId, spheres, Sphere, std::convert::identity);
indexed_by!(LightId, lights, Light, std::convert::identity);
indexed_by!(MeshId, meshes, Mesh, Arc::make_mut);

impl Index<MaterialId> for SceneBuilder {
    type Output = Material;

    fn index(&self, id: MaterialId) -> &Material {
        &self.materials[id.index()]
    }
}

impl IndexMut<MaterialId> for SceneBuilder {
    fn index_mut(&mut self, id: MaterialId) -> &mut Material {
        &mut self.materials[id.index()]
    }
}
