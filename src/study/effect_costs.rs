//! The cost of each effect on the user's own scene: single-thread nanoseconds per sample, with and without it.

use std::sync::Arc;

use serde::Serialize;

use crate::pipeline::{Prepared, Settings, SetupError};
use crate::scene::{Bsdf, Effect, Effects, FilmSize, LightClass, Scene};

/// Rounds over all variants in turn, so that other load on the machine affects them alike. The minimum time of each counts.
const ROUNDS: usize = 7;
/// About this many samples a round.
const SAMPLES: u32 = 1 << 17;
/// The longer side of the measured film.
const SIDE: u32 = 192;

/// What one effect costs.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Cost {
    /// The effect.
    pub effect: Effect,
    /// Whether the scene requires it.
    pub present: bool,
    /// Nanoseconds per sample with the effect removed from the scene (if `present`) or compiled in without being required.
    pub other_ns: f64,
    /// Whether the picture kept its bits with the effect compiled in without being required.
    pub same_bits: Option<bool>,
}

/// The cost of a scene, and of each effect that can be added or removed.
#[derive(Clone, Debug, Serialize)]
pub struct Costs {
    /// Nanoseconds per sample with the planned kernel.
    pub ns: f64,
    /// Size of the measured film.
    pub film: [u32; 2],
    /// Effect by effect.
    pub effects: Vec<Cost>,
}

/// The scene without an effect; `None` where that would be a different scene altogether.
fn without(scene: &Scene, effect: Effect) -> Option<Scene> {
    let mut scene = scene.to_builder();
    match effect {
        Effect::Phong => scene.materials.iter_mut().for_each(|m| {
            if let Bsdf::Phong { rho, .. } | Bsdf::Blend { rho, .. } = m.bsdf {
                m.bsdf = Bsdf::Diffuse { rho };
            }
        }),
        Effect::Blend => scene.materials.iter_mut().for_each(|m| {
            if let Bsdf::Blend { rho, .. } = m.bsdf {
                m.bsdf = Bsdf::Diffuse { rho };
            }
        }),
        Effect::Ggx => scene.materials.iter_mut().for_each(|m| {
            if let Bsdf::Ggx { base, .. } = m.bsdf {
                m.bsdf = Bsdf::Diffuse { rho: base };
            }
        }),
        Effect::Conductor => scene.materials.iter_mut().for_each(|m| {
            if let Bsdf::Conductor { .. } = m.bsdf {
                m.bsdf = Bsdf::Diffuse { rho: glam::DVec3::ONE };
            }
        }),
        Effect::OneSided => scene.materials.iter_mut().for_each(|m| m.one_sided = false),
        Effect::SmoothNormals => scene.meshes.iter_mut().map(Arc::make_mut).for_each(|m| {
            m.normals = None;
            m.smooth_terminator = false;
        }),
        Effect::SmoothTerminator => {
            let meshes = scene.meshes.iter_mut().map(Arc::make_mut);
            meshes.for_each(|m| m.smooth_terminator = false);
        }
        Effect::Textures => scene.materials.iter_mut().for_each(|m| m.texture = None),
        Effect::Lens => scene.camera.lens = None,
        Effect::Environment => scene.environment = None,
        Effect::DeltaLights => scene.lights.retain(|light| light.class() != LightClass::Delta),
        Effect::Suns => scene.lights.retain(|light| light.class() != LightClass::Disk),
        _ => return None,
    }
    scene.build().ok()
}

/// Measures all costs; takes a second or two.
///
/// # Errors
/// [`SetupError`] where the scene cannot be rendered with these settings.
pub fn measure(scene: &Scene, settings: Settings) -> Result<Costs, SetupError> {
    let FilmSize { width, height } = settings.film;
    let scale = f64::from(SIDE.min(width.max(height))) / f64::from(width.max(height));
    let shrunk = |side: u32| ((f64::from(side) * scale).round() as u32).max(1);
    let film = FilmSize {
        width: shrunk(width),
        height: shrunk(height),
    };
    let settings = Settings {
        film,
        threads: 1,
        ..settings
    };
    let plan = Prepared::new(scene, settings)?;
    let needs = plan.features().effects();
    let others: Vec<(Effect, Scene, Effects)> = Effect::ALL
        .into_iter()
        .filter_map(|effect| {
            let alone = Effects::of(&[effect]);
            if !needs.has(effect) {
                // An absent effect that `without` cannot remove is not measured.
                without(scene, effect).map(|_| (effect, scene.clone(), alone))
            } else {
                without(scene, effect).map(|scene| (effect, scene, Effects::default()))
            }
        })
        .collect();
    let passes = (SAMPLES / (film.width * film.height)).max(1).next_power_of_two();
    let (mut own, mut times) = (f64::INFINITY, vec![f64::INFINITY; others.len()]);
    let mut same = vec![None; others.len()];
    for _ in 0..ROUNDS {
        let (ns, picture) = timed(scene, settings, Effects::default(), passes)?;
        own = own.min(ns);
        for (i, (effect, scene, held)) in others.iter().enumerate() {
            let (ns, shown) = timed(scene, settings, *held, passes)?;
            times[i] = times[i].min(ns);
            if !needs.has(*effect) {
                same[i] = Some(picture == shown);
            }
        }
    }
    let effects = others.iter().zip(times.iter().zip(&same));
    Ok(Costs {
        ns: own,
        film: [film.width, film.height],
        effects: effects
            .map(|((effect, ..), (&other_ns, &same_bits))| Cost {
                effect: *effect,
                present: needs.has(*effect),
                other_ns,
                same_bits,
            })
            .collect(),
    })
}

/// Nanoseconds per sample, and the bits of the picture.
fn timed(scene: &Scene, settings: Settings, held: Effects, passes: u32) -> Result<(f64, Vec<u32>), SetupError> {
    // Skip the first pass: tables and memory are new.
    let mut run = Prepared::holding(scene, settings, held)?.passes(1).finish();
    let first = run.render_time();
    run.extend(1 + passes);
    let run = run.finish();
    let samples = f64::from(passes) * f64::from(settings.film.width) * f64::from(settings.film.height);
    let ns = (run.render_time() - first).as_secs_f64() * 1e9 / samples;
    let bits = run.picture().pixels.iter().flatten().map(|x| x.to_bits()).collect();
    Ok((ns, bits))
}
