//! Directions sampled for light, and the results.

use serde::Serialize;

/// A sampled direction.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Asked {
    /// The light it was sampled for: its index in the render; for a delta light, the index among the delta lights.
    pub light: Option<usize>,
    /// Kind of the light.
    pub kind: Option<&'static str>,
    /// Index of the light among the spheres of the scene.
    pub sphere: Option<u32>,
    /// `1 - cos` of the half-angle that the light subtends.
    pub one_minus_cos_max: Option<f32>,
    /// Density of sampling the light's cone, per steradian.
    pub cone_pdf: Option<f32>,
    /// Sampling technique.
    pub technique: &'static str,
    /// The direction sampled from the BRDF lobe, even if it hits no light; 0 if it is below the horizon.
    pub lobe: Option<[f32; 3]>,
    /// The result; `None` if the direction cannot contribute.
    pub found: Option<Found>,
}

/// A direction that can contribute.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Found {
    /// Unit direction.
    pub wi: [f32; 3],
    /// Cosine with the shading normal.
    pub cos_theta: f32,
    /// `f cos` in the red channel for reflectance 1.
    pub shape: f32,
    /// Density of BRDF sampling in this direction.
    pub brdf_pdf: f32,
    /// The density that the estimate divides by, per steradian: `le f_cos / ld`. Of estimators that mix two techniques it is what their
    /// weights amount to. `None` for lights that are no spheres, whose radiance may depend on the direction.
    pub pdf: Option<f32>,
    /// Distance to the light.
    pub distance: f32,
    /// The unoccluded contribution; for `uniform` and `brdf`, the throughput.
    pub ld: [f32; 3],
    /// Whether something else is hit before the light; for `uniform` and `brdf`, whether the first hit is no light.
    pub occluded: bool,
}
