//! What the hunt learned to draw later: microfacet models, and clouds of lights. Drawn last, so that scenes of older seeds that get
//! neither are what they were.

use super::Draw;
use crate::study::hunt::recipe::{Body, Recipe, Rough, RoughBody, Shape, Surface};

/// A third of the scenes get a microfacet model in place of one that they have, an eighth a cloud of lights.
pub fn ordinary(draw: &mut Draw<'_>, recipe: &mut Recipe) {
    if draw.chance(1.0 / 3.0) {
        let roughness = draw.power(-0.9, 0.0);
        rough(draw, recipe, roughness);
    }
    if draw.chance(1.0 / 8.0) {
        cloud(draw, recipe);
    }
}

/// A third of the scenes get a microfacet model, from mirrors to chalk.
pub fn wild(draw: &mut Draw<'_>, recipe: &mut Recipe) {
    if draw.chance(1.0 / 3.0) {
        let roughness = if draw.chance(0.3) { 1e-4 } else { draw.power(-4.0, 0.0) };
        rough(draw, recipe, roughness);
    }
}

/// Gives one material a microfacet model; its copy without a texture too.
fn rough(draw: &mut Draw<'_>, recipe: &mut Recipe, roughness: f64) {
    let body = if draw.chance(0.5) {
        let metallic = match draw.pick(&[1, 1, 1]) {
            0 => 0.0,
            1 => 1.0,
            _ => draw.between(0.0, 1.0),
        };
        RoughBody::Coated(draw.each(|draw| draw.between(0.1, 0.9)), metallic)
    } else {
        let eta = draw.each(|draw| draw.between(0.1, 3.0));
        RoughBody::Metal(eta, draw.each(|draw| draw.between(0.0, 5.0)))
    };
    let chosen = draw.count(0, 1);
    for number in [chosen, chosen + 3] {
        if let Some(material) = recipe.materials.get_mut(number) {
            (material.diffuse, material.phong) = (None, None);
            material.rough = Some(Rough {
                body: body.clone(),
                roughness,
            });
        }
    }
}

/// More small lights than a pass samples one by one, in a ball above the scene: as a file of lights would have them.
fn cloud(draw: &mut Draw<'_>, recipe: &mut Recipe) {
    let (count, size) = (draw.count(65, 120), draw.between(0.5, 2.0));
    let [x, _, z] = draw.place(1.5);
    let center = [x, 2.0 + size, z];
    let bright = draw.power(0.5, 1.5);
    for _ in 0..count {
        let away = draw.place(size);
        let radius = draw.power(-2.0, -1.0) * size;
        recipe.shapes.push(Shape {
            body: Body::Sphere {
                center: std::array::from_fn(|k| center[k] + away[k]),
                radius,
            },
            surface: Surface::Emission(draw.each(|draw| bright * draw.between(0.5, 1.0))),
        });
    }
}
