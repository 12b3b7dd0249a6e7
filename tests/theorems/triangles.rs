//! Triangles that emit: directions are distributed as the densities beside them say, densities integrate to the solid angle,
//! and samples are worth `f_cos / pdf`. See `proof/triangles.rs` for how.

use crate::proof::Family;
use crate::proof::triangles::{directions, weights};
use octolux::estimator::density::{Average, ConeOnly, Mix};
use octolux::lane::F32x8;

#[test]
fn directions_to_triangles_have_the_density_beside_them_and_it_integrates_to_their_solid_angle() {
    let mut family = Family::new("triangles");
    directions::<f32>(&mut family, 61, 1 << 15);
    directions::<F32x8>(&mut family, 62, 1 << 15);
    family.judge();
}

#[test]
fn a_sample_of_a_triangle_weighs_f_cos_over_pdf() {
    weights(ConeOnly);
    weights(Average);
    weights(Mix::Balance);
    weights(Mix::Power);
}
