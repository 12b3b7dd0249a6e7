//! Shares of lights and materials in the variance.
//!
//! With the same seeds, the pictures of the single lights add up to the picture of all: light is additive, and the directions
//! sampled for one light do not depend on the brightness of others. So the variance of the whole is exactly the sum of the
//! covariances of each part with it, for any estimator: `Var(sum of x) = sum of Cov(x, sum of x)`. The share of a part is its
//! covariance with the whole over the variance of the whole, summed over all pixels and colours. Correlated noise, such as at
//! an edge between two parts, is divided between both; a part that compensates others has a negative share.
//!
//! There are two measures of noise: the mean variance of the pixels, as in `--target-error`, which bright pixels dominate; and
//! relMSE, where each pixel's variance is divided by its squared radiance, closer to perception.
//!
//! Other lights are dimmed by 2^-60 instead of switched off: a light of 0 is not sampled, which would change the random numbers
//! of others. Other materials become black.

use std::cell::Cell;
use std::sync::Arc;

use glam::DVec3;
use serde::Serialize;

use super::{Ended, SEEDS, SPP, render};
use crate::cli::budget_bar::BudgetBar;
use crate::cli::names;
use octolux::film::Picture;
use octolux::pipeline::{Prepared, Settings};
use octolux::run::Goal;
use octolux::scene::{self, Bsdf, Environment, InvalidScene, Scene, SceneBuilder, Surface, Texels};
use octolux::study::error::RELMSE_FLOOR;
use octolux::study::verify::sanity::plural;

/// Maximum number of lights or materials rendered separately; the rest is one part.
const MOST: usize = 12;

/// Factor of the other lights: far below the precision of `f32`, and far above its smallest number.
const DIM: f64 = 1.0 / (1_u64 << 60) as f64;

/// A part and its share.
#[derive(Clone, Debug, Serialize)]
pub struct Part {
    /// Its name.
    pub name: String,
    /// Its share of the variance; the shares of all lights, or of all materials, add up to 1.
    pub share: f64,
    /// The standard error of the share.
    pub uncertainty: f64,
    /// Its share of relMSE, with the same property.
    pub share_of_relmse: f64,
    /// The standard error of this share.
    pub uncertainty_of_relmse: f64,
}

/// The shares of all lights, and of all materials.
#[derive(Default)]
pub struct Parts {
    pub lights: Vec<Part>,
    pub materials: Vec<Part>,
}

/// A light: the index of a sphere, a mesh or a light without shape; or the environment.
#[derive(Clone, Copy, PartialEq)]
enum Light {
    Sphere(usize),
    Mesh(usize),
    Bare(usize),
    Environment,
}

/// The render of one part.
struct Layer {
    name: String,
    scene: Result<Scene, InvalidScene>,
}

impl Parts {
    /// Number of layers to render.
    pub fn count(scene: &Scene) -> usize {
        lights_of(scene).len().min(MOST + 1) + scene.materials().len().min(MOST + 1) + 1
    }

    /// Measures the shares; `whole` are the pictures of all seeds, `begins` is called at the start of each layer.
    pub fn measure<'l>(
        scene: &Scene,
        settings: Settings,
        whole: &[Picture],
        begins: &dyn Fn(usize) -> &'l BudgetBar,
    ) -> Result<Self, Ended> {
        let number = Cell::new(0);
        let pictures = |scene: &Result<Scene, InvalidScene>| -> Result<Option<Vec<Picture>>, Ended> {
            let observer = begins(number.replace(number.get() + 1));
            // Skip a part without which the scene is invalid.
            let Ok(scene) = scene else { return Ok(None) };
            let prepared = Prepared::new(scene, settings)?;
            let all = (0..SEEDS).map(|seed| render(&prepared, Goal::passes(SPP), seed, observer));
            Ok(Some(all.map(|one| Ok(one?.0)).collect::<Result<_, Ended>>()?))
        };
        let (mut lights, mut materials) = (Vec::new(), Vec::new());
        for Layer { name, scene } in light_layers(scene) {
            lights.extend(pictures(&scene)?.map(|part| Part::of(name, &part, whole)));
        }
        // Directly visible emission is in the layer of every material.
        let seen = pictures(&only_materials(scene, &|_| false).build())?;
        for Layer { name, scene } in material_layers(scene) {
            if let (Some(mut part), Some(seen)) = (pictures(&scene)?, &seen) {
                part.iter_mut().zip(seen).for_each(|(part, seen)| subtract(part, seen));
                materials.push(Part::of(name, &part, whole));
            }
        }
        if let Some(seen) = seen {
            let name = "the lights and the environment themselves, where the camera sees them";
            materials.push(Part::of(name.to_owned(), &seen, whole));
        }
        for parts in [&mut lights, &mut materials] {
            parts.sort_by(|a, b| b.share.total_cmp(&a.share));
        }
        Ok(Self { lights, materials })
    }
}

