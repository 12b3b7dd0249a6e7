//! `uniform` and `brdf`: one direction per point; its first hit determines the radiance.

use super::ShadingPoint;
use crate::bsdf::{Brdf, Tint};
use crate::lane::{Lane, Mask};
use crate::math::elementary::sin_cos_turn;
use crate::math::{Frame, Vec3};
use crate::sampling::{Pair, warp};

/// The sampling density.
pub trait Density {
    /// Whether it is uniform over the sphere; otherwise it is the BRDF's lobe.
    const UNIFORM: bool;
}

/// Uniform over the sphere: `1 / 4 pi`.
pub struct Sphere;

/// Proportional to the BRDF's lobe.
pub struct Lobe;

impl Density for Sphere {
    const UNIFORM: bool = true;
}
impl Density for Lobe {
    const UNIFORM: bool = false;
}

/// A sampled direction and its throughput.
#[derive(Clone, Copy, Debug)]
pub struct Proposal<L: Lane> {
    /// Lanes with a direction above the surface; in the others the contribution is exactly 0.
    pub active: L::Mask,
    /// Unit direction.
    pub wi: Vec3<L>,
    /// `f_cos / pdf`.
    pub throughput: Vec3<L>,
}

/// Samples one direction at each active point; `None` if no lane has a contributing one.
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
