//! Rays and hits.

use crate::lane::Lane;
use crate::math::Vec3;

/// For [`Ray::aims_at`]: no sphere in particular.
pub const NO_SPHERE: u32 = u32::MAX;

/// Names of triangles for [`Ray::aims_at`], so that a light never blocks the rays to it. They differ from those of spheres
/// by their top bit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Aims {
    /// The name of the first triangle of a mesh.
    pub first: u32,
    /// Whether each has its own; else, in a flat mesh, where none can hide another, all have the same.
    pub each: bool,
}

impl Aims {
    /// The bit that tells triangles from spheres.
    pub const TRIANGLE: u32 = 1 << 31;

    /// The name of a triangle of the mesh.
    #[inline(always)]
    pub const fn of(self, primitive: u32) -> u32 {
        if self.each { self.first + primitive } else { self.first }
    }
}

/// Rays from `origin` along `direction` (any length but 0), from distance 0 to `tfar` in lengths of `direction`.
#[derive(Clone, Copy, Debug)]
pub struct Ray<L: Lane> {
    /// Where they start.
    pub origin: Vec3<L>,
    /// Where they go.
    pub direction: Vec3<L>,
    /// Where they end.
    pub tfar: L,
    /// A sphere or triangle that does not block visibility queries, or [`NO_SPHERE`].
    pub aims_at: L::Bits,
}

/// What rays meet first. Lanes outside `found` hold nothing of use.
#[derive(Clone, Copy, Debug)]
pub struct Hit<L: Lane> {
    /// Lanes that met something.
    pub found: L::Mask,
    /// Distance in lengths of the direction.
    pub t: L,
    /// Geometric normal, of any length and side.
    pub ng: Vec3<L>,
    /// First barycentric coordinate.
    pub u: L,
    /// Second barycentric coordinate.
    pub v: L,
    /// The geometry: the number of the mesh, or the number of meshes where it is the spheres.
    pub geometry: L::Bits,
    /// The triangle of a mesh or the sphere.
    pub primitive: L::Bits,
}
