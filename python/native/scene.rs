//! Scenes and scenes in the making.

use std::path::PathBuf;

use glam::{DMat3, DVec2, DVec3};
use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray2};
use octolux::pipeline::Chosen;
use octolux::scene::{
    self, Bsdf, Camera, Environment, Features, FilmSize, Fov, Lens, Material, Mesh, SceneBuilder, Sphere, Surface,
    Texture, Wrap,
};
use pyo3::exceptions::PyIndexError;
use pyo3::prelude::*;

use crate::errors;
use crate::picture::array;
use crate::threads::detached;
use crate::told::{self, Told};

type Array2<'py, T> = Bound<'py, PyArray2<T>>;
type Array3<'py, T> = Bound<'py, PyArray3<T>>;

/// A scene in the making.
#[pyclass(module = "octolux._native")]
pub struct Builder(SceneBuilder);

impl Builder {
    fn surface(&mut self, of: String, model: &Told, le: Option<[f64; 3]>, one_sided: bool) -> PyResult<Surface> {
        if let Some(le) = le {
            return Ok(Surface::emission(le));
        }
        let material = Material {
            one_sided,
            ..Material::new(of, told::bsdf(model)?)
        };
        Ok(self.0.material(material).into())
    }
}

#[pymethods]
impl Builder {
    #[new]
    fn new(width: u32, height: u32) -> Self {
        let camera = Camera::new([0.0, 0.0, 1.0], [0.0; 3], Fov::X(40.0));
        Self(SceneBuilder::new(camera, FilmSize { width, height }))
    }

    fn copy(&self) -> Self {
        Self(self.0.clone())
    }

    #[getter]
    fn size(&self) -> (u32, u32) {
        (self.0.film.width, self.0.film.height)
    }

    fn set_size(&mut self, width: u32, height: u32) {
        self.0.film = FilmSize { width, height };
    }

    /// Radius and focus of the lens are both 0 for a pinhole.
    fn set_camera(
        &mut self,
        eye: [f64; 3],
        at: [f64; 3],
        up: Option<[f64; 3]>,
        fov: f64,
        across: bool,
        lens: Option<(f64, f64)>,
    ) {
        let fov = if across { Fov::X(fov) } else { Fov::Y(fov) };
        let camera = Camera::new(eye, at, fov);
        self.0.camera = Camera {
            up: up.map_or(camera.up, DVec3::from),
            lens: lens.map(|(radius, focus)| Lens { radius, focus }),
            ..camera
        };
    }

    fn set_environment(&mut self, radiance: [f64; 3]) {
        self.0.environment(Environment::Constant(radiance.into()));
    }

    fn add_sphere(
        &mut self,
        center: [f64; 3],
        radius: f64,
        model: Told,
        le: Option<[f64; 3]>,
        one_sided: bool,
    ) -> PyResult<()> {
        let name = format!("of sphere {}", self.0.spheres.len() + 1);
        let surface = self.surface(name, &model, le, one_sided)?;
        self.0.sphere(Sphere::new(center, radius, surface));
        Ok(())
    }

    fn add_light(&mut self, kind: &str, numbers: Vec<f64>) -> PyResult<()> {
        self.0.light(told::light(kind, &numbers)?);
        Ok(())
    }

    #[allow(clippy::too_many_arguments)]
    fn add_mesh(
        &mut self,
        py: Python<'_>,
        vertices: PyReadonlyArray2<'_, f64>,
        faces: PyReadonlyArray2<'_, u32>,
        normals: Option<PyReadonlyArray2<'_, f64>>,
        smooth: bool,
        model: Told,
        le: Option<[f64; 3]>,
        one_sided: bool,
    ) -> PyResult<()> {
        let name = format!("of mesh {}", self.0.meshes.len() + 1);
        let surface = self.surface(name, &model, le, one_sided)?;
        let vertices = vertices.as_slice()?.as_chunks::<3>().0;
        let faces = faces.as_slice()?.as_chunks::<3>().0;
        let normals = normals.as_ref().map(|normals| normals.as_slice()).transpose()?;
        let mesh = py.detach(|| {
            let mut mesh = Mesh::new(vertices.iter().copied(), faces.to_vec(), surface);
            mesh.normals = normals.map(|n| n.as_chunks::<3>().0.iter().map(|n| DVec3::from(*n)).collect());
            if smooth { mesh.smooth() } else { mesh }
        });
        self.0.mesh(mesh);
        Ok(())
    }

    fn build(&self, py: Python<'_>) -> PyResult<Scene> {
        let builder = self.0.clone();
        detached(py, || builder.build())?
            .map(Scene)
            .map_err(|error| errors::invalid(py, &error))
    }
}

