//! Errors of the library as exceptions with sentences.

use octolux::pipeline::SetupError;
use octolux::scene::{InvalidScene, SceneError as Unreadable};
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;

pyo3::create_exception!(
    octolux,
    SceneError,
    PyValueError,
    "A scene that cannot be: `str()` is the sentence with what would do, `subject` the part that is wrong, `remedy` what would do."
);

/// A `SceneError` with its attributes.
pub fn scene_error(py: Python<'_>, what: &str, subject: &str, remedy: &str) -> PyErr {
    let error = SceneError::new_err(format!("{what}; {remedy}"));
    let value = error.value(py);
    match value
        .setattr("subject", subject)
        .and_then(|()| value.setattr("remedy", remedy))
    {
        Ok(()) => error,
        Err(other) => other,
    }
}

/// A scene that a builder refuses.
pub fn invalid(py: Python<'_>, error: &InvalidScene) -> PyErr {
    scene_error(py, &error.to_string(), &error.name(), error.remedy())
}

/// A scene file that cannot be loaded.
pub fn unreadable(py: Python<'_>, error: &Unreadable) -> PyErr {
    scene_error(py, &error.to_string(), &error.path().to_string_lossy(), error.remedy())
}

/// A scene that cannot be rendered so.
pub fn setup(error: &SetupError) -> PyErr {
    match error {
        SetupError::Embree(embree) => PyRuntimeError::new_err(format!("{embree}; {}", embree.remedy())),
        SetupError::Unsupported { what, remedy } => PyValueError::new_err(format!("{what}; {remedy}")),
        SetupError::Threads(_) => PyRuntimeError::new_err(error.to_string()),
    }
}
