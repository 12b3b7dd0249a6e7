//! Textures: file contents as linear reflectances.

use super::error::Fault;
use super::files::Files;
use super::picture::{self, Purpose};
use crate::texels::Texels;

/// The texture outside the unit square.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wrap {
    /// The picture repeats.
    Repeat,
    /// The outermost texels continue.
    Clamp,
}

impl Wrap {
    pub(super) const ALL: [Self; 2] = [Self::Repeat, Self::Clamp];

    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::Repeat => "repeat",
            Self::Clamp => "clamp",
        }
    }
}

/// A picture that multiplies a reflectance: linear RGB, finite, not negative; at least one texel.
///
/// The point `(u, v)` of a surface maps to `(u width, (1 - v) height)`, rows counted from the top: `v` points up. Texel centres
/// have the texel's value; between four centres it is interpolated bilinearly.
#[derive(Clone, Debug, PartialEq)]
pub struct Texture {
    /// Texels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Row by row from the top.
    pub texels: Texels,
    /// The behaviour outside the unit square.
    pub wrap: Wrap,
}

/// Reads a picture, and notes about it; `layer` selects one of an EXR file.
pub(super) fn read(
    files: &Files,
    name: &str,
    layer: Option<&str>,
    wrap: Wrap,
) -> Result<(Texture, Vec<String>), Fault> {
    let picture = picture::read(files, Purpose::Texture, name, layer, 1.0)?;
    let texture = Texture {
        width: picture.width,
        height: picture.height,
        texels: picture.texels,
        wrap,
    };
    Ok((texture, picture.notes))
}
