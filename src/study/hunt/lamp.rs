//! Lights without shape, as data of a recipe.

/// A light.
#[derive(Clone, Debug, PartialEq)]
pub enum Light {
    /// A point light; a spot light if it has angles from its axis.
    At {
        /// Where it is.
        position: [f64; 3],
        /// Radiant intensity.
        intensity: [f64; 3],
        /// The axis of a spot light, and its inner and outer angle in degrees.
        test_point: Option<([f64; 3], [f64; 2])>,
    },
    /// A directional light.
    Directional {
        /// The direction of travel.
        direction: [f64; 3],
        /// Irradiance on a perpendicular surface.
        irradiance: [f64; 3],
        /// Angular radius in degrees; 0 for a single direction.
        angular_radius: f64,
    },
}

impl Light {
    /// Its table in a scene file, with all lengths times `scale`. Intensities scale with the square of lengths, which keeps the
    /// picture.
    pub fn toml(&self, scale: f64) -> String {
        match self {
            Self::At {
                position,
                intensity,
                test_point,
            } => {
                let position = position.map(|x| x * scale);
                let intensity = intensity.map(|x| x * scale * scale);
                let (kind, cone) = match test_point {
                    None => ("point", String::new()),
                    Some((direction, [inner, outer])) => (
                        "spot",
                        format!("direction = {direction:?}\ninner_angle = {inner:?}\nouter_angle = {outer:?}\n"),
                    ),
                };
                format!("[[lights]]\nkind = \"{kind}\"\nposition = {position:?}\nintensity = {intensity:?}\n{cone}")
            }
            Self::Directional {
                direction,
                irradiance,
                angular_radius,
            } => format!(
                "[[lights]]\nkind = \"directional\"\ndirection = {direction:?}\nirradiance = {irradiance:?}\n\
                 angular_radius = {angular_radius:?}\n"
            ),
        }
    }
}
