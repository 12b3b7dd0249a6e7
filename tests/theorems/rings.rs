//! `product` on Phong surfaces: lobes inside lights, against quadrature. See `proof/rings.rs` for how.

use crate::proof::Family;
use crate::proof::rings;
use octolux::lane::F32x8;

/// The table that it leaves is in `docs/product.md`.
#[test]
fn weights_of_lobes_inside_lights_are_those_of_a_quadrature() {
    let table = rings::weights_are_those_of_a_quadrature();
    let lines = table
        .iter()
        .map(|[sine, mean, variance, most]| format!("{sine:e}\t{mean:.1e}\t{variance:.1e}\t{most:.3}\n"));
    std::fs::write(crate::proof::artefact("rings-errors.tsv"), lines.collect::<String>())
        .expect("a table can be written");
    rings::from_inside_it_is_the_lobe();
}

#[test]
fn a_tail_of_a_lobe_brings_what_all_its_samples_would() {
    rings::a_tail_brings_what_all_its_samples_would();
}

/// 131 072 draws in 192 cells at 12 places, in one lane and in eight.
#[test]
fn directions_are_uniform_in_the_lobe_inside_a_light() {
    let mut family = Family::new("rings");
    rings::directions::<f32>(&mut family, 61, 1 << 17);
    rings::directions::<F32x8>(&mut family, 62, 1 << 17);
    family.judge();
}

/// The thinned tail in the stage of a render, whose loops are its own.
#[test]
fn a_tail_in_a_picture_is_as_bright_as_by_light_sampling() {
    rings::a_tail_in_a_picture_is_as_bright_as_by_light_sampling();
}
