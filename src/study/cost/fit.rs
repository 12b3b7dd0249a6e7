//! How error falls with samples: `error(n) = b^2 + V(n)`, with `V(n) = c n^slope`.
//!
//! The spread `V` comes from seeds alone (no reference and no reference noise) and the bias `b` is measured separately. The two
//! are never confused: a curve that flattens does not prove bias, and a straight one does not disprove it.

use super::statistics::{Estimate, bootstrap};

/// Mean squared distances between the pictures of independent seeds, under some weights of pixels.
#[derive(Clone, Debug)]
pub struct Spread {
    seeds: usize,
    /// Row by row, symmetric.
    distances: Vec<f64>,
}

impl Spread {
    /// From the distance of each pair.
    pub fn new(seeds: usize, distance: impl Fn(usize, usize) -> f64) -> Self {
        let mut distances = vec![0.0; seeds * seeds];
        for a in 0..seeds {
            for b in 0..a {
                distances[a * seeds + b] = distance(a, b);
                distances[b * seeds + a] = distances[a * seeds + b];
            }
        }
        Self { seeds, distances }
    }

    /// Number of pictures.
    pub fn seeds(&self) -> usize {
        self.seeds
    }

    /// The variance of one picture, averaged over pixels: half the mean squared distance of two independent ones.
    pub fn variance(&self) -> f64 {
        self.variance_of(&(0..self.seeds).collect::<Vec<_>>())
    }

    /// The same from the given pictures, which may repeat.
    pub fn variance_of(&self, drawn: &[usize]) -> f64 {
        let pairs = drawn.iter().enumerate().flat_map(|(k, &a)| {
            let others = drawn[..k].iter().filter(move |&&b| b != a);
            others.map(move |b| self.distances[a * self.seeds + b])
        });
        let (sum, count) = pairs.fold((0.0, 0), |(sum, count), pair| (sum + pair, count + 1));
        sum / f64::from(2 * count)
    }
}

/// `value = exp(intercept) n^slope`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Power {
    /// Logarithm of the value at n = 1.
    pub intercept: f64,
    /// Exponent of n.
    pub slope: f64,
}

impl Power {
    /// Least-squares line through the logarithms of `(n, value)`; slope -1 for a single point. `None` without positive values.
    pub fn fit(points: &[(f64, f64)]) -> Option<Self> {
        let logs: Vec<(f64, f64)> = points
            .iter()
            .filter(|(_, value)| *value > 0.0)
            .map(|(n, value)| (n.ln(), value.ln()))
            .collect();
        let count = logs.len() as f64;
        if logs.is_empty() {
            return None;
        }
        let x = logs.iter().map(|p| p.0).sum::<f64>() / count;
        let y = logs.iter().map(|p| p.1).sum::<f64>() / count;
        let xx: f64 = logs.iter().map(|p| (p.0 - x).powi(2)).sum();
        let xy: f64 = logs.iter().map(|p| (p.0 - x) * (p.1 - y)).sum();
        let slope = if xx > 0.0 { xy / xx } else { -1.0 };
        Some(Self {
            intercept: y - slope * x,
            slope,
        })
    }

    /// The law with a given slope through a point.
    pub fn through((n, value): (f64, f64), slope: f64) -> Self {
        Self {
            intercept: value.ln() - slope * n.ln(),
            slope,
        }
    }

    /// The value at n.
    pub fn at(self, n: f64) -> f64 {
        (self.intercept + self.slope * n.ln()).exp()
    }

    /// The n at which the law equals `value`; infinite if it never does.
    pub fn reaches(self, value: f64) -> f64 {
        if value > 0.0 && self.slope < 0.0 {
            ((value.ln() - self.intercept) / self.slope).exp()
        } else {
            f64::INFINITY
        }
    }
}

/// The spread at several numbers of samples, all from the same seeds.
#[derive(Clone, Debug)]
pub struct Curve {
    /// Samples per pixel with the spread there, ascending.
    pub points: Vec<(u32, Spread)>,
}

