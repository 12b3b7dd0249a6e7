//! Effects in `explain`: required ones with evidence, absent ones, and their costs.

use serde::Serialize;

use super::names;
use octolux::pipeline::Prepared;
use octolux::scene::{Effect, Environment, Features, Scene, Surface};
use octolux::study::effect_costs::Costs;

/// An effect with its evidence.
#[derive(Serialize)]
pub struct Found {
    effect: Effect,
    evidence: String,
}

impl Found {
    /// A line of the explanation.
    pub fn line(&self) -> String {
        format!("    {:<17} {}", self.effect.name(), self.evidence)
    }
}

/// Their names, comma-separated.
pub fn names(effects: &[Effect]) -> String {
    let names: Vec<&str> = effects.iter().map(|effect| effect.name()).collect();
    if names.is_empty() {
        "nothing".to_owned()
    } else {
        names.join(", ")
    }
}

/// The effects that a scene requires, with evidence.
pub fn found(scene: &Scene, features: &Features) -> Vec<Found> {
    let effects = features.effects().iter();
    effects
        .map(|effect| Found {
            effect,
            evidence: evidence(scene, features, effect),
        })
        .collect()
}

fn evidence(scene: &Scene, features: &Features, effect: Effect) -> String {
    let count = features.count(effect);
    let of = |count: usize, all: usize, what: &str| format!("{count} of {all} {what}");
    let materials = scene.materials().iter().filter(|m| m.effects().has(effect)).count();
    match effect {
        Effect::Diffuse
        | Effect::Phong
        | Effect::Blend
        | Effect::Ggx
        | Effect::Conductor
        | Effect::OneSided
        | Effect::Textures => format!(
            "{}, on {count} shapes in sight",
            of(materials, scene.materials().len(), "materials")
        ),
        Effect::Spheres | Effect::SphereLights => of(count, scene.spheres().len(), "spheres"),
        Effect::Meshes | Effect::MeshLights | Effect::SmoothNormals | Effect::SmoothTerminator => {
            of(count, scene.meshes().len(), "meshes")
        }
        Effect::ManyLights => match features.placed {
            0 => format!("{count} spheres and triangles emit"),
            placed if placed == count => format!("{count} points and spots emit"),
            _ => format!("{count} spheres, triangles, points and spots emit"),
        },
        Effect::Lens => {
            let lens = scene.camera().lens.map_or((0.0, 0.0), |lens| (lens.radius, lens.focus));
            format!("radius {}, in focus at {}", lens.0, lens.1)
        }
        Effect::Environment => match scene.environment() {
            Some(Environment::Picture(picture)) => {
                format!("a picture of {} x {} texels", picture.width, picture.height)
            }
            _ => "the same radiance from everywhere".to_owned(),
        },
        Effect::DeltaLights | Effect::Suns => of(count, scene.lights().len(), "lights without a shape"),
    }
}

/// The effects that it does not require.
pub fn absent(features: &Features) -> Vec<Effect> {
    Effect::ALL.into_iter().filter(|&e| features.count(e) == 0).collect()
}

/// Notes about parts of the scene without effect.
pub fn notes(scene: &Scene, features: &Features) -> Vec<String> {
    let mut said = Vec::new();
    if features.unseen > 0 {
        said.push(format!(
            "the camera does not see {} of the {} spheres and meshes, so no code is needed for their materials",
            features.unseen, features.bodies
        ));
    }
    let dark = |surface: &Surface| matches!(surface, Surface::Emission(le) if le.max_element() == 0.0);
    let spheres = scene.spheres().iter().map(|s| &s.surface);
    let dark = spheres
        .chain(scene.meshes().iter().map(|m| &m.surface))
        .filter(|s| dark(s))
        .count();
    if dark > 0 {
        said.push(format!("{dark} emissions are 0: no light is sampled for them"));
    }
    for light in scene.lights_below_every_horizon() {
        let name = names::sphere(scene, light);
        said.push(format!("{name} emits, but below the horizon of every surface in sight"));
    }
    for light in scene.lights_with_nothing_between() {
        let name = names::sphere(scene, light);
        said.push(format!("nothing stands between {name} and any surface"));
    }
    said
}

/// The table of costs, line by line.
pub fn cost_lines(costs: &Costs, prepared: &Prepared) -> Vec<String> {
    let mut lines = vec![format!(
        "  cost       {:.1} ns a sample on one thread ({} x {} pixels, {})",
        costs.ns,
        costs.film[0],
        costs.film[1],
        prepared.kernel()
    )];
    for cost in &costs.effects {
        let (name, change) = (cost.effect.name(), cost.other_ns - costs.ns);
        lines.push(if cost.present {
            format!("    without {name:<17} {:6.1} ns ({change:+.1})", cost.other_ns)
        } else {
            let bits = match cost.same_bits {
                Some(true) => "same bits",
                _ => "OTHER BITS",
            };
            // Negative costs are noise of the measurement.
            let change = if change > 0.0 {
                format!("{change:+.1}")
            } else {
                "no cost seen".to_owned()
            };
            format!(
                "    compiled in {name:<13} {:6.1} ns ({change}), unused, {bits}",
                cost.other_ns
            )
        });
    }
    lines
}
