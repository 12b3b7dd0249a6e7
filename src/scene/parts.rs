//! The parts of a scene. Anyone can make these; [`SceneBuilder::build`](super::SceneBuilder::build) checks their values.

use std::sync::Arc;

use glam::{DMat3, DVec2, DVec3};

use super::texture::Texture;
use super::{Effect, Effects, EstimatorKind, SamplerKind};
use crate::texels::Texels;

/// A camera: `origin != target`, `up` not parallel to the view, the angle in (0, 180) degrees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// The pinhole, or the centre of the lens.
    pub origin: DVec3,
    /// The point at the centre of the picture.
    pub target: DVec3,
    /// A direction that points up in the picture; any length except 0.
    pub up: DVec3,
    /// The full angle of view.
    pub fov: Fov,
    /// A lens instead of the pinhole.
    pub lens: Option<Lens>,
}

/// A thin lens: a disk perpendicular to the view direction that images the focal plane sharply. Both values above 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lens {
    /// Radius of the disk.
    pub radius: f64,
    /// Distance of the focal plane, along the view direction.
    pub focus: f64,
}

impl Camera {
    /// A pinhole at `origin` that looks at `target`. Up is +y, or +z if the view direction is along y.
    pub fn new(origin: impl Into<DVec3>, target: impl Into<DVec3>, fov: Fov) -> Self {
        let (origin, target) = (origin.into(), target.into());
        let along_y = origin.x == target.x && origin.z == target.z;
        Self {
            origin,
            target,
            up: if along_y { DVec3::Z } else { DVec3::Y },
            fov,
            lens: None,
        }
    }

    /// The effects that it requires.
    pub fn effects(&self) -> Effects {
        Effects::default().with(Effect::Lens, self.lens.is_some())
    }
}

/// The full field of view in degrees, along one side of the picture; pixels are square.
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

/// The default render settings of a scene (`[render]` in a scene file): `None` if not given.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RenderTable {
    /// Passes, at least 1.
    pub spp: Option<u32>,
    /// Which estimator; `None`, in a file also `"auto"`: `product`.
    pub estimator: Option<EstimatorKind>,
    /// Which random numbers.
    pub sampler: Option<SamplerKind>,
    /// Their seed.
    pub seed: Option<u32>,
}

/// The radiance of rays that leave the scene.
#[derive(Clone, Debug, PartialEq)]
pub enum Environment {
    /// The same radiance from every direction; finite and not negative.
    Constant(DVec3),
    /// An environment map.
    Picture(LatLong),
}

/// An environment map by longitude and latitude: its top row is up (+y), its middle column is forward (-z), and columns to the
/// right of it are to the right (+x). Radiance is interpolated between texel centres, also across the left and right edge.
#[derive(Clone, Debug, PartialEq)]
pub struct LatLong {
    /// Texels in a row, at least 1.
    pub width: u32,
    /// Rows, at least 1.
    pub height: u32,
    /// Radiance at texel centres, row by row from the top; finite and not negative.
    pub texels: Arc<Texels>,
    /// Rotates directions of the picture to those of the scene.
    pub to_scene: DMat3,
}

/// How a surface reflects.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Its name in messages; the key under `[materials]` in a scene file. It does not affect the picture.
    pub name: String,
    /// The model with its parameters.
    pub bsdf: Bsdf,
    /// Whether only the front reflects: the outside of a sphere, or the side where a triangle's corners are counter-clockwise.
    pub one_sided: bool,
    /// A factor of the reflectance (in a blend, of the diffuse one). On spheres, whose outward normal is `(x, y, z)`, the
    /// coordinates are `u = 1/2 + atan2(x, z) / (2 pi)`, `v = 1 - acos(y) / pi`; meshes need texture coordinates.
    pub texture: Option<Arc<Texture>>,
}

impl Material {
    /// A surface that reflects on both sides, without a texture.
    pub fn new(name: impl Into<String>, bsdf: Bsdf) -> Self {
        Self {
            name: name.into(),
            bsdf,
            one_sided: false,
            texture: None,
        }
    }

    /// A diffuse surface of reflectance `rho`.
    pub fn diffuse(name: impl Into<String>, rho: impl Into<DVec3>) -> Self {
        Self::new(name, Bsdf::Diffuse { rho: rho.into() })
    }

    /// A glossy surface of specular reflectance `rho` and Phong exponent `alpha`.
    pub fn phong(name: impl Into<String>, rho: impl Into<DVec3>, alpha: f64) -> Self {
        Self::new(name, Bsdf::Phong { rho: rho.into(), alpha })
    }

