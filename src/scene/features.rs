//! What a scene calls for, and how many things in it do.

use super::sight::Frustum;
use super::{Effect, Effects, Environment, FilmSize, Mesh, Scene, Surface};
use crate::settings::LightsAsked;

/// What a scene contains, found by looking at it: the kernel need support no more.
///
/// Shapes that no eye ray can meet call for nothing but to be in the way of light; an emission of 0 is no light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Features {
    /// Shapes or cameras that call for each effect, in the order of [`Effect::ALL`]; a mesh is one, but for many lights a triangle.
    counts: [usize; Effect::ALL.len()],
    /// Triangles of small meshes that emit: lights of their own.
    pub triangle_lights: usize,
    /// Larger meshes that emit: a triangle of each is picked.
    pub picked_lights: usize,
    /// Spheres and triangles that emit.
    pub emitters: usize,
    /// Triangles and spheres of any kind.
    pub shapes: usize,
    /// Spheres and meshes of any kind.
    pub bodies: usize,
    /// Those of them that no eye ray can meet.
    pub unseen: usize,
}

impl Features {
    /// Looks at a scene as a film of this size shows it.
    pub fn of(scene: &Scene, film: FilmSize) -> Self {
        let mut found = Self::default();
        let frustum = Frustum::new(scene.camera(), film);
        for sphere in scene.spheres() {
            let seen = frustum.may_see_ball(sphere.center, sphere.radius);
            found.add(scene, &sphere.surface, sphere.effects(), seen);
        }
        for mesh in scene.meshes() {
            let seen = frustum.may_see_points(&mesh.vertices);
            found.add(scene, &mesh.surface, mesh.effects(), seen);
            if mesh.effects().has(Effect::MeshLights) {
                found.emitters += mesh.triangles.len();
                let each = Self::samples_each_triangle(mesh);
                found.triangle_lights += if each { mesh.triangles.len() } else { 0 };
                found.picked_lights += usize::from(!each);
            }
        }
        found.emitters += found.count(Effect::SphereLights);
        if found.emitters > LightsAsked::FEW {
            found.counts[Effect::ManyLights as usize] = found.emitters;
        }
        let sky = scene.environment().is_some_and(Environment::emits);
        found.counts[Effect::Environment as usize] = usize::from(sky);
        for effect in scene.lights().iter().flat_map(|light| light.effects().iter()) {
            found.counts[effect as usize] += 1;
        }
        for effect in scene.camera().effects().iter() {
            found.counts[effect as usize] += 1;
        }
        found.bodies = scene.spheres().len() + scene.meshes().len();
        found.shapes = scene.spheres().len() + scene.meshes().iter().map(|m| m.triangles.len()).sum::<usize>();
        found
    }

    fn add(&mut self, scene: &Scene, surface: &Surface, shape: Effects, seen: bool) {
        self.unseen += usize::from(!seen);
        let effects = match surface {
            Surface::Emission(_) => shape,
            Surface::Material(i) if seen => shape.union(scene.material(*i).effects()),
            Surface::Material(_) => return,
        };
        for effect in effects.iter() {
            self.counts[effect as usize] += 1;
        }
    }

    /// Whether the triangles of a mesh that emits are lights of their own, up to two quadrilaterals; of larger ones a triangle
    /// is picked for every point.
    pub fn samples_each_triangle(mesh: &Mesh) -> bool {
        mesh.triangles.len() <= 4
    }

    /// How many lights `light` and `mis` draw a direction for; delta lights have theirs.
    pub fn lights(&self) -> usize {
        let one_each = self.count(Effect::SphereLights) + self.count(Effect::Environment) + self.count(Effect::Suns);
        one_each + self.triangle_lights + self.picked_lights
    }

    /// Those of them that are in no list of lights: the environment and suns.
    pub fn unlisted(&self) -> usize {
        self.count(Effect::Environment) + self.count(Effect::Suns)
    }

    /// How many shapes call for an effect.
    pub fn count(&self, effect: Effect) -> usize {
        self.counts[effect as usize]
    }

    /// The effects that any shape calls for.
    pub fn effects(&self) -> Effects {
        let there = Effect::ALL.into_iter().filter(|&effect| self.count(effect) > 0);
        there.fold(Effects::default(), |set, effect| set.with(effect, true))
    }

    /// Whether eye rays can meet anything at all.
    pub fn nothing_in_sight(&self) -> bool {
        self.unseen == self.bodies && self.count(Effect::Environment) + self.count(Effect::Suns) == 0
    }
}
