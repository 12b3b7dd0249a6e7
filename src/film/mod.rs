//! Pictures: what comes out, and the files that hold them.
//!
//! [`write_picture`] and [`read_picture`] choose the format by the file's ending; each format has one file here and
//! knows nothing of files that stand half-written: [`replace`] sees to that.

pub mod allocation;
mod chunk_sum;
mod error;
mod exr_file;
mod npy_file;
pub mod picture;
mod png_file;
pub mod replace;
mod sums;
pub mod sums_file;
mod tree;

use std::path::Path;

use serde::{Deserialize, Serialize};

pub use allocation::Noise;
pub use chunk_sum::ChunkSum;
pub use error::PictureError;
pub use picture::Picture;
pub use png_file::encode as srgb;
pub use sums::{Film, TILE, Tile, leaf_passes};
pub use tree::{Node, TileSum, Tree};

/// What a picture file says about its own making.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Attributes {
    /// Names with their values; an EXR file keeps them all, as `octolux.NAME`. Names have at most 23 letters, so that
    /// even readers of the first version of the format take them.
    pub settings: Vec<(String, Value)>,
    /// Stops by which a PNG is brightened (2 to that power); EXR and NPY keep the radiances as they are.
    pub exposure: f64,
    /// Samples of each pixel, row by row, where they differ; an EXR file keeps them as the layer `samples`.
    pub samples: Option<Vec<u32>>,
}

impl Attributes {
    /// Names with their values, and no exposure.
    pub fn new<N: Into<String>>(settings: impl IntoIterator<Item = (N, Value)>) -> Self {
        Self {
            settings: settings.into_iter().map(|(name, value)| (name.into(), value)).collect(),
            ..Self::default()
        }
    }
}

/// The value of one attribute.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Value {
    /// Words, in UTF-8.
    Text(String),
    /// A number; a whole one in the range of `i32` becomes an integer in the file.
    Number(f64),
}

/// The formats, by the ending of the file's name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Format {
    Exr,
    Png,
    Npy,
}

impl Format {
    fn of(path: &Path) -> Option<Self> {
        match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
            "exr" => Some(Self::Exr),
            "png" => Some(Self::Png),
            "npy" => Some(Self::Npy),
            _ => None,
        }
    }
}

/// Writes a picture whole or not at all: `.exr` (linear, f32, with its attributes), `.png` (8 bit, sRGB curve) or
/// `.npy` (`height x width x 3`, f32).
///
/// # Errors
/// A sentence about an ending that is none of these or a file that cannot be written; the old file then still stands.
pub fn write_picture(path: &Path, picture: &Picture, attributes: &Attributes) -> Result<(), PictureError> {
    let format = Format::of(path).ok_or_else(|| unknown_ending(path))?;
    replace::replace(path, |file| match format {
        Format::Exr => exr_file::write(file, picture, attributes),
        Format::Png => png_file::write(file, picture, attributes.exposure),
        Format::Npy => npy_file::write(file, picture),
    })
}

/// Reads a picture from `.npy` (f32 or f64) or `.exr` (`R G B` in any type of channel; others are left aside).
///
/// # Errors
/// A sentence about a file that is missing, empty, cut short or no picture of that kind.
pub fn read_picture(path: &Path) -> Result<Picture, PictureError> {
    match Format::of(path) {
        Some(Format::Exr) => exr_file::read(path),
        Some(Format::Npy) => npy_file::read(path),
        Some(Format::Png) => Err(
            PictureError::new(path, "a PNG has lost its radiances and cannot be read back")
                .help("give the .exr or .npy file of the same picture"),
        ),
        None => Err(PictureError::new(path, "a picture to read ends in .exr or .npy")),
    }
}

/// Looks before a render whether its picture can be written to `path` afterwards.
///
/// # Errors
/// A sentence about the ending, the folder (missing, not writable) or what already stands there.
pub fn check_output(path: &Path) -> Result<(), PictureError> {
    if Format::of(path).is_none() {
        return Err(unknown_ending(path));
    }
    replace::check(path)
}

fn unknown_ending(path: &Path) -> PictureError {
    PictureError::new(path, "a picture ends in .exr, .png or .npy").help("the ending chooses the format")
}
