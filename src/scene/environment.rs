//! `[environment]`: what rays see that leave the scene.

use std::io::Cursor;
use std::sync::Arc;

use glam::{DMat3, DVec3};
use image::{ImageError, ImageFormat, ImageReader};

use super::error::Fault;
use super::files::Files;
use super::mesh;
use super::rule::POSITIVE;
use super::table::Table;
use super::{Environment, LatLong};

pub(super) const KEYS: &[&str] = &["emission", "file", "scale", "rotate_x", "rotate_y", "rotate_z"];

/// The longest side of a picture, in texels.
const LONGEST_SIDE: u32 = 16384;

pub(super) fn environment(table: &Table<'_>, files: &Files) -> Result<Environment, Fault> {
    let help = "write emission = [r, g, b] for the same light from everywhere, or file = \"sky.exr\"";
    let source = table.one_of("emission", "file", help)?;
    if source.key == "emission" {
        for key in ["scale", "rotate_x", "rotate_y", "rotate_z"] {
            if let Some(value) = table.get(key) {
                let help = "it belongs to a picture: leave it out, and write the emission as it should be";
                return Err(value.fault("must not stand beside emission", help));
            }
        }
        return source.triple().map(Environment::Constant);
    }
    let scale = table.get("scale").map_or(Ok(1.0), |value| value.ruled(&POSITIVE))?;
    let to_scene = mesh::rotations(table)?;
    let name = source.string()?;
    let (span, label) = source.place();
    let picture = picture(files, name, scale, to_scene).map_err(|fault| fault.at(span, label))?;
    Ok(Environment::Picture(Arc::new(picture)))
}

fn picture(files: &Files, name: &str, scale: f64, to_scene: DMat3) -> Result<LatLong, Fault> {
    let fault = |what: &str, help: &str| Fault::new(format!("environment file \"{name}\" {what}"), help);
    let ending = name.rsplit('.').next().unwrap_or_default().to_ascii_lowercase();
    let format = match ending.as_str() {
        "exr" => ImageFormat::OpenExr,
        "hdr" => ImageFormat::Hdr,
        _ => return Err(fault("has an ending that is not known", "name a .exr or a .hdr file")),
    };
    let bytes = files.bytes("environment file", name)?;
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    let mut limits = image::Limits::default();
    (limits.max_image_width, limits.max_image_height) = (Some(LONGEST_SIDE), Some(LONGEST_SIDE));
    reader.limits(limits);
    let decoded = reader.decode().map_err(|error| match error {
        ImageError::Limits(_) => fault(
            "is too large",
            "make it smaller: at most 16384 texels on a side, in 512 MiB",
        ),
        other => {
            let said = other.to_string();
            let first = said.lines().next().unwrap_or_default();
            fault(
                &format!("cannot be read: {first}"),
                "save it again as a whole EXR or Radiance HDR file with R, G and B",
            )
        }
    })?;
    let decoded = decoded.into_rgb32f();
    let (width, height) = decoded.dimensions();
    let scaled = |x: f32| (f64::from(x) * scale) as f32;
    let texels: Vec<[f32; 3]> = decoded.pixels().map(|texel| texel.0.map(scaled)).collect();
    let sound = |texel: &[f32; 3]| texel.iter().all(|x| x.is_finite() && *x >= 0.0);
    if let Some(index) = texels.iter().position(|texel| !sound(texel)) {
        let (x, y) = (index as u32 % width, index as u32 / width);
        let [r, g, b] = texels[index];
        let what = format!("has [{r}, {g}, {b}] at ({x}, {y}) once it is scaled");
        return Err(fault(
            &what,
            "every texel must be finite and not negative: mend the picture, or scale it less",
        ));
    }
    if width == 0 || height == 0 {
        return Err(fault("has no texels", "save it again"));
    }
    Ok(LatLong {
        width,
        height,
        texels,
        to_scene,
    })
}

impl Environment {
    /// Whether any light comes from it.
    pub fn emits(&self) -> bool {
        match self {
            Self::Constant(le) => le.max_element() > 0.0,
            Self::Picture(picture) => picture.texels.iter().flatten().any(|&x| x > 0.0),
        }
    }

    /// The largest radiance of any direction, by channel.
    pub fn brightest(&self) -> DVec3 {
        match self {
            Self::Constant(le) => *le,
            Self::Picture(picture) => {
                let all = picture
                    .texels
                    .iter()
                    .map(|texel| DVec3::from_array(texel.map(f64::from)));
                all.fold(DVec3::ZERO, DVec3::max)
            }
        }
    }
}
