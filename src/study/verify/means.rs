//! Whether two means agree, and which bias would have been detected.
//!
//! The bound of a difference is `t * stderr + hidden + rounding`: the quantile of Student's t at the false-alarm rate of the
//! test, shared among its values ([`Family`]); what the samples may have missed ([`super::tails`]); and 1e-4 of the larger mean
//! for single precision. The same sum is the smallest detectable bias.

use crate::study::distributions::t_quantile;
use crate::study::family::Family;

/// Relative error allowed for single precision.
pub const ROUNDING: f64 = 1e-4;

/// A test whose detectable bias, relative, is above this reports no power.
pub const POWER: f64 = 0.5;

/// Two means that should have the same expectation.
#[derive(Clone, Copy, Debug)]
pub struct Estimate {
    /// The difference of the means.
    pub difference: f64,
    /// Variance of the difference.
    pub variance: f64,
    /// Degrees of freedom of that variance.
    pub dof: f64,
    /// Share that the samples of both may have missed.
    pub hidden: f64,
    /// The larger of the means.
    pub size: f64,
    /// The unit of relative biases: the reflected light.
    pub light: f64,
}

/// An estimate against its bound.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Judged {
    /// Difference over bound; above 1 the means disagree.
    pub ratio: f64,
    /// The difference, relative to the light; 0 where there is none.
    pub difference: f64,
    /// The bound, relative to the light: the smallest detectable bias.
    pub visible: f64,
    /// Whether there is any reflected light.
    pub lit: bool,
}

/// The estimates of one test, judged together.
#[derive(Clone, Debug, PartialEq)]
pub struct Judgement {
    /// Each, in order.
    pub judged: Vec<Judged>,
}

impl Judgement {
    /// Judges all; `alpha` is the probability of a false alarm in any of them.
    pub fn new(estimates: &[Estimate], alpha: f64) -> Self {
        let (each, estimates) = Family::of(alpha, estimates).close();
        let mut known: Option<(f64, f64)> = None;
        let mut quantile = |dof: f64| match known {
            Some((at, value)) if at == dof => value,
            _ => known.insert((dof, t_quantile(each, dof))).1,
        };
        let judged = estimates
            .into_iter()
            .map(|estimate| estimate.judge(quantile(estimate.dof)));
        Self {
            judged: judged.collect(),
        }
    }

    /// The one with the largest ratio to its bound.
    pub fn worst(&self) -> Option<Judged> {
        self.judged.iter().copied().max_by(|a, b| a.ratio.total_cmp(&b.ratio))
    }

    /// Whether none is beyond its bound.
    pub fn agrees(&self) -> bool {
        self.judged.iter().all(|judged| judged.ratio <= 1.0)
    }

    /// The detectable bias: of up to 3 values the largest; of more, the median of the blocks that have power, if these are a
    /// quarter of all with light (and 1 or more). `None` without light.
    pub fn visible(&self) -> Option<f64> {
        let mut visible: Vec<f64> = self.judged.iter().filter(|j| j.lit).map(|j| j.visible).collect();
        visible.sort_by(f64::total_cmp);
        let able = visible.partition_point(|&bias| bias <= POWER);
        match visible.len() {
            0..=3 => visible.last().copied(),
            all if 4 * able >= all => Some(visible[able / 2]),
            all => Some(visible[all / 4]),
        }
    }

    /// The number of values with light, and how many of them would show a bias below [`POWER`].
    pub fn power(&self) -> [usize; 2] {
        let lit = self.judged.iter().filter(|judged| judged.lit);
        [
            lit.clone().count(),
            lit.filter(|judged| judged.visible <= POWER).count(),
        ]
    }
}

