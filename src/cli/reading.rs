//! Common options for reading scenes.

use std::path::Path;

use super::CliError;
use super::units::degrees;
use octolux::scene::{Fov, Outside, Scene};

/// What a scene may do, and the camera that looks at it.
#[derive(clap::Args, Clone, Copy, Debug)]
pub struct LoadOptions {
    /// Let scenes name files outside of their own folder
    #[arg(long)]
    pub allow_outside: bool,
    /// Where the camera is, instead of the scene's own place
    #[arg(long, value_name = "X,Y,Z", value_parser = point, allow_hyphen_values = true)]
    pub origin: Option<[f64; 3]>,
    /// What the camera looks at
    #[arg(long, value_name = "X,Y,Z", value_parser = point, allow_hyphen_values = true)]
    pub target: Option<[f64; 3]>,
    /// The camera's angle of view in degrees, across the width or the height as in the scene
    #[arg(long, value_name = "DEGREES", value_parser = degrees, allow_negative_numbers = true)]
    pub fov: Option<f64>,
}

impl LoadOptions {
    /// Which files a scene may name.
    pub fn outside(self) -> Outside {
        if self.allow_outside {
            Outside::Allowed
        } else {
            Outside::Refused
        }
    }

    /// Reads the scene at `path`, and applies the camera options.
    ///
    /// # Errors
    /// An error of the scene, and its place.
    pub fn load(self, path: &Path) -> Result<Scene, CliError> {
        let scene = Scene::load_with(path, self.outside()).map_err(CliError::scene)?;
        let Self {
            origin, target, fov, ..
        } = self;
        if (origin, target, fov) == (None, None, None) {
            return Ok(scene);
        }
        let mut turned = scene.to_builder();
        let camera = &mut turned.camera;
        camera.origin = origin.map_or(camera.origin, Into::into);
        camera.target = target.map_or(camera.target, Into::into);
        camera.fov = match (camera.fov, fov) {
            (Fov::X(_), Some(degrees)) => Fov::X(degrees),
            (Fov::Y(_), Some(degrees)) => Fov::Y(degrees),
            (fov, None) => fov,
        };
        turned.build().map_err(|error| CliError::change(&error))
    }

    /// The given options as typed, each with a leading space.
    pub fn given(self) -> String {
        let outside = self.allow_outside.then(|| " --allow-outside".to_owned());
        let place = |name: &str, at: Option<[f64; 3]>| at.map(|[x, y, z]| format!(" --{name}={x},{y},{z}"));
        let fov = self.fov.map(|fov| format!(" --fov {fov}"));
        let all = [outside, place("origin", self.origin), place("target", self.target), fov];
        all.into_iter().flatten().collect()
    }
}

fn point(text: &str) -> Result<[f64; 3], String> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|number| number.trim().parse()).collect();
    let three = numbers.ok().and_then(|numbers| numbers.try_into().ok());
    three
        .filter(|point: &[f64; 3]| point.iter().all(|x| x.is_finite()))
        .ok_or_else(|| "a place is three numbers, such as 0,1.5,-4".to_owned())
}
