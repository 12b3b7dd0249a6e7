//! TEMPORARY stand-in for `Scene::load` and `SceneError`, until the reader of scene files is merged.

use std::path::Path;

use glam::DVec3;

use crate::scene::{Camera, FilmSize, Fov, RenderTable, Scene};

#[derive(Debug, thiserror::Error, miette::Diagnostic)]
#[error("{path}: cannot be read: {source}")]
#[diagnostic(help("give the path of a scene file"))]
pub struct SceneError {
    path: String,
    source: std::io::Error,
}

/// An empty scene of 64 x 48 pixels for every file that is there.
pub fn load(path: &Path) -> Result<Scene, SceneError> {
    let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    std::fs::read(path).map_err(|source| SceneError {
        path: path.display().to_string(),
        source,
    })?;
    Ok(Scene {
        name,
        path: path.to_owned(),
        camera: Camera {
            origin: DVec3::Z,
            target: DVec3::ZERO,
            up: DVec3::Y,
            fov: Fov::X(45.0),
        },
        film: FilmSize { width: 64, height: 48 },
        render: RenderTable::default(),
        materials: Vec::new(),
        spheres: Vec::new(),
        meshes: Vec::new(),
    })
}