impl Part {
    fn of(name: String, part: &[Picture], whole: &[Picture]) -> Self {
        let [all, relative] = shares(part, whole);
        Self {
            name,
            share: all.0,
            uncertainty: all.1,
            share_of_relmse: relative.0,
            uncertainty_of_relmse: relative.1,
        }
    }
}

fn subtract(from: &mut Picture, what: &Picture) {
    let values = from.pixels.as_flattened_mut().iter_mut();
    values.zip(what.pixels.as_flattened()).for_each(|(x, y)| *x -= y);
}

/// All emitters, the brightest first.
fn lights_of(scene: &Scene) -> Vec<Light> {
    let of = |surface: &Surface| match surface {
        Surface::Emission(le) if surface.emits() => Some(le.element_sum()),
        _ => None,
    };
    let spheres = scene.spheres().iter().enumerate();
    let spheres = spheres.filter_map(|(i, s)| Some((Light::Sphere(i), of(&s.surface)? * s.radius * s.radius)));
    let meshes = scene.meshes().iter().enumerate();
    let meshes = meshes.filter_map(|(i, m)| {
        let corner = |i: u32| m.vertices[i as usize];
        let area = |t: &[u32; 3]| {
            (corner(t[1]) - corner(t[0]))
                .cross(corner(t[2]) - corner(t[0]))
                .length()
                / 2.0
        };
        // The projected area from afar: pi r^2 for a sphere, a quarter of the area on average for a mesh.
        let seen = m.triangles.iter().map(area).sum::<f64>() / (4.0 * std::f64::consts::PI);
        Some((Light::Mesh(i), of(&m.surface)? * seen))
    });
    let sky = scene.environment().filter(|sky| sky.emits());
    let sky = sky.map(|_| (Light::Environment, f64::INFINITY));
    // Lights without shape have no comparable power, so they come first.
    let bare = scene.lights().iter().enumerate().filter(|(_, light)| light.emits());
    let bare = bare.map(|(i, _)| (Light::Bare(i), f64::MAX));
    let mut all: Vec<(Light, f64)> = spheres.chain(meshes).chain(bare).chain(sky).collect();
    all.sort_by(|a, b| b.1.total_cmp(&a.1));
    all.into_iter().map(|(light, _)| light).collect()
}

fn light_layers(scene: &Scene) -> Vec<Layer> {
    let lights = lights_of(scene);
    let (alone, rest) = lights.split_at(lights.len().min(MOST));
    let layer = |name: String, kept: &[Light]| Layer {
        name,
        scene: only_lights(scene, kept).build(),
    };
    let named = |light: &Light| match *light {
        Light::Sphere(i) => names::sphere(scene, i),
        Light::Mesh(i) => names::mesh(scene, i),
        Light::Bare(i) => names::light(scene, i),
        Light::Environment => "environment".to_owned(),
    };
    let mut layers: Vec<Layer> = alone.iter().map(|light| layer(named(light), &[*light])).collect();
    if !rest.is_empty() {
        layers.push(layer(
            format!("the other {} together", plural(rest.len(), "light")),
            rest,
        ));
    }
    layers
}

/// The scene with all lights dimmed except these.
fn only_lights(scene: &Scene, kept: &[Light]) -> SceneBuilder {
    let mut dimmed = scene.to_builder();
    let dim = |surface: &mut Surface| {
        if let Surface::Emission(le) = surface {
            *le *= DIM;
        }
    };
    for (i, sphere) in dimmed.spheres.iter_mut().enumerate() {
        if !kept.contains(&Light::Sphere(i)) {
            dim(&mut sphere.surface);
        }
    }
    for (i, mesh) in dimmed.meshes.iter_mut().enumerate() {
        if !kept.contains(&Light::Mesh(i)) && mesh.surface.emits() {
            dim(&mut Arc::make_mut(mesh).surface);
        }
    }
    for (i, light) in dimmed.lights.iter_mut().enumerate() {
        if !kept.contains(&Light::Bare(i)) {
            match light {
                scene::Light::Point { intensity, .. } | scene::Light::Spot { intensity, .. } => *intensity *= DIM,
                scene::Light::Directional { irradiance, .. } => *irradiance *= DIM,
            }
        }
    }
    if !kept.contains(&Light::Environment) {
        match &mut dimmed.environment {
            None => {}
            Some(Environment::Constant(le)) => *le *= DIM,
            Some(Environment::Picture(picture)) => {
                let dim = |texel: [f32; 3]| texel.map(|x| x * DIM as f32);
                picture.texels = Arc::new(Texels::Single(picture.texels.iter().map(dim).collect()));
            }
        }
    }
    dimmed
}

fn material_layers(scene: &Scene) -> Vec<Layer> {
    let count = scene.materials().len();
    let alone = count.min(MOST);
    let layer = |name: String, kept: &dyn Fn(usize) -> bool| Layer {
        name,
        scene: only_materials(scene, kept).build(),
    };
    let named = |i: usize| format!("material {}", scene.materials()[i].name);
    let mut layers: Vec<Layer> = (0..alone).map(|i| layer(named(i), &|other| other == i)).collect();
    if alone < count {
        layers.push(layer(
            format!("the other {} together", plural(count - alone, "material")),
            &|i| i >= alone,
        ));
    }
    layers
}

