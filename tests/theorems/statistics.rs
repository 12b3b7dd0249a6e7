//! The tests of the tests: p-values are what tables and simulations say they are.

use crate::proof::runs::Estimate;
use crate::proof::stats::{chi_square, integrate, p_chi_square, p_student};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

fn close(x: f64, expected: f64, relative: f64) {
    assert!((x / expected - 1.0).abs() < relative, "{x:e} instead of {expected:e}");
}

#[test]
fn special_functions_have_the_values_of_the_tables() {
    // Even degrees of freedom are Poisson sums: 2 gives exp(-x/2), 4 gives exp(-x/2) (1 + x/2).
    for x in [0.1_f64, 1.0, 3.0, 30.0, 300.0] {
        close(p_chi_square(x, 2), (-x / 2.0).exp(), 1e-12);
        close(p_chi_square(x, 4), (-x / 2.0).exp() * (1.0 + x / 2.0), 1e-12);
    }
    close(p_chi_square(3.841_458_820_694_124, 1), 0.05, 1e-10);
    close(p_chi_square(124.342_113_404_004, 100), 0.05, 1e-9);
    // One degree of freedom is Cauchy's distribution, two have an algebraic one.
    for t in [0.3_f64, 2.0, 50.0] {
        close(p_student(t, 1.0), 1.0 - 2.0 / std::f64::consts::PI * t.atan(), 1e-9);
        close(p_student(t, 2.0), 1.0 - t / (2.0 + t * t).sqrt(), 1e-9);
    }
    close(p_student(1.959_963_984_540_054, f64::INFINITY), 0.05, 1e-10);
    close(p_student(2.039_513_446_396_408, 31.0), 0.05, 1e-9);
    close(integrate(0.0, 2.0, 3, f64::exp), 2.0_f64.exp() - 1.0, 1e-12);
}

/// 2000 p-values of each kind under the null hypothesis: the share below 1, 5, 25 % is binomial, within 4.9 of its
/// deviations but for 1e-6; and a shift of 6 standard errors is seen.
#[test]
fn p_values_are_uniform_where_there_is_nothing_to_find() {
    const TRIALS: usize = 2000;
    let mut rng = Pcg64::seed_from_u64(1);
    let (mut student, mut pearson) = (vec![], vec![]);
    for _ in 0..TRIALS {
        let mut values = || -> Vec<f64> {
            let normal = |rng: &mut Pcg64| (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0;
            (0..16).map(|_| 5.0 + normal(&mut rng)).collect()
        };
        let (a, b) = (Estimate::of(&values()), Estimate::of(&values()));
        student.push(a.p(b, 0.0));
        let shifted = Estimate {
            mean: a.mean + 6.0 * (a.variance + b.variance).sqrt(),
            ..a
        };
        assert!(shifted.p(b, 0.0) < 0.05, "{shifted:?} {b:?}");
        let mut counts = [0.0; 20];
        (0..2000).for_each(|_| counts[rng.random_range(0..20)] += 1.0);
        pearson.push(chi_square(&counts, &[100.0; 20]).p);
    }
    for (name, values) in [("student", student), ("pearson", pearson)] {
        for level in [0.01, 0.05, 0.25] {
            let share = values.iter().filter(|p| **p < level).count() as f64 / TRIALS as f64;
            let deviation = (level * (1.0 - level) / TRIALS as f64).sqrt();
            assert!((share - level).abs() < 4.9 * deviation, "{name}: {share} below {level}");
        }
    }
}

#[test]
fn pooling_loses_no_count_and_no_expectation() {
    // Pools of 30 = 10 + 20 and 40, then 5 that join the last one.
    let test = chi_square(&[12.0, 20.0, 35.0, 8.0], &[10.0, 20.0, 40.0, 5.0]);
    assert_eq!(test.degrees, 1);
    close(test.statistic, 4.0 / 30.0 + 4.0 / 45.0, 1e-12);
}

#[test]
#[should_panic(expected = "1 of 2 tests rejected")]
fn a_family_with_one_impossible_test_is_rejected() {
    let mut family = crate::proof::Family::new("a-family-to-reject");
    family.add(0.5, "plain".into());
    family.add(1e-9, "impossible".into());
    family.judge();
}
