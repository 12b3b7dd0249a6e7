//! Subsampled channels: luminance and chroma (`Y`, `RY`, `BY`), as OpenEXR's `RgbaOutputFile` writes them.
//!
//! `RY = (R - Y) / Y`, `BY = (B - Y) / Y`, with the luminance `Y` of the file's primaries ("Technical Introduction to OpenEXR",
//! Luminance/Chroma Images). Channels are interpolated linearly between samples and constant beyond the last.

use std::io::Cursor;

use exr::block::chunk::{Chunk, CompressedBlock};
use exr::compression::Compression;
use exr::meta::attribute::{ChannelDescription, ChannelList, SampleType};
use exr::meta::header::Header;
use exr::meta::{BlockDescription, MetaData};
use exr::prelude::{IntegerBounds, Vec2};

use super::super::colour::Primaries;
use super::super::{Problem, damaged};
use super::layers::{Kind, Layer};
use crate::texels::Texels;

/// The texels of the data window. The chunk table begins at byte `first`.
pub(super) fn read(
    bytes: &[u8],
    first: u64,
    meta: &MetaData,
    layer: &Layer,
    primaries: Primaries,
) -> Result<Texels, Problem> {
    let header = &meta.headers[layer.part];
    let unusual = |what: &str| Problem::new(what, "save it with the channels R, G and B");
    if meta.headers.len() > 1 || header.blocks != BlockDescription::ScanLines {
        return Err(unusual(
            "has channels of fewer samples than pixels in tiles or in one of several parts",
        ));
    }
    let (data, list) = (header.data_window(), &header.channels.list);
    let (width, height) = (data.size.width(), data.size.height());
    let divides = |c: &ChannelDescription| {
        let Vec2(x, y) = c.sampling;
        let starts = |at: i32, step: usize| i64::from(at).rem_euclid(step as i64) == 0;
        let small = (1..=16).contains(&x) && (1..=16).contains(&y);
        small && width % x == 0 && height % y == 0 && starts(data.position.x(), x) && starts(data.position.y(), y)
    };
    if !list.iter().all(divides) {
        return Err(unusual("has channels whose samples do not divide its data window"));
    }
    let mut planes = [(); 3].map(|()| vec![0.0_f32; width * height]);
    for chunk in chunks(bytes, first, meta)? {
        let CompressedBlock::ScanLine(block) = chunk.compressed_block else {
            return Err(damaged(&"a block is of another kind than the header says"));
        };
        let top = i64::from(block.y_coordinate) - i64::from(data.position.y());
        let lines = header.compression.scan_lines_per_block() as i64;
        if top < 0 || top >= height as i64 || top % lines != 0 {
            return Err(damaged(&"a block lies outside of the data window"));
        }
        let rows = top as usize..(top + lines).min(height as i64) as usize;
        let area = IntegerBounds::new((data.position.x(), block.y_coordinate), (width, rows.len()));
        let samples = decompress(header, block.compressed_pixels_le, area)?;
        let mut rest = &samples[..];
        for y in rows {
            for (channel, described) in list.iter().enumerate() {
                let Vec2(across, down) = described.sampling;
                if y % down != 0 {
                    continue;
                }
                let length = width / across * described.sample_type.bytes_per_sample();
                let (line, after) = rest.split_at(length);
                rest = after;
                let mut row = vec![[0.0_f32; 3]; width / across];
                super::copy(line, described.sample_type, &mut row, 0);
                for (plane, _) in planes
                    .iter_mut()
                    .zip(layer.channels)
                    .filter(|(_, wanted)| *wanted == channel)
                {
                    let places = plane[y * width..][..width].iter_mut().step_by(across);
                    places.zip(&row).for_each(|(place, x)| *place = x[0]);
                }
            }
        }
    }
    for (plane, channel) in planes.iter_mut().zip(layer.channels) {
        let Vec2(across, down) = list[channel].sampling;
        between(plane, width, height, across, down);
    }
    let weights = primaries.to_xyz().map(|xyz| xyz.transpose().y_axis);
    let weights = weights.ok_or_else(|| unusual("names chromaticities that are no colours, which luminance needs"))?;
    let [a, b, c] = &planes;
    let colours = (0..width * height).map(|i| {
        if layer.kind != Kind::Chroma {
            return [a[i], b[i], c[i]];
        }
        let (y, red, blue) = (f64::from(a[i]), f64::from(b[i]), f64::from(c[i]));
        let (red, blue) = ((red + 1.0) * y, (blue + 1.0) * y);
        let green = (y - red * weights.x - blue * weights.z) / weights.y;
        [red, green, blue].map(|x| x as f32)
    });
    Ok(Texels::Single(colours.collect()))
}

