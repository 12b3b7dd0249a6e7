//! What a replay reports for each BRDF model.

use super::Found;
use crate::bsdf::{self, Brdf, Tint};
use crate::estimator::density::{Density, Mix, Warp};
use crate::estimator::{ShadingPoint, product};
use crate::light::SphereLight;
use crate::math::Vec3;
use crate::pipeline::kernels::{self, Suited};
use crate::pipeline::lists::Probed;
use crate::pipeline::model;
use crate::pipeline::world::World;
use crate::scene::EstimatorKind;

/// A BRDF model that a replay can report.
pub trait Told: Suited + Probed {
    /// Its name.
    const NAME: &'static str;
    /// The value of [`Point::alpha`](super::Point::alpha).
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

/// How an estimator samples spheres at points of a model.
pub fn of_spheres<M: Told>(estimator: EstimatorKind) -> (Mix, Warp) {
    let of_estimator = kernels::mix(estimator);
    match estimator {
        EstimatorKind::Projected => (M::Projected::of(of_estimator).mix(), M::Projected::WARP),
        EstimatorKind::Product => (M::Product::of(of_estimator).mix(), M::Product::WARP),
        _ => (of_estimator, Warp::Cone),
    }
}

/// Name of the technique that samples a sphere.
pub fn technique<B: Brdf<f32>>(warp: Warp, point: &ShadingPoint<f32, B>, light: &SphereLight) -> &'static str {
    match warp {
        Warp::ProjectedCap => "cap",
        Warp::DiskOrCone if product::clears(point, &light.seen_from(point.p)) => "cap",
        Warp::Cone | Warp::DiskOrCone => "cone",
        Warp::LobeInCap => "lobe",
    }
}

/// Evaluates a sampled direction; `le` is the radiance of the light, 1 if `ld` is a throughput, `None` if unknown.
pub fn found<B: Brdf<f32>>(
    world: &World,
    point: &ShadingPoint<f32, B>,
    (wi, distance): (Vec3<f32>, f32),
    le: Option<[f32; 3]>,
    ld: Vec3<f32>,
    occluded: bool,
) -> Found {
    let cos_theta = point.bsdf.normal().dot(wi);
    let lobe = point.bsdf.eval(wi, cos_theta);
    let f_cos = lobe.shape.colour(point.bsdf.rho(), Vec3::splat([1.0; 3])).lane(0);
    Found {
        pdf: le.and_then(|le| pdf(le, f_cos, ld.lane(0))),
        wi: wi.lane(0),
        cos_theta,
        shape: lobe.shape.colour(Vec3::splat([1.0; 3]), Vec3::splat([1.0; 3])).x,
        brdf_pdf: lobe.pdf,
        distance: world.space.in_scene(distance),
        ld: ld.lane(0),
        occluded,
    }
}

/// `le f_cos / ld`, from the channel with the most light.
fn pdf(le: [f32; 3], f_cos: [f32; 3], ld: [f32; 3]) -> Option<f32> {
    let most = (0..3).max_by(|&a, &b| ld[a].total_cmp(&ld[b]))?;
    let pdf = f64::from(le[most]) * f64::from(f_cos[most]) / f64::from(ld[most]);
    pdf.is_finite().then_some(pdf as f32)
}