impl Estimate {
    fn judge(&self, quantile: f64) -> Judged {
        let bound = quantile * self.variance.max(0.0).sqrt() + self.hidden + ROUNDING * self.size + 1e-37;
        let relative = |value: f64| if self.light > 0.0 { value / self.light } else { 0.0 };
        // NaN never agrees.
        let ratio = self.difference.abs() / bound;
        Judged {
            ratio: if ratio.is_nan() { f64::INFINITY } else { ratio },
            difference: relative(self.difference),
            visible: relative(bound),
            lit: self.light > 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64;

    use super::super::replicates::spread;
    use super::*;

    /// Means of 16 replicates of rare, bright light, as in renders, times `bias`.
    fn estimates(rng: &mut Pcg64, cells: usize, bias: f64) -> Vec<Estimate> {
        let mut replicate = |factor: f64| {
            let hits = (0..60).filter(|_| rng.random::<f64>() < 0.25).count();
            factor * hits as f64 / 15.0
        };
        let mut cell = || {
            let differences: Vec<f64> = (0..16).map(|_| replicate(1.0 + bias) - replicate(1.0)).collect();
            let (difference, variance) = spread(&differences);
            Estimate {
                difference,
                variance,
                dof: 15.0,
                hidden: 0.0,
                size: 1.0,
                light: 1.0,
            }
        };
        (0..cells).map(|_| cell()).collect()
    }

    /// 2000 families of 6 at a rate of 2 %: 40 false alarms are expected, 15 to 65 within four deviations.
    #[test]
    fn false_alarms_are_as_rare_as_stated() {
        let mut rng = Pcg64::seed_from_u64(20);
        let alarms = (0..2000)
            .filter(|_| !Judgement::new(&estimates(&mut rng, 6, 0.0), 0.02).agrees())
            .count();
        assert!((15..=65).contains(&alarms), "{alarms}");
    }

    /// The mean of a replicate is accurate to 22 %, a difference of two to 32 %, and the mean of 16 to 8 %.
    #[test]
    fn a_bias_is_found_where_the_bound_says_so() {
        let mut rng = Pcg64::seed_from_u64(21);
        let family = Judgement::new(&estimates(&mut rng, 3, 1.5), 1e-4);
        assert!(family.visible().unwrap() < 1.5 && !family.agrees());
    }

    /// 1 % of a mean whose replicates differ by 0.2 %.
    #[test]
    fn a_planted_bias_of_one_percent_is_found() {
        let mut rng = Pcg64::seed_from_u64(22);
        let mut found = [0, 0];
        for _ in 0..200 {
            for (bias, found) in [0.0, 0.01].into_iter().zip(&mut found) {
                let values: Vec<f64> = (0..16).map(|_| bias + 0.004 * (rng.random::<f64>() - 0.5)).collect();
                let (difference, variance) = spread(&values);
                let estimate = Estimate {
                    difference,
                    variance,
                    dof: 15.0,
                    hidden: 0.0,
                    size: 1.0,
                    light: 1.0,
                };
                let family = Judgement::new(&[estimate], 1e-6);
                assert!(family.visible().unwrap() < 0.01);
                *found += usize::from(!family.agrees());
            }
        }
        assert_eq!(found, [0, 200]);
    }

    #[test]
    fn what_may_be_hidden_is_granted_and_nan_never() {
        let estimate = Estimate {
            difference: 0.3,
            variance: 0.0,
            dof: 7.0,
            hidden: 0.4,
            size: 1.0,
            light: 1.0,
        };
        assert!(Judgement::new(&[estimate], 1e-4).agrees());
        assert!(
            !Judgement::new(
                &[Estimate {
                    hidden: 0.0,
                    ..estimate
                }],
                1e-4
            )
            .agrees()
        );
        assert!(
            !Judgement::new(
                &[Estimate {
                    difference: f64::NAN,
                    ..estimate
                }],
                1e-4
            )
            .agrees()
        );
        let dark = Estimate {
            difference: 0.0,
            hidden: 0.0,
            size: 0.0,
            light: 0.0,
            ..estimate
        };
        let family = Judgement::new(&[dark], 1e-4);
        assert!(family.agrees() && family.visible().is_none());
    }
}
