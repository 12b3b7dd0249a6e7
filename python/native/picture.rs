//! Pictures in files, and those of the oracle.

use std::path::PathBuf;

use numpy::{Element, PyArray1, PyArray3, PyArrayMethods, PyReadonlyArray3, PyUntypedArrayMethods};
use octolux::film::{Attributes, Picture, read_picture, write_picture};
use octolux::scene::FilmSize;
use pyo3::exceptions::PyOSError;
use pyo3::prelude::*;

use crate::scene::Scene;
use crate::threads::detached;

type Array3<'py, T> = Bound<'py, PyArray3<T>>;

/// Pixels as an array `(h, w, 3)`.
pub fn array<'py, T: Element + Copy>(
    py: Python<'py>,
    width: u32,
    height: u32,
    pixels: &[[T; 3]],
) -> PyResult<Array3<'py, T>> {
    PyArray1::from_slice(py, pixels.as_flattened()).reshape([height as usize, width as usize, 3])
}

/// Writes `.exr`, `.png` or `.npy`.
#[pyfunction]
pub fn write(py: Python<'_>, path: PathBuf, pixels: PyReadonlyArray3<'_, f32>, exposure: f64) -> PyResult<()> {
    let shape = pixels.shape();
    let picture = Picture {
        width: u32::try_from(shape[1])?,
        height: u32::try_from(shape[0])?,
        pixels: pixels.as_slice()?.as_chunks().0.to_vec(),
    };
    let attributes = Attributes {
        exposure,
        ..Attributes::default()
    };
    let written = py.detach(|| write_picture(&path, &picture, &attributes));
    written.map_err(|error| PyOSError::new_err(error.to_string()))
}

/// Reads `.exr` or `.npy`.
#[pyfunction]
pub fn read(py: Python<'_>, path: PathBuf) -> PyResult<Array3<'_, f32>> {
    let picture = py.detach(|| read_picture(&path));
    let picture = picture.map_err(|error| PyOSError::new_err(error.to_string()))?;
    array(py, picture.width, picture.height, &picture.pixels)
}

/// The oracle's mean and standard error of each pixel.
#[pyfunction]
pub fn reference<'py>(
    py: Python<'py>,
    scene: &Scene,
    size: (u32, u32),
    spp: u32,
    seed: u64,
) -> PyResult<(Array3<'py, f64>, Array3<'py, f64>)> {
    let film = FilmSize {
        width: size.0,
        height: size.1,
    };
    let oracle = detached(py, || {
        octolux::reference::render(&scene.0, film, spp.max(1), seed, &|_| ())
    })?;
    let of = |pixels: &[[f64; 3]]| array(py, film.width, film.height, pixels);
    Ok((of(&oracle.picture)?, of(&oracle.stderr)?))
}