/// A checked scene; it does not change.
#[pyclass(frozen, module = "octolux._native")]
pub struct Scene(pub scene::Scene);

/// Reads a scene file.
#[pyfunction]
pub fn load(py: Python<'_>, path: PathBuf) -> PyResult<Scene> {
    detached(py, || scene::Scene::load(&path))?
        .map(Scene)
        .map_err(|error| errors::unreadable(py, &error))
}

/// `rho` with the exponent, what a blend adds to it, and the radiance. What eight numbers cannot say, a rough surface, is not a number.
fn row(scene: &scene::Scene, surface: Surface) -> ([f32; 4], [f32; 4], [f32; 3]) {
    let with = |rho: DVec3, alpha: f64| [rho.x as f32, rho.y as f32, rho.z as f32, alpha as f32];
    let none = with(DVec3::ZERO, 1.0);
    let material = match surface {
        Surface::Emission(le) => return (none, none, le.as_vec3().to_array()),
        Surface::Material(id) => scene.material(id),
    };
    let (brdf, blend) = match material.bsdf {
        Bsdf::Diffuse { rho } => (with(rho, 1.0), none),
        Bsdf::Phong { rho, alpha } => (with(rho, alpha), none),
        Bsdf::Blend { rho, specular, alpha } => (with(rho, 1.0), with(specular, alpha)),
        Bsdf::Ggx { .. } | Bsdf::Conductor { .. } => ([f32::NAN; 4], none),
    };
    (brdf, blend, [0.0; 3])
}

#[pymethods]
impl Scene {
    fn builder(&self) -> Builder {
        Builder(self.0.to_builder())
    }

    #[getter]
    fn name(&self) -> &str {
        self.0.name()
    }

    #[getter]
    fn size(&self) -> (u32, u32) {
        (self.0.film().width, self.0.film().height)
    }

    #[getter]
    fn notes(&self) -> Vec<String> {
        self.0.notes().to_vec()
    }

    #[getter]
    fn hash(&self, py: Python<'_>) -> String {
        py.detach(|| self.0.hash().to_owned())
    }

    /// What the scene asks for: samples, estimator, sampler, seed.
    #[getter]
    fn render(&self) -> (Option<u32>, Option<&'static str>, Option<&'static str>, Option<u32>) {
        let table = self.0.render();
        let (estimator, sampler) = (table.estimator.map(|e| e.name()), table.sampler.map(|s| s.name()));
        (table.spp, estimator, sampler, table.seed)
    }

    /// The estimator of its pictures where no keyword names one, and why that.
    #[getter]
    fn estimator(&self) -> (&'static str, &'static str) {
        let chosen = Chosen::of(&self.0, None);
        (chosen.estimator.name(), chosen.why)
    }

