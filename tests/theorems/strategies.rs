//! Strategies: the directions of `Bsdf::sample`, of the cone of a light and of the mixture of `mis`, frames and coins
//! included, are distributed as the densities say.
//!
//! 131 072 draws in 384 cells; see `proof_warps.rs` for what that finds.

use crate::proof::Family;
use crate::proof::places::LIGHTS;
use crate::proof::strategies::{lobes, mixtures};
use octolux::estimator::density::{Average, ConeOnly};
use octolux::lane::{F32x8, Lane};

const DRAWS: u32 = 1 << 17;

#[test]
fn lobes_are_sampled_with_the_density_that_they_report() {
    const ALPHAS: [f64; 9] = [1.0, 1.5, 2.0, 5.0, 20.0, 300.0, 1e4, 1e5, 1e6];
    let mut family = Family::new("lobes");
    lobes::<f32>(&mut family, &ALPHAS, DRAWS);
    lobes::<F32x8>(&mut family, &ALPHAS, DRAWS);
    family.judge();
}

#[test]
fn lights_and_mixtures_are_sampled_with_the_density_that_weighs_them() {
    fn both<L: Lane>(family: &mut Family, seed: u32) {
        mixtures::<L, _>(Average, family, &LIGHTS, seed, DRAWS);
        mixtures::<L, _>(ConeOnly, family, &LIGHTS, seed + 1, DRAWS);
    }
    let mut family = Family::new("mixtures");
    both::<f32>(&mut family, 21);
    both::<F32x8>(&mut family, 31);
    family.judge();
}
