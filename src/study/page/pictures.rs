//! Pictures inside the page: PNG as data URIs.

use std::fmt::Write;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder, ImageError};
use plotters::style::RGBColor;
use plotters::style::colors::colormaps::{ColorMap, ViridisRGB};

use super::html::escape;
use super::words;
use crate::film::srgb;
use crate::study::cost::Study;
use crate::study::cost::strip::{CROP, Frame};

/// Upper end of the error scale: the error equals the pixel's brightness.
const MOST: f64 = 1.0;

/// Lower end of the error scale.
const LEAST: f64 = 0.01;

/// The strip, its scale, and the crops.
///
/// # Errors
/// None expected: PNGs are written into memory.
pub fn strip(study: &Study) -> Result<String, ImageError> {
    let frames = &study.strip.frames;
    let [width, height] = study.film;
    let reference: Vec<[f32; 3]> = study.truth.mean.iter().map(|pixel| pixel.map(|x| x as f32)).collect();
    let gain = gain(&reference);
    let mut html = String::from("<div class=\"strip\">\n");
    for frame in frames {
        let picture = png(&shown(&frame.pixels, gain), width)?;
        let error = png(&colours(&frame.error(&study.truth)), width)?;
        let _ = writeln!(
            html,
            "<figure>{}{}<figcaption><b>{}</b> {} samples a pixel in {}<br>relative MSE {}</figcaption></figure>",
            img(&picture, [width, height], &format!("{} after equal time", frame.label)),
            img(&error, [width, height], &format!("error of {}", frame.label)),
            escape(&frame.label),
            frame.spp,
            words::seconds(frame.seconds).replace(' ', "\u{a0}"),
            words::number(frame.relative_mse),
        );
    }
    html += "</div>\n";
    html += &scale()?;
    if !study.strip.crops.is_empty() {
        html += "<h3>Where they differ most</h3>\n<div class=\"crops\">\n";
        for &at in &study.strip.crops {
            html += &crops(at, frames, &reference, width, gain)?;
        }
        html += "</div>\n";
    }
    Ok(html)
}

/// One window of every frame, and of the reference.
fn crops(
    [left, top]: [u32; 2],
    frames: &[Frame],
    reference: &[[f32; 3]],
    width: u32,
    gain: f32,
) -> Result<String, ImageError> {
    let cut = |pixels: &[[f32; 3]]| {
        let rows = top..top + CROP;
        let cut: Vec<[f32; 3]> = rows
            .flat_map(|y| {
                let start = (y * width + left) as usize;
                pixels[start..start + CROP as usize].to_vec()
            })
            .collect();
        png(&shown(&cut, gain), CROP)
    };
    let named = frames.iter().map(|frame| (frame.label.as_str(), &frame.pixels[..]));
    let mut html = String::from("<div class=\"crop\">\n");
    for (name, pixels) in named.chain([("reference", reference)]) {
        let picture = img(&cut(pixels)?, [CROP, CROP], &format!("{name}, enlarged"));
        let _ = writeln!(
            html,
            "<figure>{picture}<figcaption>{}</figcaption></figure>",
            escape(name)
        );
    }
    Ok(html + "</div>\n")
}

/// The scale of the error pictures.
fn scale() -> Result<String, ImageError> {
    let ramp: Vec<f64> = (0..256)
        .map(|i| LEAST * (MOST / LEAST).powf(f64::from(i) / 255.0))
        .collect();
    let ramp = img(&png(&colours(&ramp), 256)?, [256, 1], "scale of errors");
    Ok(format!(
        "<div class=\"scale\"><span>≤ {}</span>{ramp}<span>≥ {} of the pixel's own brightness</span></div>\n",
        words::exact_percent(LEAST),
        words::exact_percent(MOST)
    ))
}

/// A power of two for the exposure: the 95th percentile is just below white.
fn gain(reference: &[[f32; 3]]) -> f32 {
    let mut values: Vec<f32> = reference.iter().map(|p| p[0].max(p[1]).max(p[2])).collect();
    values.sort_by(f32::total_cmp);
    let bright = values[values.len() * 19 / 20];
    if bright > 0.0 {
        (0.8 / bright).log2().round().clamp(-10.0, 10.0).exp2()
    } else {
        1.0
    }
}

fn shown(pixels: &[[f32; 3]], gain: f32) -> Vec<[u8; 3]> {
    pixels.iter().map(|pixel| pixel.map(|x| srgb(x * gain))).collect()
}

/// Viridis over the logarithm of the error: perceptually uniform, and readable with colour blindness and in print.
fn colours(errors: &[f64]) -> Vec<[u8; 3]> {
    let color = |&error: &f64| {
        let share = (error.max(LEAST) / LEAST).ln() / (MOST / LEAST).ln();
        let RGBColor(r, g, b) = ViridisRGB.get_color(share.min(1.0) as f32);
        [r, g, b]
    };
    errors.iter().map(color).collect()
}

fn img(uri: &str, [width, height]: [u32; 2], about: &str) -> String {
    format!(
        "<img src=\"{uri}\" width=\"{width}\" height=\"{height}\" alt=\"{}\">",
        escape(about)
    )
}

fn png(pixels: &[[u8; 3]], width: u32) -> Result<String, ImageError> {
    let mut file = Vec::new();
    PngEncoder::new_with_quality(&mut file, CompressionType::Best, FilterType::Adaptive).write_image(
        pixels.as_flattened(),
        width,
        pixels.len() as u32 / width,
        ExtendedColorType::Rgb8,
    )?;
    Ok(format!("data:image/png;base64,{}", STANDARD.encode(file)))
}
