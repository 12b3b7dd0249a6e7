//! Lights that are no shapes, as data of a recipe.

/// A light.
#[derive(Clone, Debug, PartialEq)]
pub enum Light {
    /// A point, or a spot where there are angles from its axis.
    At {
        /// Where it is.
        position: [f64; 3],
        /// Radiant intensity.
        intensity: [f64; 3],
        /// The axis of a spot, and its inner and outer angle in degrees.
        test_point: Option<([f64; 3], [f64; 2])>,
    },
    /// Light from far away.
    Directional {
        /// Where it goes.
        direction: [f64; 3],
        /// Irradiance on what faces it.
        irradiance: [f64; 3],
        /// Degrees; 0 for one direction.
        angular_radius: f64,
    },
}

impl Light {
    /// Its table of a scene file, with all lengths times `scale`. Intensities follow the square of lengths: the picture stays.
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
