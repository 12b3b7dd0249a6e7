//! `uniform` and `brdf`: one direction for the point; what it meets first brings the light.

use super::ShadingPoint;
use crate::bsdf::{Brdf, Tint};
use crate::lane::{Lane, Mask};
use crate::math::elementary::sin_cos_turn;
use crate::math::{Frame, Vec3};
use crate::sampling::{Pair, warp};

/// Which density directions are drawn from.
pub trait Density {
    /// The whole sphere, or else the BRDF's lobe.
    const UNIFORM: bool;
}

/// `1 / 4 pi`.
pub struct Sphere;

/// The BRDF's own lobe.
pub struct Lobe;

impl Density for Sphere {
    const UNIFORM: bool = true;
}
impl Density for Lobe {
    const UNIFORM: bool = false;
}

/// A direction, and what the radiance from it has to be multiplied by.
#[derive(Clone, Copy, Debug)]
pub struct Proposal<L: Lane> {
    /// Lanes with a direction above the surface; elsewhere the contribution is exactly 0.
    pub active: L::Mask,
    /// Unit direction.
    pub wi: Vec3<L>,
    /// `f_cos / pdf`.
    pub throughput: Vec3<L>,
}

/// Draws one direction at each active point; `None` where no lane has one that counts.
#[inline(always)]
pub fn sample<L: Lane, D: Density>(
    point: &ShadingPoint<L, impl Brdf<L>>,
    numbers: Pair<L::Bits>,
    active: L::Mask,
) -> Option<Proposal<L>> {
    let bsdf = &point.bsdf;
    let (u, v) = numbers.unit::<L>();
    let wi = if D::UNIFORM {
        let (sin_phi, cos_phi) = sin_cos_turn(v);
        Frame::about(Vec3::splat([0.0, 0.0, 1.0])).direction(warp::sphere(u), sin_phi, cos_phi)
    } else {
        bsdf.draw(u, v)
    };
    let (cos_theta, above) = point.above(wi);
    let active = active & above;
    if active.none() {
        return None;
    }
    let (weight, active) = if D::UNIFORM {
        let shape = bsdf.eval(wi, cos_theta).shape;
        (
            shape.scaled(L::splat(mutate!(1.0, HemisphereForSphere => 0.5) / warp::SPHERE_PDF)),
            active & shape.lit(),
        )
    } else {
        (bsdf.weight(wi, cos_theta), active)
    };
    if active.none() {
        return None;
    }
    Some(Proposal {
        active,
        wi,
        throughput: weight.colour(bsdf.rho(), Vec3::splat([1.0; 3])),
    })
}
