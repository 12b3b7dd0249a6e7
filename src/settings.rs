//! Settings with their names in scene files and on the command line.

use serde::{Deserialize, Serialize};

/// The density from which light directions are sampled (`docs/explanation/estimators.md` has the formulas).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
#[serde(rename_all = "kebab-case")]
pub enum EstimatorKind {
    /// The whole sphere of directions, `1 / 4 pi`.
    Uniform,
    /// The cone that each light subtends.
    Light,
    /// The BRDF's own lobe.
    Brdf,
    /// The average of `light` and `brdf`: the balance heuristic in one sample.
    Mis,
    /// One direction of `light` and one of `brdf`, weighed by the balance heuristic.
    Mis2Balance,
    /// One direction of `light` and one of `brdf`, weighed by the power heuristic.
    Mis2Power,
    /// As `light`; sphere lights on diffuse surfaces in proportion to the cosine as well.
    Projected,
    /// Sphere lights in proportion to the reflected light: on Phong surfaces the lobe inside the light, on diffuse ones the cosine, or
    /// the cone where the horizon cuts the light. Constant environments by the BRDF, suns on diffuse surfaces by their disk, all else by
    /// two directions as `mis2-power`.
    Product,
}

/// An estimator by name, or the one that is taken where nobody names one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum EstimatorAsked {
    /// [`Chosen::AUTO`](crate::pipeline::Chosen::AUTO).
    #[default]
    Auto,
    /// This one.
    Named(EstimatorKind),
}

impl EstimatorAsked {
    /// `auto`, then the estimators in their order.
    pub const ALL: [Self; 1 + EstimatorKind::ALL.len()] = {
        let mut all = [Self::Auto; 1 + EstimatorKind::ALL.len()];
        let mut i = 0;
        while i < EstimatorKind::ALL.len() {
            all[i + 1] = Self::Named(EstimatorKind::ALL[i]);
            i += 1;
        }
        all
    };

    /// The name that scene files and the command line use.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Named(estimator) => estimator.name(),
        }
    }

    /// The estimator, if one is named.
    pub const fn named(self) -> Option<EstimatorKind> {
        match self {
            Self::Auto => None,
            Self::Named(estimator) => Some(estimator),
        }
    }
}

impl From<EstimatorKind> for EstimatorAsked {
    fn from(estimator: EstimatorKind) -> Self {
        Self::Named(estimator)
    }
}

#[cfg(feature = "cli")]
impl clap::ValueEnum for EstimatorAsked {
    fn value_variants<'a>() -> &'a [Self] {
        &Self::ALL
    }

    fn to_possible_value(&self) -> Option<clap::builder::PossibleValue> {
        match self {
            Self::Auto => Some(
                clap::builder::PossibleValue::new(self.name()).help("product, also where the scene names another one"),
            ),
            Self::Named(estimator) => clap::ValueEnum::to_possible_value(estimator),
        }
    }
}

/// The source of random numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
#[serde(rename_all = "lowercase")]
pub enum SamplerKind {
    /// Owen-scrambled Sobol points in pairs of dimensions.
    Sobol,
    /// Plain independent numbers.
    Independent,
}

/// Which lights a pass samples, for estimators that sample a direction for every light; for the others, of points and spots alone.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum LightsAsked {
    /// All up to 64 ([`Self::FEW`]), otherwise a list of 8 per tile and pass.
    #[default]
    Auto,
    /// All lights; one triangle of each large mesh.
    All,
    /// A list of this length per tile and pass: 1 to 64.
    List(u8),
}

impl LightsAsked {
    /// Maximum number of lights that `Auto` samples individually: spheres, triangles, points and spots. Others are in no list.
    pub const FEW: usize = 64;
    /// Length of a list chosen by `Auto`.
    pub const LENGTH: u8 = 8;
    /// Maximum length of a list.
    pub const LONGEST: u8 = 64;

    /// Length of the list for so many lights; `None` if all are sampled.
    pub const fn list_of(self, lights: usize) -> Option<u32> {
        match self {
            _ if lights == 0 => None,
            Self::All => None,
            Self::Auto if lights <= Self::FEW => None,
            Self::Auto => Some(Self::LENGTH as u32),
            Self::List(length) => Some(length as u32),
        }
    }
}

impl std::fmt::Display for LightsAsked {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Auto => f.write_str("auto"),
            Self::All => f.write_str("all"),
            Self::List(length) => length.fmt(f),
        }
    }
}

/// The intersector.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
#[serde(rename_all = "lowercase")]
pub enum AccelKind {
    /// Embree's hierarchy.
    Embree,
    /// Brute force over all shapes, culled per tile and light: for few shapes.
    Linear,
}

impl AccelKind {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Embree, Self::Linear];

    /// The name that the command line uses.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Embree => "embree",
            Self::Linear => "linear",
        }
    }
}

impl EstimatorKind {
    /// The four of the assignment in its order, then the additional ones.
    pub const ALL: [Self; 8] = [
        Self::Uniform,
        Self::Light,
        Self::Brdf,
        Self::Mis,
        Self::Mis2Balance,
        Self::Mis2Power,
        Self::Projected,
        Self::Product,
    ];

    /// Whether a pass samples directions for every light, or only one per point.
    pub const fn per_light(self) -> bool {
        !matches!(self, Self::Uniform | Self::Brdf)
    }

    /// The name that scene files and the command line use.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Uniform => "uniform",
            Self::Light => "light",
            Self::Brdf => "brdf",
            Self::Mis => "mis",
            Self::Mis2Balance => "mis2-balance",
            Self::Mis2Power => "mis2-power",
            Self::Projected => "projected",
            Self::Product => "product",
        }
    }
}

impl SamplerKind {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Sobol, Self::Independent];

    /// The name that scene files and the command line use.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Sobol => "sobol",
            Self::Independent => "independent",
        }
    }
}

/// Rays in a packet. All widths give the same bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Lanes {
    /// One ray at a time: the scalar kernel.
    One,
    /// Eight, with AVX2 or AVX-512.
    Eight,
    /// Sixteen, with AVX-512.
    Sixteen,
}

impl Lanes {
    /// Every width, the narrowest first.
    pub const ALL: [Self; 3] = [Self::One, Self::Eight, Self::Sixteen];

    /// Rays in a packet: 1, 8 or 16.
    pub const fn count(self) -> usize {
        match self {
            Self::One => 1,
            Self::Eight => 8,
            Self::Sixteen => 16,
        }
    }
}

impl std::fmt::Display for Lanes {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.count().fmt(f)
    }
}
