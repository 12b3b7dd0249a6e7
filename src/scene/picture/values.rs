//! Makes every number of a picture finite and nonnegative; values slightly below 0 are treated as noise.

use glam::{DMat3, DVec3};
use half::f16;
use rayon::prelude::*;

use crate::texels::Texels;

/// Lossy compression and resampling filters cause negative values, at most this part of the picture's mean; larger ones mean
/// that the picture does not store light.
pub(super) const NOISE: f64 = 0.01;

/// Texels per work item.
const PIECE: usize = 1 << 16;

/// Statistics of all texels.
#[derive(Clone, Copy, Default)]
struct Found {
    infinite: Option<usize>,
    /// Sum of all positive numbers.
    sum: f64,
    negative: u64,
    least: f32,
}

/// Sets values slightly below 0 to 0. Returns a note for the user if there are any.
///
/// # Errors
/// The first texel that is not finite, otherwise the first that is too far below 0.
pub(super) fn settle(texels: &mut Texels) -> Result<Option<String>, usize> {
    let found = look(texels);
    if let Some(at) = found.infinite {
        return Err(at);
    }
    if found.negative == 0 {
        return Ok(None);
    }
    let limit = -(NOISE * found.sum / (3 * texels.len()) as f64) as f32;
    if found.least < limit {
        let beyond = |texel: [f32; 3]| texel.iter().any(|&x| x < limit);
        return Err(texels.iter().position(beyond).unwrap_or_default());
    }
    match texels {
        Texels::Single(texels) => texels.iter_mut().flatten().for_each(|x| *x = x.max(0.0)),
        Texels::Half(texels) => texels.iter_mut().flatten().for_each(|x| *x = x.max(f16::ZERO)),
    }
    let (count, least) = (found.negative, found.least);
    let numbers = if count == 1 { "number" } else { "numbers" };
    Ok(Some(format!(
        "{count} {numbers} below 0, down to {least:e}, taken as 0"
    )))
}

fn look(texels: &Texels) -> Found {
    let pieces: Vec<Found> = (0..texels.len().div_ceil(PIECE))
        .into_par_iter()
        .map(|piece| {
            let mut found = Found::default();
            for index in piece * PIECE..((piece + 1) * PIECE).min(texels.len()) {
                for x in texels.at(index) {
                    if !x.is_finite() {
                        found.infinite = found.infinite.or(Some(index));
                    } else if x < 0.0 {
                        found.negative += 1;
                        found.least = found.least.min(x);
                    } else {
                        found.sum += f64::from(x);
                    }
                }
            }
            found
        })
        .collect();
    pieces.into_iter().fold(Found::default(), |all, piece| Found {
        infinite: all.infinite.or(piece.infinite),
        sum: all.sum + piece.sum,
        negative: all.negative + piece.negative,
        least: all.least.min(piece.least),
    })
}

/// Multiplies all colours by a matrix, in single precision, and clamps colours outside Rec. 709 at 0. Also returns the number
/// of clamped colours.
pub(super) fn convert(texels: &Texels, by: DMat3) -> (Texels, usize) {
    let mut outside = 0;
    let converted = texels.iter().map(|texel| {
        let colour = by * DVec3::from_array(texel.map(f64::from));
        // Negative values from rounding do not count as outside.
        outside += usize::from(colour.min_element() < -1e-6 * colour.abs().max_element());
        colour.max(DVec3::ZERO).to_array().map(|x| x as f32)
    });
    (Texels::Single(converted.collect()), outside)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_below_zero_is_counted_and_the_rest_refused() {
        let mut texels = Texels::Single(vec![[1.0, -1e-4, 0.5], [2.0, 0.0, -3e-4]]);
        let note = settle(&mut texels).unwrap().unwrap();
        assert_eq!(note, "2 numbers below 0, down to -3e-4, taken as 0");
        assert_eq!(texels, Texels::Single(vec![[1.0, 0.0, 0.5], [2.0, 0.0, 0.0]]));
        assert_eq!(settle(&mut texels), Ok(None));
        assert_eq!(settle(&mut Texels::Single(vec![[1.0; 3], [1.0, -0.1, 1.0]])), Err(1));
        assert_eq!(
            settle(&mut Texels::Single(vec![[-1.0; 3], [1.0, f32::NAN, 1.0]])),
            Err(1)
        );
        let mut halves = Texels::Half(vec![[f16::ONE, f16::from_f32(-1e-3), f16::ONE]]);
        assert!(settle(&mut halves).unwrap().is_some());
        assert_eq!(halves.at(0), [1.0, 0.0, 1.0]);
    }
}
