//! A delta light: the one direction that its light comes from. All estimators count it so, for no other technique can find it.

use super::ShadingPoint;
use super::per_light::Contribution;
use crate::lane::{Lane, Mask};
use crate::light::DeltaLight;
use crate::light::delta::Arriving;
use crate::math::Vec3;

/// What a light adds at each active point; `None` where no lane gets light by it.
#[inline(always)]
pub fn sample<L: Lane>(
    point: &ShadingPoint<L>,
    light: &DeltaLight,
    arriving: &Arriving<L>,
    active: L::Mask,
) -> Option<Contribution<L>> {
    let (cos_theta, above) = point.above(arriving.wi);
    let active = active & arriving.active & above;
    if active.none() {
        return None;
    }
    let lobe = point.bsdf.eval(arriving.wi, cos_theta);
    let weight = arriving.strength * lobe.shape;
    let active = active & weight.gt(L::zero());
    if active.none() {
        return None;
    }
    Some(Contribution {
        active,
        wi: arriving.wi,
        distance: arriving.distance,
        ld: Vec3::splat(light.le).times(point.bsdf.rho) * weight.or_zero(active),
    })
}
