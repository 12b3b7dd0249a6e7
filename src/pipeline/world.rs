//! The scene in tables for the kernels: `f32`, relative to the camera.
//!
//! Positions are made relative to the pinhole in `f64` before rounding. A scene far from the origin is therefore as precise as one
//! around it, and nearby geometry has the most digits. The unit is that of [`Space`].

use std::collections::HashSet;
use std::sync::Arc;

use super::camera::CameraRays;
use super::emitters::{self, Emitters};
use super::intersector::Intersector;
use super::lists::{Lights, Lists};
use super::narrow::narrow;
use super::space::Space;
use super::texture::Textured;
use crate::bsdf::phong;
use crate::embree::{Accel, Device, EmbreeError, SceneBuilder};
use crate::lane::{Bits, Lane, Mask};
use crate::light::{DeltaLight, Environment, MeshLight, SphereLight, Sun, TriangleLight};
use crate::linear::LinearScene;
use crate::scene::{self, Bsdf, Effect, Effects, FilmSize, Mesh, Scene, Surface, Texture};
use crate::settings::AccelKind;
use crate::shape::{BoundingSphere, Hit, Sphere};

/// All data shared by the rays.
#[derive(Debug)]
pub struct World {
    /// Embree's accelerator, used unless brute force traces.
    pub accel: Accel,
    /// The shapes for brute force; empty unless brute force traces or culls.
    pub line: LinearScene,
    /// Whether occluders are culled for all rays of a tile at once; see [`Intersector::shafts`] for the other.
    pub culls: bool,
    pub by_shaft: bool,
    /// Surface properties, meshes first, then spheres.
    pub surfaces: Vec<SurfaceRecord>,
    /// Geometry index of the spheres; equals the number of meshes.
    pub sphere_geometry: u32,
    /// For each sphere, its index in the scene.
    pub sphere_numbers: Vec<u32>,
    /// For each mesh, its smooth normals, if any.
    pub normals: Vec<Option<SmoothNormals>>,
    /// For each mesh with a smooth terminator, the corners of its triangles.
    pub corners: Vec<Option<Corners>>,
    /// For each mesh with a texture, its texture coordinates.
    pub textured: Vec<Option<Textured>>,
    /// The texture of each sphere; empty if there are none.
    pub sphere_textures: Vec<Option<Arc<Texture>>>,
    /// Spherical lights.
    pub lights: Vec<SphereLight>,
    /// Triangles that are individual lights.
    pub triangle_lights: Vec<TriangleLight>,
    /// Mesh lights, of which one triangle is sampled.
    pub mesh_lights: Vec<MeshLight>,
    /// Lists of lights, if not every light is sampled each time.
    pub lists: Option<Lists>,
    /// Suns: directional lights with an angular radius.
    pub suns: Vec<Sun>,
    /// Delta lights: point, spot and directional.
    pub delta_lights: Vec<DeltaLight>,
    /// The environment, if it emits.
    pub environment: Option<Environment>,
    /// Generates camera rays.
    pub camera: CameraRays,
    /// For each mesh, whether its faces overlap others in one plane, of other meshes or of its own; empty if there are no such
    /// meshes.
    pub overlaps: Vec<bool>,
    /// Transform between scene and packet coordinates.
    pub space: Space,
}

/// Properties of a surface.
#[derive(Clone, Copy, Debug)]
pub struct SurfaceRecord {
    /// Reflectance; 0 if the surface emits.
    pub rho: [f32; 3],
    /// Reflectance of the Phong lobe of a blend; `rho` is that of the diffuse lobe.
    pub specular: Option<[f32; 3]>,
    /// The microfacet model, if any.
    pub facets: Option<Facets>,
    /// Exponent above 1 for Phong and blends, 1 for all others.
    pub alpha: f32,
    /// Reach of the Phong lobe: see [`phong::reach`].
    pub reach: f32,
    /// Effects that it requires.
    pub effects: Effects,
    /// Radiance if the surface emits.
    pub le: Option<[f32; 3]>,
    /// The sphere onto which hit points are projected; of radius 0 at the camera if there is none.
    pub ball: BoundingSphere,
    /// Upper bound on the extent of its shapes along each axis: the largest box around a triangle, or the radius.
    pub extent: [f32; 3],
}

