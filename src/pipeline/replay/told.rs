//! What a replay tells of each model of reflection.

use crate::bsdf;
use crate::pipeline::model;
use crate::pipeline::rows::Suited;

/// A model that can be told of.
pub trait Told: Suited {
    /// Its name.
    const NAME: &'static str;
    /// What [`Point::alpha`](super::Point::alpha) says.
    fn alpha(bsdf: &Self::Of<f32>) -> f32;
}

impl Told for model::Diffuse {
    const NAME: &'static str = "diffuse";
    fn alpha(_: &bsdf::Diffuse<f32>) -> f32 {
        1.0
    }
}

impl Told for model::Phong {
    const NAME: &'static str = "phong";
    fn alpha(bsdf: &bsdf::Phong<f32>) -> f32 {
        bsdf.alpha
    }
}

impl Told for model::Ggx {
    const NAME: &'static str = "ggx";
    fn alpha(bsdf: &bsdf::Ggx<f32>) -> f32 {
        bsdf.facets.alpha
    }
}

impl Told for model::Conductor {
    const NAME: &'static str = "conductor";
    fn alpha(bsdf: &bsdf::Conductor<f32>) -> f32 {
        bsdf.facets.alpha
    }
}
