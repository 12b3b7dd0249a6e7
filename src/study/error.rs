//! Distances of a picture `x` from a reference `r`.
//!
//! Pictures are slices of RGB triples in `f32` or `f64`; all sums are `f64`. Means run over all pixels and channels, except for
//! pairs with a value that is not finite; these are counted as invalid instead.

use serde::Serialize;

/// Keeps relative errors of black pixels finite: the `1e-4` in every relMSE of this project.
pub const RELMSE_FLOOR: f64 = 1e-4;

/// The distance of a picture from its reference. Every formula is a mean over values (pixels times channels).
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Errors {
    /// `mean(x)`
    pub mean: f64,
    /// `mean(r)`
    pub reference_mean: f64,
    /// `mean(x) / mean(r) - 1`; 0 where the two means are equal, whatever they are.
    pub relative: f64,
    /// `sqrt(mean((x - r)^2))`
    pub rmse: f64,
    /// `mean((x - r)^2 / (r^2 + 1e-4))`
    pub relmse: f64,
    /// `mean(|x - r| / (|x| + |r|))`, 0 where both are 0; between 0 and 1.
    pub smape: f64,
    /// `max(|x - r|)`
    pub max_abs: f64,
    /// Counts of invalid values of `x`: NaN, infinite, negative.
    pub invalid: Invalid,
    /// The same of `r`.
    pub reference_invalid: Invalid,
}

/// Counts of invalid values.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Invalid {
    /// Not a number.
    pub nan: u64,
    /// Infinite, of either sign.
    pub infinite: u64,
    /// Finite and below 0.
    pub negative: u64,
}

impl Invalid {
    /// Counts them in a picture.
    pub fn count<T: Copy + Into<f64>>(picture: &[[T; 3]]) -> Self {
        let mut counts = Self::default();
        for value in values(picture) {
            counts.nan += u64::from(value.is_nan());
            counts.infinite += u64::from(value.is_infinite());
            counts.negative += u64::from(value.is_finite() && value < 0.0);
        }
        counts
    }

    /// All of them together.
    pub fn total(&self) -> u64 {
        self.nan + self.infinite + self.negative
    }
}

/// NaN and infinite values: how many, and the pixel of the first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{count} of its values are NaN or infinite, the first of them in pixel {x},{y}")]
pub struct NotFinite {
    /// How many there are.
    pub count: usize,
    /// Column of the first, from 0.
    pub x: usize,
    /// Row of the first, from 0.
    pub y: usize,
}

impl NotFinite {
    /// Looks for them in a picture that is `width` pixels wide.
    pub fn find<T: Copy + Into<f64>>(picture: &[[T; 3]], width: u32) -> Option<Self> {
        let wrong = |&value: &T| !value.into().is_finite();
        let first = picture.iter().position(|pixel| pixel.iter().any(wrong))?;
        let width = width.max(1) as usize;
        Some(Self {
            count: picture.iter().flatten().filter(|value| wrong(value)).count(),
            x: first % width,
            y: first / width,
        })
    }
}

impl Errors {
    /// Measures `x` against `r`.
    ///
    /// # Panics
    /// If the two have different numbers of pixels.
    pub fn between<X, R>(x: &[[X; 3]], r: &[[R; 3]]) -> Self
    where
        X: Copy + Into<f64>,
        R: Copy + Into<f64>,
    {
        assert_eq!(x.len(), r.len(), "pictures of different sizes");
        let mut mean = Mean::default();
        let mut max_abs = 0.0_f64;
        for (x, r) in values(x).zip(values(r)).filter(|(x, r)| x.is_finite() && r.is_finite()) {
            let difference = x - r;
            let size = x.abs() + r.abs();
            let smape = if size > 0.0 { difference.abs() / size } else { 0.0 };
            let square = difference * difference;
            mean.add([x, r, square, square / (r * r + RELMSE_FLOOR), smape]);
            max_abs = max_abs.max(difference.abs());
        }
        let [mean_x, mean_r, mse, relmse, smape] = mean.get();
        Self {
            mean: mean_x,
            reference_mean: mean_r,
            relative: if mean_x == mean_r { 0.0 } else { mean_x / mean_r - 1.0 },
            rmse: mse.sqrt(),
            relmse,
            smape,
            max_abs,
            invalid: Invalid::count(x),
            reference_invalid: Invalid::count(r),
        }
    }
}

