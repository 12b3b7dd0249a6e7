//! `light` and `mis` for the environment: one direction for the whole sphere of directions.

use super::ShadingPoint;
use super::density::Density;
use super::per_light::Contribution;
use crate::bsdf::{Brdf, Tint};
use crate::lane::{Lane, Mask};
use crate::light::environment::EnvironmentLight;
use crate::math::Vec3;
use crate::sampling::TechniqueSample;

/// Samples one direction at each active point and weights it; `None` if no lane receives light. The light is infinitely far away;
/// otherwise as for spheres ([`super::per_light::sample`]).
#[inline(always)]
pub fn sample<L: Lane, D: Density, M: Brdf<L>, B: EnvironmentLight>(
    density: D,
    point: &ShadingPoint<L, M>,
    environment: &B,
    technique_sample: TechniqueSample<L::Bits>,
    active: L::Mask,
) -> Option<Contribution<L>> {
    let bsdf = &point.bsdf;
    let by_brdf = active & density.mix().by_brdf::<L>(technique_sample.by_brdf_lanes);
    let by_light = active & !by_brdf;
    let mut wi = Vec3::zero();
    // A packet mostly holds one technique.
    if by_light.any() {
        wi = environment.draw(bsdf.normal(), technique_sample.pair, by_light);
    }
    if by_brdf.any() {
        let (u, v) = technique_sample.pair.unit::<L>();
        wi = Vec3::select(by_brdf, bsdf.draw(u, v), wi);
    }
    let (cos_theta, above) = point.above(wi);
    let active = active & above;
    if active.none() {
        return None;
    }
    let lobe = bsdf.eval(wi, cos_theta);
    let (le, omega) = environment.meet(wi, active & lobe.shape.lit());
    let active = active & (le.x + le.y + le.z).gt(L::zero());
    if active.none() {
        return None;
    }
    Some(Contribution {
        active,
        wi,
        distance: L::splat(f32::INFINITY),
        ld: density
            .mix()
            .weight(omega, lobe, by_brdf)
            .kept(active)
            .colour(le.times(bsdf.rho()), le),
    })
}