    /// Names of what it calls for.
    #[getter]
    fn effects(&self) -> Vec<&'static str> {
        Features::of(&self.0, self.0.film()).effects().names()
    }

    /// Eye, target, up, the angle in degrees, whether that is across the width, and the lens.
    #[getter]
    #[allow(clippy::type_complexity)]
    fn camera(&self) -> ([f64; 3], [f64; 3], [f64; 3], f64, bool, Option<(f64, f64)>) {
        let camera = self.0.camera();
        let (fov, across) = match camera.fov {
            Fov::X(fov) => (fov, true),
            Fov::Y(fov) => (fov, false),
        };
        let lens = camera.lens.map(|lens| (lens.radius, lens.focus));
        (
            camera.origin.to_array(),
            camera.target.to_array(),
            camera.up.to_array(),
            fov,
            across,
            lens,
        )
    }

    /// Lights without shape, as `add_light` takes them.
    #[getter]
    fn lamps(&self) -> Vec<Told> {
        self.0.lights().iter().map(told::of_light).collect()
    }

    /// How many meshes and how many spheres: objects count meshes first.
    #[getter]
    fn counts(&self) -> (usize, usize) {
        (self.0.meshes().len(), self.0.spheres().len())
    }

    /// Of each object the BRDF's parameters `(n, 4)`, those of a blend's other lobe `(n, 4)`, and the radiance `(n, 3)`.
    #[allow(clippy::type_complexity)]
    fn surfaces<'py>(&self, py: Python<'py>) -> PyResult<(Array2<'py, f32>, Array2<'py, f32>, Array2<'py, f32>)> {
        let all: Vec<_> = self.of_objects().map(|surface| row(&self.0, surface)).collect();
        let brdf: Vec<_> = all.iter().map(|row| row.0).collect();
        let blend: Vec<_> = all.iter().map(|row| row.1).collect();
        let le: Vec<_> = all.iter().map(|row| row.2).collect();
        Ok((rows(py, &brdf)?, rows(py, &blend)?, rows(py, &le)?))
    }

    /// Objects with a texture; a mesh without texture coordinates shows none.
    #[getter]
    fn textured(&self) -> Vec<usize> {
        let meshes = self.0.meshes();
        let shows = |object: &usize| meshes.get(*object).is_none_or(|mesh| mesh.uvs.is_some());
        let objects = self.of_objects().enumerate();
        let textured = objects.filter(|(_, surface)| self.texture_of(*surface).is_some());
        textured.map(|(object, _)| object).filter(shows).collect()
    }

    /// Texels of an object's texture, `(h, w, 3)` from the top, and whether it is clamped outside of the unit square.
    fn texture<'py>(&self, py: Python<'py>, index: usize) -> PyResult<(Array3<'py, f32>, bool)> {
        let texture = self
            .of_objects()
            .nth(index)
            .and_then(|surface| self.texture_of(surface));
        let texture = texture.ok_or_else(|| PyIndexError::new_err("no such texture"))?;
        let texels: Vec<_> = texture.texels.iter().collect();
        let clamped = texture.wrap == Wrap::Clamp;
        Ok((array(py, texture.width, texture.height, &texels)?, clamped))
    }

    /// Texels of the environment, `(h, w, 3)` from the top, and the rows of the matrix that turns its directions to those of the scene.
    #[allow(clippy::type_complexity)]
    fn environment<'py>(&self, py: Python<'py>) -> PyResult<Option<(Array3<'py, f32>, [[f64; 3]; 3])>> {
        let Some(environment) = self.0.environment() else {
            return Ok(None);
        };
        Ok(Some(match environment {
            Environment::Constant(le) => {
                let texel = le.as_vec3().to_array();
                (array(py, 1, 1, &[texel])?, DMat3::IDENTITY.to_cols_array_2d())
            }
            Environment::Picture(picture) => {
                let texels: Vec<_> = picture.texels.iter().collect();
                let to_scene = picture.to_scene.transpose().to_cols_array_2d();
                (array(py, picture.width, picture.height, &texels)?, to_scene)
            }
        }))
    }

    /// Centre and radius of a sphere, by its place among the spheres.
    fn sphere(&self, index: usize) -> PyResult<([f64; 3], f64)> {
        let sphere = self
            .0
            .spheres()
            .get(index)
            .ok_or_else(|| PyIndexError::new_err("no such sphere"))?;
        Ok((sphere.center.to_array(), sphere.radius))
    }

    /// Vertices, faces, and normals at the vertices of a mesh.
    #[allow(clippy::type_complexity)]
    fn mesh<'py>(
        &self,
        py: Python<'py>,
        index: usize,
    ) -> PyResult<(Array2<'py, f64>, Array2<'py, u32>, Option<Array2<'py, f64>>)> {
        let mesh = self
            .0
            .meshes()
            .get(index)
            .ok_or_else(|| PyIndexError::new_err("no such mesh"))?;
        let points = |points: &[DVec3]| points.iter().map(|p| p.to_array()).collect::<Vec<_>>();
        let normals = mesh
            .normals
            .as_ref()
            .map(|normals| rows(py, &points(normals)))
            .transpose()?;
        Ok((rows(py, &points(&mesh.vertices))?, rows(py, &mesh.triangles)?, normals))
    }

    /// Texture coordinates of a mesh's vertices.
    fn uvs<'py>(&self, py: Python<'py>, index: usize) -> PyResult<Option<Array2<'py, f64>>> {
        let mesh = self
            .0
            .meshes()
            .get(index)
            .ok_or_else(|| PyIndexError::new_err("no such mesh"))?;
        let pairs = |uvs: &Vec<DVec2>| uvs.iter().map(|uv| uv.to_array()).collect::<Vec<_>>();
        mesh.uvs.as_ref().map(|uvs| rows(py, &pairs(uvs))).transpose()
    }
}

impl Scene {
    /// Surfaces in the order of objects.
    fn of_objects(&self) -> impl Iterator<Item = Surface> {
        let meshes = self.0.meshes().iter().map(|mesh| mesh.surface);
        meshes.chain(self.0.spheres().iter().map(|sphere| sphere.surface))
    }

    fn texture_of(&self, surface: Surface) -> Option<&Texture> {
        match surface {
            Surface::Material(id) => self.0.material(id).texture.as_deref(),
            Surface::Emission(_) => None,
        }
    }
}

fn rows<'py, T: numpy::Element + Copy, const N: usize>(py: Python<'py>, rows: &[[T; N]]) -> PyResult<Array2<'py, T>> {
    PyArray1::from_slice(py, rows.as_flattened()).reshape([rows.len(), N])
}
