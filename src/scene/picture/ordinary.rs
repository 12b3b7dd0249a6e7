//! PNG and JPEG, decoded from sRGB.

use std::io::{BufRead, Cursor, Seek};

use image::codecs::jpeg::JpegDecoder;
use image::codecs::png::PngDecoder;
use image::metadata::Orientation;
use image::{DynamicImage, ImageDecoder, ImageResult, Limits};

use super::{Decoded, Problem, Purpose, damaged, room_for};
use crate::texels::Texels;

/// The exponent of sRGB as PNG writes it, with a tolerance.
const GAMMA: std::ops::Range<f64> = 0.45..0.46;

pub(super) fn png(bytes: &[u8], purpose: Purpose) -> Result<Decoded, Problem> {
    let decoder = PngDecoder::with_limits(Cursor::new(bytes), Limits::no_limits()).map_err(|error| damaged(&error))?;
    let gamma = decoder.gamma_value().ok().flatten();
    let note = gamma.filter(|gamma| !GAMMA.contains(gamma));
    let note = note.map(|gamma| format!("its gamma of {gamma} is not applied: its numbers are read as sRGB"));
    decode(decoder, purpose, note)
}

pub(super) fn jpeg(bytes: &[u8], purpose: Purpose) -> Result<Decoded, Problem> {
    let mut decoder = jpeg_decoder(Cursor::new(bytes)).map_err(|error| damaged(&error))?;
    let turned = !matches!(decoder.orientation(), Ok(Orientation::NoTransforms) | Err(_));
    let note =
        turned.then(|| "it is not turned as its EXIF tag says: its rows are taken as they are stored".to_owned());
    decode(decoder, purpose, note)
}

fn jpeg_decoder<R: BufRead + Seek>(from: R) -> ImageResult<JpegDecoder<R>> {
    let mut decoder = JpegDecoder::new(from)?;
    decoder.set_limits(Limits::no_limits())?;
    Ok(decoder)
}

fn decode(mut decoder: impl ImageDecoder, purpose: Purpose, note: Option<String>) -> Result<Decoded, Problem> {
    let (width, height) = decoder.dimensions();
    room_for(width as usize, height as usize, purpose)?;
    let profile = decoder.icc_profile().ok().flatten().filter(|profile| !is_srgb(profile));
    let profile = profile.map(|_| "its colour profile is not applied: its numbers are read as sRGB".to_owned());
    let picture = DynamicImage::from_decoder(decoder).map_err(|error| damaged(&error))?;
    let has_alpha = picture.color().has_alpha();
    let transparent = has_alpha && picture.to_rgba16().pixels().any(|texel| texel.0[3] < u16::MAX);
    let alpha = transparent.then(|| "its transparency is left out".to_owned());
    let picture = picture.into_rgb16();
    let texels = picture
        .pixels()
        .map(|texel| texel.0.map(|x| linear(f64::from(x) / 65535.0)));
    Ok(Decoded {
        width,
        height,
        texels: Texels::Single(texels.collect()),
        factors: [1.0; 3],
        primaries: None,
        neutral: None,
        notes: note.into_iter().chain(profile).chain(alpha).collect(),
    })
}

/// Whether a profile is sRGB, judged by its description.
fn is_srgb(profile: &[u8]) -> bool {
    let letters: Vec<u8> = profile.iter().copied().filter(|&byte| byte != 0).collect();
    letters.windows(4).any(|word| word.eq_ignore_ascii_case(b"sRGB"))
}

/// IEC 61966-2-1.
fn linear(x: f64) -> f32 {
    (if x <= 0.04045 {
        x / 12.92
    } else {
        ((x + 0.055) / 1.055).powf(2.4)
    }) as f32
}

#[cfg(test)]
mod tests {
    use super::linear;

    #[test]
    fn srgb_is_decoded() {
        assert_eq!((linear(0.0), linear(1.0)), (0.0, 1.0));
        // The grey card: 18 % is about 118 of 255.
        assert!((linear(118.0 / 255.0) - 0.181).abs() < 1e-3);
    }
}
