//! The single index space of lights that use random numbers: spheres, triangles, sampled meshes, the environment, suns.

use super::lists::{Draws, Lists};
use super::world::World;

/// Kinds of light with their own random numbers, in index order. Delta lights have none.
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

/// Up to this many lights, testing a direction against all of them is cheaper than tracing a ray.
const LOOKED_AT: usize = 256;

impl World {
    /// Whether a direction that misses all lights is dropped before a ray is traced. This holds if only spheres emit and there are
    /// few enough to test them all.
    #[inline(always)]
    pub fn drops_misses(&self) -> bool {
        self.only_spheres_emit() && self.lights.len() <= LOOKED_AT
    }

    /// The lists that an estimator draws from, if any.
    pub fn lists_of(&self, draws: Draws) -> Option<&Lists> {
        self.lists.as_ref()?.drawn_by(draws, &self.delta_lights)
    }

    /// Number of lights of a kind.
    pub fn count(&self, kind: Kind) -> usize {
        match kind {
            Kind::Spheres => self.lights.len(),
            Kind::Triangles => self.triangle_lights.len(),
            Kind::Meshes => self.mesh_lights.len(),
            Kind::Environment => usize::from(self.environment.is_some()),
            Kind::Suns => self.suns.len(),
        }
    }

    /// Index of the first light of a kind. The index of a light selects its random numbers.
    pub fn first(&self, kind: Kind) -> usize {
        let kinds = [
            Kind::Spheres,
            Kind::Triangles,
            Kind::Meshes,
            Kind::Environment,
            Kind::Suns,
        ];
        let before = kinds.into_iter().take_while(|&other| other < kind);
        // A list reserves as many indices as it is long, whichever lights are on it.
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
