//! Pictures on surfaces: what a file says, as linear reflectances.

use std::io::Cursor;
use std::path::Path;

use exr::prelude::{ReadChannels, ReadLayers};

use super::error::Fault;
use super::files::Files;

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
    pub texels: Vec<[f32; 3]>,
    /// What is outside.
    pub wrap: Wrap,
}

/// Reads a PNG, whose numbers are decoded from sRGB, or an EXR, whose numbers are linear.
pub(super) fn read(files: &Files, name: &str, wrap: Wrap) -> Result<Texture, Fault> {
    let fault = |what: String, help: &str| Fault::new(format!("texture \"{name}\" {what}"), help);
    let ending = Path::new(name).extension().unwrap_or_default();
    let read = match ending.to_string_lossy().to_lowercase().as_str() {
        "png" => png,
        "exr" => exr,
        _ => {
            return Err(fault(
                "has an ending that Octolux does not read".to_owned(),
                "save the picture as .png or .exr",
            ));
        }
    };
    let bytes = files.bytes("texture", name)?;
    let (width, height, texels) = read(&bytes).map_err(|error| {
        fault(
            format!("cannot be read: {error}"),
            "the file is damaged or of another kind: save it again",
        )
    })?;
    if let Some(at) = texels
        .iter()
        .position(|t| !t.iter().all(|x| x.is_finite() && *x >= 0.0))
    {
        let (x, y) = (at % width as usize, at / width as usize);
        return Err(fault(
            format!("has {:?} at ({x}, {y})", texels[at]),
            "every texel must be finite and not negative: mend the picture",
        ));
    }
    Ok(Texture {
        width,
        height,
        texels,
        wrap,
    })
}

type Texels = (u32, u32, Vec<[f32; 3]>);

fn png(bytes: &[u8]) -> Result<Texels, String> {
    let picture = image::load_from_memory_with_format(bytes, image::ImageFormat::Png).map_err(|e| e.to_string())?;
    let picture = picture.into_rgb16();
    let texels = picture
        .pixels()
        .map(|texel| texel.0.map(|x| linear(f64::from(x) / 65535.0)));
    Ok((picture.width(), picture.height(), texels.collect()))
}

/// IEC 61966-2-1.
fn linear(x: f64) -> f32 {
    (if x <= 0.04045 {
        x / 12.92
    } else {
        ((x + 0.055) / 1.055).powf(2.4)
    }) as f32
}

fn exr(bytes: &[u8]) -> Result<Texels, String> {
    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .rgb_channels(
            |size, _| (size.width(), vec![[0.0_f32; 3]; size.area()]),
            |(width, texels): &mut (usize, Vec<[f32; 3]>), at, (r, g, b): (f32, f32, f32)| {
                texels[at.y() * *width + at.x()] = [r, g, b];
            },
        )
        .first_valid_layer()
        .all_attributes()
        .from_buffered(Cursor::new(bytes))
        .map_err(|error| error.to_string())?;
    let size = image.layer_data.size;
    Ok((
        size.width() as u32,
        size.height() as u32,
        image.layer_data.channel_data.pixels.1,
    ))
}

#[cfg(test)]
mod tests {
    use super::linear;

    #[test]
    fn srgb_is_decoded() {
        assert_eq!((linear(0.0), linear(1.0)), (0.0, 1.0));
        // The grey card: 18 % is 118 of 255, nearly.
        assert!((linear(118.0 / 255.0) - 0.181).abs() < 1e-3);
    }
}
