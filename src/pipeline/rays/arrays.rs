//! Rays and hits as they lie in the arrays of a caller.

use crate::embree::Coherence;

/// What stands for the object and the primitive where a ray meets nothing.
pub const NOTHING: u32 = u32::MAX;

/// Vectors of three numbers as they lie in memory.
#[derive(Clone, Copy, Debug)]
pub enum Vectors<'a> {
    /// One after the other: an array of shape `(n, 3)`.
    Rows(&'a [[f32; 3]]),
    /// All `x`, all `y`, all `z`: columns of one length.
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
    /// How many vectors there are; of columns, the fewest.
    pub fn len(&self) -> usize {
        match self {
            Self::Rows(rows) => rows.len(),
            Self::Columns([x, y, z]) => x.len().min(y.len()).min(z.len()),
        }
    }

    /// Whether there is none.
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

/// Rays in the units and the coordinates of the scene. They start at their origins and end after `tmax` lengths of their directions,
/// which need not be unit. A ray meets nothing if its direction is 0, if a number of it is not finite (`tmax` may be infinite), or if
/// it starts farther from the camera than 2^98 times the farthest shape: single precision cannot hold that.
#[derive(Clone, Copy, Debug)]
pub struct Rays<'a> {
    pub(super) origins: Vectors<'a>,
    pub(super) directions: Vectors<'a>,
    pub(super) tmax: Option<&'a [f32]>,
    pub(super) coherence: Coherence,
}

impl<'a> Rays<'a> {
    /// Rays without an end.
    pub fn new(origins: impl Into<Vectors<'a>>, directions: impl Into<Vectors<'a>>) -> Self {
        Self {
            origins: origins.into(),
            directions: directions.into(),
            tmax: None,
            coherence: Coherence::Incoherent,
        }
    }

    /// The same, with the end of each ray in lengths of its direction.
    #[must_use]
    pub fn within(self, tmax: &'a [f32]) -> Self {
        Self {
            tmax: Some(tmax),
            ..self
        }
    }

    /// The same, where neighbours in the array go the same way, as those of neighbouring pixels. It changes the speed alone.
    #[must_use]
    pub fn coherent(self) -> Self {
        Self {
            coherence: Coherence::Coherent,
            ..self
        }
    }

    /// How many rays there are.
    pub fn len(&self) -> usize {
        self.origins.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Fails unless all arrays have the length of `answers`.
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

/// Arrays whose lengths do not fit together; the message says which.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct RaysError(String);

/// What rays meet first, ray by ray.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Hits {
    /// Distance in lengths of the direction; infinite where nothing is met.
    pub t: Vec<f32>,
    /// Unit geometric normal on the side of the ray's origin; 0 where nothing is met.
    pub normals: Vec<[f32; 3]>,
    /// Barycentric coordinates of the second and third corner of a triangle; 0 on spheres.
    pub uv: Vec<[f32; 2]>,
    /// The object: meshes are counted from 0 in the scene's order, spheres from the number of meshes on; [`NOTHING`] where none is met.
    pub objects: Vec<u32>,
    /// The triangle of a mesh, 0 for a sphere; [`NOTHING`] where none is met.
    pub primitives: Vec<u32>,
}

/// Where [`Hits`] go: arrays of a caller, each as long as there are rays.
#[derive(Debug)]
pub struct HitsMut<'a> {
    /// As [`Hits::t`].
    pub t: &'a mut [f32],
    /// As [`Hits::normals`].
    pub normals: &'a mut [[f32; 3]],
    /// As [`Hits::uv`].
    pub uv: &'a mut [[f32; 2]],
    /// As [`Hits::objects`].
    pub objects: &'a mut [u32],
    /// As [`Hits::primitives`].
    pub primitives: &'a mut [u32],
}
