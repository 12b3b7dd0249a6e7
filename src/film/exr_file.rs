//! OpenEXR: linear radiance in 32-bit floats, with all settings of the render.

use std::fs::File;
use std::io::{self, BufRead, BufReader, BufWriter, Read, Seek, SeekFrom, Write};
use std::path::Path;

use exr::meta::header::Header;
use exr::prelude::*;

use super::{Attributes, Picture, PictureError, Value};

/// Deflate compresses at most 1 to 1032. A header that claims more pixels for the size of its file is invalid, and must not
/// cause a large allocation.
const MOST_PIXELS_A_BYTE: u64 = 1032;

/// Writes one part, scan lines, `B G R` in f32 and `samples.N` where samples differ, with lossless ZIP of 16 lines. The samples
/// are f32 too, exact up to 2^24: many readers reject mixed number types.
///
/// A noisy picture of 768 x 512 takes 53 ms and 3.6 MB with ZIP16 (36 ms and 3.8 MB with ZIP1, 72 ms and 3.5 MB with PIZ, 6 ms
/// and 4.7 MB uncompressed; 2 cores): nearly the smallest, and supported by every reader.
pub(super) fn write(file: &mut BufWriter<&File>, picture: &Picture, attributes: &Attributes) -> io::Result<()> {
    let width = picture.width as usize;
    let index = |at: Vec2<usize>| at.y() * width + at.x();
    let rgb = |at: Vec2<usize>| {
        let [r, g, b] = picture.pixels[index(at)];
        (r, g, b)
    };
    let encoding = Encoding {
        compression: Compression::ZIP16,
        blocks: Blocks::ScanLines,
        line_order: LineOrder::Increasing,
    };
    let mut about = LayerAttributes {
        software_name: Some(Text::from(concat!("octolux ", env!("CARGO_PKG_VERSION")))),
        ..LayerAttributes::default()
    };
    for (name, value) in &attributes.settings {
        let name = text(&format!("octolux.{name}"));
        about.other.insert(name, attribute(value));
    }
    let size = (width, picture.height as usize);
    let written = match &attributes.samples {
        None => {
            let layer = Layer::new(size, about, encoding, SpecificChannels::rgb(rgb));
            Image::from_layer(layer).write().to_buffered(&mut *file)
        }
        Some(samples) => {
            let channels = SpecificChannels::build()
                .with_channel::<f32>("R")
                .with_channel::<f32>("G")
                .with_channel::<f32>("B")
                .with_channel::<f32>("samples.N")
                .with_pixel_fn(|at: Vec2<usize>| {
                    let (r, g, b) = rgb(at);
                    (r, g, b, samples[index(at)] as f32)
                });
            let layer = Layer::new(size, about, encoding, channels);
            Image::from_layer(layer).write().to_buffered(&mut *file)
        }
    };
    written.map_err(|error| match error {
        Error::Io(error) => error,
        other => io::Error::other(other.to_string()),
    })?;
    file.flush()?;
    sort_attributes(file.get_ref())
}

/// Sorts the attributes of the single header by name. The crate keeps them in a hash map, so files of the same picture would
/// differ otherwise. Each is a name and the name of its type, both zero-terminated, the length of its value, and the value; an
/// empty name ends the list.
fn sort_attributes(mut file: &File) -> io::Result<()> {
    const MAGIC_AND_VERSION: u64 = 8;
    file.seek(SeekFrom::Start(MAGIC_AND_VERSION))?;
    let mut header = BufReader::new(file);
    let mut attributes = Vec::new();
    loop {
        let mut attribute = Vec::new();
        header.read_until(0, &mut attribute)?;
        if attribute.len() <= 1 {
            break;
        }
        header.read_until(0, &mut attribute)?;
        let mut length = [0; 4];
        header.read_exact(&mut length)?;
        attribute.extend(length);
        let value = u64::from(u32::from_le_bytes(length));
        header.by_ref().take(value).read_to_end(&mut attribute)?;
        attributes.push(attribute);
    }
    attributes.sort();
    file.seek(SeekFrom::Start(MAGIC_AND_VERSION))?;
    file.write_all(&attributes.concat())?;
    file.seek(SeekFrom::End(0)).map(drop)
}

pub(super) fn read(path: &Path) -> std::result::Result<Picture, PictureError> {
    let broken = |what: String| PictureError::new(path, what);
    let unreadable = |error: io::Error| PictureError::unreadable(path, &error);
    let bytes = File::open(path).and_then(|file| file.metadata()).map_err(unreadable)?;
    if bytes.is_dir() {
        return Err(broken("is a folder, not a picture".into()));
    }
    if bytes.len() == 0 {
        return Err(broken("is empty".into()));
    }
    let explain = |error: Error| match error {
        Error::Io(error) => broken(format!("is not a whole EXR picture: {error}")),
        other => broken(format!("is not a whole EXR picture: {other}")),
    };
    let meta = MetaData::read_from_file(path, false).map_err(explain)?;
    for header in &meta.headers {
        let size = header.layer_size;
        if (size.area() as u64) / MOST_PIXELS_A_BYTE > bytes.len() {
            return Err(broken(format!(
                "is cut short: {} x {} pixels are announced, {} bytes are there",
                size.width(),
                size.height(),
                bytes.len()
            )));
        }
    }
    let has_rgb = |header: &Header| {
        ["R", "G", "B"]
            .iter()
            .all(|name| header.channels.find_index_of_channel(&Text::from(*name)).is_some())
    };
    if !meta.headers.iter().any(has_rgb) {
        return Err(broken("has no channels R, G and B".into()));
    }
    let image = exr::image::read::read()
        .no_deep_data()
        .largest_resolution_level()
        .rgb_channels(
            |size, _| (size.width(), vec![[0.0_f32; 3]; size.area()]),
            |(width, pixels), at, (r, g, b): (f32, f32, f32)| pixels[at.y() * *width + at.x()] = [r, g, b],
        )
        .first_valid_layer()
        .all_attributes()
        .from_file(path)
        .map_err(explain)?;
    let size = image.layer_data.size;
    let dimension = |n: usize| u32::try_from(n).map_err(|_| broken(format!("is too large: {n} pixels on a side")));
    Ok(Picture {
        width: dimension(size.width())?,
        height: dimension(size.height())?,
        pixels: image.layer_data.channel_data.pixels.1,
    })
}

fn attribute(value: &Value) -> AttributeValue {
    match value {
        Value::Text(words) => AttributeValue::Text(text(words)),
        Value::Number(number) if number.fract() == 0.0 && number.abs() <= f64::from(i32::MAX) => {
            AttributeValue::I32(*number as i32)
        }
        Value::Number(number) => AttributeValue::F64(*number),
    }
}

/// UTF-8 bytes: the format stores bytes, while the crate's own conversion would refuse a name such as `水.toml`.
fn text(words: &str) -> Text {
    Text::from_slice_unchecked(words.as_bytes())
}
