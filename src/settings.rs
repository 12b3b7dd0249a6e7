//! The names of estimators and samplers, as scene files and the command line spell them.

use serde::{Deserialize, Serialize};

/// Which density the directions of light are drawn from (`docs/explanation/estimators.md` has the formulas).
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
    /// Sphere lights in proportion to the reflected light: on Phong surfaces the lobe inside the light, on diffuse ones the cone, or
    /// the cosine where a light is large or low. Other lights as `mis`.
    Product,
}

/// Where random numbers come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
#[serde(rename_all = "lowercase")]
pub enum SamplerKind {
    /// Owen-scrambled Sobol points in pairs of dimensions.
    Sobol,
    /// Plain independent numbers.
    Independent,
}

/// How rays find what they hit.
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
    /// The four of the hand-out in its order, then those beyond it.
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

    /// Whether a pass draws directions for every light, or one for the point alone.
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
