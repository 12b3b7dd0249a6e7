//! Arrays of rays and hits in the layout of the caller.

use crate::embree::Coherence;

/// Object and primitive of rays that hit nothing.
pub const NOTHING: u32 = u32::MAX;

/// Three-component vectors, in one of two layouts.
#[derive(Clone, Copy, Debug)]
pub enum Vectors<'a> {
    /// Rows: an array of shape `(n, 3)`.
    Rows(&'a [[f32; 3]]),
    /// Columns: all `x`, all `y`, all `z`, of equal length.
    Columns([&'a [f32]; 3]),
}

impl<'a> From<&'a [[f32; 3]]> for Vectors<'a> {
    fn from(rows: &'a [[f32; 3]]) -> Self {
        Self::Rows(rows)
    }
}

impl<'a, const N: usize> From<&'a [[f32; 3]; N]> for Vectors<'a> {
    fn from(rows: &'a [[f32; 3]; N]) -> Self {
        Self::Rows(rows)
    }
}

impl<'a> From<&'a Vec<[f32; 3]>> for Vectors<'a> {
    fn from(rows: &'a Vec<[f32; 3]>) -> Self {
        Self::Rows(rows)
    }
}

impl<'a> From<[&'a [f32]; 3]> for Vectors<'a> {
    fn from(columns: [&'a [f32]; 3]) -> Self {
        Self::Columns(columns)
    }
}

impl Vectors<'_> {
    /// Number of vectors; of columns, the length of the shortest.
    pub fn len(&self) -> usize {
        match self {
            Self::Rows(rows) => rows.len(),
            Self::Columns([x, y, z]) => x.len().min(y.len()).min(z.len()),
        }
    }

    /// Whether there are no vectors.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    fn is_even(&self) -> bool {
        match self {
            Self::Rows(_) => true,
            Self::Columns(columns) => columns.iter().all(|column| column.len() == self.len()),
        }
    }

    #[inline(always)]
    pub(super) fn get(&self, at: usize) -> [f32; 3] {
        match self {
            Self::Rows(rows) => rows[at],
            Self::Columns([x, y, z]) => [x[at], y[at], z[at]],
        }
    }
}

/// Rays in the units and coordinates of the scene. They end after `tmax` lengths of their directions, which need not be unit. A ray
/// hits nothing if its direction is 0, if any of its numbers is not finite (`tmax` may be infinite), or if it starts farther from
/// the camera than 2^98 times the farthest shape, which `f32` cannot represent.
#[derive(Clone, Copy, Debug)]
pub struct Rays<'a> {
    pub(super) origins: Vectors<'a>,
    pub(super) directions: Vectors<'a>,
    pub(super) tmax: Option<&'a [f32]>,
    pub(super) coherence: Coherence,
}

impl<'a> Rays<'a> {
    /// Rays of infinite length.
    pub fn new(origins: impl Into<Vectors<'a>>, directions: impl Into<Vectors<'a>>) -> Self {
        Self {
            origins: origins.into(),
            directions: directions.into(),
            tmax: None,
            coherence: Coherence::Incoherent,
        }
    }

    /// The same rays, each ending after `tmax` lengths of its direction.
    #[must_use]
    pub fn within(self, tmax: &'a [f32]) -> Self {
        Self {
            tmax: Some(tmax),
            ..self
        }
    }

    /// The same rays, marked coherent: neighbors in the array have similar paths, like those of neighboring pixels. Affects only
    /// speed.
    #[must_use]
    pub fn coherent(self) -> Self {
        Self {
            coherence: Coherence::Coherent,
            ..self
        }
    }

    /// Number of rays.
    pub fn len(&self) -> usize {
        self.origins.len()
    }

    /// Whether there are no rays.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns an error unless all arrays have the length of the rays.
    pub(super) fn check(&self, answers: &[(&'static str, usize)]) -> Result<(), RaysError> {
        let rays = self.len();
        if !self.origins.is_even() || !self.directions.is_even() {
            return Err(RaysError(
                "the columns of origins or directions differ in length".to_owned(),
            ));
        }
        let asked = [
            ("directions", self.directions.len()),
            ("tmax", self.tmax.map_or(rays, <[f32]>::len)),
        ];
        match asked.iter().chain(answers).find(|(_, length)| *length != rays) {
            Some((name, length)) => Err(RaysError(format!("there are {rays} origins, and {name} has {length}"))),
            None => Ok(()),
        }
    }
}

/// Array lengths do not match; the message says which.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct RaysError(String);

/// Closest hits, ray by ray.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Hits {
    /// Distance in lengths of the direction; infinite if nothing is hit.
    pub t: Vec<f32>,
    /// Unit geometric normal on the side of the ray's origin; 0 if nothing is hit.
    pub normals: Vec<[f32; 3]>,
    /// Barycentric coordinates of the second and third vertex of a triangle; 0 on spheres.
    pub uv: Vec<[f32; 2]>,
    /// Object index: meshes count from 0 in scene order, spheres from the number of meshes on; [`NOTHING`] if nothing is hit.
    pub objects: Vec<u32>,
    /// The triangle of a mesh, 0 for a sphere; [`NOTHING`] if nothing is hit.
    pub primitives: Vec<u32>,
}

/// Destination of [`Hits`]: arrays of the caller, each as long as the rays.
#[derive(Debug)]
pub struct HitsMut<'a> {
    /// Like [`Hits::t`].
    pub t: &'a mut [f32],
    /// Like [`Hits::normals`].
    pub normals: &'a mut [[f32; 3]],
    /// Like [`Hits::uv`].
    pub uv: &'a mut [[f32; 2]],
    /// Like [`Hits::objects`].
    pub objects: &'a mut [u32],
    /// Like [`Hits::primitives`].
    pub primitives: &'a mut [u32],
}
