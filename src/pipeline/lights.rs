//! The only index space of the lights that have random numbers: spheres, triangles, picked meshes, the environment, suns.

use super::world::World;

/// Lights with random numbers of their own, in the order of their numbers. Delta lights have none.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// [`World::lights`].
    Spheres,
    /// [`World::triangle_lights`].
    Triangles,
    /// [`World::mesh_lights`].
    Meshes,
    /// [`World::environment`], if it emits.
    Environment,
    /// [`World::suns`].
    Suns,
}

impl World {
    /// How many lights of a kind there are.
    pub fn count(&self, kind: Kind) -> usize {
        match kind {
            Kind::Spheres => self.lights.len(),
            Kind::Triangles => self.triangle_lights.len(),
            Kind::Meshes => self.mesh_lights.len(),
            Kind::Environment => usize::from(self.environment.is_some()),
            Kind::Suns => self.suns.len(),
        }
    }

    /// The number of the first light of a kind; a light's number says which random numbers are its own.
    pub fn first(&self, kind: Kind) -> usize {
        let kinds = [
            Kind::Spheres,
            Kind::Triangles,
            Kind::Meshes,
            Kind::Environment,
            Kind::Suns,
        ];
        let before = kinds.into_iter().take_while(|&other| other < kind);
        before.map(|kind| self.count(kind)).sum()
    }
}
