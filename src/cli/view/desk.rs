//! Requests answered without the renderer: the value of a pixel, and one sample step by step.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use octolux::pipeline::{Prepared, Replay, Settings};
use octolux::scene::Scene;
use octolux::settings::Lanes;
use serde_json::{Value, json};

use super::batches::Batches;
use super::board::Board;
use super::message::Ask;
use super::said;
use crate::cli::replay;

/// The current render.
#[derive(Clone, Debug)]
pub struct Shown {
    /// The scene as viewed.
    pub scene: Arc<Scene>,
    /// The picture, or the racers in order.
    pub prepared: Vec<Prepared>,
}

/// The data for answers.
#[derive(Debug)]
pub struct Desk {
    board: Arc<Board>,
    shown: Mutex<Option<Shown>>,
    batches: Mutex<Batches>,
}

impl Desk {
    /// An empty desk.
    pub fn new(board: Arc<Board>) -> Self {
        Self {
            board,
            shown: Mutex::default(),
            batches: Mutex::default(),
        }
    }

    /// Sets the current render.
    pub fn put(&self, shown: Shown) {
        self.batches().clear();
        *self.shown.lock().unwrap_or_else(PoisonError::into_inner) = Some(shown);
    }

    /// The batches for standard errors.
    pub fn batches(&self) -> MutexGuard<'_, Batches> {
        self.batches.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The current render.
    pub fn shown(&self) -> Option<Shown> {
        self.shown.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// The answer to a request, if the desk can answer it.
    pub fn answer(&self, ask: &Ask) -> Option<String> {
        match *ask {
            Ask::Pixel { x, y } => Some(self.pixel(x, y).to_string()),
            Ask::Sample {
                x,
                y,
                pass,
                count,
                layer,
            } => {
                let sample = self.sample([x, y, pass], count, layer);
                Some(sample.map_or_else(|what| said("error", &what), |sample| sample.to_string()))
            }
            _ => None,
        }
    }

    /// Every layer's radiance in full precision, and the picture's standard error.
    fn pixel(&self, x: u32, y: u32) -> Value {
        let look = self.board.look();
        let value = |picture: &octolux::film::Picture| {
            let inside = x < picture.width && y < picture.height;
            inside.then(|| picture.pixels[(y * picture.width + x) as usize])
        };
        let values = look.layers.iter();
        let values = values.map(|layer| json!({ "layer": layer.id, "value": value(&layer.picture) }));
        let first = look
            .layers
            .first()
            .filter(|layer| x < layer.picture.width && y < layer.picture.height);
        let place = first.map(|layer| (y * layer.picture.width + x) as usize);
        json!({
            "kind": "pixel",
            "x": x,
            "y": y,
            "values": values.collect::<Vec<_>>(),
            "standard_error": place.and_then(|place| self.batches().standard_error(place)),
        })
    }

    /// Samples of a pixel from `pass` on.
    fn sample(&self, [x, y, pass]: [u32; 3], count: u32, layer: usize) -> Result<Value, String> {
        let Shown { scene, prepared } = self.shown().ok_or("nothing is rendered yet")?;
        let prepared = prepared.get(layer).ok_or("there is no such picture")?;
        let settings = prepared.settings();
        let replays = one_lane(prepared, count, [x, y, pass])?;
        let point = replays.iter().find_map(|replay| replay.point);
        let first = replays.first().ok_or("no sample")?;
        // Meshes and the environment are not listed one by one, but their rays are.
        let untold = replays.iter().filter(|replay| replay.meshes_untold);
        let rays: Vec<[f32; 3]> = untold
            .flat_map(|replay| &replay.rays)
            .map(|ray| ray.direction)
            .collect();
        Ok(json!({
            "kind": "sample",
            "x": x,
            "y": y,
            "pass": pass,
            "layer": layer,
            "estimator": settings.estimator.name(),
            "sampler": settings.sampler.name(),
            "text": replay::text(first, &scene, prepared.kernel()),
            "caps": point.map_or_else(Vec::new, |point| caps(&scene, point.p)),
            "rays": rays,
            "replays": replays,
        }))
    }

    /// The hit point of the centre of a pixel's first sample, in scene coordinates.
    pub fn met(&self, x: u32, y: u32) -> Option<[f64; 3]> {
        let Shown { scene, prepared } = self.shown()?;
        let replay = one_lane(prepared.first()?, 1, [x, y, 0]).ok()?.pop()?;
        let distance = f64::from(replay.hit?.distance);
        let pinhole = scene.camera().origin.to_array();
        let along = |axis: usize| f64::from(replay.origin[axis]) + f64::from(replay.direction[axis]) * distance;
        Some([0, 1, 2].map(|axis| pinhole[axis] + along(axis)))
    }
}

/// Samples by the scalar kernel, which has the bits of all widths.
fn one_lane(prepared: &Prepared, count: u32, [x, y, pass]: [u32; 3]) -> Result<Vec<Replay>, String> {
    let settings = Settings {
        lanes: Some(Lanes::One),
        ..prepared.settings()
    };
    let prepared = prepared.with_settings(settings).map_err(|error| error.to_string())?;
    let passes = pass..pass.saturating_add(count);
    let one = |pass| {
        let replay = prepared.replay([x, y, pass]).map_err(|error| error.to_string())?;
        replay.ok_or_else(|| format!("there is no pixel {x},{y}"))
    };
    passes.map(one).collect()
}

/// The spherical cap of each emitting sphere seen from a point, which is relative to the pinhole.
fn caps(scene: &Scene, point: [f32; 3]) -> Vec<Value> {
    let pinhole = scene.camera().origin;
    let spheres = scene.spheres().iter().enumerate();
    let emit = spheres.filter(|(_, sphere)| sphere.surface.emits());
    emit.filter_map(|(at, sphere)| {
        let towards = (sphere.center - pinhole).to_array();
        let towards = [0, 1, 2].map(|axis| towards[axis] - f64::from(point[axis]));
        let distance = towards.iter().map(|x| x * x).sum::<f64>().sqrt();
        let sine = sphere.radius / distance;
        // From inside a light covers all directions: no cap.
        (sine < 1.0).then(|| {
            json!({
                "sphere": at,
                "to": towards.map(|x| x / distance),
                "cos": (1.0 - sine * sine).sqrt(),
                "distance": distance,
            })
        })
    })
    .collect()
}