/// Microfacet models.
#[derive(Clone, Copy, Debug)]
pub enum Facets {
    /// Metal, or a coated body.
    Ggx {
        /// Roughness of the distribution.
        alpha: f32,
        /// Share of metal.
        metallic: f32,
    },
    /// Metal with a complex index of refraction.
    Conductor {
        /// Roughness of the distribution.
        alpha: f32,
        /// Index of refraction.
        eta: [f32; 3],
        /// Extinction coefficient.
        k: [f32; 3],
    },
}

/// Placeholder for surfaces whose hit points are not projected.
const NOWHERE: BoundingSphere = BoundingSphere {
    center: [0.0; 3],
    radius: 0.0,
};

/// For each triangle, the unit normals at its corners. They are stored per triangle, not per vertex: a hit on a mesh of a million
/// triangles waits for one cache line instead of four.
pub type SmoothNormals = Vec<[[f32; 3]; 3]>;

/// For each triangle, its corners.
pub type Corners = Vec<[[f32; 3]; 3]>;

/// The spheres relative to the camera. Of spheres that coincide after rounding, only the first is kept.
fn distinct_spheres<'s>(scene: &'s Scene, space: &Space) -> Vec<(u32, &'s scene::Sphere, Sphere)> {
    let mut seen = HashSet::new();
    let narrowed = (0..).zip(scene.spheres()).map(|(number, sphere)| {
        let center = space.relative(sphere.center).to_array();
        (number, sphere, Sphere::new(center, space.length(sphere.radius)))
    });
    narrowed
        .filter(|(_, _, Sphere { ball, origin_power })| {
            // Adding 0 turns -0 into +0.
            let place = ball.center.map(|x| (x + 0.0).to_bits());
            seen.insert((place, ball.radius.to_bits(), origin_power.map(f32::to_bits)))
        })
        .collect()
}

fn textured(scene: &Scene, mesh: &Mesh) -> Option<Textured> {
    let Surface::Material(index) = mesh.surface else {
        return None;
    };
    let (texture, uvs) = (scene.material(index).texture.clone()?, mesh.uvs.as_ref()?);
    Some(Textured::new(&mesh.triangles, uvs, texture))
}

fn sphere_texture(scene: &Scene, sphere: &scene::Sphere) -> Option<Arc<Texture>> {
    match sphere.surface {
        Surface::Material(index) => scene.material(index).texture.clone(),
        Surface::Emission(_) => None,
    }
}

/// Sort key of lights. Any order works if it depends only on the light.
fn by_content(light: &SphereLight) -> [f32; 7] {
    let [x, y, z] = light.center;
    let [r, g, b] = light.le;
    [x, y, z, light.radius, r, g, b]
}

fn overlaps(scene: &Scene) -> Vec<bool> {
    let pairs = scene.overlapping_meshes();
    let mut overlaps = vec![false; if pairs.is_empty() { 0 } else { scene.meshes().len() }];
    for &mesh in pairs.as_flattened() {
        overlaps[mesh] = true;
    }
    overlaps
}

/// The sides of the smallest box into which every triangle fits after translation.
fn largest_box(vertices: &[[f32; 3]], triangles: &[[u32; 3]]) -> [f32; 3] {
    let mut largest = [0.0_f32; 3];
    for corners in triangles {
        let [a, b, c] = corners.map(|i| vertices[i as usize]);
        for k in 0..3 {
            let side = a[k].max(b[k]).max(c[k]) - a[k].min(b[k]).min(c[k]);
            largest[k] = largest[k].max(side);
        }
    }
    largest
}

