//! Models of reflection and lights without shape, as Python tells of them: a name, and numbers in a fixed order.

use glam::DVec3;
use octolux::scene::{Bsdf, Light};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// A name and its numbers.
pub type Told = (String, Vec<f64>);

fn unknown<T>(name: &str, numbers: &[f64]) -> PyResult<T> {
    let count = numbers.len();
    Err(PyValueError::new_err(format!("there is no {name} of {count} numbers")))
}

fn three(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}

/// The model of a surface.
pub fn bsdf((name, numbers): &Told) -> PyResult<Bsdf> {
    Ok(match (name.as_str(), &numbers[..]) {
        ("brdf_params", &[r, g, b, 1.0]) => Bsdf::Diffuse { rho: three(r, g, b) },
        ("brdf_params", &[r, g, b, alpha]) => Bsdf::Phong {
            rho: three(r, g, b),
            alpha,
        },
        ("blend", &[r, g, b, x, y, z, alpha]) => Bsdf::Blend {
            rho: three(r, g, b),
            specular: three(x, y, z),
            alpha,
        },
        ("ggx", &[r, g, b, metallic, roughness]) => Bsdf::Ggx {
            base: three(r, g, b),
            metallic,
            roughness,
        },
        ("conductor", &[r, g, b, x, y, z, roughness]) => Bsdf::Conductor {
            eta: three(r, g, b),
            k: three(x, y, z),
            roughness,
        },
        _ => return unknown(name, numbers),
    })
}

/// A light without shape.
pub fn light(kind: &str, numbers: &[f64]) -> PyResult<Light> {
    Ok(match (kind, numbers) {
        ("point", &[x, y, z, r, g, b]) => Light::point(three(x, y, z), three(r, g, b)),
        ("spot", &[x, y, z, dx, dy, dz, r, g, b, inner_angle, outer_angle]) => Light::Spot {
            position: three(x, y, z),
            direction: three(dx, dy, dz),
            intensity: three(r, g, b),
            inner_angle,
            outer_angle,
        },
        ("directional", &[x, y, z, r, g, b, angular_radius]) => {
            Light::directional(three(x, y, z), three(r, g, b), angular_radius)
        }
        _ => return unknown(kind, numbers),
    })
}

/// What [`light`] makes this light of.
pub fn of_light(light: &Light) -> Told {
    let (kind, triples, angles): (_, Vec<DVec3>, Vec<f64>) = match *light {
        Light::Point { position, intensity } => ("point", vec![position, intensity], vec![]),
        Light::Spot {
            position,
            direction,
            intensity,
            inner_angle,
            outer_angle,
        } => (
            "spot",
            vec![position, direction, intensity],
            vec![inner_angle, outer_angle],
        ),
        Light::Directional {
            direction,
            irradiance,
            angular_radius,
        } => ("directional", vec![direction, irradiance], vec![angular_radius]),
    };
    let triples = triples.iter().flat_map(DVec3::to_array);
    (kind.to_owned(), triples.chain(angles).collect())
}
