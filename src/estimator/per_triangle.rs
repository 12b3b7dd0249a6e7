//! `light` and `mis` for emissive triangles: samples each triangle, or one triangle of a mesh.

use super::ShadingPoint;
use super::density::Density;
use super::per_light::Contribution;
use crate::bsdf::{Brdf, Lobe, Tint};
use crate::lane::{Lane, Mask};
use crate::light::triangle::View;
use crate::math::Vec3;
use crate::sampling::{Pair, TechniqueSample};

/// Random numbers of a sample.
#[derive(Clone, Copy, Debug)]
pub struct Numbers<L: Lane> {
    /// Lanes that use BRDF sampling, if the density mixes both.
    pub by_brdf_lanes: L::Mask,
    /// First number, in [0, 1).
    pub u: L,
    /// Second number, in [0, 1).
    pub v: L,
}

impl<L: Lane> From<TechniqueSample<L::Bits>> for Numbers<L> {
    #[inline(always)]
    fn from(TechniqueSample { by_brdf_lanes, pair }: TechniqueSample<L::Bits>) -> Self {
        let (u, v) = pair.unit::<L>();
        Self { by_brdf_lanes, u, v }
    }
}

/// Samples one direction at each active point for its triangle and weights it; `None` if no lane receives light. Test
/// [`View::rises_above`] first: a triangle below the horizon cannot be sampled.
///
/// `share` is the probability in (0, 1] with which the triangle was chosen among those of its light, per lane. Directions are
/// sampled as for spheres ([`super::per_light::sample`]).
#[inline(always)]
pub fn sample<L: Lane, D: Density, B: Brdf<L>>(
    density: D,
    point: &ShadingPoint<L, B>,
    view: &View<L>,
    (le, share): (Vec3<L>, L),
    Numbers { by_brdf_lanes, u, v }: Numbers<L>,
    active: L::Mask,
) -> Option<Contribution<L>> {
    let bsdf = &point.bsdf;
    let by_brdf = active & density.mix().by_brdf::<L>(by_brdf_lanes);
    let by_light = active & !by_brdf;
    let (mut wi, mut met) = (Vec3::zero(), L::Mask::splat(false));
    // A packet mostly holds one technique.
    if by_light.any() {
        wi = view.draw(u, v);
        met = by_light & view.met(wi);
    }
    if by_brdf.any() {
        wi = Vec3::select(by_brdf, bsdf.draw(u, v), wi);
        met = met | (by_brdf & view.contains(wi));
    }
    let (cos_theta, above) = point.above(wi);
    let mut active = active & above & met;
    if active.none() {
        return None;
    }
    let lobe = bsdf.eval(wi, cos_theta);
    active = active & lobe.shape.lit();
    if active.none() {
        return None;
    }
    let distance = view.distance(wi);
    let omega = view.inverse_density(wi, distance) / share;
    let weight = density.mix().weight(omega, lobe, by_brdf);
    Some(Contribution {
        active,
        wi,
        distance,
        ld: weight.kept(active).colour(le.times(bsdf.rho()), le),
    })
}

/// A BRDF sample, to be weighted once the triangle that it hits is known.
#[derive(Clone, Copy, Debug)]
pub struct Look<L: Lane> {
    /// Lanes with a direction that may contribute.
    pub active: L::Mask,
    /// Unit direction.
    pub wi: Vec3<L>,
    /// `f_cos`.
    pub f_cos: Vec3<L>,
    /// Density of BRDF sampling, per steradian.
    pub pdf: L,
}

/// Samples the BRDF at each active point.
#[inline(always)]
pub fn look<L: Lane, B: Brdf<L>>(
    point: &ShadingPoint<L, B>,
    numbers: Pair<L::Bits>,
    active: L::Mask,
) -> Option<Look<L>> {
    let bsdf = &point.bsdf;
    let (u, v) = numbers.unit::<L>();
    let wi = bsdf.draw(u, v);
    let (cos_theta, above) = point.above(wi);
    let lobe = bsdf.eval(wi, cos_theta);
    let active = active & above & lobe.shape.lit();
    if active.none() {
        return None;
    }
    Some(Look {
        active,
        wi,
        f_cos: lobe.shape.colour(bsdf.rho(), Vec3::splat([1.0; 3])),
        pdf: lobe.pdf,
    })
}

/// The factor for `f_cos` and the radiance, if a direction with BRDF density `pdf` hits the triangle of `view`, chosen with
/// probability `share`, at `distance`.
#[inline(always)]
pub fn weigh<L: Lane, D: Density>(density: D, view: &View<L>, share: L, wi: Vec3<L>, distance: L, pdf: L) -> L {
    let lobe = Lobe { shape: L::one(), pdf };
    let omega = view.inverse_density(wi, distance) / share;
    density.mix().weight(omega, lobe, L::Mask::splat(true))
}