impl World {
    /// Builds the tables and the accelerator; with lists of `listed` lights, if any.
    ///
    /// # Errors
    /// [`EmbreeError`] if Embree cannot build.
    pub fn build(
        scene: &Scene,
        device: &Device,
        intersector: Intersector,
        robust: bool,
        film: FilmSize,
        listed: Option<u32>,
    ) -> Result<Self, EmbreeError> {
        let (space, accel) = (Space::of(scene), intersector.accel);
        let mut builder = SceneBuilder::new(device, robust)?;
        let mut line = LinearScene::default();
        let in_line = intersector.lists_shapes();
        let lamps = Emitters::of(scene, &space, listed.is_some())?;
        let mut surfaces = Vec::with_capacity(scene.meshes().len() + scene.spheres().len());
        let mut normals = Vec::with_capacity(scene.meshes().len());
        let mut all_corners = Vec::with_capacity(scene.meshes().len());
        for (mesh, &skip_ids) in scene.meshes().iter().zip(&lamps.skip_ids) {
            let vertices: Vec<[f32; 3]> = mesh.vertices.iter().map(|&v| space.point(v)).collect();
            if in_line {
                line.add_mesh(normals.len() as u32, &vertices, &mesh.triangles, skip_ids);
            }
            match (accel, skip_ids) {
                (AccelKind::Embree, Some(skip_ids)) => _ = builder.add_light(&vertices, &mesh.triangles, skip_ids)?,
                (AccelKind::Embree, None) => _ = builder.add_mesh(&vertices, &mesh.triangles)?,
                (AccelKind::Linear, _) => {}
            }
            let smooth = mesh.effects().has(Effect::SmoothTerminator);
            all_corners.push(smooth.then(|| {
                let corners = |triangle: &[u32; 3]| triangle.map(|i| vertices[i as usize]);
                mesh.triangles.iter().map(corners).collect()
            }));
            let extent = largest_box(&vertices, &mesh.triangles);
            surfaces.push(SurfaceRecord::new(
                scene,
                &mesh.surface,
                mesh.effects(),
                NOWHERE,
                extent,
            ));
            normals.push(mesh.normals.as_ref().map(|normals| {
                let corners = |triangle: &[u32; 3]| triangle.map(|i| narrow(normals[i as usize]));
                mesh.triangles.iter().map(corners).collect()
            }));
        }
        let spheres = distinct_spheres(scene, &space);
        let mut lights = Vec::new();
        for (i, (_, sphere, Sphere { ball, origin_power })) in spheres.iter().enumerate() {
            // The surface of a sphere with a power is more precise than its center and radius: a hit point is not projected onto
            // these.
            let (put_onto, extent) = match origin_power {
                Some(_) => (NOWHERE, [0.0; 3]),
                None => (*ball, [ball.radius; 3]),
            };
            let record = SurfaceRecord::new(scene, &sphere.surface, sphere.effects(), put_onto, extent);
            if let Some(le) = record.le
                && le.iter().any(|&x| x > 0.0)
            {
                lights.push(SphereLight {
                    center: ball.center,
                    radius: ball.radius,
                    le,
                    sphere: i as u32,
                    origin_power: *origin_power,
                });
            }
            surfaces.push(record);
        }
        // Random numbers and sums follow the index of a light. Sorting by content makes the result independent of the order in the
        // file.
        lights.sort_by(|a, b| {
            by_content(a)
                .into_iter()
                .map(f32::to_bits)
                .cmp(by_content(b).into_iter().map(f32::to_bits))
        });
        let sphere_geometry = scene.meshes().len() as u32;
        let delta_lights = emitters::delta_lights(scene, &space);
        let kinds = Lights::new(&lights, &lamps.triangles, &delta_lights);
        let lists = listed.map(|length| Lists::new(kinds, spheres.len(), &lamps.first_triangles, length, film));
        let sphere_textures: Vec<_> = spheres
            .iter()
            .map(|(_, sphere, _)| sphere_texture(scene, sphere))
            .collect();
        let sphere_numbers = spheres.iter().map(|(number, ..)| *number).collect();
        let spheres: Vec<Sphere> = spheres.into_iter().map(|(.., sphere)| sphere).collect();
        if in_line {
            line.set_spheres(spheres.clone(), sphere_geometry);
        }
        if intersector.shafts {
            line.sort_spheres();
        }
        if accel == AccelKind::Embree {
            builder.set_spheres(spheres)?;
        }
        Ok(Self {
            accel: builder.commit()?,
            line,
            culls: intersector.culls(),
            by_shaft: intersector.shafts,
            surfaces,
            sphere_geometry,
            sphere_numbers,
            normals,
            corners: all_corners,
            textured: scene.meshes().iter().map(|mesh| textured(scene, mesh)).collect(),
            sphere_textures: if sphere_textures.iter().any(Option::is_some) {
                sphere_textures
            } else {
                Vec::new()
            },
            lights,
            triangle_lights: lamps.triangles,
            mesh_lights: lamps.meshes,
            lists,
            suns: emitters::suns(scene),
            delta_lights,
            environment: emitters::environment(scene),
            camera: CameraRays::of(scene.camera(), film, &space),
            overlaps: overlaps(scene),
            space,
        })
    }