/// All chunks of a single-part file, found by its table.
fn chunks(bytes: &[u8], first: u64, meta: &MetaData) -> Result<Vec<Chunk>, Problem> {
    let mut read = Cursor::new(bytes);
    let table = bytes.get(first as usize..).unwrap_or_default();
    let offsets = table.chunks_exact(8).take(meta.headers[0].chunk_count);
    if offsets.len() < meta.headers[0].chunk_count {
        return Err(damaged(&"its table of blocks is cut short"));
    }
    let chunk = |offset: &[u8]| {
        read.set_position(u64::from_le_bytes(offset.try_into().unwrap_or_default()));
        Chunk::read(&mut read, meta).map_err(|error| damaged(&error))
    };
    offsets.map(chunk).collect()
}

/// Decompresses a block into its existing samples, by line and channel. The crate computes the size of a block as if every
/// pixel had all samples, so it gets a header for which that is true.
fn decompress(header: &Header, compressed: Vec<u8>, area: IntegerBounds) -> Result<Vec<u8>, Problem> {
    let lines = area.position.y()..area.position.y() + area.size.height() as i32;
    let of_line = |y: i32| {
        let of_channel = |c: &ChannelDescription| {
            let there = i64::from(y).rem_euclid(c.sampling.y() as i64) == 0;
            usize::from(there) * (area.size.width() / c.sampling.x()) * c.sample_type.bytes_per_sample()
        };
        header.channels.list.iter().map(of_channel).sum::<usize>()
    };
    let length: usize = lines.map(of_line).sum();
    if compressed.len() == length || length == 0 {
        return Ok(compressed);
    }
    let mut like = header.clone();
    let area = match header.compression {
        // Treated as bytes of any meaning: as many as one line of halves.
        Compression::Uncompressed | Compression::RLE | Compression::ZIP1 | Compression::ZIP16 => {
            let half = ChannelDescription::named("half", SampleType::F16);
            like.channels = ChannelList::new([half].into_iter().collect());
            like.layer_size = Vec2(length / 2, 1);
            IntegerBounds::from_dimensions((length / 2, 1))
        }
        Compression::PIZ | Compression::PXR24 | Compression::DWAA(_) | Compression::DWAB(_)
            if length.is_multiple_of(area.size.area()) =>
        {
            like.channels.bytes_per_pixel = length / area.size.area();
            area
        }
        // The crate's B44 codec assumes that every pixel has all samples.
        other => {
            let what = format!("has channels of fewer samples than pixels, compressed by {other}");
            return Err(Problem::new(
                what,
                "save it with the channels R, G and B, or compressed by ZIP",
            ));
        }
    };
    let decompressed = header
        .compression
        .decompress_image_section_from_le(&like, compressed, area, false);
    let decompressed = decompressed.map_err(|error| damaged(&error))?;
    if decompressed.len() < length {
        return Err(damaged(&"a block is too short"));
    }
    Ok(decompressed)
}

/// Fills a plane by interpolation between samples at regular columns and rows.
fn between(plane: &mut [f32], width: usize, height: usize, across: usize, down: usize) {
    let mix = |a: f32, b: f32, step: usize, of: usize| a + (b - a) * (step as f32 / of as f32);
    for y in (0..height).step_by(down) {
        let row = &mut plane[y * width..][..width];
        for x in (0..width).filter(|x| x % across != 0) {
            let (left, right) = (x - x % across, x - x % across + across);
            row[x] = mix(
                row[left],
                row[if right < width { right } else { left }],
                x % across,
                across,
            );
        }
    }
    for y in (0..height).filter(|y| y % down != 0) {
        let (above, below) = (y - y % down, y - y % down + down);
        let below = if below < height { below } else { above };
        for x in 0..width {
            plane[y * width + x] = mix(plane[above * width + x], plane[below * width + x], y % down, down);
        }
    }
}
