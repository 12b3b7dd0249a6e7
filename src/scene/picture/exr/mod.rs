//! OpenEXR: any layer of any part, on its display window, in the primaries of the header.
//!
//! The format: "Technical Introduction to OpenEXR" (openexr.com). The crate `exr` decodes the data window, which is placed in
//! the display window here.

mod chroma;
mod layers;

use std::io::Cursor;

use exr::block::UncompressedBlock;
use exr::block::reader::ChunksReader as _;
use exr::meta::MetaData;
use exr::meta::attribute::{EnvironmentMap, IntegerBounds, SampleType};
use exr::meta::header::Header;
use half::f16;

use super::colour::Primaries;
use super::{Decoded, Problem, Purpose, damaged, room_for};
use crate::texels::Texels;
use layers::{Kind, Layer};

/// Below this many texels halves are converted to singles: memory does not matter, and lookups are faster.
const KEPT_AS_HALF: usize = 1 << 22;

/// Reads one picture of the file.
pub(super) fn read(bytes: &[u8], called: Option<&str>, purpose: Purpose) -> Result<Decoded, Problem> {
    let mut at = Cursor::new(bytes);
    let meta = MetaData::read_from_buffered(&mut at, false).map_err(|error| damaged(&error))?;
    let (layer, note) = layers::choose(&meta.headers, called)?;
    let header = &meta.headers[layer.part];
    if purpose == Purpose::Environment && header.own_attributes.environment_map == Some(EnvironmentMap::Cube) {
        return Err(Problem::new(
            "is a cube map (its attribute envmap says cube)",
            "convert it to longitude and latitude, as OpenEXR's `exrenvmap -l` does",
        ));
    }
    let display = header.shared_attributes.display_window;
    let (width, height) = (display.size.width(), display.size.height());
    let (stored, data) = (header.layer_size.area(), header.data_window());
    room_for(width, height, purpose)?;
    room_for(data.size.width(), data.size.height(), Purpose::Texture)?;
    let types = layer.channels.map(|channel| header.channels.list[channel].sample_type);
    let halves = types.iter().all(|&kind| kind == SampleType::F16);
    let primaries = primaries(header);
    let subsampled = layer
        .channels
        .iter()
        .any(|&c| header.channels.list[c].sampling.area() != 1);
    let texels = if layer.kind == Kind::Chroma || subsampled {
        let first = at.position();
        chroma::read(bytes, first, &meta, &layer, primaries.unwrap_or(super::colour::REC_709))?
    } else if halves && stored.max(width * height) > KEPT_AS_HALF {
        Texels::Half(place(plain(bytes, &layer, stored)?, data, display))
    } else {
        Texels::Single(place(plain(bytes, &layer, stored)?, data, display))
    };
    let texels = match texels {
        Texels::Single(texels) if texels.len() != width * height => Texels::Single(place(texels, data, display)),
        other => other,
    };
    Ok(Decoded {
        width: width as u32,
        height: height as u32,
        texels,
        factors: [1.0; 3],
        primaries,
        neutral: header
            .own_attributes
            .adopted_neutral
            .map(|xy| [xy.x().into(), xy.y().into()]),
        notes: note.into_iter().collect(),
    })
}

fn primaries(header: &Header) -> Option<Primaries> {
    let named = header.shared_attributes.chromaticities?;
    let [red, green, blue, white] =
        [named.red, named.green, named.blue, named.white].map(|xy| [xy.x().into(), xy.y().into()]);
    Some(Primaries {
        red,
        green,
        blue,
        white,
    })
}

/// A number type of stored pictures.
trait Number: Copy + Default {
    fn of_half(x: f16) -> Self;
    fn of_single(x: f32) -> Self;
}

impl Number for f32 {
    fn of_half(x: f16) -> Self {
        x.to_f32()
    }
    fn of_single(x: f32) -> Self {
        x
    }
}

impl Number for f16 {
    fn of_half(x: f16) -> Self {
        x
    }
    fn of_single(x: f32) -> Self {
        Self::from_f32(x)
    }
}