/// The share of a relMSE that is the reference's own noise, `mean(stderr^2 / (r^2 + 1e-4))`. Subtract it to get the relMSE
/// against the picture that the reference converges to.
///
/// # Panics
/// If the two have different numbers of pixels.
pub fn relmse_of_reference<R, E>(r: &[[R; 3]], stderr: &[[E; 3]]) -> f64
where
    R: Copy + Into<f64>,
    E: Copy + Into<f64>,
{
    assert_eq!(r.len(), stderr.len(), "pictures of different sizes");
    let mut mean = Mean::default();
    for (r, error) in values(r)
        .zip(values(stderr))
        .filter(|(r, error)| r.is_finite() && error.is_finite())
    {
        mean.add([error * error / (r * r + RELMSE_FLOOR)]);
    }
    mean.get()[0]
}

/// All values of a picture, as `f64`.
fn values<T: Copy + Into<f64>>(picture: &[[T; 3]]) -> impl Iterator<Item = f64> {
    picture.iter().flatten().map(|&value| value.into())
}

/// Means of several quantities over the same values; 0 over none.
struct Mean<const N: usize> {
    sums: [f64; N],
    count: f64,
}

impl<const N: usize> Default for Mean<N> {
    fn default() -> Self {
        Self {
            sums: [0.0; N],
            count: 0.0,
        }
    }
}

impl<const N: usize> Mean<N> {
    fn add(&mut self, values: [f64; N]) {
        for (sum, value) in self.sums.iter_mut().zip(values) {
            *sum += value;
        }
        self.count += 1.0;
    }

    fn get(&self) -> [f64; N] {
        self.sums
            .map(|sum| if self.count > 0.0 { sum / self.count } else { 0.0 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_formula_by_hand() {
        let x = [[1.0_f32, 2.0, 0.0], [0.0, 0.5, 4.0]];
        let r = [[1.0_f64, 1.0, 0.0], [0.01, 0.5, 2.0]];
        let errors = Errors::between(&x, &r);
        assert!((errors.mean - 7.5 / 6.0).abs() < 1e-15);
        assert!((errors.reference_mean - 4.51 / 6.0).abs() < 1e-15);
        assert!((errors.relative - (7.5 / 4.51 - 1.0)).abs() < 1e-12);
        assert!((errors.rmse - ((1.0_f64 + 1e-4 + 4.0) / 6.0).sqrt()).abs() < 1e-12);
        assert!((errors.relmse - (1.0 / 1.0001 + 0.5 + 4.0 / 4.0001) / 6.0).abs() < 1e-12);
        assert!((errors.smape - (1.0 / 3.0 + 1.0 + 1.0 / 3.0) / 6.0).abs() < 1e-12);
        assert_eq!(errors.max_abs, 2.0);
        assert_eq!(errors.invalid.total() + errors.reference_invalid.total(), 0);
        let share = relmse_of_reference(&r, &[[0.1_f32, 0.0, 0.01], [0.0; 3]]);
        assert!((share - (0.01 / 1.0001 + 1.0) / 6.0).abs() < 1e-8);
    }

    #[test]
    fn a_picture_is_no_distance_from_itself_black_or_not() {
        for pixels in [[[0.0_f32; 3]; 2], [[0.3, 7.0, 1e-20]; 2]] {
            let errors = Errors::between(&pixels, &pixels);
            assert_eq!(
                [
                    errors.relative,
                    errors.rmse,
                    errors.relmse,
                    errors.smape,
                    errors.max_abs
                ],
                [0.0; 5]
            );
        }
    }

    #[test]
    fn the_first_value_that_is_not_finite_is_named() {
        let mut picture = [[1.0_f32; 3]; 12];
        assert_eq!(NotFinite::find(&picture, 4), None);
        (picture[6][1], picture[7], picture[11][2]) = (f32::NAN, [f32::INFINITY; 3], -1.0);
        let found = NotFinite::find(&picture, 4);
        assert_eq!(found, Some(NotFinite { count: 4, x: 2, y: 1 }));
    }

    #[test]
    fn invalid_values_are_counted_and_left_out() {
        let x = [[f64::NAN, f64::INFINITY, -1.0], [f64::NEG_INFINITY, 1.0, -0.0]];
        let r = [[1.0_f64, 1.0, 1.0], [1.0, f64::NAN, 0.0]];
        let errors = Errors::between(&x, &r);
        assert_eq!(
            errors.invalid,
            Invalid {
                nan: 1,
                infinite: 2,
                negative: 1
            }
        );
        assert_eq!(
            errors.reference_invalid,
            Invalid {
                nan: 1,
                infinite: 0,
                negative: 0
            }
        );
        assert_eq!((errors.mean, errors.max_abs), (-0.5, 2.0));
    }
}
