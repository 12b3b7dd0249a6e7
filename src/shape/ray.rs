//! Rays and hits.

use crate::lane::Lane;
use crate::math::Vec3;

/// For [`Ray::skip_id`]: no sphere in particular.
pub const NO_SKIP_ID: u32 = u32::MAX;

/// Names of triangles for [`Ray::skip_id`], so that a light never blocks the rays to it. They differ from those of spheres
/// by their top bit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SkipIds {
    /// The name of the first triangle of a mesh.
    pub first: u32,
    /// Whether each has its own; else, in a flat mesh, where none can hide another, all have the same.
    pub each: bool,
}

impl SkipIds {
    /// The bit that tells triangles from spheres.
    pub const TRIANGLE: u32 = 1 << 31;

    /// The name of a triangle of the mesh.
    #[inline(always)]
    pub const fn of(self, primitive: u32) -> u32 {
        if self.each { self.first + primitive } else { self.first }
    }
}

/// Gives meshes the names of their triangles.
#[derive(Clone, Copy, Debug, Default)]
pub struct SkipIdAllocator {
    given: u32,
}

impl SkipIdAllocator {
    /// How many names there are. All but the last number with the top bit, which is [`NO_SKIP_ID`].
    pub const MOST: u32 = SkipIds::TRIANGLE - 1;

    /// The names of the next mesh, which has so many triangles; `each` says whether each gets its own. `None` where there are not
    /// as many left.
    pub fn next(&mut self, triangles: usize, each: bool) -> Option<SkipIds> {
        let more = if each { u32::try_from(triangles).ok()? } else { 1 };
        let first = SkipIds::TRIANGLE + self.given;
        self.given = self.given.checked_add(more).filter(|&given| given <= Self::MOST)?;
        Some(SkipIds { first, each })
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
    /// A sphere or triangle that does not block visibility queries, or [`NO_SKIP_ID`].
    pub skip_id: L::Bits,
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

#[cfg(test)]
mod tests {
    use super::*;

    /// 2^31 triangles that emit would come round to the names of spheres, and one fewer to that of nothing.
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
