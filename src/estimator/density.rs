//! Combines light sampling and BRDF sampling into one estimate.
//!
//! With the integrand `f`, the density `p` of light sampling and the density `q` of BRDF sampling:
//!
//! | [`Mix`] | samples per pass | estimate |
//! | --- | --- | --- |
//! | `Light` | one of `p` | `f / p` |
//! | `Average` | one of `p` or of `q`, with equal probability | `2 f / (p + q)` |
//! | `Balance` | one of `p` and one of `q` | `f / (p + q)` |
//! | `Power` | one of `p` and one of `q` | `f p / (p^2 + q^2)` or `f q / (p^2 + q^2)` |
//! | `Lobe` | one of `q` | `f / q` |
//!
//! Veach and Guibas 1995, "Optimally Combining Sampling Techniques for Monte Carlo Rendering": the balance heuristic, the power
//! heuristic with exponent 2, and the one-sample model. The average density of the course assignment (README) is the balance heuristic of the one-sample
//! model.

use crate::bsdf::{Lobe, Tint};
use crate::lane::{Lane, Mask};

/// Which techniques are sampled and how they are weighted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Mix {
    /// Light sampling only.
    #[default]
    Light,
    /// The average of both densities with one sample, i.e. one-sample MIS (the course assignment, section 6).
    Average,
    /// One sample of each technique, balance heuristic.
    Balance,
    /// One sample of each technique, power heuristic.
    Power,
    /// BRDF sampling only: `product` where the light is the same from all directions.
    Lobe,
}

impl Mix {
    /// Whether BRDF sampling is used too.
    #[inline(always)]
    pub const fn mixed(self) -> bool {
        !matches!(self, Self::Light)
    }

    /// Whether a pass samples both techniques, instead of choosing one at random.
    #[inline(always)]
    pub const fn both(self) -> bool {
        matches!(self, Self::Balance | Self::Power)
    }

    /// Directions per light and pass.
    #[inline(always)]
    pub const fn times(self) -> u32 {
        if self.both() { 2 } else { 1 }
    }

    /// The weight of a light that no BRDF sample finds: with one-sample MIS half of the points sample it.
    #[inline(always)]
    pub const fn alone(self) -> f32 {
        if matches!(self, Self::Average) { 2.0 } else { 1.0 }
    }

    /// Whether one bit of a light's random pair chooses the technique, so that the direction uses the remaining bits.
    #[inline(always)]
    pub const fn tosses(self, warp: Warp) -> bool {
        !self.both() && matches!(warp, Warp::Cone)
    }

    /// Of the lanes that chose BRDF sampling, those that use it: all, or none without MIS.
    #[inline(always)]
    pub fn by_brdf<L: Lane>(self, by_brdf_lanes: L::Mask) -> L::Mask {
        if self.mixed() {
            by_brdf_lanes
        } else {
            L::Mask::splat(false)
        }
    }

    /// `f_cos` times the MIS weight, over the density, without colors. `omega` is the reciprocal density of light sampling, in
    /// steradians; `by_brdf` are the lanes with BRDF samples.
    #[inline(always)]
    pub fn weight<L: Lane, T: Tint<L>>(self, omega: L, lobe: Lobe<L, T>, by_brdf: L::Mask) -> T {
        match self {
            Self::Light => lobe.shape.scaled(omega),
            // With a single division: `2 Ω f_cos / (1 + Ω q)`.
            Self::Average => {
                let twice = mutate!(omega + omega, MixtureWithoutHalf => omega);
                lobe.shape.scaled(twice).over(omega.mul_add(lobe.pdf, L::one()))
            }
            Self::Balance => lobe.shape.scaled(omega).over(omega.mul_add(lobe.pdf, L::one())),
            Self::Lobe => lobe.shape.over(lobe.pdf).kept(lobe.pdf.gt(L::zero())),
            Self::Power => {
                // `f_cos / own / (1 + (other / own)^2)`: if the square overflows, the result is 0, which is the limit.
                let ratio = omega * lobe.pdf;
                let alone = T::chosen(by_brdf, lobe.shape.over(lobe.pdf), lobe.shape.scaled(omega));
                let ratio = L::select(mutate!(by_brdf, HeuristicTurned => !by_brdf), L::one() / ratio, ratio);
                alone.over(ratio.mul_add(ratio, L::one()))
            }
        }
    }
}