/// The scene with all materials black except these.
fn only_materials(scene: &Scene, kept: &dyn Fn(usize) -> bool) -> SceneBuilder {
    let mut black = scene.to_builder();
    for (i, material) in black.materials.iter_mut().enumerate() {
        if !kept(i) {
            (material.bsdf, material.texture) = (Bsdf::Diffuse { rho: DVec3::ZERO }, None);
        }
    }
    black
}

/// A part's shares of the variance of the whole and of its relMSE, from the pictures of all seeds; each with its standard
/// error.
fn shares(part: &[Picture], whole: &[Picture]) -> [(f64, f64); 2] {
    let ratios = covariances(part, whole).into_iter().zip(covariances(whole, whole));
    let ratio = |cov: f64, var: f64| if var > 0.0 { cov / var } else { 0.0 };
    let ratios = ratios.map(|(cov, var)| [0, 1].map(|k| ratio(cov[k], var[k])));
    jackknife(&ratios.collect::<Vec<_>>())
}

/// The covariance of two kinds of pictures with the same seeds, summed over all values: first over all seeds, then with each
/// left out in turn. Unweighted, and over `r^2 + 1e-4` as in relMSE, where `r` is the mean of the second kind.
pub fn covariances(part: &[Picture], whole: &[Picture]) -> Vec<[f64; 2]> {
    let n = whole.len() as f64;
    let mut sums = vec![[0.0; 2]; whole.len() + 1];
    let covariance = |[x, y, xy]: [f64; 3], n: f64| (xy - x * y / n) / (n - 1.0);
    for p in 0..whole[0].pixels.len() {
        for c in 0..3 {
            let of = |seed: usize| {
                let [x, y] = [part, whole].map(|pictures| f64::from(pictures[seed].pixels[p][c]));
                [x, y, x * y]
            };
            let add = |sum: [f64; 3], one: [f64; 3]| [0, 1, 2].map(|k| sum[k] + one[k]);
            let all = (0..whole.len()).map(of).fold([0.0; 3], add);
            let weights = [1.0, 1.0 / ((all[1] / n).powi(2) + RELMSE_FLOOR)];
            let mut put = |at: usize, value: f64| {
                sums[at]
                    .iter_mut()
                    .zip(weights)
                    .for_each(|(sum, weight)| *sum += weight * value);
            };
            put(0, covariance(all, n));
            for seed in 0..whole.len() {
                put(seed + 1, covariance(add(all, of(seed).map(|x| -x)), n - 1.0));
            }
        }
    }
    sums
}

/// Computes a value and its standard error from the value of all seeds and those with each left out (Quenouille and Tukey's
/// jackknife).
pub fn jackknife(values: &[[f64; 2]]) -> [(f64, f64); 2] {
    let without = &values[1..];
    let n = without.len() as f64;
    [0, 1].map(|k| {
        let mean = without.iter().map(|value| value[k]).sum::<f64>() / n;
        let squares: f64 = without.iter().map(|value| (value[k] - mean).powi(2)).sum();
        (values[0][k], (squares * (n - 1.0) / n).sqrt())
    })
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64;

    use super::*;

    /// Independent, nearly normal parts of variances 1, 4 and 0: shares 0.2, 0.8 and 0, which add up to exactly 1; chance
    /// exceeds a bound of 5 standard errors once in a million.
    #[test]
    fn shares_are_those_of_the_variances_and_add_up_to_one() {
        let mut rng = Pcg64::seed_from_u64(23);
        let mut noise = |scale: f32| Picture {
            width: 40,
            height: 25,
            pixels: (0..1000)
                .map(|_| [0; 3].map(|_| scale * ((0..12).map(|_| rng.random::<f32>()).sum::<f32>() - 6.0)))
                .collect(),
        };
        let parts: Vec<[Picture; 3]> = (0..SEEDS).map(|_| [noise(1.0), noise(2.0), noise(0.0)]).collect();
        let of = |k: usize| -> Vec<Picture> { parts.iter().map(|seed| seed[k].clone()).collect() };
        let whole: Vec<Picture> = parts
            .iter()
            .map(|[a, b, c]| Picture {
                pixels: (0..1000)
                    .map(|p| [0, 1, 2].map(|k| a.pixels[p][k] + b.pixels[p][k] + c.pixels[p][k]))
                    .collect(),
                ..a.clone()
            })
            .collect();
        let shares = [0, 1, 2].map(|k| shares(&of(k), &whole)[0]);
        for ((found, error), truth) in shares.into_iter().zip([0.2, 0.8, 0.0]) {
            assert!(
                (found - truth).abs() <= 5.0 * error + 1e-6,
                "{found} +- {error}, not {truth}"
            );
            assert!(error < 0.02);
        }
        let sum: f64 = shares.iter().map(|(share, _)| share).sum();
        assert!((sum - 1.0).abs() < 1e-6, "{sum}");
    }
}
