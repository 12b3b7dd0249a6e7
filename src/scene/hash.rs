//! The hash of a scene: it covers everything that affects the picture, and nothing else.

use bytemuck::{NoUninit, must_cast_slice};
use half::f16;
use sha2::{Digest, Sha256};

use super::SceneBuilder;
use super::light::Light;
use super::parts::{Bsdf, Environment, Fov, Material, Surface};
use super::texture::Wrap;
use crate::texels::Texels;

/// Change this when the same values start to give another picture.
const REVISION: &[u8] = b"Octolux scene 1";

/// Texels converted to single precision at a time.
const PIECE: usize = 1 << 12;

/// SHA-256 in hexadecimal of camera, shapes with their materials, environment and lights.
///
/// It excludes names, the size of the picture, render settings and unused materials. It includes the order of shapes, because
/// random numbers depend on it.
pub fn of(scene: &SceneBuilder) -> String {
    let mut hash = Content(Sha256::new());
    hash.list(REVISION);
    let camera = &scene.camera;
    hash.numbers(&camera.origin.to_array());
    hash.numbers(&camera.target.to_array());
    hash.numbers(&camera.up.to_array());
    match camera.fov {
        Fov::X(degrees) => hash.variant(0, &[degrees]),
        Fov::Y(degrees) => hash.variant(1, &[degrees]),
    }
    hash.option(camera.lens, |hash, lens| hash.numbers(&[lens.radius, lens.focus]));

    let materials: Vec<[u8; 32]> = scene.materials.iter().map(material).collect();
    let surface = |hash: &mut Content, surface: Surface| match surface {
        Surface::Emission(radiance) => hash.variant(0, &radiance.to_array()),
        Surface::Material(id) => {
            hash.variant(1, &[]);
            hash.list(&materials[id.index()]);
        }
    };
    hash.count(scene.spheres.len());
    for sphere in &scene.spheres {
        hash.numbers(&sphere.center.to_array());
        hash.numbers(&[sphere.radius]);
        surface(&mut hash, sphere.surface);
    }
    hash.count(scene.meshes.len());
    for mesh in &scene.meshes {
        hash.list(&mesh.vertices);
        hash.list(&mesh.triangles);
        hash.option(mesh.normals.as_deref(), Content::list);
        hash.count(usize::from(mesh.smooth_terminator));
        hash.option(mesh.uvs.as_deref(), Content::list);
        surface(&mut hash, mesh.surface);
    }
    hash.option(scene.environment.as_ref(), |hash, environment| match environment {
        Environment::Constant(radiance) => hash.variant(0, &radiance.to_array()),
        Environment::Picture(sky) => {
            hash.variant(1, &sky.to_scene.to_cols_array());
            hash.count(sky.width as usize);
            hash.texels(&sky.texels);
        }
    });
    // Adds nothing if there are none, so that older scenes keep their hash.
    for light in &scene.lights {
        match *light {
            Light::Point { position, intensity } => {
                hash.variant(2, &[position, intensity].map(|v| v.to_array()).concat())
            }
            Light::Spot {
                position,
                direction,
                intensity,
                inner_angle,
                outer_angle,
            } => {
                hash.variant(3, &[position, direction, intensity].map(|v| v.to_array()).concat());
                hash.numbers(&[inner_angle, outer_angle]);
            }
            Light::Directional {
                direction,
                irradiance,
                angular_radius,
            } => {
                hash.variant(4, &[direction, irradiance].map(|v| v.to_array()).concat());
                hash.numbers(&[angular_radius]);
            }
        }
    }
    hash.0.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
}

/// The hash of a material: shapes refer to it by content and not by index.
fn material(material: &Material) -> [u8; 32] {
    let mut hash = Content(Sha256::new());
    match material.bsdf {
        Bsdf::Diffuse { rho } => hash.variant(0, &rho.to_array()),
        Bsdf::Phong { rho, alpha } => {
            hash.variant(1, &rho.to_array());
            hash.numbers(&[alpha]);
        }
        Bsdf::Blend { rho, specular, alpha } => {
            hash.variant(2, &rho.to_array());
            hash.numbers(&specular.to_array());
            hash.numbers(&[alpha]);
        }
        Bsdf::Ggx {
            base,
            metallic,
            roughness,
        } => {
            hash.variant(3, &base.to_array());
            hash.numbers(&[metallic, roughness]);
        }
        Bsdf::Conductor { eta, k, roughness } => {
            hash.variant(4, &eta.to_array());
            hash.numbers(&k.to_array());
            hash.numbers(&[roughness]);
        }
    }
    hash.count(usize::from(material.one_sided));
    hash.option(material.texture.as_deref(), |hash, texture| {
        hash.count(match texture.wrap {
            Wrap::Repeat => 0,
            Wrap::Clamp => 1,
        });
        hash.count(texture.width as usize);
        hash.texels(&texture.texels);
    });
    hash.0.finalize().into()
}

/// Hashed bytes with unambiguous boundaries: different scenes have different bytes.
struct Content(Sha256);

impl Content {
    fn numbers(&mut self, numbers: &[f64]) {
        self.0.update(must_cast_slice::<f64, u8>(numbers));
    }

    fn count(&mut self, count: usize) {
        self.0.update((count as u64).to_le_bytes());
    }

    fn list<T: NoUninit>(&mut self, items: &[T]) {
        self.count(items.len());
        self.0.update(must_cast_slice::<T, u8>(items));
    }

    /// As single precision, so that half precision hashes equal.
    fn texels(&mut self, texels: &Texels) {
        match texels {
            Texels::Single(texels) => self.list(texels),
            Texels::Half(halves) => {
                self.count(halves.len());
                for piece in halves.chunks(PIECE) {
                    let singles: Vec<[f32; 3]> = piece.iter().map(|texel| texel.map(f16::to_f32)).collect();
                    self.0.update(must_cast_slice::<_, u8>(&singles));
                }
            }
        }
    }

    /// A variant of an enum with its numbers.
    fn variant(&mut self, which: u8, numbers: &[f64]) {
        self.0.update([which]);
        self.numbers(numbers);
    }

    fn option<T>(&mut self, item: Option<T>, put: impl FnOnce(&mut Self, T)) {
        self.0.update([u8::from(item.is_some())]);
        if let Some(item) = item {
            put(self, item);
        }
    }
}
