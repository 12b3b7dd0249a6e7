//! Directions in which a sample asks for light, and what came of them.

use serde::Serialize;

/// A direction that was asked for light.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Asked {
    /// The light that it was drawn for: its place in the order of the render; of a delta light, among the delta lights.
    pub light: Option<usize>,
    /// What kind of light that is.
    pub kind: Option<&'static str>,
    /// The number of this light among the spheres.
    pub sphere: Option<u32>,
    /// `1 - cos` of the half-angle that the light subtends.
    pub one_minus_cos_max: Option<f32>,
    /// The density of the light's cone, per steradian.
    pub cone_pdf: Option<f32>,
    /// How the direction was drawn.
    pub technique: &'static str,
    /// The direction, where it was drawn from the lobe: also one that meets no light, or is below the horizon (then 0).
    pub lobe: Option<[f32; 3]>,
    /// What came of it; nothing where it has no chance to bring light.
    pub found: Option<Found>,
}

/// A direction that can bring light.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Found {
    /// Unit direction.
    pub wi: [f32; 3],
    /// Cosine with the shading normal.
    pub cos_theta: f32,
    /// `f cos` of red where the reflectance is 1.
    pub shape: f32,
    /// Density of the BRDF's own sampling there.
    pub brdf_pdf: f32,
    /// Distance to the light.
    pub distance: f32,
    /// The contribution where nothing is in the way; by `uniform` and `brdf`, what radiance is multiplied by.
    pub ld: [f32; 3],
    /// Whether something else is met before the light; by `uniform` and `brdf`, whether no light is met first.
    pub occluded: bool,
}
