//! The scene as the streams see it: `f32`, relative to the camera, in tables.
//!
//! Positions are made relative to the pinhole in `f64` before they are rounded, so a scene far from the origin is as
//! good as one around it, and what the camera sees close by has the most digits. Their unit is that of [`Space`].

use std::collections::HashSet;
use std::sync::Arc;

use super::camera::CameraRays;
use super::emitters::{self, Emitters};
use super::intersector::Intersector;
use super::lists::Lists;
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
use crate::shape::{Ball, Hit, Sphere};

/// Everything that is the same for all rays.
#[derive(Debug)]
pub struct World {
    /// Answers rays, unless the line does.
    pub accel: Accel,
    /// The shapes in a line; empty unless it answers rays or culls.
    pub line: LinearScene,
    /// Whether the line says for all rays of a tile at once what may be in their way.
    pub culls: bool,
    /// What surfaces do, meshes first, then spheres.
    pub surfaces: Vec<SurfaceRecord>,
    /// The geometry that the spheres are, and so also the number of meshes.
    pub sphere_geometry: u32,
    /// Of each sphere, its place among those of the scene.
    pub sphere_numbers: Vec<u32>,
    /// Smooth normals of each mesh that has them.
    pub normals: Vec<Option<SmoothNormals>>,
    /// Corners of each triangle of the meshes with a smooth terminator.
    pub corners: Vec<Option<Corners>>,
    /// Texture coordinates of each mesh that has a texture.
    pub textured: Vec<Option<Textured>>,
    /// The texture of each sphere; empty if there are none.
    pub sphere_textures: Vec<Option<Arc<Texture>>>,
    /// Spheres that emit something.
    pub lights: Vec<SphereLight>,
    /// Triangles that are lights of their own.
    pub triangle_lights: Vec<TriangleLight>,
    /// Meshes of which a triangle is picked.
    pub mesh_lights: Vec<MeshLight>,
    /// What lists of lights are drawn from, where not all lights are asked each time.
    pub lists: Option<Lists>,
    /// Disks of light in the sky.
    pub suns: Vec<Sun>,
    /// Points, spots and lights from one direction.
    pub delta_lights: Vec<DeltaLight>,
    /// What lies beyond the scene, if it emits.
    pub environment: Option<Environment>,
    /// Eye rays.
    pub camera: CameraRays,
    /// Of each mesh, whether faces of others lie in the planes of its own and cover them; empty if there are none.
    pub overlaps: Vec<bool>,
    /// What lengths are here and in the scene.
    pub space: Space,
}

/// What a surface does.
#[derive(Clone, Copy, Debug)]
pub struct SurfaceRecord {
    /// Reflectance; 0 where it emits.
    pub rho: [f32; 3],
    /// Reflectance of the Phong lobe of a blend; its diffuse one is `rho`.
    pub specular: Option<[f32; 3]>,
    /// What it is if it has microfacets.
    pub facets: Option<Facets>,
    /// Above 1 for Phong and blends, 1 for all others.
    pub alpha: f32,
    /// How far its Phong lobe reaches: see [`phong::reach`].
    pub reach: f32,
    /// What it calls for.
    pub effects: Effects,
    /// Radiance where it emits.
    pub le: Option<[f32; 3]>,
    /// The sphere that points are put back onto, or one of no size at the camera.
    pub ball: Ball,
    /// How far one of its shapes reaches along each axis, at most: the largest box around a triangle, or the radius.
    pub extent: [f32; 3],
}

/// Models with microfacets.
#[derive(Clone, Copy, Debug)]
pub enum Facets {
    /// Metal, or a body below a coat.
    Ggx {
        /// Roughness of the distribution.
        alpha: f32,
        /// Share of metal.
        metallic: f32,
    },
    /// Metal by its index of refraction.
    Conductor {
        /// Roughness of the distribution.
        alpha: f32,
        /// Index of refraction.
        eta: [f32; 3],
        /// Extinction coefficient.
        k: [f32; 3],
    },
}

