//! NumPy's format: `height x width x 3`, C order, top row first; written in little-endian f32.

use std::fs::File;
use std::io::{self, BufReader, Write};
use std::path::Path;

use npyz::{DType, NpyFile, Order, TypeStr, WriterBuilder};

use super::{Picture, PictureError};

pub(super) fn write(file: impl Write, picture: &Picture) -> io::Result<()> {
    let little_endian: TypeStr = "<f4".parse().map_err(io::Error::other)?;
    let mut writer = npyz::WriteOptions::<f32>::new()
        .dtype(DType::Plain(little_endian))
        .shape(&[picture.height.into(), picture.width.into(), 3])
        .writer(file)
        .begin_nd()?;
    writer.extend(picture.pixels.as_flattened().iter().copied())?;
    writer.finish()
}

pub(super) fn read(path: &Path) -> Result<Picture, PictureError> {
    let broken = |what: String| PictureError::new(path, what);
    let unreadable = |error: io::Error| PictureError::unreadable(path, &error);
    let file = File::open(path).map_err(unreadable)?;
    let about = file.metadata().map_err(unreadable)?;
    if about.is_dir() {
        return Err(broken("is a folder, not a picture".into()));
    }
    if about.len() == 0 {
        return Err(broken("is empty".into()));
    }
    let array = NpyFile::new(BufReader::new(file)).map_err(|error| broken(format!("is not an NPY array: {error}")))?;
    let &[height, width, 3] = array.shape() else {
        return Err(broken(format!(
            "has the shape {:?}; a picture is height x width x 3",
            array.shape()
        )));
    };
    let dimension = |n: u64| u32::try_from(n).ok().filter(|&n| n > 0);
    let (Some(height), Some(width)) = (dimension(height), dimension(width)) else {
        return Err(broken(format!(
            "has the shape {:?}: not the size of a picture",
            array.shape()
        )));
    };
    if array.order() != Order::C {
        return Err(broken("is in Fortran order".into()).help("save it with numpy.ascontiguousarray"));
    }
    let is = |size: u64| matches!(array.dtype(), DType::Plain(t) if t.type_char() == npyz::TypeChar::Float && t.size_field() == size);
    let (single, double) = (is(4), is(8));
    let item = if double { 8 } else { 4 };
    if !single && !double {
        return Err(broken(format!(
            "holds {}; a picture is f4 or f8",
            array.dtype().descr()
        )));
    }
    // Checked before anything is allocated. The product cannot overflow: 2^32 * 2^32 * 24 < 2^128.
    let needed = u128::from(width) * u128::from(height) * 3 * item;
    if needed > about.len().into() {
        return Err(broken(format!(
            "is cut short: {needed} bytes of pixels are announced, the file has {}",
            about.len()
        )));
    }
    let values: Vec<f32> = if single {
        array.into_vec::<f32>().map_err(unreadable)?
    } else {
        array
            .into_vec::<f64>()
            .map_err(unreadable)?
            .into_iter()
            .map(|value| value as f32)
            .collect()
    };
    let (pixels, _) = values.as_chunks::<3>();
    Ok(Picture {
        width,
        height,
        pixels: pixels.to_vec(),
    })
}