    /// Lanes that hit a mesh with [overlapping faces](Self::overlaps); `None` if there is no such mesh.
    #[inline(always)]
    pub fn covered<L: Lane>(&self, hit: &Hit<L>) -> Option<L::Mask> {
        if self.overlaps.is_empty() {
            return None;
        }
        let covered = |lane: &usize| self.overlaps.get(hit.geometry.lane(*lane) as usize) == Some(&true);
        let bits = hit.found.lanes().filter(covered);
        Some(L::Mask::from_bitmask(bits.fold(0, |bits, lane| bits | 1 << lane)))
    }

    /// Whether spheres are the only lights that a sampled direction can hit.
    #[inline(always)]
    pub fn only_spheres_emit(&self) -> bool {
        self.triangle_lights.is_empty()
            && self.mesh_lights.is_empty()
            && self.environment.is_none()
            && self.suns.is_empty()
    }

    /// Surface index of a primitive.
    #[inline(always)]
    pub fn surface_index(&self, geometry: u32, primitive: u32) -> u32 {
        if geometry == self.sphere_geometry {
            geometry + primitive
        } else {
            geometry
        }
    }
}

impl SurfaceRecord {
    fn new(scene: &Scene, surface: &Surface, shape: Effects, ball: BoundingSphere, extent: [f32; 3]) -> Self {
        let mut record = Self {
            rho: [0.0; 3],
            specular: None,
            facets: None,
            alpha: 1.0,
            reach: phong::reach(1.0),
            effects: shape,
            le: None,
            ball,
            extent,
        };
        // An exponent that rounds to 1 must stay Phong.
        let exponent = |alpha: f64| (alpha as f32).max(1.0_f32.next_up());
        match *surface {
            Surface::Emission(le) => record.le = Some(narrow(le)),
            Surface::Material(i) => {
                record.effects = shape.union(scene.material(i).effects());
                match scene.material(i).bsdf {
                    Bsdf::Diffuse { rho } => record.rho = narrow(rho),
                    Bsdf::Phong { rho, alpha } => (record.rho, record.alpha) = (narrow(rho), exponent(alpha)),
                    Bsdf::Blend { rho, specular, alpha } => {
                        (record.rho, record.alpha) = (narrow(rho), exponent(alpha));
                        record.specular = Some(narrow(specular));
                    }
                    Bsdf::Ggx {
                        base,
                        metallic,
                        roughness,
                    } => {
                        record.rho = narrow(base);
                        record.facets = Some(Facets::Ggx {
                            alpha: (roughness * roughness) as f32,
                            metallic: metallic as f32,
                        });
                    }
                    Bsdf::Conductor { eta, k, roughness } => {
                        record.rho = [1.0; 3];
                        record.facets = Some(Facets::Conductor {
                            alpha: (roughness * roughness) as f32,
                            eta: narrow(eta),
                            k: narrow(k),
                        });
                    }
                }
            }
        }
        record.reach = phong::reach(record.alpha);
        record
    }
}
