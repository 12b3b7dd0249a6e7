//! What a scene calls for.

use super::{Bsdf, Mesh, Scene, Surface};

/// What a scene contains, found by looking at it: the kernel need support no more.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Features {
    /// Surfaces with the diffuse model.
    pub diffuse: usize,
    /// Surfaces with Phong's model.
    pub phong: usize,
    /// Spheres that reflect.
    pub spheres: usize,
    /// Meshes that reflect.
    pub meshes: usize,
    /// Spheres that emit anything.
    pub sphere_lights: usize,
    /// Meshes that emit anything.
    pub mesh_lights: usize,
    /// Triangles of small meshes that emit: lights of their own.
    pub triangle_lights: usize,
    /// Larger meshes that emit: a triangle of each is picked.
    pub picked_lights: usize,
    /// Meshes with smooth normals.
    pub smooth_normals: usize,
    /// Triangles and spheres of any kind.
    pub shapes: usize,
}

impl Features {
    /// Looks at a scene.
    pub fn of(scene: &Scene) -> Self {
        let mut found = Self::default();
        let reflects = |found: &mut Self, surface: &Surface| match surface {
            Surface::Material(i) => {
                match scene.materials[*i].bsdf {
                    Bsdf::Diffuse { .. } => found.diffuse += 1,
                    Bsdf::Phong { .. } => found.phong += 1,
                }
                true
            }
            Surface::Emission(_) => false,
        };
        let emits = |surface: &Surface| matches!(surface, Surface::Emission(le) if le.max_element() > 0.0);
        for sphere in &scene.spheres {
            found.spheres += usize::from(reflects(&mut found, &sphere.surface));
            found.sphere_lights += usize::from(emits(&sphere.surface));
        }
        found.shapes = scene.spheres.len() + scene.meshes.iter().map(|m| m.triangles.len()).sum::<usize>();
        for mesh in &scene.meshes {
            let reflecting = reflects(&mut found, &mesh.surface);
            found.meshes += usize::from(reflecting);
            if emits(&mesh.surface) {
                found.mesh_lights += 1;
                found.triangle_lights += if Self::samples_each_triangle(mesh) {
                    mesh.triangles.len()
                } else {
                    0
                };
                found.picked_lights += usize::from(!Self::samples_each_triangle(mesh));
            }
            found.smooth_normals += usize::from(reflecting && mesh.normals.is_some());
        }
        found
    }

    /// Whether the triangles of a mesh that emits are lights of their own, up to two quadrilaterals; of larger ones a triangle
    /// is picked for every point.
    pub fn samples_each_triangle(mesh: &Mesh) -> bool {
        mesh.triangles.len() <= 4
    }

    /// How many lights `light` and `mis` draw a direction for.
    pub fn lights(&self) -> usize {
        self.sphere_lights + self.triangle_lights + self.picked_lights
    }

    /// The effects that are there, in words.
    pub fn needs(&self) -> Vec<&'static str> {
        [
            (self.diffuse, "diffuse"),
            (self.phong, "phong"),
            (self.spheres, "spheres"),
            (self.meshes, "meshes"),
            (self.sphere_lights, "sphere lights"),
            (self.mesh_lights, "mesh lights"),
            (self.smooth_normals, "smooth normals"),
        ]
        .into_iter()
        .filter_map(|(count, name)| (count > 0).then_some(name))
        .collect()
    }
}