/// How directions to a spherical light are sampled. All variants except the first use both random numbers of the light's pair.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Warp {
    /// Uniform in the light's cone. The technique choice may have used a bit of the light's pair.
    Cone,
    /// Diffuse points: cosine-weighted.
    ProjectedCap,
    /// Diffuse points: cosine-weighted where the light is wholly above the horizon ([`light::disk`](crate::light::disk)), else
    /// uniform in the cone.
    DiskOrCone,
    /// Phong points: proportional to the lobe.
    LobeInCap,
}

/// A [`Mix`] known at compile time, or one read at run time: [`Mix`] itself.
pub trait Density: Copy {
    /// How directions to a light are sampled.
    const WARP: Warp = Warp::Cone;
    /// Whether all lights of a point share one technique choice, even with independent random numbers.
    const SHARES_COIN: bool = false;
    /// The density for a stage that runs with this mix.
    fn of(mix: Mix) -> Self;
    /// The mix.
    fn mix(self) -> Mix;
    /// Reciprocal density of light sampling, including the probability that the light is selected; `omega` is without it.
    #[inline(always)]
    fn asked<L: Lane>(self, omega: L) -> L {
        omega
    }
}

/// A mix for lights that are selected with a probability.
#[derive(Clone, Copy, Debug)]
pub struct Listed {
    mix: Mix,
    /// Reciprocal of the selection probability, or of an estimate of it.
    inverse: f32,
}

impl Listed {
    /// For a light with about this selection probability.
    pub fn new(mix: Mix, chance: f32) -> Self {
        Self {
            mix,
            inverse: 1.0 / chance,
        }
    }
}

impl Density for Listed {
    const SHARES_COIN: bool = true;
    #[inline(always)]
    fn of(mix: Mix) -> Self {
        Self::new(mix, 1.0)
    }
    #[inline(always)]
    fn mix(self) -> Mix {
        self.mix
    }
    #[inline(always)]
    fn asked<L: Lane>(self, omega: L) -> L {
        omega * L::splat(self.inverse)
    }
}

/// [`Listed`] with a light of its own in each lane.
#[derive(Clone, Copy, Debug)]
pub struct ListedEach {
    mix: Mix,
    inverses: [f32; 16],
}

impl ListedEach {
    /// For lights with about these selection probabilities.
    #[inline(always)]
    pub fn new<L: Lane>(mix: Mix, chance: L) -> Self {
        let mut inverses = [1.0; 16];
        (L::one() / chance).store(&mut inverses);
        Self { mix, inverses }
    }
}

impl Density for ListedEach {
    const SHARES_COIN: bool = true;
    #[inline(always)]
    fn of(mix: Mix) -> Self {
        Self {
            mix,
            inverses: [1.0; 16],
        }
    }
    #[inline(always)]
    fn mix(self) -> Mix {
        self.mix
    }
    #[inline(always)]
    fn asked<L: Lane>(self, omega: L) -> L {
        omega * L::load(&self.inverses)
    }
}

/// Defines types for mixes known at compile time.
macro_rules! known {
    ($($(#[$doc:meta])* $name:ident: $mix:ident, $warp:ident;)*) => {$(
        $(#[$doc])*
        #[derive(Clone, Copy, Debug)]
        pub struct $name;

        impl Density for $name {
            const WARP: Warp = Warp::$warp;
            #[inline(always)]
            fn of(_: Mix) -> Self {
                Self
            }
            #[inline(always)]
            fn mix(self) -> Mix {
                Mix::$mix
            }
        }
    )*};
}

known! {
    /// `1 / Ω`: uniform in the cone of the light.
    ConeOnly: Light, Cone;
    /// `(p_light + p_brdf) / 2`.
    Average: Average, Cone;
    /// `cos / Π`: uniform in the projected solid angle of the light, for diffuse surfaces.
    Projected: Light, ProjectedCap;
    /// `cos / Π`, or `1 / Ω` where the horizon cuts the light: `product` on diffuse surfaces.
    DiskOrCone: Light, DiskOrCone;
    /// The lobe, divided by its mass between the light's nearest and farthest ring and by the fraction of the ring inside the
    /// light: `product` on Phong surfaces ([`Rings`](crate::light::Rings)).
    LobeInCap: Light, LobeInCap;
}

impl Density for Mix {
    #[inline(always)]
    fn of(mix: Mix) -> Self {
        mix
    }
    #[inline(always)]
    fn mix(self) -> Mix {
        self
    }
}
