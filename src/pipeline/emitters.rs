//! Collects the emitters of a scene: triangles of small meshes, large meshes as a whole, the environment, suns and delta lights.

use glam::DVec3;

use super::narrow::narrow;
use super::space::Space;
use crate::embree::EmbreeError;
use crate::light::delta::Place;
use crate::light::environment::{Constant, LatLong};
use crate::light::falloff::Falloff;
use crate::light::{DeltaLight, Environment, MeshLight, Sun, Triangle, TriangleLight};
use crate::sampling::Discrete;
use crate::scene::{self, Features, Light, LightClass, Mesh, Scene, Surface};
use crate::shape::{BoundingSphere, SkipIdAllocator, SkipIds};

/// Lights made from emissive meshes.
#[derive(Debug, Default)]
pub struct Emitters {
    /// Triangles of small emissive meshes.
    pub triangles: Vec<TriangleLight>,
    /// Large emissive meshes.
    pub meshes: Vec<MeshLight>,
    /// For each mesh of the scene, the index of its first triangle in [`Self::triangles`]; `u32::MAX` if it has none there.
    pub first_triangles: Vec<u32>,
    /// For each mesh of the scene, the self-intersection (skip) ids of its triangles; `None` if the mesh is not a light.
    pub skip_ids: Vec<Option<SkipIds>>,
}

/// A mesh counts as flat if no vertex is farther from its plane than this fraction of its size. Rays cannot resolve less.
const FLAT: f64 = 1e-7;

impl Emitters {
    /// Collects the emissive meshes, relative to the camera. With `each`, every triangle of a large mesh also becomes its own
    /// light.
    ///
    /// # Errors
    /// [`EmbreeError::TooManyLights`] if there are more triangles than skip ids.
    pub fn of(scene: &Scene, space: &Space, each: bool) -> Result<Self, EmbreeError> {
        let mut found = Self::default();
        let mut names = SkipIdAllocator::default();
        for (geometry, mesh) in (0..).zip(scene.meshes()) {
            let first = found.triangles.len() as u32;
            found.first_triangles.push(u32::MAX);
            let Surface::Emission(le) = mesh.surface else {
                found.skip_ids.push(None);
                continue;
            };
            if le.max_element() <= 0.0 {
                found.skip_ids.push(None);
                continue;
            }
            let skip_ids = names.next(mesh.triangles.len(), !is_flat(mesh));
            let skip_ids = skip_ids.ok_or(EmbreeError::TooManyLights)?;
            found.skip_ids.push(Some(skip_ids));
            found.add(mesh, space, skip_ids, narrow(le), (geometry, each));
            if found.triangles.len() as u32 > first {
                found.first_triangles[geometry as usize] = first;
            }
        }
        Ok(found)
    }

    fn add(&mut self, mesh: &Mesh, space: &Space, skip_ids: SkipIds, le: [f32; 3], (geometry, each): (u32, bool)) {
        let corners = |t: &[u32; 3]| t.map(|i| mesh.vertices[i as usize]);
        let triangles: Vec<Triangle> = mesh.triangles.iter().map(|t| triangle(corners(t), space)).collect();
        let named = (0..).zip(&triangles).map(|(i, t)| (skip_ids.of(i), *t));
        if each || Features::samples_each_triangle(mesh) {
            let lights = named.map(|(skip_id, triangle)| TriangleLight { triangle, le, skip_id });
            self.triangles.extend(lights);
            return;
        }
        let areas: Vec<f64> = mesh
            .triangles
            .iter()
            .map(|t| area_vector(corners(t)).length())
            .collect();
        let Some(shares) = Discrete::new(&areas) else {
            return;
        };
        let points: Vec<[f32; 3]> = triangles.iter().flat_map(|t| t.corners).collect();
        let BoundingSphere { center, radius } = BoundingSphere::around(&points);
        self.meshes.push(MeshLight {
            skip_ids: named.map(|(skip_id, _)| skip_id).collect(),
            triangles,
            shares,
            le,
            geometry,
            center,
            radius,
        });
    }
}

