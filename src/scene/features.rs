//! The effects that a scene requires, and counts of its shapes.

use super::sight::Frustum;
use super::{Effect, Effects, Environment, FilmSize, Mesh, Scene, Surface};
use crate::settings::LightsAsked;

/// The contents of a scene: the kernel needs to support no more.
///
/// Shapes outside the view only act as occluders; an emission of 0 is no light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Features {
    /// Number of shapes or cameras that require each effect, in the order of [`Effect::ALL`]. A mesh counts once, except for
    /// many lights, where each triangle counts.
    counts: [usize; Effect::ALL.len()],
    /// Triangles of small emitting meshes: each is a light.
    pub triangle_lights: usize,
    /// Larger emitting meshes: one triangle is sampled per point.
    pub picked_lights: usize,
    /// Points and spots that emit.
    pub placed: usize,
    /// Lights that lists may have: emitting spheres and triangles, points and spots.
    pub emitters: usize,
    /// Triangles and spheres of any kind.
    pub shapes: usize,
    /// Triangles of any kind.
    pub triangles: usize,
    /// Spheres and meshes of any kind.
    pub bodies: usize,
    /// Those of them outside the view.
    pub unseen: usize,
}

impl Features {
    /// Examines a scene as seen on a film of this size.
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
        let placed = scene
            .lights()
            .iter()
            .filter(|light| light.emits() && light.position().is_some());
        found.placed = placed.count();
        found.emitters += found.count(Effect::SphereLights) + found.placed;
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
        found.triangles = scene.meshes().iter().map(|mesh| mesh.triangles.len()).sum();
        found.shapes = scene.spheres().len() + found.triangles;
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

    /// Whether each triangle of an emitting mesh is a separate light: up to two quadrilaterals. In larger meshes one triangle
    /// is sampled per point.
    pub fn samples_each_triangle(mesh: &Mesh) -> bool {
        mesh.triangles.len() <= 4
    }

    /// Number of lights for which `light` and `mis` sample a direction; delta lights have a fixed one.
    pub fn lights(&self) -> usize {
        let one_each = self.count(Effect::SphereLights) + self.count(Effect::Environment) + self.count(Effect::Suns);
        one_each + self.triangle_lights + self.picked_lights
    }

    /// Number of lights with random numbers of their own that are in no list of lights: the environment and suns.
    pub fn unlisted(&self) -> usize {
        self.count(Effect::Environment) + self.count(Effect::Suns)
    }

    /// Number of shapes that require an effect.
    pub fn count(&self, effect: Effect) -> usize {
        self.counts[effect as usize]
    }

    /// The effects that any shape requires.
    pub fn effects(&self) -> Effects {
        let there = Effect::ALL.into_iter().filter(|&effect| self.count(effect) > 0);
        there.fold(Effects::default(), |set, effect| set.with(effect, true))
    }

    /// Whether camera rays can hit nothing at all.
    pub fn nothing_in_sight(&self) -> bool {
        self.unseen == self.bodies && self.count(Effect::Environment) + self.count(Effect::Suns) == 0
    }
}
