//! How directions of a light and directions of the BRDF make one estimate.
//!
//! With `f` the integrand, `p` the density of the light's own directions and `q` that of the BRDF's:
//!
//! | [`Mix`] | a pass draws | a direction counts |
//! | --- | --- | --- |
//! | `Light` | one of `p` | `f / p` |
//! | `Average` | one of `p` or of `q`, by a fair coin | `2 f / (p + q)` |
//! | `Balance` | one of `p` and one of `q` | `f / (p + q)` |
//! | `Power` | one of `p` and one of `q` | `f p / (p^2 + q^2)` or `f q / (p^2 + q^2)` |
//!
//! Veach and Guibas 1995, "Optimally Combining Sampling Techniques for Monte Carlo Rendering": the balance heuristic, the power
//! heuristic with exponent 2, and the one-sample model, of which the hand-out's average density is the balance heuristic.

use crate::bsdf::{Lobe, Tint};
use crate::lane::{Lane, Mask};

/// Which directions are drawn and how they are weighed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Mix {
    /// Those of the light alone.
    #[default]
    Light,
    /// The average of both densities, in one sample (the hand-out, section 6).
    Average,
    /// One of each, by the balance heuristic.
    Balance,
    /// One of each, by the power heuristic.
    Power,
}

impl Mix {
    /// Whether directions of the BRDF count too.
    #[inline(always)]
    pub const fn mixed(self) -> bool {
        !matches!(self, Self::Light)
    }

    /// Whether a pass draws one direction of each, not one by a coin.
    #[inline(always)]
    pub const fn both(self) -> bool {
        matches!(self, Self::Balance | Self::Power)
    }

    /// Of the lanes whose coin shows heads, those that follow their BRDF: all, or none.
    #[inline(always)]
    pub fn by_brdf<L: Lane>(self, by_brdf_lanes: L::Mask) -> L::Mask {
        if self.mixed() {
            by_brdf_lanes
        } else {
            L::Mask::splat(false)
        }
    }

    /// `f_cos` times the weight, over the density, without the colours. `omega` is one over the light's own density, in
    /// steradians; `by_brdf` are lanes whose direction is the BRDF's.
    #[inline(always)]
    pub fn weight<L: Lane, T: Tint<L>>(self, omega: L, lobe: Lobe<L, T>, by_brdf: L::Mask) -> T {
        match self {
            Self::Light => lobe.shape.scaled(omega),
            // With one division: `2 Ω f_cos / (1 + Ω q)`.
            Self::Average => {
                let twice = mutate!(omega + omega, MixtureWithoutHalf => omega);
                lobe.shape.scaled(twice).over(omega.mul_add(lobe.pdf, L::one()))
            }
            Self::Balance => lobe.shape.scaled(omega).over(omega.mul_add(lobe.pdf, L::one())),
            Self::Power => {
                // `f_cos / own / (1 + (other / own)^2)`: a square that overflows leaves 0, which is the limit.
                let ratio = omega * lobe.pdf;
                let alone = T::chosen(by_brdf, lobe.shape.over(lobe.pdf), lobe.shape.scaled(omega));
                let ratio = L::select(mutate!(by_brdf, HeuristicTurned => !by_brdf), L::one() / ratio, ratio);
                alone.over(ratio.mul_add(ratio, L::one()))
            }
        }
    }
}

/// How the directions of a sphere that emits are drawn. All but the first take the light's whole pair of random numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Warp {
    /// Uniformly in the light's cone; of the light's pair, a coin may have taken a bit.
    Cone,
    /// Of a diffuse point: in the cone, or by the cosine where the light is large or low.
    ConeOrCap,
    /// Of a diffuse point: by the cosine.
    ProjectedCap,
    /// Of a Phong point: by its lobe.
    LobeInCap,
}

/// A [`Mix`] that is known when a stage is compiled, or one that is looked up when it runs: [`Mix`] itself.
pub trait Density: Copy {
    /// How the directions of a light are drawn.
    const WARP: Warp = Warp::Cone;
    /// Whether all lights of a point follow one coin, also where random numbers are independent.
    const SHARES_COIN: bool = false;
    /// The density for a stage that runs with this mix.
    fn of(mix: Mix) -> Self;
    /// Which it is.
    fn mix(self) -> Mix;
    /// One over the density of a light's own directions, with the chance that it is asked at all; `omega` is that without.
    #[inline(always)]
    fn asked<L: Lane>(self, omega: L) -> L {
        omega
    }
}

/// A mix for lights of which not all are asked.
#[derive(Clone, Copy, Debug)]
pub struct Listed {
    mix: Mix,
    /// One over the chance that a light is asked, or a guess of it.
    inverse: f32,
}

impl Listed {
    /// For a light that is asked with about this chance.
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

/// Types that stand for a mix which is known when a stage is compiled.
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
    /// `1 / Ω`, or `cos / Π` where the light is large or low ([`suits_cap`](super::per_light::suits_cap)): `product` on diffuse surfaces.
    ConeOrCap: Light, ConeOrCap;
    /// The lobe over what it has between the light's nearest and farthest ring, over the share of the ring that is in the light:
    /// `product` on Phong surfaces ([`Rings`](crate::light::Rings)).
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