/// The environment, if it emits light.
pub fn environment(scene: &Scene) -> Option<Environment> {
    match scene.environment().filter(|sky| sky.emits())? {
        scene::Environment::Constant(le) => Some(Environment::Constant(Constant { le: narrow(*le) })),
        scene::Environment::Picture(picture) => {
            let (width, height) = (picture.width as usize, picture.height as usize);
            let axes = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| narrow(picture.to_scene * axis));
            LatLong::new(width, height, picture.texels.clone(), axes).map(Environment::LatLong)
        }
    }
}

fn lights_of(scene: &Scene, class: LightClass) -> impl Iterator<Item = &Light> {
    scene
        .lights()
        .iter()
        .filter(move |light| light.emits() && light.class() == class)
}

/// Directional lights with a nonzero angular radius.
pub fn suns(scene: &Scene) -> Vec<Sun> {
    let suns = lights_of(scene, LightClass::Disk).filter_map(|light| {
        let Light::Directional {
            direction,
            irradiance,
            angular_radius,
        } = *light
        else {
            return None;
        };
        let angle = angular_radius.to_radians();
        // Irradiance on a facing surface from a disk of radiance 1.
        let facing = std::f64::consts::PI * angle.sin().powi(2);
        Some(Sun::new(toward(direction), angle, narrow(irradiance / facing)))
    });
    suns.collect()
}

/// Delta lights: point, spot and directional lights.
pub fn delta_lights(scene: &Scene, space: &Space) -> Vec<DeltaLight> {
    let at = |position: DVec3, intensity: DVec3, spot: Option<Falloff>| DeltaLight {
        place: Place::At {
            position: space.point(position),
            unit: Space::UNIT_DISTANCE,
            spot,
        },
        le: narrow(space.at_unit(intensity)),
    };
    let lights = lights_of(scene, LightClass::Delta).map(|light| match *light {
        Light::Point { position, intensity } => at(position, intensity, None),
        Light::Spot {
            position,
            direction,
            intensity,
            inner_angle,
            outer_angle,
        } => {
            let angles = [inner_angle, outer_angle].map(f64::to_radians);
            at(position, intensity, Some(Falloff::new(toward(-direction), angles)))
        }
        Light::Directional {
            direction, irradiance, ..
        } => DeltaLight {
            place: Place::Toward(toward(direction)),
            le: narrow(irradiance),
        },
    });
    lights.collect()
}

/// Unit vector opposite to `direction`, which may have any nonzero length. The division first keeps the squares within the range of
/// `f64`.
fn toward(direction: DVec3) -> [f32; 3] {
    narrow(-(direction / direction.abs().max_element()).normalize())
}

/// Normal of the triangle; its length is the area.
fn area_vector([a, b, c]: [DVec3; 3]) -> DVec3 {
    (b - a).cross(c - a) / 2.0
}

/// The area is computed from the vertices in the file. Relative to a distant camera, `f64` loses a triangle as small as 1e-12 of
/// the distance.
fn triangle(corners: [DVec3; 3], space: &Space) -> Triangle {
    let vector = area_vector(corners);
    Triangle {
        corners: corners.map(|corner| space.point(corner)),
        normal: narrow(vector.normalize_or_zero()),
        area: space.area(vector.length()) as f32,
    }
}

fn is_flat(mesh: &Mesh) -> bool {
    let corner = |i: u32| mesh.vertices[i as usize];
    let Some(first) = mesh.triangles.first() else {
        return true;
    };
    let (anchor, normal) = (corner(first[0]), area_vector(first.map(corner)).normalize_or_zero());
    let corners = || mesh.triangles.iter().flatten().map(|&i| corner(i) - anchor);
    let size = corners().map(DVec3::length).fold(0.0, f64::max);
    corners().all(|v| v.dot(normal).abs() <= FLAT * size)
}
