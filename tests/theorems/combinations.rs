//! The hand-out's average density against multiple importance sampling with two samples: equal in every direction and in the mean,
//! not in the variance. See `proof/combinations.rs` for what is compared.

use crate::proof::{Family, combinations};

#[test]
fn a_direction_counts_in_the_average_as_in_two_samples_by_the_balance_heuristic() {
    assert!(combinations::directions_count_the_same() > 4000);
}

/// False alarms 1e-6.
#[test]
fn means_of_one_and_two_samples_agree_and_variances_differ_by_the_coin_alone() {
    let mut family = Family::rarely("combinations", 1e-6);
    combinations::means_agree_and_variances_differ_by_the_coin(&mut family);
    family.judge();
}
