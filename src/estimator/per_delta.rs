//! Delta lights: the light's single direction. All estimators use it, because no other technique can find a delta light.

use super::ShadingPoint;
use super::per_light::Contribution;
use crate::bsdf::{Brdf, Tint};
use crate::lane::{Lane, Mask};
use crate::light::delta::Arriving;
use crate::math::Vec3;

/// Contribution of a light at each active point; `le` is [`DeltaLight::le`](crate::light::DeltaLight::le). `None` if no lane
/// receives light.
#[inline(always)]
pub fn sample<L: Lane, B: Brdf<L>>(
    point: &ShadingPoint<L, B>,
    le: Vec3<L>,
    arriving: &Arriving<L>,
    active: L::Mask,
) -> Option<Contribution<L>> {
    let (cos_theta, above) = point.above(arriving.wi);
    let active = active & arriving.active & above;
    if active.none() {
        return None;
    }
    let lobe = point.bsdf.eval(arriving.wi, cos_theta);
    let weight = lobe.shape.scaled(arriving.strength);
    let active = active & weight.lit();
    if active.none() {
        return None;
    }
    Some(Contribution {
        active,
        wi: arriving.wi,
        distance: arriving.distance,
        ld: weight.kept(active).colour(le.times(point.bsdf.rho()), le),
    })
}