/// The texels of the data window, for channels without subsampling.
fn plain<T: Number>(bytes: &[u8], layer: &Layer, stored: usize) -> Result<Vec<[T; 3]>, Problem> {
    let reader = exr::block::read(Cursor::new(bytes), false).map_err(|error| damaged(&error))?;
    let width = reader.headers()[layer.part].layer_size.width();
    let of_layer = reader.filter_chunks(false, |_, tile, block| {
        block.layer == layer.part && tile.is_largest_resolution_level()
    });
    let mut texels = vec![[T::default(); 3]; stored];
    let put = |meta: &MetaData, block: UncompressedBlock| {
        let columns = block.index.pixel_size.width();
        let left = block.index.pixel_position.x();
        let list = &meta.headers[layer.part].channels.list;
        let mut rest = &block.data[..];
        for y in 0..block.index.pixel_size.height() {
            let start = (block.index.pixel_position.y() + y) * width + left;
            let row = &mut texels[start..start + columns];
            for (channel, described) in list.iter().enumerate() {
                let kind = described.sample_type;
                let (line, after) = rest.split_at(columns * kind.bytes_per_sample());
                rest = after;
                for (colour, _) in (0..3).zip(layer.channels).filter(|(_, wanted)| *wanted == channel) {
                    copy(line, kind, row, colour);
                }
            }
        }
        Ok(())
    };
    let decoded = of_layer.and_then(|chunks| chunks.decompress_parallel(false, put));
    decoded.map_err(|error| damaged(&error))?;
    Ok(texels)
}

/// Copies a line of samples into one channel of a row.
fn copy<T: Number>(line: &[u8], kind: SampleType, row: &mut [[T; 3]], colour: usize) {
    match kind {
        SampleType::F16 => {
            let samples = line.chunks_exact(2).map(|b| f16::from_ne_bytes([b[0], b[1]]));
            row.iter_mut()
                .zip(samples)
                .for_each(|(texel, x)| texel[colour] = T::of_half(x));
        }
        SampleType::F32 => {
            let samples = line
                .chunks_exact(4)
                .map(|b| f32::from_ne_bytes([b[0], b[1], b[2], b[3]]));
            row.iter_mut()
                .zip(samples)
                .for_each(|(texel, x)| texel[colour] = T::of_single(x));
        }
        SampleType::U32 => {
            let samples = line
                .chunks_exact(4)
                .map(|b| u32::from_ne_bytes([b[0], b[1], b[2], b[3]]));
            row.iter_mut()
                .zip(samples)
                .for_each(|(texel, x)| texel[colour] = T::of_single(x as f32));
        }
    }
}

/// Maps the data window to the display window: black where nothing is stored.
fn place<T: Number>(stored: Vec<[T; 3]>, data: IntegerBounds, display: IntegerBounds) -> Vec<[T; 3]> {
    if (data.position, data.size) == (display.position, display.size) {
        return stored;
    }
    let (width, height) = (display.size.width(), display.size.height());
    let mut shown = vec![[T::default(); 3]; width * height];
    let begin = |d: i32, s: i32| (i64::from(d) - i64::from(s)).max(0) as usize;
    // The overlap of the two: its first column in each of them, and its width.
    let (left, from_left) = (
        begin(data.position.x(), display.position.x()),
        begin(display.position.x(), data.position.x()),
    );
    let (top, from_top) = (
        begin(data.position.y(), display.position.y()),
        begin(display.position.y(), data.position.y()),
    );
    let columns = width
        .saturating_sub(left)
        .min(data.size.width().saturating_sub(from_left));
    let rows = height
        .saturating_sub(top)
        .min(data.size.height().saturating_sub(from_top));
    if columns > 0 {
        for row in 0..rows {
            let from = (from_top + row) * data.size.width() + from_left;
            let to = (top + row) * width + left;
            shown[to..to + columns].copy_from_slice(&stored[from..from + columns]);
        }
    }
    shown
}
