//! Rays and hits.

use crate::lane::Lane;
use crate::math::Vec3;

/// Value of [`Ray::skip_id`] that skips nothing.
pub const NO_SKIP_ID: u32 = u32::MAX;

/// Skip ids of triangles for [`Ray::skip_id`], so that a light never occludes itself. Their top bit distinguishes them from those
/// of spheres.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SkipIds {
    /// The skip id of the first triangle of a mesh.
    pub first: u32,
    /// Whether each triangle has its own. Otherwise all share one; this is for flat meshes, where no triangle can occlude another.
    pub each: bool,
}

impl SkipIds {
    /// The bit that marks the skip id of a triangle.
    pub const TRIANGLE: u32 = 1 << 31;

    /// The skip id of a triangle of the mesh.
    #[inline(always)]
    pub const fn of(self, primitive: u32) -> u32 {
        if self.each { self.first + primitive } else { self.first }
    }
}

/// Allocates skip ids for the triangles of meshes.
#[derive(Clone, Copy, Debug, Default)]
pub struct SkipIdAllocator {
    given: u32,
}

impl SkipIdAllocator {
    /// Number of skip ids: all with the top bit except the last, which is [`NO_SKIP_ID`].
    pub const MOST: u32 = SkipIds::TRIANGLE - 1;

    /// Allocates skip ids for a mesh with this many triangles; with `each`, one per triangle. `None` if not enough are left.
    pub fn next(&mut self, triangles: usize, each: bool) -> Option<SkipIds> {
        let more = if each { u32::try_from(triangles).ok()? } else { 1 };
        let first = SkipIds::TRIANGLE + self.given;
        self.given = self.given.checked_add(more).filter(|&given| given <= Self::MOST)?;
        Some(SkipIds { first, each })
    }
}

/// Rays from `origin` along `direction` (any nonzero length), from distance 0 to `tfar` in lengths of `direction`.
#[derive(Clone, Copy, Debug)]
pub struct Ray<L: Lane> {
    /// Origins.
    pub origin: Vec3<L>,
    /// Directions.
    pub direction: Vec3<L>,
    /// Ends, in lengths of the direction.
    pub tfar: L,
    /// A sphere or triangle that occlusion queries ignore, or [`NO_SKIP_ID`].
    pub skip_id: L::Bits,
}

/// Closest hits. Lanes outside `found` are undefined.
#[derive(Clone, Copy, Debug)]
pub struct Hit<L: Lane> {
    /// Lanes with a hit.
    pub found: L::Mask,
    /// Distance in lengths of the direction.
    pub t: L,
    /// Geometric normal, of any length and side.
    pub ng: Vec3<L>,
    /// First barycentric coordinate.
    pub u: L,
    /// Second barycentric coordinate.
    pub v: L,
    /// The geometry: the index of the mesh; for spheres, the number of meshes.
    pub geometry: L::Bits,
    /// Index of the triangle in the mesh, or of the sphere.
    pub primitive: L::Bits,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// With 2^31 skip ids the last would be [`NO_SKIP_ID`]; with one more, ids would wrap around to those of spheres.
    #[test]
    fn names_of_triangles_end_before_they_mean_something_else() {
        let half = 1_usize << 30;
        let mut names = SkipIdAllocator::default();
        let first = names.next(half, true).unwrap();
        let second = names.next(half - 2, true).unwrap();
        let flat = names.next(half, false).unwrap();
        assert_eq!(first.of(0), SkipIds::TRIANGLE);
        assert_eq!(first.of((half - 1) as u32) + 1, second.of(0));
        assert_eq!(second.of((half - 3) as u32) + 1, flat.of(7));
        assert_eq!(flat.of(7), NO_SKIP_ID - 1);
        assert_eq!(names.next(1, true), None);
        assert_eq!(SkipIdAllocator::default().next(2 * half, true), None);
        assert_eq!(SkipIdAllocator::default().next(8 * half, true), None);
        assert!(SkipIdAllocator::default().next(8 * half, false).is_some());
    }
}
