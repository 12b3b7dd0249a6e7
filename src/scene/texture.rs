//! Pictures on surfaces: what a file says, as linear reflectances.

use super::error::Fault;
use super::files::Files;
use super::picture::{self, Purpose};
use crate::texels::Texels;

/// What a texture shows outside of the unit square.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wrap {
    /// The picture again and again.
    Repeat,
    /// Its outermost texels.
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

/// A picture that a reflectance is multiplied by: linear RGB, finite, not negative; at least one texel.
///
/// The point `(u, v)` of a surface shows `(u width, (1 - v) height)`, rows counted from the top: `v` points up. The middle of a
/// texel has its own value, between four middles it is their bilinear mean.
#[derive(Clone, Debug, PartialEq)]
pub struct Texture {
    /// Texels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Row by row from the top.
    pub texels: Texels,
    /// What is outside.
    pub wrap: Wrap,
}

/// Reads a picture, and what should be said of it; `layer` chooses one of an EXR file.
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
