//! Weights: every sample of every strategy is worth `f_cos / pdf`, and none that counts is left out.

use crate::proof::weights;

#[test]
fn a_sample_of_a_light_weighs_f_cos_over_pdf() {
    weights::samples_of_lights();
}

#[test]
fn a_sample_of_the_point_weighs_f_cos_over_pdf() {
    weights::samples_of_points();
}

#[test]
fn nothing_that_counts_is_dropped_before_it_is_drawn() {
    weights::nothing_is_dropped();
}
