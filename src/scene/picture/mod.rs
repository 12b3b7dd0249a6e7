//! Pictures named by a scene, for textures and environments: file contents as linear Rec. 709.

mod colour;
mod exr;
mod hdr;
mod ordinary;
mod values;

use std::fmt::Display;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use super::error::Fault;
use super::files::Files;
use super::memory;
use crate::texels::Texels;
use colour::{Primaries, REC_709};

/// A problem with a file; `what` follows its name.
type Problem = Fault;

/// The purpose of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Purpose {
    /// Reflectances.
    Texture,
    /// An environment map.
    Environment,
}

impl Purpose {
    /// Its name in errors.
    const fn name(self) -> &'static str {
        match self {
            Self::Texture => "texture",
            Self::Environment => "environment file",
        }
    }

    /// Maximum side, in texels.
    const fn longest_side(self) -> usize {
        match self {
            Self::Texture => 65_536,
            Self::Environment => 16_384,
        }
    }
}

/// A picture ready for a scene: every number finite and not negative, no side 0.
pub(super) struct Picture {
    pub width: u32,
    pub height: u32,
    pub texels: Texels,
    /// Messages for the user, one sentence each.
    pub notes: Vec<String>,
}

/// The decoded contents of a file.
struct Decoded {
    width: u32,
    height: u32,
    texels: Texels,
    /// Factors of the numbers, per channel.
    factors: [f64; 3],
    /// `None` if not given: Rec. 709.
    primaries: Option<Primaries>,
    /// The white point if it differs from that of its primaries.
    neutral: Option<[f64; 2]>,
    notes: Vec<String>,
}

/// Peak memory per texel in bytes during reading.
const BYTES_PER_TEXEL: u64 = 36;

/// Reads the picture `name`: PNG or JPEG, decoded from sRGB; EXR, with `layer` selecting a picture; or Radiance. All numbers
/// are multiplied by `scale`.
pub(super) fn read(
    files: &Files,
    purpose: Purpose,
    name: &str,
    layer: Option<&str>,
    scale: f64,
) -> Result<Picture, Fault> {
    let kind = purpose.name();
    let named = |problem: Problem| Fault::new(format!("{kind} \"{name}\" {}", problem.what), problem.help);
    let ending = Path::new(name)
        .extension()
        .unwrap_or_default()
        .to_string_lossy()
        .to_lowercase();
    if !["exr", "hdr", "pic", "png", "jpg", "jpeg"].contains(&ending.as_str()) {
        return Err(named(Problem::new(
            "has an ending that Octolux does not read",
            "save the picture as .exr, .hdr, .png or .jpg",
        )));
    }
    if layer.is_some() && ending != "exr" {
        return Err(named(Problem::new(
            "has no layers",
            "leave layer out: it belongs to .exr files",
        )));
    }
    let bytes = files.bytes(kind, name)?;
    let decode = || match ending.as_str() {
        "exr" => exr::read(&bytes, layer, purpose),
        "hdr" | "pic" => hdr::read(&bytes, purpose),
        "png" => ordinary::png(&bytes, purpose),
        _ => ordinary::jpeg(&bytes, purpose),
    };
    // Decoders may panic on damaged files: the B44 codec of `exr` 1.74.2 does. That fails the scene, not the program.
    let decoded = catch_unwind(AssertUnwindSafe(decode)).unwrap_or_else(|_| Err(damaged(&"its decoder gave up")));
    drop(bytes);
    let ordinary = ["png", "jpg", "jpeg"].contains(&ending.as_str());
    let mut picture = decoded
        .and_then(|decoded| settle(decoded, purpose, scale))
        .map_err(named)?;
    if ordinary && purpose == Purpose::Environment {
        let what = "is an ordinary picture: its brightest light is white, so that a sun in it lights next to nothing; .exr and .hdr \
            files keep radiances";
        picture.notes.push(what.to_owned());
    }
    picture
        .notes
        .iter_mut()
        .for_each(|note| *note = format!("{kind} \"{name}\": {note}"));
    Ok(picture)
}

/// Converts decoded contents to a picture for a scene.
fn settle(decoded: Decoded, purpose: Purpose, scale: f64) -> Result<Picture, Problem> {
    let Decoded {
        width,
        height,
        texels,
        factors,
        primaries,
        neutral,
        mut notes,
    } = decoded;
    if width == 0 || height == 0 {
        return Err(Problem::new("has no texels", "save it again"));
    }
    let mut texels = scaled(texels, factors.map(|factor| factor * scale));
    let noise = values::settle(&mut texels).map_err(|at| {
        let (x, y) = (at as u32 % width, at as u32 / width);
        let [r, g, b] = texels.at(at);
        match purpose {
            Purpose::Texture => Problem::new(
                format!("has {:?} at ({x}, {y})", [r, g, b]),
                "every texel must be finite and not negative: mend the picture",
            ),
            Purpose::Environment => Problem::new(
                format!("has [{r}, {g}, {b}] at ({x}, {y}) once it is scaled"),
                "every texel must be finite and not negative: mend the picture, or scale it less",
            ),
        }
    })?;
    notes.extend(noise);
    if let Some(named) = primaries.filter(|primaries| !primaries.are(&REC_709)) {
        let matrix = named.to_rec_709(neutral).ok_or_else(|| {
            let what = "names chromaticities (primaries) that no colours can have";
            Problem::new(what, "save it in Rec. 709 without them")
        })?;
        let (converted, outside) = values::convert(&texels, matrix);
        texels = converted;
        let mut note = "converted from its chromaticities (primaries) to Rec. 709".to_owned();
        if outside > 0 {
            note += &format!(", of which {outside} colours are outside: their negative channels are taken as 0");
        }
        notes.push(note);
    }
    Ok(Picture {
        width,
        height,
        texels,
        notes,
    })
}

fn scaled(texels: Texels, factors: [f64; 3]) -> Texels {
    if factors == [1.0; 3] {
        return texels;
    }
    let times = |texel: [f32; 3]| std::array::from_fn(|k| (f64::from(texel[k]) * factors[k]) as f32);
    Texels::Single(match texels {
        Texels::Single(mut texels) => {
            texels.iter_mut().for_each(|texel| *texel = times(*texel));
            texels
        }
        halves @ Texels::Half(_) => halves.iter().map(times).collect(),
    })
}

/// Checks that so many texels may be read.
fn room_for(width: usize, height: usize, purpose: Purpose) -> Result<(), Problem> {
    let longest = purpose.longest_side();
    if width.max(height) > longest {
        let what = format!("is {width} x {height} texels, and {longest} on a side are the most");
        return Err(Problem::new(what, "make it smaller"));
    }
    if !memory::fits((width as u64 * height as u64).saturating_mul(BYTES_PER_TEXEL)) {
        let what = format!("is too large for the memory that is free: {width} x {height} texels");
        return Err(Problem::new(what, "make it smaller, or close other programs"));
    }
    Ok(())
}

/// The problem of a decoder error, in one line.
fn damaged(said: &dyn Display) -> Problem {
    let said = said.to_string();
    let first = said.lines().next().unwrap_or_default();
    Problem::new(
        format!("cannot be read: {first}"),
        "the file is damaged or of another kind: save it again",
    )
}