    /// The effects that it requires.
    pub fn effects(&self) -> Effects {
        let model = match self.bsdf {
            Bsdf::Diffuse { .. } => Effects::of(&[Effect::Diffuse]),
            Bsdf::Phong { .. } => Effects::of(&[Effect::Phong]),
            Bsdf::Blend { .. } => Effects::of(&[Effect::Diffuse, Effect::Phong, Effect::Blend]),
            Bsdf::Ggx { .. } => Effects::of(&[Effect::Ggx]),
            Bsdf::Conductor { .. } => Effects::of(&[Effect::Conductor]),
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
        specular: DVec3,
        /// The exponent, finite and above 1.
        alpha: f64,
    },
    /// Metal with Schlick's Fresnel reflectance, a diffuse base below a dielectric coat, or a mixture of both: the
    /// metallic-roughness model of glTF 2.0, modified to conserve energy. The page on the effect has the formulas.
    Ggx {
        /// Base colour: reflectance of the metal at normal incidence, and of the diffuse base.
        base: DVec3,
        /// Share of metal, in [0, 1].
        metallic: f64,
        /// Square root of the roughness of the distribution of Trowbridge and Reitz, in [1e-4, 1].
        roughness: f64,
    },
    /// Metal with exact Fresnel reflectance.
    Conductor {
        /// Index of refraction for red, green and blue, each in [0.001, 1000].
        eta: DVec3,
        /// Extinction coefficient for each, in [0, 1000].
        k: DVec3,
        /// As in `Ggx`.
        roughness: f64,
    },
}

impl Bsdf {
    /// The largest reflectance of any channel, summed over lobes.
    pub fn largest(&self) -> f64 {
        match *self {
            Self::Diffuse { rho } | Self::Phong { rho, .. } => rho.max_element(),
            Self::Blend { rho, specular, .. } => (rho + specular).max_element(),
            Self::Ggx { base, .. } => base.max_element().max(1.0),
            Self::Conductor { .. } => 1.0,
        }
    }
}

/// A material of a scene: the handle that [`SceneBuilder::material`](super::SceneBuilder::material) returns.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct MaterialId(usize);

impl MaterialId {
    /// The material at this index in the scene. Building fails if there is none.
    pub const fn new(index: usize) -> Self {
        Self(index)
    }

    /// Its index in the scene, from 0.
    pub const fn index(self) -> usize {
        self.0
    }
}

/// The surface of a shape: it reflects or emits, never both.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Surface {
    /// It reflects with this material of its scene.
    Material(MaterialId),
    /// Radiance in W m⁻² sr⁻¹, the same in every direction and on both sides; finite and not negative.
    Emission(DVec3),
}

impl From<MaterialId> for Surface {
    fn from(material: MaterialId) -> Self {
        Self::Material(material)
    }
}

impl Surface {
    /// A surface that emits this radiance.
    pub fn emission(radiance: impl Into<DVec3>) -> Self {
        Self::Emission(radiance.into())
    }

    /// Whether it emits any light.
    pub fn emits(&self) -> bool {
        matches!(self, Self::Emission(le) if le.max_element() > 0.0)
    }

    /// The effects that a shape with this surface requires: `reflector`, `light`, or nothing if its emission is 0.
    fn effects(&self, reflector: Effect, light: Effect) -> Effects {
        match self {
            Self::Material(_) => Effects::of(&[reflector]),
            Self::Emission(le) => Effects::default().with(light, le.max_element() > 0.0),
        }
    }
}

/// A sphere with a finite centre and a finite radius above 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    /// Centre.
    pub center: DVec3,
    /// Radius.
    pub radius: f64,
    /// Its surface.
    pub surface: Surface,
}

impl Sphere {
    /// A sphere whose surface is a material or [`Surface::emission`].
    pub fn new(center: impl Into<DVec3>, radius: f64, surface: impl Into<Surface>) -> Self {
        Self {
            center: center.into(),
            radius,
            surface: surface.into(),
        }
    }

    /// The effects that it requires, without its material.
    pub fn effects(&self) -> Effects {
        self.surface.effects(Effect::Spheres, Effect::SphereLights)
    }
}

/// Triangles in scene space (after transforms); vertices finite, indices in range, at least one triangle.
#[derive(Clone, Debug, PartialEq)]
pub struct Mesh {
    /// Its name in messages; if empty, its number is used. It does not affect the picture.
    pub name: String,
    /// Positions.
    pub vertices: Vec<DVec3>,
    /// Corners of each triangle, as indices into `vertices`.
    pub triangles: Vec<[u32; 3]>,
    /// With smooth shading: a unit normal for each vertex (same length as `vertices`).
    pub normals: Option<Vec<DVec3>>,
    /// The smooth shadow terminator: lights the mesh as if it were as smooth as its normals, which it must have.
    ///
    /// The point `p` of a triangle with the corners `v`, their unit normals `n` and the barycentric weights `w` is lit at `p +
    /// sum of w max(0, dot(n, v - p)) n`, and only the shading normal defines the horizon there (after Hanika, "Hacking the
    /// Shadow Terminator", Ray Tracing Gems II, 2021, chapter 4). If the shading normal is flipped towards the viewer, all `n`
    /// are.
    pub smooth_terminator: bool,
    /// Texture coordinates for each vertex, finite; `v` points up.
    pub uvs: Option<Vec<DVec2>>,
    /// Its surface.
    pub surface: Surface,
}

impl Mesh {
    /// A mesh with flat shading. Triangles without area and unused vertices are allowed.
    pub fn new(
        vertices: impl IntoIterator<Item = impl Into<DVec3>>,
        triangles: Vec<[u32; 3]>,
        surface: impl Into<Surface>,
    ) -> Self {
        Self {
            name: String::new(),
            vertices: vertices.into_iter().map(Into::into).collect(),
            triangles,
            normals: None,
            smooth_terminator: false,
            uvs: None,
            surface: surface.into(),
        }
    }

    /// The quadrilateral with these corners, in order around it. Its triangles share the edge from the first to the third.
    pub fn quadrilateral(corners: [impl Into<DVec3>; 4], surface: impl Into<Surface>) -> Self {
        Self::new(corners, vec![[0, 1, 2], [0, 2, 3]], surface)
    }

    /// The effects that it requires, without its material.
    pub fn effects(&self) -> Effects {
        let smooth = self.normals.is_some() && matches!(self.surface, Surface::Material(_));
        let plain = self.surface.effects(Effect::Meshes, Effect::MeshLights);
        let plain = plain.with(Effect::SmoothNormals, smooth);
        plain.with(Effect::SmoothTerminator, smooth && self.smooth_terminator)
    }
}
