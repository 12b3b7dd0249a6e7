//! Pictures and their files.
//!
//! [`write_picture`] and [`read_picture`] choose the format by the file's extension. Each format has one module here;
//! [`replace`] makes writing atomic for all of them.

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

/// Metadata of a picture file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Attributes {
    /// Names with their values; an EXR file stores them as `octolux.NAME`. Names have at most 23 letters, so that even readers
    /// of the first version of the format accept them.
    pub settings: Vec<(String, Value)>,
    /// Exposure of a PNG in stops (factors of 2); EXR and NPY store unchanged radiances.
    pub exposure: f64,
    /// Samples of each pixel, row by row, where they differ; an EXR file stores them as the layer `samples`.
    pub samples: Option<Vec<u32>>,
}

impl Attributes {
    /// Names with their values, with exposure 0.
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
    /// A number; an integer in the range of `i32` is stored as an integer.
    Number(f64),
}

/// The formats by file extension.
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

/// Writes a picture atomically: `.exr` (linear, f32, with its attributes), `.png` (8 bit, sRGB curve) or
/// `.npy` (`height x width x 3`, f32).
///
/// # Errors
/// A sentence about an unknown extension or a file that cannot be written; an older file is then kept.
pub fn write_picture(path: &Path, picture: &Picture, attributes: &Attributes) -> Result<(), PictureError> {
    let format = Format::of(path).ok_or_else(|| unknown_ending(path))?;
    replace::replace(path, |file| match format {
        Format::Exr => exr_file::write(file, picture, attributes),
        Format::Png => png_file::write(file, picture, attributes.exposure),
        Format::Npy => npy_file::write(file, picture),
    })
}

/// Reads a picture from `.npy` (f32 or f64) or `.exr` (`R G B` with any channel type; other channels are ignored).
///
/// # Errors
/// A sentence about a file that is missing, empty, truncated or no picture of that kind.
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

/// Checks before a render whether its picture can be written to `path` afterwards.
///
/// # Errors
/// A sentence about the extension, the folder (missing, not writable) or an existing file.
pub fn check_output(path: &Path) -> Result<(), PictureError> {
    if Format::of(path).is_none() {
        return Err(unknown_ending(path));
    }
    replace::check(path)
}

fn unknown_ending(path: &Path) -> PictureError {
    PictureError::new(path, "a picture ends in .exr, .png or .npy").help("the ending chooses the format")
}
