//! Shading points and lights that the tests of strategies share.

use glam::DVec3;
use octolux::bsdf::DiffuseOrPhong;
use octolux::estimator::ShadingPoint;
use octolux::lane::Lane;
use octolux::light::SphereLight;
use octolux::math::Vec3;

pub const RHO: [f32; 3] = [0.9, 0.5, 0.25];

pub fn wide(v: [f32; 3]) -> DVec3 {
    DVec3::from_array(v.map(f64::from))
}

pub fn narrow<L: Lane>(v: DVec3) -> Vec3<L> {
    Vec3::splat(v.to_array().map(|x| x as f32))
}

/// A shading point at the origin under a normal off every axis, seen under an angle of `tilt`. Diffuse where alpha is 1.
pub fn point<L: Lane>(alpha: f64, tilt: f64) -> ShadingPoint<L, DiffuseOrPhong<L>> {
    let n = DVec3::new(0.3, -0.5, 0.8).normalize();
    let wo = n * tilt.cos() + n.cross(DVec3::Y).normalize() * tilt.sin();
    let (n, wo) = (narrow(n), narrow(wo));
    ShadingPoint {
        p: Vec3::zero(),
        ng: n,
        bsdf: DiffuseOrPhong::new(n, wo, Vec3::splat(RHO), L::splat(alpha as f32)),
    }
}

/// A light of `sin(theta_max) = sine` (above 1: from inside), whose direction is `off` from the lobe's axis in units of
/// its own half-angle, and towards the horizon by `dip`.
pub fn light<L: Lane>(point: &ShadingPoint<L, DiffuseOrPhong<L>>, sine: f64, off: f64, dip: f64) -> SphereLight {
    let axis = wide(point.bsdf.axis().lane(0)).normalize();
    let aside = axis.any_orthonormal_vector();
    let angle = off * sine.min(1.0).asin() + dip;
    let center = 5.0 * (axis * angle.cos() + aside * angle.sin());
    SphereLight {
        center: center.to_array().map(|x| x as f32),
        radius: (5.0 * sine) as f32,
        le: [2.0, 3.0, 5.0],
        sphere: 0,
        origin_power: None,
    }
}

/// Sine of the light's half-angle, exponent of the lobe, and the light's place as [`light`] takes it.
pub type Place = (f64, f64, f64, f64);

/// Lights from a sine of 1e-4 (below, single directions are coarser than the cells) to the whole horizon and from
/// inside, and lobes that are wider, as wide and narrower than the light.
pub const LIGHTS: [Place; 16] = [
    // sine, alpha, off, dip
    (1e-4, 1.0, 0.0, 0.3),
    (1e-4, 1e6, 0.5, 0.0),
    (1e-3, 1e6, 0.3, 0.0),
    (1e-3, 2e4, 0.3, 0.0),
    (0.01, 1.0, 0.0, 1.5608),
    (0.01, 1e5, 0.2, 0.0),
    (0.1, 1.5, 0.3, 0.0),
    (0.1, 2000.0, 0.8, 0.0),
    (0.5, 1.0, 0.0, 1.3),
    (0.5, 1.0, 0.0, 1.8),
    (0.5, 30.0, 0.3, 0.0),
    (0.9, 1.0, 0.0, 0.9),
    (0.9, 8.0, 0.3, 0.3),
    (0.9999, 1.0, 0.0, 1.0),
    (1.2, 1.0, 0.0, 0.5),
    (1.2, 12.0, 0.4, 0.0),
];
