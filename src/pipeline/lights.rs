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

/// So many lights are looked at one by one for a direction: as long as that takes less than a ray.
const LOOKED_AT: usize = 256;

impl World {
    /// Whether a direction that misses all lights is dropped before it costs a ray: where only spheres emit, and few enough that it
    /// takes less time to look at all of them.
    #[inline(always)]
    pub fn drops_misses(&self) -> bool {
        self.only_spheres_emit() && self.lights.len() <= LOOKED_AT
    }

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
        // A list has numbers for its own length, whatever is on it.
        let listed = |kind: Kind| match &self.lists {
            Some(lists) if kind == Kind::Spheres => Some(lists.length() as usize),
            Some(_) if kind < Kind::Environment => Some(0),
            _ => None,
        };
        before
            .map(|kind| listed(kind).unwrap_or_else(|| self.count(kind)))
            .sum()
    }
}
