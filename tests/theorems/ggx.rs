//! Rough surfaces: directions follow their density, every sample is worth `f_cos / pdf`, and no light is made.
//!
//! 65 536 draws in 256 cells for each roughness and angle.

use crate::proof::{Family, albedos, ggx};
use octolux::lane::F32x8;

#[test]
fn visible_normals_are_drawn_with_the_density_that_they_report() {
    const ALPHAS: [f64; 7] = [1e-4, 1e-3, 0.01, 0.09, 0.25, 0.5, 1.0];
    let mut family = Family::new("ggx");
    ggx::directions::<f32>(&mut family, &ALPHAS, 1 << 16);
    ggx::directions::<F32x8>(&mut family, &ALPHAS, 1 << 16);
    family.judge();
}

#[test]
fn coated_bodies_are_drawn_with_the_density_that_they_report() {
    let mut family = Family::new("ggx-coat");
    ggx::mixtures::<F32x8>(&mut family, 1 << 16);
    family.judge();
}

#[test]
fn a_sample_of_a_rough_surface_weighs_f_cos_over_pdf() {
    ggx::every_sample_is_the_answer();
}

#[test]
fn a_white_furnace_gets_back_what_quadrature_says() {
    albedos::furnace();
}

#[test]
fn by_the_formulas_no_coated_body_reflects_more_than_arrives() {
    albedos::no_light_is_made();
}

#[test]
fn metals_reflect_as_complex_arithmetic_says() {
    albedos::reflectances();
}

#[test]
fn tints_scale_and_add_as_colours_do() {
    ggx::tints_are_colours();
}
