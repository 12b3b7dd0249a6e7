//! Rules for numbers of a scene file, as text and as a test.

/// A rule for a number.
pub(super) struct Rule {
    /// "must be positive".
    pub words: &'static str,
    /// The remedy.
    pub help: &'static str,
    holds: fn(f64) -> bool,
}

impl Rule {
    /// Whether `x` satisfies the rule.
    pub fn holds(&self, x: f64) -> bool {
        (self.holds)(x)
    }

    /// The problem of a number that breaks the rule.
    pub fn problem(&self, x: f64) -> &'static str {
        // Numbers such as 1e39 are finite, but out of range.
        if x.is_finite() && !in_range(x) {
            "is beyond single precision"
        } else if self.is_tiny(x) {
            "is too small for single precision"
        } else {
            self.words
        }
    }

    /// The remedy for a number that breaks the rule.
    pub fn remedy(&self, x: f64) -> &'static str {
        if self.is_tiny(x) {
            "write a number from 1.2e-38 to 3.4e38"
        } else {
            self.help
        }
    }

    /// Whether `x` is positive, and breaks the rule only because it is too small.
    fn is_tiny(&self, x: f64) -> bool {
        let least = f64::from(f32::MIN_POSITIVE);
        0.0 < x && x < least && !self.holds(x) && self.holds(least)
    }
}

// Packets compute in single precision: larger numbers would become infinite.
fn in_range(x: f64) -> bool {
    x.abs() <= f64::from(f32::MAX)
}

/// Any number that single precision can hold.
pub(super) const FINITE: Rule = Rule {
    words: "must be finite",
    help: "write a number between -3.4e38 and 3.4e38",
    holds: in_range,
};
/// Above 0.
pub(super) const POSITIVE: Rule = Rule {
    words: "must be positive and finite",
    help: "write a number above 0, at most 3.4e38",
    holds: |x| x >= f64::from(f32::MIN_POSITIVE) && in_range(x),
};
/// 0 or above.
pub(super) const NOT_NEGATIVE: Rule = Rule {
    words: "must be finite and not negative",
    help: "write numbers from 0 to 3.4e38, one each for red, green and blue",
    holds: |x| x >= 0.0 && in_range(x),
};
/// Any number except 0.
pub(super) const NOT_ZERO: Rule = Rule {
    words: "must be finite and not 0",
    help: "write a number other than 0: 2 doubles the mesh, 0.5 halves it, -1 mirrors it",
    holds: |x| x != 0.0 && in_range(x),
};
/// A Phong exponent.
pub(super) const EXPONENT: Rule = Rule {
    words: "must be above 1 and finite",
    help: "write a number above 1: 5 is dull, 1000 is polished; a matt surface is `diffuse = [r, g, b]`",
    holds: |x| x > 1.0 && in_range(x),
};
/// The roughness of a microfacet surface.
pub(super) const ROUGHNESS: Rule = Rule {
    words: "must be from 0.0001 to 1",
    help: "write a number such as 0.05 (polished), 0.3 (brushed) or 0.8 (dull)",
    holds: |x| (1e-4..=1.0).contains(&x),
};
/// A fraction.
pub(super) const SHARE: Rule = Rule {
    words: "must be from 0 to 1",
    help: "write 0 for a coated body such as plastic, 1 for metal",
    holds: |x| (0.0..=1.0).contains(&x),
};
/// An index of refraction.
pub(super) const ETA: Rule = Rule {
    words: "must be from 0.001 to 1000",
    help: "write the index of refraction for red, green and blue, such as [0.143, 0.375, 1.442] for gold",
    holds: |x| (1e-3..=1e3).contains(&x),
};
/// An extinction coefficient.
pub(super) const EXTINCTION: Rule = Rule {
    words: "must be from 0 to 1000",
    help: "write the extinction coefficient for red, green and blue, such as [3.983, 2.386, 1.603] for gold",
    holds: |x| (0.0..=1e3).contains(&x),
};
/// The fourth number of `brdf_params`.
pub(super) const ALPHA: Rule = Rule {
    words: "must have an alpha of 1 (diffuse) or above 1 (Phong)",
    help: "write [r, g, b, 1] for a diffuse surface or, say, [r, g, b, 1000] for a Phong one",
    holds: |x| x >= 1.0 && in_range(x),
};
/// The outer angle of a spot light.
pub(super) const OUTER_ANGLE: Rule = Rule {
    words: "must be above 0 and at most 180 degrees",
    help: "write the angle between the axis and the edge of the cone in degrees, such as 30",
    holds: |x| x > 0.0 && x <= 180.0,
};
/// The inner angle of a spot light.
pub(super) const INNER_ANGLE: Rule = Rule {
    words: "must be from 0 degrees to outer_angle",
    help: "write the angle from the axis up to which the light is full in degrees, at most outer_angle",
    holds: |x| (0.0..=180.0).contains(&x),
};
/// The angular radius of a directional light.
pub(super) const ANGULAR_RADIUS: Rule = Rule {
    words: "must be from 0 to 90 degrees",
    help: "write half the angle across the disk of the light in degrees, 0.2665 for the sun, or leave it out for one direction",
    holds: |x| (0.0..=90.0).contains(&x),
};
/// A full field of view.
pub(super) const VIEW_ANGLE: Rule = Rule {
    words: "must be between 0 and 180 degrees",
    help: "write the full angle of view in degrees, such as 45",
    holds: |x| x > 0.0 && x < 180.0,
};
