//! Random delta lights and suns.

use super::Draw;
use crate::study::hunt::lamp::Light;

/// A point light, a spot light or a directional light, about as bright as the other lights.
pub fn delta(draw: &mut Draw<'_>) -> Light {
    let colour = draw.each(|draw| draw.between(0.5, 4.0));
    let down = [draw.between(-0.7, 0.7), -1.0, draw.between(-0.7, 0.7)];
    let kind = draw.pick(&[2, 2, 1, 1]);
    if kind >= 2 {
        let angular_radius = if kind == 2 { 0.0 } else { draw.power(-0.3, 1.5) };
        return Light::Directional {
            direction: down,
            irradiance: colour,
            angular_radius,
        };
    }
    let [x, y, z] = draw.place(2.0);
    let inner = draw.between(0.0, 40.0);
    let angles = [inner, inner + draw.between(0.0, 40.0) + 1.0];
    Light::At {
        position: [x, y + 2.5, z],
        intensity: colour.map(|x| 3.0 * x),
        test_point: (kind == 1).then_some((down, angles)),
    }
}

/// Like [`delta`], of any size and place; sometimes exactly where shapes are.
pub fn wild_delta(draw: &mut Draw<'_>) -> Light {
    let colour = draw.wild_colour(-6.0, 6.0);
    let direction = draw.each(|draw| draw.between(-1.0, 1.0) + 1e-3);
    if draw.chance(0.4) {
        let angular_radius = if draw.chance(0.5) { 0.0 } else { draw.power(-7.0, 1.9) };
        return Light::Directional {
            direction,
            irradiance: colour,
            angular_radius,
        };
    }
    let inner = if draw.chance(0.3) { 0.0 } else { draw.power(-3.0, 2.0) };
    let angles = [inner, inner + draw.power(-6.0, 1.8)];
    Light::At {
        position: draw.wild_place(),
        intensity: colour,
        test_point: draw.chance(0.5).then_some((direction, angles)),
    }
}
