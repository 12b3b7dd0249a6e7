//! The scene as viewed: with another camera and other lights, and the text to store these in the file.

use std::sync::Arc;

use serde_json::{Value, json};

use super::message::View;
use crate::cli::names;
use octolux::scene::{Camera, Environment, Fov, InvalidScene, Lens, Scene, Surface};

/// The user's changes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Changes {
    /// The camera.
    pub view: Option<View>,
    /// A factor for each of [`lights`]; missing factors are 1.
    pub gains: Vec<f64>,
}

impl Changes {
    /// The scene with these changes.
    ///
    /// # Errors
    /// A camera without a direction, and other invalid values.
    pub fn of(&self, scene: &Arc<Scene>) -> Result<Arc<Scene>, InvalidScene> {
        if *self == Self::default() {
            return Ok(scene.clone());
        }
        let mut changed = scene.to_builder();
        if let Some(view) = self.view {
            changed.camera = camera(scene.camera(), view);
        }
        let mut gains = self.gains.iter().copied();
        let mut gain = || gains.next().unwrap_or(1.0);
        for sphere in changed.spheres.iter_mut().filter(|sphere| sphere.surface.emits()) {
            dim(&mut sphere.surface, gain());
        }
        for mesh in changed.meshes.iter_mut().filter(|mesh| mesh.surface.emits()) {
            // A mesh may have millions of corners: copy it only if it changes.
            match gain() {
                1.0 => {}
                gain => dim(&mut Arc::make_mut(mesh).surface, gain),
            }
        }
        if let Some(Environment::Constant(le)) = &mut changed.environment {
            *le *= gain();
        }
        for light in changed.lights.iter_mut().filter(|light| light.emits()) {
            *light.power_mut() *= gain();
        }
        changed.build().map(Arc::new)
    }
}

fn dim(surface: &mut Surface, gain: f64) {
    if let Surface::Emission(le) = surface {
        *le *= gain;
    }
}

/// The adjustable lights, for the page.
pub fn lights(scene: &Scene) -> Vec<Value> {
    let one = |name: String, surface: &Surface| match surface {
        Surface::Emission(le) if surface.emits() => Some(json!({ "name": name, "radiance": le.to_array() })),
        _ => None,
    };
    let spheres = scene.spheres().iter().enumerate();
    let spheres = spheres.filter_map(|(at, sphere)| one(names::sphere(scene, at), &sphere.surface));
    let meshes = scene.meshes().iter().enumerate();
    let meshes = meshes.filter(|(_, mesh)| mesh.surface.emits());
    let meshes = meshes.filter_map(|(at, mesh)| one(names::mesh(scene, at), &mesh.surface));
    let sky = match scene.environment() {
        Some(Environment::Constant(le)) => Some(json!({ "name": "environment", "radiance": le.to_array() })),
        _ => None,
    };
    let others = scene.lights().iter().enumerate().filter(|(_, light)| light.emits());
    let others =
        others.map(|(at, light)| json!({ "name": names::light(scene, at), "radiance": light.power().to_array() }));
    spheres.chain(meshes).chain(sky).chain(others).collect()
}

/// The scene's camera with the view of `view`.
fn camera(own: &Camera, view: View) -> Camera {
    let lens = own.lens.map(|lens| Lens {
        focus: view.focus.unwrap_or(lens.focus),
        ..lens
    });
    Camera {
        origin: view.origin.into(),
        target: view.target.into(),
        up: view.up.into(),
        lens,
        ..*own
    }
}

/// The camera for the page.
pub fn told(camera: &Camera) -> Value {
    json!({
        "origin": camera.origin.to_array(),
        "target": camera.target.to_array(),
        "up": camera.up.to_array(),
        "focus": camera.lens.map(|lens| lens.focus),
        "lens": camera.lens.map(|lens| lens.radius),
        "table": table(camera),
        "fov": match camera.fov { Fov::X(fov) => json!({ "x": fov }), Fov::Y(fov) => json!({ "y": fov }) },
    })
}

/// The table `[camera]` for a scene file.
fn table(camera: &Camera) -> String {
    // Six decimals: a micrometre if the unit is a metre.
    let number = |x: f64| {
        let rounded = (x * 1e6).round() / 1e6;
        format!("{:?}", if rounded == 0.0 { 0.0 } else { rounded })
    };
    let triple = |v: [f64; 3]| v.map(number).join(", ");
    let mut lines = vec![
        "[camera]".to_owned(),
        format!("origin = [{}]", triple(camera.origin.to_array())),
        format!("target = [{}]", triple(camera.target.to_array())),
        format!("up = [{}]", triple(camera.up.to_array())),
        match camera.fov {
            Fov::X(fov) => format!("fov_x = {fov:?}"),
            Fov::Y(fov) => format!("fov_y = {fov:?}"),
        },
    ];
    if let Some(lens) = camera.lens {
        lines.push(format!("lens_radius = {:?}", lens.radius));
        lines.push(format!("focus_distance = {}", number(lens.focus)));
    }
    lines.join("\n") + "\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_of_a_camera_reads_back_as_that_camera() {
        let film = "[film]\nwidth = 4\nheight = 3\n";
        let sphere = "[[spheres]]\ncenter = [0, 0, 0]\nradius = 1\nemission = [1, 2, 3]\n";
        let old =
            "[camera]\norigin = [0, 0, 5]\ntarget = [0, 0, 0]\nup = [0, 1, 0]\nfov_y = 30.5\nlens_radius = 0.125\n";
        let scene = Arc::new(Scene::parse(&format!("{old}{film}{sphere}"), "a.toml".as_ref()).unwrap());
        let view = View {
            origin: [1.25, -2.5, 7.0],
            target: [0.5, 0.0, -1e-9],
            up: [0.0, 0.0, 1.0],
            focus: Some(3.75),
        };
        let changes = Changes {
            view: Some(view),
            gains: vec![2.0],
        };
        let changed = changes.of(&scene).unwrap();
        let text = format!("{}{film}{sphere}", table(changed.camera()));
        let back = Scene::parse(&text, "b.toml".as_ref()).unwrap();
        assert_eq!(back.camera().origin.to_array(), view.origin);
        assert_eq!(back.camera().target.to_array(), [0.5, 0.0, 0.0]);
        assert_eq!(back.camera().fov, Fov::Y(30.5));
        assert_eq!(back.camera().lens, changed.camera().lens);
        assert_eq!(lights(&changed)[0]["radiance"], json!([2.0, 4.0, 6.0]));
    }
}
