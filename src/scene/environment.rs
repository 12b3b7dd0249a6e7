//! `[environment]`: the radiance of rays that leave the scene.

use std::sync::Arc;

use glam::DVec3;

use super::error::Fault;
use super::files::Files;
use super::mesh;
use super::picture::{self, Purpose};
use super::rule::POSITIVE;
use super::table::Table;
use super::{Environment, LatLong};

pub(super) const KEYS: &[&str] = &[
    "emission", "file", "layer", "scale", "rotate_x", "rotate_y", "rotate_z", "rotate",
];

/// An environment, and notes about its picture.
pub(super) fn environment(table: &Table<'_>, files: &Files) -> Result<(Environment, Vec<String>), Fault> {
    let help = "write emission = [r, g, b] for the same light from everywhere, or file = \"sky.exr\"";
    let source = table.one_of("emission", "file", help)?;
    if source.key == "emission" {
        for key in ["layer", "scale", "rotate_x", "rotate_y", "rotate_z", "rotate"] {
            if let Some(value) = table.get(key) {
                let help = "it belongs to a picture: leave it out, and write the emission as it should be";
                return Err(value.fault("must not stand beside emission", help));
            }
        }
        let constant = source.triple().map(Environment::Constant)?;
        return Ok((constant, Vec::new()));
    }
    let scale = table.get("scale").map_or(Ok(1.0), |value| value.ruled(&POSITIVE))?;
    let to_scene = mesh::rotations(table)?;
    let name = source.string()?;
    let (span, label) = source.place();
    let layer = table.get("layer").map(|value| value.string()).transpose()?;
    let picture = picture::read(files, Purpose::Environment, name, layer, scale);
    let picture = picture.map_err(|fault| fault.at(span, label))?;
    let environment = LatLong {
        width: picture.width,
        height: picture.height,
        texels: Arc::new(picture.texels),
        to_scene,
    };
    Ok((Environment::Picture(environment), picture.notes))
}

impl Environment {
    /// Whether it emits any light.
    pub fn emits(&self) -> bool {
        match self {
            Self::Constant(le) => le.max_element() > 0.0,
            Self::Picture(picture) => picture.texels.iter().flatten().any(|x| x > 0.0),
        }
    }

    /// The largest radiance of any direction, by channel.
    pub fn brightest(&self) -> DVec3 {
        match self {
            Self::Constant(le) => *le,
            Self::Picture(picture) => {
                let all = picture.texels.iter();
                let all = all.map(|texel| DVec3::from_array(texel.map(f64::from)));
                all.fold(DVec3::ZERO, DVec3::max)
            }
        }
    }
}