impl Curve {
    /// Its power law.
    pub fn law(&self) -> Option<Power> {
        self.law_of(&(0..self.seeds()).collect::<Vec<_>>())
    }

    /// The same from the given seeds.
    pub fn law_of(&self, drawn: &[usize]) -> Option<Power> {
        let points: Vec<(f64, f64)> = self
            .points
            .iter()
            .map(|(n, spread)| (f64::from(*n), spread.variance_of(drawn)))
            .collect();
        Power::fit(&points)
    }

    /// Number of seeds.
    pub fn seeds(&self) -> usize {
        self.points.first().map_or(0, |(_, spread)| spread.seeds())
    }

    /// Its slope; `None` without noise.
    pub fn slope(&self) -> Option<Estimate> {
        self.law()?;
        Some(bootstrap(self.seeds(), |drawn| {
            self.law_of(drawn).map_or(-1.0, |law| law.slope)
        }))
    }

    /// Samples per pixel at which `V` falls to `value`, from the given seeds. Extrapolates along `slope` from the last point,
    /// the most accurate one and usually the nearest.
    pub fn samples_for(&self, value: f64, slope: f64, drawn: &[usize]) -> f64 {
        let Some((n, spread)) = self.points.last() else {
            return 1.0;
        };
        Power::through((f64::from(*n), spread.variance_of(drawn)), slope).reaches(value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_power_law_is_recovered() {
        for (c, slope) in [(3.0_f64, -1.0), (0.02, -1.37)] {
            let points: Vec<_> = [4.0_f64, 16.0, 64.0, 256.0]
                .iter()
                .map(|n| (*n, c * n.powf(slope)))
                .collect();
            let law = Power::fit(&points).unwrap();
            assert!((law.slope - slope).abs() < 1e-12 && (law.at(1.0) / c - 1.0).abs() < 1e-12);
            let n = law.reaches(law.at(1000.0));
            assert!((n / 1000.0 - 1.0).abs() < 1e-9);
        }
        assert_eq!(Power::fit(&[(4.0, 0.0)]), None);
        assert_eq!(Power::fit(&[(4.0, 1.0)]).unwrap().slope, -1.0);
        assert_eq!(
            Power {
                intercept: 0.0,
                slope: 0.1
            }
            .reaches(0.5),
            f64::INFINITY
        );
    }

    /// Seeds at known places on a line: the spread is the sample variance, with and without one.
    #[test]
    fn a_spread_is_the_variance_of_its_pictures() {
        let at = [1.0_f64, 2.0, 3.0, 6.0];
        let spread = Spread::new(4, |a, b| (at[a] - at[b]).powi(2));
        assert!((spread.variance() - 14.0 / 3.0).abs() < 1e-12);
        assert!((spread.variance_of(&[0, 1, 2]) - 1.0).abs() < 1e-12);
        // A picture paired with itself is not counted: of 0 1 1 2 2 there are 8 pairs, with squares 1 1 4 4 1 1 1 1.
        assert!((spread.variance_of(&[0, 1, 1, 2, 2]) - 0.5 * 14.0 / 8.0).abs() < 1e-12);
    }

    #[test]
    fn a_curve_knows_its_slope_and_where_it_will_be() {
        let at = [1.0_f64, 2.0, 3.0, 6.0];
        let points = [4, 16, 64].map(|n| {
            let scale = 5.0 * f64::from(n).powf(-1.2);
            (n, Spread::new(4, |a, b| scale * (at[a] - at[b]).powi(2)))
        });
        let curve = Curve { points: points.into() };
        let slope = curve.slope().unwrap();
        assert!((slope.value + 1.2).abs() < 1e-12 && slope.stderr < 1e-12);
        let (v, expected) = (5.0 * 14.0 / 3.0 * 1000.0_f64.powf(-1.2), 1000.0);
        assert!((curve.samples_for(v, slope.value, &[0, 1, 2, 3]) / expected - 1.0).abs() < 1e-9);
    }
}
