//! `[[lights]]`: lights without shape.

use super::Light;
use super::error::Fault;
use super::table::Table;

pub(super) const KEYS: &[&str] = &[
    "kind",
    "position",
    "target",
    "direction",
    "intensity",
    "irradiance",
    "inner_angle",
    "outer_angle",
    "angular_radius",
];

/// The kinds of lights and their keys.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Point,
    Spot,
    Directional,
}

impl Kind {
    const ALL: [Self; 3] = [Self::Point, Self::Spot, Self::Directional];

    fn name(self) -> &'static str {
        match self {
            Self::Point => "point",
            Self::Spot => "spot",
            Self::Directional => "directional",
        }
    }

    fn keys(self) -> &'static [&'static str] {
        match self {
            Self::Point => &["kind", "position", "intensity"],
            Self::Spot => &[
                "kind",
                "position",
                "target",
                "direction",
                "intensity",
                "inner_angle",
                "outer_angle",
            ],
            Self::Directional => &["kind", "direction", "irradiance", "angular_radius"],
        }
    }
}

/// A light.
pub(super) fn light(table: &Table<'_>) -> Result<Light, Fault> {
    let kind = table.need("kind", "kind = \"point\"")?;
    let kind = kind.choice(&Kind::ALL, Kind::name)?;
    for key in KEYS.iter().filter(|key| !kind.keys().contains(key)) {
        if let Some(value) = table.get(key) {
            let name = kind.name();
            let keys = kind.keys().join(", ");
            let help = format!("the keys of a {name} light are {keys}");
            return Err(value.fault(&format!("does not belong to a {name} light"), help));
        }
    }
    let position = || table.need("position", "position = [0.0, 3.0, 0.0]")?.triple();
    let intensity = || table.need("intensity", "intensity = [10.0, 10.0, 10.0]")?.triple();
    Ok(match kind {
        Kind::Point => Light::Point {
            position: position()?,
            intensity: intensity()?,
        },
        Kind::Spot => {
            let position = position()?;
            let help = "write target = [x, y, z] for what it shines at, or direction = [x, y, z] for where it shines";
            let aim = table.one_of("target", "direction", help)?;
            let outer_angle = table.need("outer_angle", "outer_angle = 30.0")?.number()?;
            Light::Spot {
                position,
                direction: match (aim.key, aim.triple()?) {
                    ("target", target) if target == position => {
                        let help = "point the spot at something: move the target";
                        return Err(aim.fault("must differ from the position", help));
                    }
                    ("target", target) => target - position,
                    (_, direction) => direction,
                },
                intensity: intensity()?,
                inner_angle: table.get("inner_angle").map_or(Ok(0.0), |angle| angle.number())?,
                outer_angle,
            }
        }
        Kind::Directional => Light::Directional {
            direction: table.need("direction", "direction = [0.0, -1.0, 0.0]")?.triple()?,
            irradiance: table.need("irradiance", "irradiance = [3.0, 3.0, 3.0]")?.triple()?,
            angular_radius: table.get("angular_radius").map_or(Ok(0.0), |angle| angle.number())?,
        },
    })
}
