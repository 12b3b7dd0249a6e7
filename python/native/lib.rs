//! `octolux._native`: what the Python package `octolux` asks of the library. It checks nothing that the library checks; shapes and
//! types of arrays are the package's own affair. No function holds Python's lock while it computes.

mod errors;
mod picture;
mod prepared;
mod scene;
mod threads;
mod told;

use pyo3::prelude::*;

#[pymodule]
mod _native {
    #[pymodule_export]
    use super::errors::SceneError;
    #[pymodule_export]
    use super::picture::{read, reference, write};
    #[pymodule_export]
    use super::prepared::{Prepared, Run, all_threads};
    #[pymodule_export]
    use super::scene::{Builder, Scene, load};
}