/// The ball of what no point is put back onto.
const NOWHERE: Ball = Ball {
    center: [0.0; 3],
    radius: 0.0,
};

/// Of each triangle, the unit normals at its corners. Side by side and not by way of the vertices: a hit on a mesh of a
/// million triangles waits for one line of the cache, not for four.
pub type SmoothNormals = Vec<[[f32; 3]; 3]>;

/// Of each triangle, its corners.
pub type Corners = Vec<[[f32; 3]; 3]>;

/// The spheres relative to the camera. Of spheres that coincide once they are rounded, the first hides the others.
fn distinct_spheres<'s>(scene: &'s Scene, space: &Space) -> Vec<(u32, &'s scene::Sphere, Sphere)> {
    let mut seen = HashSet::new();
    let narrowed = (0..).zip(scene.spheres()).map(|(number, sphere)| {
        let center = space.relative(sphere.center).to_array();
        (number, sphere, Sphere::new(center, space.length(sphere.radius)))
    });
    narrowed
        .filter(|(_, _, Sphere { ball, origin_power })| {
            // The sum makes one zero of the two.
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

/// What orders lights; any order will do that depends on nothing else.
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

/// The sides of the smallest box that every triangle fits into, moved about.
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
    /// Builds the tables and the accelerator; with lists of `listed` lights, if there are to be any.
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
            // By its power the ground is where it is to the rounding of the point, and centre and radius say less.
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
        // Random numbers and sums follow the place of a light in this list: with an order by what a light is, the order in the
        // file changes no bit.
        lights.sort_by(|a, b| {
            by_content(a)
                .into_iter()
                .map(f32::to_bits)
                .cmp(by_content(b).into_iter().map(f32::to_bits))
        });
        let sphere_geometry = scene.meshes().len() as u32;
        let lists = listed.map(|length| {
            let kinds = (&*lights, &*lamps.triangles);
            Lists::new(kinds, spheres.len(), lamps.first_triangles.clone(), length, film)
        });
        let sphere_textures: Vec<_> = spheres
            .iter()
            .map(|(_, sphere, _)| sphere_texture(scene, sphere))
            .collect();
        let sphere_numbers = spheres.iter().map(|(number, ..)| *number).collect();
        let spheres: Vec<Sphere> = spheres.into_iter().map(|(.., sphere)| sphere).collect();
        if in_line {
            line.set_spheres(spheres.clone(), sphere_geometry);
        }
        if accel == AccelKind::Embree {
            builder.set_spheres(spheres)?;
        }
        Ok(Self {
            accel: builder.commit()?,
            line,
            culls: intersector.culls(),
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
            delta_lights: emitters::delta_lights(scene, &space),
            environment: emitters::environment(scene),
            camera: CameraRays::of(scene.camera(), film, &space),
            overlaps: overlaps(scene),
            space,
        })
    }

    /// Lanes that met a mesh whose faces others cover; `None` where there is no such mesh.
    #[inline(always)]
    pub fn covered<L: Lane>(&self, hit: &Hit<L>) -> Option<L::Mask> {
        if self.overlaps.is_empty() {
            return None;
        }
        let covered = |lane: &usize| self.overlaps.get(hit.geometry.lane(*lane) as usize) == Some(&true);
        let bits = hit.found.lanes().filter(covered);
        Some(L::Mask::from_bitmask(bits.fold(0, |bits, lane| bits | 1 << lane)))
    }

    /// Whether no direction can meet a light but spheres.
    #[inline(always)]
    pub fn only_spheres_emit(&self) -> bool {
        self.triangle_lights.is_empty()
            && self.mesh_lights.is_empty()
            && self.environment.is_none()
            && self.suns.is_empty()
    }

    /// The surface of a primitive of a geometry.
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
    fn new(scene: &Scene, surface: &Surface, shape: Effects, ball: Ball, extent: [f32; 3]) -> Self {
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
        // An exponent that rounds to 1 is still Phong's model.
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
